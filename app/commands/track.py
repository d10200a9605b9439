"""`phalanx track FILE...`: solve recordings offline, by the engine that works live."""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from app.commands.result import Exit, Result
from app.commands.terminal import Progress, say
from core.errors import FormatError, PhalanxError
from core.takes.take import EXTENSION

if TYPE_CHECKING:
    from app.tracking_figures import TrackFigures
    from core.frames import MarkerFrame
    from core.profile import Profile


def add(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Declares the command."""
    parser = commands.add_parser(
        "track",
        help="solve recordings offline",
        description="Solves recordings (TRC, C3D, Qualisys TSV, Motive CSV, points.csv, takes) and writes markers.csv, "
        "angles.csv and joints.csv for each to DIR/<name of the file>/; those of an earlier run are replaced.",
    )
    parser.add_argument("files", metavar="FILE", nargs="+", type=Path, help="a recording")
    parser.add_argument(
        "--profile", metavar="P", help="profile file, or a layout on a generic hand; default for takes: their own"
    )
    parser.add_argument("--out", metavar="DIR", type=Path, required=True, help="folder for the results")
    parser.add_argument(
        "--unlabelled", action="store_true", help="withhold the labels of the file: points in random order, without ids"
    )
    parser.add_argument("--json", action="store_true", help="figures as one JSON object on the last line")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> Result:
    """One line per file. A file that cannot be solved does not stop the others; the command then fails at its end."""
    from core.profile import load_profile

    profile = load_profile(arguments.profile) if arguments.profile else None
    folders = _folders(arguments.files, arguments.out)
    done, failed = [], {}
    for path, folder in folders.items():
        try:
            figures = _track(path, profile, folder, arguments.unlabelled)
        except PhalanxError as error:
            if len(folders) == 1:
                raise
            say(f"phalanx: {error}")
            failed[str(path)] = str(error)
            continue
        print(_line(figures), flush=True)
        done.append(figures)
    result = {"profile": arguments.profile, "unlabelled": arguments.unlabelled, "files": done, "failed": failed}
    if len(done) > 1:
        result["all"] = _all(done)
    return Result(Exit.FAILED if failed else Exit.DONE, result)


def _folders(files: Sequence[Path], out: Path) -> dict[Path, Path]:
    """A folder of its own for each file, by its name without ending. Raises FormatError where two would share one."""
    folders: dict[Path, Path] = {}
    for path in files:
        folder = out / path.stem
        other = next((p for p, f in folders.items() if f == folder and p != path), None)
        if other is not None:
            raise FormatError(
                f"{path} and {other} would both be written to {folder}.", "Solve them one by one, into other folders."
            )
        folders[path] = folder
    return folders


def _track(path: Path, profile: Profile | None, folder: Path, unlabelled: bool) -> TrackFigures:
    from app.labels import label_map
    from app.tracking_figures import figures, frames_and_columns
    from core.takes.export import export
    from core.takes.formats import read_recording
    from core.takes.reprocess import solve
    from core.takes.solution import Solution

    recording = read_recording(path)
    frames, columns = frames_and_columns(recording, unlabelled)
    if path.suffix == EXTENSION:
        frames, profile = _of_take(path, profile)
    if profile is None:
        raise FormatError(f"{path.name} does not say what the hands wore.", "Give --profile, for example han19.")
    progress = Progress(f"Solving {path.name}")
    labels = None if unlabelled else label_map(recording, profile)
    solved = solve(frames, profile, progress, labels=labels)
    progress.done()
    solution = Solution(path.stem, profile, recording.rate_hz, frames, solved)
    progress = Progress(f"Writing {folder}")
    export(solution, ("csv",), folder, progress, overwrite=True)
    progress.done()
    return figures(path, recording, profile.layout, solved, columns, labels is not None)


def _of_take(path: Path, profile: Profile | None) -> tuple[list[MarkerFrame], Profile]:
    """The very frames that were recorded, with all their times, so that they solve to what was solved live."""
    from core.takes.reader import open_take

    with open_take(path) as take:
        return list(take.raw), profile or take.profile


def _all(done: Sequence[TrackFigures]) -> dict[str, float]:
    """The figures of all files together; prints them."""
    frames = sum(f.frames for f in done)
    tracked = sum(f.tracked * f.frames for f in done) / max(frames, 1)
    blind = [f for f in done if f.labelled_points and not f.labels_given]
    points = sum(f.labelled_points for f in blind)
    right = sum(f.labels_right * f.labelled_points for f in blind) / points if points else math.nan
    labels = f", {100 * right:.2f} % of {points:,} labels right" if points else ""
    print(f"{len(done)} files: {frames:,} frames, {100 * tracked:.1f} % tracked{labels}")
    return {"frames": frames, "tracked": tracked, "labels_right": right, "labelled_points": points}


def _line(f: TrackFigures) -> str:
    hands = " and ".join(f"{side} ({100 * hand.tracked:.1f} %)" for side, hand in f.hands.items()) or "no hand found"
    parts = [f"{f.file.name}: {f.frames:,} frames", hands, f"{100 * f.tracked:.1f} % tracked"]
    if math.isfinite(f.rms_m):
        parts.append(f"RMS {1000 * f.rms_m:.2f} mm")
    if f.labels_given:
        parts.append("labels as given")
    elif f.labelled_points:
        parts.append(f"{100 * f.labels_right:.2f} % of {f.labelled_points:,} labels right")
    return ", ".join(parts)
