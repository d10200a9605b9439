"""`phalanx` alone, or `phalanx window`: opens the application."""

from __future__ import annotations

import argparse

from app.commands.result import Exit, Result
from app.virtual_display import has_display
from core.errors import PhalanxError


def add(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Declares the command."""
    parser = commands.add_parser("window", help="open the application (as phalanx alone does)")
    parser.add_argument("--demo", action="store_true", help="on the built-in performer, connected and tracking")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> Result:
    """Stays until the window is closed. Raises PhalanxError where there is no display: Qt would abort."""
    if not has_display():
        raise PhalanxError(
            "There is no display to open a window on.",
            "Start Phalanx at a desktop; `phalanx demo` shows what it does without one.",
        )
    from app.application import run as open_window

    return Result(Exit.DONE if open_window(arguments.demo) == 0 else Exit.FAILED)
