"""`phalanx track FILE...`: solve recordings offline, by the engine that works live, one file per core."""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Generator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from app.commands.batch import batch_of, command_for, judged_by, settings_of
from app.commands.export_options import FORMATS_HELP, add_export_options, folders_of, formats, options_of, tell_notes
from app.commands.file_list import FILES_HELP, files_of
from app.commands.job import Job
from app.commands.out import out_folder
from app.commands.parallel import in_parallel, usable_cores
from app.commands.result import Exit, Result
from app.commands.terminal import Progress, say, warn
from app.commands.whole_results import solve_and_place
from app.least import LEAST_TRACKED
from core.errors import PhalanxError
from core.printable import MOST_OF_TEXT, printable

if TYPE_CHECKING:
    from app.commands.batch import Batch
    from app.tracking_figures import TrackFigures

FILL = "fill"
GAPS = (FILL, "live")


def add(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Declares the command."""
    parser = commands.add_parser(
        "track",
        help="solve recordings offline",
        description="Solves recordings (TRC, C3D, Qualisys TSV, Motive CSV, points.csv, takes) and writes each in the "
        "formats asked for to DIR/<name of the file>/, with run.json, which says what they came from. The same again "
        "replaces its own results, takes never; results of another recording, profile, network, option or version are "
        "left as they are, and the new ones go to DIR/<name of the file>-2/. Several files are solved at once, one on "
        "each core. A file that is stopped leaves nothing; --resume goes on. Points without labels are named from the "
        "whole recording: it is gone through forward and backward in time, and what is one marker is named as one.",
    )
    parser.add_argument("files", metavar="FILE", nargs="+", help=FILES_HELP)
    parser.add_argument(
        "--profile",
        metavar="P",
        action="append",
        default=[],
        help="profile file, or a layout on a generic hand; once for each performer in the volume; default for takes: "
        "their own",
    )
    parser.add_argument(
        "--network",
        metavar="FILE",
        help="name points by this labelling network, made by phalanx train labeller; shipped: by the one of Phalanx; "
        "default: as the profile says",
    )
    parser.add_argument("--out", metavar="DIR", type=out_folder, required=True, help="folder for the results")
    parser.add_argument(
        "--overwrite", action="store_true", help="replace results of other settings in DIR/<name of the file>/"
    )
    parser.add_argument(
        "--resume",
        action="store_true",
        help="skip files whose results are there, whole, from the same recording, profiles, options and version",
    )
    parser.add_argument("--to", metavar="FORMATS", type=formats, default="csv", help=f"{FORMATS_HELP} (default csv)")
    parser.add_argument(
        "--take",
        action="store_true",
        help="also write DIR/<name of the file>/<name of the file>.mcap, a take to open in review",
    )
    parser.add_argument(
        "--unlabelled",
        action="store_true",
        help="withhold the labels of the file: its points come in random order, without ids. Points that have no "
        "labels (points.csv, takes) keep the ids that their device gave them, as it sends them live",
    )
    parser.add_argument(
        "--no-ids",
        action="store_true",
        help="withhold labels and ids, of takes too: points in random order, as of a device that tells no ids",
    )
    parser.add_argument(
        "--live-labels",
        action="store_true",
        help="name each point from what was before it alone, as live and in takes; three times as fast",
    )
    parser.add_argument(
        "--gaps",
        choices=GAPS,
        default=FILL,
        help="fill: while markers are hidden, lead each joint smoothly from where it was to where it is seen again "
        "(default); live: leave every frame as it is solved live and kept in takes",
    )
    parser.add_argument(
        "--least",
        metavar="SHARE",
        type=_share,
        default=LEAST_TRACKED,
        help="percentage of the frames in which each hand that is found must be tracked; where one is in fewer, or "
        f"none is found, the command says so and ends with status 3 (default {100 * LEAST_TRACKED:g})",
    )
    parser.add_argument("--json", action="store_true", help="figures as one JSON object on the last line")
    add_export_options(parser)
    parser.set_defaults(run=run, refuse=parser.error)


def run(arguments: argparse.Namespace) -> Result:
    """One line per file, in order. A file that cannot be solved does not stop the others; the command then fails at
    its end."""
    options = options_of(arguments)
    folders = folders_of(files_of(arguments.files), arguments.out, each=True)
    jobs = [
        Job(
            path,
            tuple(arguments.profile),
            folder,
            arguments.unlabelled or arguments.no_ids,
            arguments.live_labels,
            arguments.gaps == FILL,
            arguments.network,
            arguments.no_ids,
            formats=arguments.to,
            options=options,
            take=arguments.take,
            settings=settings_of(arguments),
            command=command_for(arguments, path),
            judged_by=judged_by(arguments),
            overwrite=arguments.overwrite,
            least=arguments.least,
        )
        for path, folder in folders.items()
    ]
    if jobs and arguments.profile:
        from core.profile import load_profile

        for profile in arguments.profile:
            load_profile(profile)  # what is wrong with it is said once
    if jobs and arguments.network:
        from core.labelling.network import SHIPPED_NAME, LabelNetwork

        if arguments.network != SHIPPED_NAME:
            LabelNetwork(Path(arguments.network))
    batch = batch_of(jobs, arguments.resume)
    try:
        return _run(arguments, batch)
    except KeyboardInterrupt:
        batch.say_what_is_left()
        raise


def _run(arguments: argparse.Namespace, batch: Batch) -> Result:
    started = time.perf_counter()
    done: list[TrackFigures] = []
    failed: dict[str, str] = {}
    jobs = batch.jobs
    for job, outcome in zip(jobs, batch.outcomes(_outcomes), strict=True):
        if isinstance(outcome, PhalanxError):
            if len(jobs) == 1:
                raise outcome
            said = str(outcome)
            say(f"phalanx: {said}" if job.path.name in said else f"phalanx: {job.path.name}: {said}")
            failed[str(job.path)] = str(outcome)
            continue
        warn(job.path.name, outcome.warnings)
        print(
            printable(_line(outcome), MOST_OF_TEXT) + (" (done before)" if job.path in batch.before else ""), flush=True
        )
        alone = outcome.notes if len(jobs) == 1 else ()  # of several each is said once, at the end
        for text in (*alone, *dict.fromkeys(outcome.failed.values())):
            say(f"phalanx: {job.path.name}: {text}")
        done.append(outcome)
    if len(jobs) > 1:
        tell_notes({outcome.file.name: outcome.notes for outcome in done})
    result = {
        "profiles": arguments.profile, "network": arguments.network, "unlabelled": arguments.unlabelled,
        "no_ids": arguments.no_ids,
        "live_labels": arguments.live_labels, "gaps": arguments.gaps, "files": done, "failed": failed,
        "skipped": list(batch.before),
    }  # fmt: skip
    if failed:
        batch.say_what_is_left()
    if len(done) > 1:
        result["all"] = _all(done, time.perf_counter() - started)
    lost = any(outcome.losses for outcome in done)
    failed_formats = any(outcome.failed for outcome in done)
    return Result(Exit.FAILED if failed or failed_formats else Exit.LOSS if lost else Exit.DONE, result)


def _outcomes(jobs: Sequence[Job]) -> Generator[TrackFigures | PhalanxError]:
    """What became of each job, in order."""
    at_once = min(len(jobs), usable_cores())
    if at_once > 1:
        yield from in_parallel(solve_and_place, jobs, at_once, "Solving")
        return
    for job in jobs:
        progress = Progress(f"Solving {job.path.name}")
        try:
            outcome: TrackFigures | PhalanxError = solve_and_place(job, progress)
        except PhalanxError as error:
            outcome = error
        progress.done()
        yield outcome


def _all(done: Sequence[TrackFigures], seconds: float) -> dict[str, float]:
    """The figures of all files together; prints them. seconds: from the first to the last."""
    frames = sum(f.frames for f in done)
    tracked = sum(f.tracked * f.frames for f in done) / max(frames, 1)
    blind = [f for f in done if f.labelled_points and not f.labels_given]
    points = sum(f.labelled_points for f in blind)
    right = sum(f.labels_right * f.labelled_points for f in blind) / points if points else math.nan
    labels = f", {100 * right:.2f} % of {points:,} labels right" if points else ""
    new = [f for f in done if math.isfinite(f.speed)]  # of the others it is not known
    speed = sum(f.duration_s for f in new) / seconds if new else math.nan
    print(f"{len(done)} files: {frames:,} frames, {100 * tracked:.1f} % tracked{labels}{_times(speed)}")
    return {
        "frames": frames, "tracked": tracked, "labels_right": right, "labelled_points": points, "speed": speed,
    }  # fmt: skip


def _line(f: TrackFigures) -> str:
    each = [f"{name} ({100 * hand.tracked:.1f} %{_size(hand.length_m)})" for name, hand in f.hands.items()]
    hands = " and ".join(each) or "no hand found"
    parts = [f"{f.file.name}: {f.frames:,} frames", hands, f"{100 * f.tracked:.1f} % tracked"]
    if len(f.holes):
        parts.append(f.holes.words)
    if math.isfinite(f.rms_m):
        parts.append(f"RMS {1000 * f.rms_m:.2f} mm")
    if f.labels_given:
        doubted = any(loss.kind in ("unit", "side", "names") for loss in f.losses)
        parts.append(_left_out(f) if f.labels_left_out else "labels doubted" if doubted else "labels as given")
    elif f.labelled_points:
        parts.append(f"{100 * f.labels_right:.2f} % of {f.labelled_points:,} labels right")
    if f.filled:
        parts.append(f"gaps filled in {100 * f.filled:.1f} %")
    if f.sources:
        parts.append("angles " + ", ".join(f"{100 * share:.1f} % {name}" for name, share in f.sources.items()))
    return ", ".join([*parts, *f.neutral]) + _times(f.speed)


def _size(length_m: float) -> str:
    return f", {1000 * length_m:.0f} mm" if math.isfinite(length_m) else ""


def _left_out(f: TrackFigures) -> str:
    out = f.labels_left_out
    each = ", ".join(f"{label} {count:,}" for label, count in out.items())
    return f"{sum(out.values()):,} of {f.labelled_points:,} given labels left out: {each}"


def _share(text: str) -> float:
    """A percentage as a share, 0..1."""
    try:
        share = float(text.strip().removesuffix("%")) / 100.0
    except ValueError:
        share = math.nan
    if not 0.0 <= share <= 1.0:
        raise argparse.ArgumentTypeError(f"{text!r} is no percentage from 0 to 100")
    return share


def _times(speed: float) -> str:
    return f", {speed:.3g} x real time" if math.isfinite(speed) else ""
