"""`phalanx doctor`: what is missing on this machine, and how to get it."""

from __future__ import annotations

import argparse
import sys

from app.commands.printable_output import unfiltered
from app.commands.result import Exit, Result
from app.commands.terminal import say


def add(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Declares the command."""
    parser = commands.add_parser("doctor", help="what is missing on this machine, and how to get it")
    parser.add_argument(
        "--clear-leftovers",
        action="store_true",
        help="remove the files that ended processes left and that nobody needs, say which, and tell of faults for the "
        "last time; examine nothing else",
    )
    parser.add_argument("--json", action="store_true", help="figures as one JSON object on the last line")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> Result:
    """One line per finding; fails if anything will not work."""
    if arguments.clear_leftovers:
        return _clear()
    from app.doctor import examine
    from devices.device import Level

    colours = {Level.GOOD: 32, Level.WARNING: 33, Level.PROBLEM: 31}
    findings = examine()
    for finding in findings:
        word = f"{finding.level.value:8}"
        if sys.stdout.isatty():
            word = f"\x1b[{colours[finding.level]}m{word}\x1b[0m"
        print(word, end="", file=unfiltered(sys.stdout))
        print(f" {finding.topic:17} {finding.text}")
        if finding.action:
            print(f"{'':26} {finding.action}")
    problems = sum(finding.level is Level.PROBLEM for finding in findings)
    warnings = sum(finding.level is Level.WARNING for finding in findings)
    print("Ready." if not problems else f"{problems} to mend before Phalanx works as it should.")
    figures = {"problems": problems, "warnings": warnings, "findings": findings}
    return Result(Exit.FAILED if problems else Exit.DONE, figures)


def _clear() -> Result:
    """Of takes and of reports nothing goes; reports count as told."""
    from app.doctor.storage import takes_folder
    from app.left_behind.found import look, size_words
    from app.left_behind.leftovers import clear
    from app.left_behind.run_file import settle

    folder = takes_folder()
    found = look(folder)
    cleared, refused = clear(folder, found.files)
    for file in cleared:
        print(f"{file.path}: {size_words(file.bytes)}, {file.what}")
    for path, why in refused.items():
        say(f"phalanx: {path} cannot be removed ({why}). Remove it by hand.")
    for run in found.faults:
        settle(run)
        print(f"{run.what}, begun {run.begun:%Y-%m-%d %H:%M}, was ended by a fault: {run.fault}.")
        print(f"Its report stays in {run.path.parent}.")
    total = sum(file.bytes for file in cleared)
    print(f"{size_words(total)} cleared." if cleared else "Nothing to clear.")
    figures = {
        "cleared": [file.path for file in cleared],
        "bytes": total,
        "failed": {str(path): why for path, why in refused.items()},
    }
    return Result(Exit.FAILED if refused else Exit.DONE, figures)
