"""How well poses, surfaces and hand shapes are found: the experiments of the papers, beside the papers' own figures.

The protocols are those of Schröder 2017 and Han 2018 as far as the papers tell them; each experiment prints what it
does. Those on recordings need --data, the folder in which they lie as han2018/ and qualisys_hand/.
"""

from __future__ import annotations

import argparse
from typing import Any

import app.reconstruction
from app.commands.out import out_folder
from app.experiments import add_choice, experiments_of, run_chosen


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of this benchmark."""
    add_choice(parser, experiments_of(app.reconstruction))
    parser.add_argument("--out", metavar="DIR", type=out_folder, help="folder for plots; without it none is drawn")
    parser.add_argument("--seed", metavar="N", type=int, default=0, help="what is drawn at random; default %(default)s")
    parser.add_argument(
        "--frames", metavar="N", type=int, help="at most so many of each motion, for a quick look; default: enough"
    )


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Runs the experiments one after the other; each prints its table. Raises FormatError where recordings lack."""
    if arguments.out is not None:
        arguments.out.mkdir(parents=True, exist_ok=True)
    return {"seed": arguments.seed} | run_chosen(experiments_of(app.reconstruction), arguments)
