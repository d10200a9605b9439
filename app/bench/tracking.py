"""Labels while hands are followed: frames with every label right, recovery, real recordings, and what it costs."""

from __future__ import annotations

import argparse
from typing import Any

import app.tracking_bench
from app.experiments import add_choice, experiments_of, run_chosen
from app.people import add_sizes


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of this benchmark."""
    add_choice(parser, experiments_of(app.tracking_bench))
    parser.add_argument("--seed", metavar="N", type=int, default=0, help="the first; default %(default)s")
    parser.add_argument("--seeds", metavar="N", type=int, default=5, help="how many; default %(default)s")
    add_sizes(parser)
    parser.add_argument(
        "--failures", metavar="N", type=int, default=0, help="list the N longest wrong stretches after each row"
    )


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Runs the experiments one after the other; each prints its table. Raises FormatError where recordings lack."""
    figures = {"seed": arguments.seed, "seeds": arguments.seeds, "sizes": arguments.sizes}
    return figures | run_chosen(experiments_of(app.tracking_bench), arguments)
