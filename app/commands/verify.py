"""`phalanx verify TAKE`: reads all of a take and checks every record."""

from __future__ import annotations

import argparse
from pathlib import Path

from app.commands.result import Exit, Result
from app.commands.terminal import Progress


def add(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Declares the command."""
    parser = commands.add_parser("verify", help="read all of a take and check every record")
    parser.add_argument("take", metavar="TAKE", type=Path)
    parser.add_argument("--json", action="store_true", help="figures as one JSON object on the last line")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> Result:
    """One line per finding; fails if the take is not what it should be."""
    from core.takes.verify import verify

    progress = Progress(f"Reading {arguments.take.name}")
    report = verify(arguments.take, progress)
    progress.done()
    for finding in report.findings:
        print(f"{finding.level:8} {finding.text}")
    state = "is whole" if report.ok else "is damaged; `phalanx recover` saves what can be read"
    print(f"{report.path} {state}: {report.raw:,} raw and {report.solved:,} solved frames, {report.marks} marks.")
    figures = {
        "take": report.path,
        "ok": report.ok,
        "sealed": report.sealed,
        "raw": report.raw,
        "solved": report.solved,
        "marks": report.marks,
        "counts": report.counts,
        "findings": report.findings,
    }
    return Result(Exit.DONE if report.ok else Exit.FAILED, figures)
