"""`phalanx recover TAKE`: a whole take from one that was cut off or is damaged."""

from __future__ import annotations

import argparse
from pathlib import Path

from app.commands.result import Exit, Result
from app.commands.terminal import Progress
from app.commands.verdict import status_of, verdict_figures, verdict_line
from core.errors import PhalanxError, TakeError
from core.printable import MOST_OF_TEXT, printable


def add(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Declares the command."""
    parser = commands.add_parser(
        "recover",
        help="make a whole take of one that was cut off or is damaged",
        description="Writes what can be read of a take to a new one beside it. Never changes the original. "
        "Exit status: 0 if the take that there is then is whole; 3 if something of it is lost or not as it should be, "
        "and the figures say how much; 1 if there is nothing to recover.",
    )
    parser.add_argument("take", metavar="TAKE", type=Path)
    parser.add_argument("--json", action="store_true", help="figures as one JSON object on the last line")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> Result:
    """Says what was recovered and lost."""
    from app.rescued import rescued_from
    from core.takes.recover import recover

    progress = Progress(f"Recovering {arguments.take.name}")
    try:
        recovery = recover(arguments.take, progress)
    except PhalanxError as error:
        found = rescued_from(arguments.take)  # it was taken away, or cut, while it was recorded
        if found and str(found[0]) not in error.what:
            raise TakeError(f"{error.what} But it was rescued as {found[0]}.", "Name that one.") from error
        raise
    progress.done()
    for text in recovery.findings:
        print(printable(text, MOST_OF_TEXT))
    print(printable(recovery, MOST_OF_TEXT))
    figures = {
        "take": recovery.source,
        "recovered_take": recovery.path,
        "recovered": recovery.recovered,
        "lost": recovery.lost,
        "recovered_solved": recovery.recovered_solved,
        "lost_solved": recovery.lost_solved,
        "lost_marks": recovery.lost_marks,
        "streams": recovery.streams,
        "findings": recovery.findings,
        "verdict": verdict_figures(recovery.verdict),
    }
    if not recovery.verdict.whole:
        print(printable(f"Verdict: {verdict_line(recovery.verdict)}.", MOST_OF_TEXT))
    status = status_of(recovery.verdict)
    return Result(status if status or recovery.complete else Exit.LOSS, figures)  # a mark or a pose may be lost, too
