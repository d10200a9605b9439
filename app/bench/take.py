"""Takes on this disk: records written a second, bytes a frame, time to seal, to open and to read a frame."""

from __future__ import annotations

import argparse
from dataclasses import asdict
from pathlib import Path
from typing import Any

from core.takes.bench import bench_take


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of this benchmark."""
    parser.add_argument("--frames", metavar="N", type=int, default=7200, help="default 7200: a minute at 120 Hz")
    parser.add_argument("--folder", metavar="DIR", type=Path, help="where to write; default a temporary folder")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Two hands of 19 markers and 40 points in every frame."""
    figures = asdict(bench_take(arguments.frames, arguments.folder))
    for name, figure in figures.items():
        print(f"  {name:28} {figure:,.6g}")
    return figures
