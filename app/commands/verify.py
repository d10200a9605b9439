"""`phalanx verify FILE`: reads all of a take and checks every record; says what is amiss in any other recording."""

from __future__ import annotations

import argparse
from pathlib import Path

from app.commands.recording_info import common_figures, recording_figures
from app.commands.result import Exit, Result
from app.commands.stream_info import stream_figures
from app.commands.terminal import Progress
from app.commands.verdict import status_of, verdict_figures
from core.printable import MOST_OF_TEXT, printable
from core.words import count


def add(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Declares the command."""
    parser = commands.add_parser(
        "verify",
        help="read all of a recording and check it",
        description="Reads all of a take and checks every record and every count. Of any other recording that Phalanx "
        "reads it checks frame numbers, times and rate, range and unit, names and gaps, and says what its reader found "
        "amiss.",
        epilog="Exit status of a take: 0 if it is whole, whatever is warned of in its times and points; 3 if it is not "
        "sealed, or something is damaged, lost or not as it should be; 1 if no frame can be read. Of any other "
        "recording: 0 without warnings, 3 with some.",
    )
    parser.add_argument("file", metavar="FILE", type=Path, help="a take or a recording")
    parser.add_argument("--json", action="store_true", help="figures as one JSON object on the last line")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> Result:
    """One line per finding; the exit status is that of a take's verdict, done with loss for warnings of others."""
    from core.takes.formats.take import is_take

    return _take(arguments.file) if is_take(arguments.file) else _recording(arguments.file)


def _recording(path: Path) -> Result:
    from core.takes.formats import read_recording
    from core.takes.overview import findings, overview

    recording = read_recording(path)
    seen = overview(recording)
    found = findings(recording, seen)
    for finding in found:
        print(f"{finding.level:8} {printable(finding.text, MOST_OF_TEXT)}")
    warnings = [finding.text for finding in found if finding.level == "warning"]
    ok = not warnings
    state = "is as it should be" if ok else "can be read, with warnings"
    markers = count(len(recording.labels), "marker") if recording.labels else "points without names"
    frames = count(recording.n_frames, "frame")
    print(f"{printable(path)} {state}: {recording.format}, {frames} at {recording.rate_hz:g} Hz, {markers}.")
    figures = {**recording_figures(path, recording, seen), "ok": ok, "warnings": warnings, "findings": found}
    return Result(Exit.DONE if ok else Exit.LOSS, figures)


def _take(path: Path) -> Result:
    from core.takes.reader import open_take
    from core.takes.verify import verify

    progress = Progress(f"Reading {path.name}")
    report = verify(path, progress)
    progress.done()
    status = status_of(report.verdict)
    for finding in report.findings:
        print(f"{finding.level:8} {printable(finding.text, MOST_OF_TEXT)}")
    warnings = [finding.text for finding in report.findings if finding.level == "warning"]
    solved = count(report.solved, "solved frame")
    others = "".join(f", {printable(key)}: {count(n, 'frame')}" for key, n in report.streams.items())
    print(
        f"{printable(report.path)} {report.condition}: {report.raw:,} raw and {solved}, {count(report.marks, 'mark')}"
        f"{others}."
    )
    with open_take(path, check=False) as take:  # read through just now
        common = common_figures(take, report.gaps, report.points, warnings)
        streams = {
            key: {**of, "frames": report.streams.get(key, report.raw), "lost": report.lost.get(key, of["lost"])}
            for key, of in stream_figures(take).items()
        }
    figures = {
        "take": report.path,
        **common,
        "ok": status == Exit.DONE,
        "verdict": verdict_figures(report.verdict),
        "sealed": report.sealed,
        "raw": report.raw,
        "solved": report.solved,
        "marks": report.marks,
        "streams": streams,
        "counts": report.counts,
        "findings": report.findings,
    }
    return Result(status, figures)
