"""One file read, solved and written, as a job asks for it."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

from app.commands.job import Job
from app.labels import cast_labels
from app.run_origin import made
from app.tracking_doubts import Doubt, check_performers, doubts
from app.tracking_figures import TrackFigures, figures, frames_and_columns, without_ids
from core.cast import Cast
from core.engine import Engine
from core.errors import FormatError
from core.frames import HandKey, MarkerFrame, TrackedFrame
from core.gap_filling import filled
from core.labelling.given import Names
from core.labelling.name_check import believed, check_names, check_sides
from core.labelling.network import SHIPPED_NAME
from core.observability import not_told
from core.profile import load_profile
from core.sources import source_shares
from core.takes.export import ExportOptions, export_each
from core.takes.formats import read_recording
from core.takes.holes import Holes, holes_of
from core.takes.imported import info_of
from core.takes.made import Made
from core.takes.reader import open_take
from core.takes.reprocess import relabelled, solve
from core.takes.seal import counts_found
from core.takes.solution import Solution
from core.takes.take import EXTENSION, Mark, TakeCounts, TakeInfo
from core.takes.tracked import TrackedCount
from core.takes.whole import write_take

_SOLVING = 0.8  # of the work of a file; the rest is writing


def solve_file(job: Job, progress: Callable[[float, str], bool | None]) -> TrackFigures:
    """Read, solve and write one file. Raises FormatError, ExportError, and CancelledError if `progress` says so."""
    path, cast = job.path, tuple(load_profile(profile) for profile in job.profiles)
    recording = read_recording(path)
    frames, columns = frames_and_columns(recording, job.unlabelled, no_ids=job.no_ids)
    holes = holes_of(recording.times_s, recording.rate_hz)
    info: TakeInfo | None = None
    marks: tuple[Mark, ...] = ()
    counts: TakeCounts | None = None
    if path.suffix == EXTENSION:
        frames, cast, holes, info, marks, counts = _of_take(path, cast)
        frames = without_ids(frames)[0] if job.no_ids else frames
    if not cast:
        raise FormatError(f"{path.name} does not say what the hands wore.", "Give --profile, for example han19.")
    if job.network is not None:
        own = None if job.network == SHIPPED_NAME else job.network
        cast = tuple(replace(profile, network=own) for profile in cast)
    check_performers(path.name, recording, cast)
    labels = None if job.unlabelled else cast_labels(recording, cast)
    for first in frames[:1]:
        Engine(cast).step(first)  # what the first frame of all prepares says nothing of speed
    target = job.folder / f"{path.stem}{EXTENSION}"
    started = time.perf_counter()

    def told(share: float, text: str) -> bool | None:
        return progress(_SOLVING * share, text)

    faults = check_names(frames, recording.rate_hz, cast, labels) if labels is not None else ()
    named, names = believed(frames, labels, faults) if labels is not None else (frames, None)
    given = labels is not None or job.live_labels
    solved = solve(named, cast, told, labels=names) if given else relabelled(frames, cast, told)
    if labels is None:
        faults = check_sides(frames, solved, cast)
        if faults:  # these hands are not what they were asked for
            solved = _without({fault.hand for fault in faults}, solved, solve(frames, cast, told, labels={}))
    shown = list(filled(solved, cast)) if job.fill else solved
    seconds = time.perf_counter() - started
    exported = export_each(
        Solution(
            path.stem,
            cast,
            recording.rate_hz,
            frames,
            shown,
            holes,
            info,
            marks,
            file=path.name,
            made=_made(job, labels),
        ),
        job.formats,
        job.folder,
        lambda share, text: progress(_SOLVING + (1.0 - _SOLVING) * share, "Writing"),
        overwrite=True,
        options=job.options or ExportOptions(),
    )
    files = list(exported.files)
    if job.take:
        about = replace(info, name=path.stem) if info else info_of(path, recording, cast)
        with open_take(path) if info else nullcontext() as source:
            counting = _counting(counts, len(frames))
            write_take(target, about, cast, zip(frames, shown, strict=True), marks, counting, source=source)
        files.append(target)
    found = figures(path, recording, cast, solved, columns, labels, holes)
    changed = sum(a is not b for a, b in zip(solved, shown, strict=True))
    failed = {name: str(error) for name, error in exported.failed.items()}
    told_of = doubts(recording, cast, labels, job.unlabelled, found.hands, faults, found.labels_left_out, job.least)
    without = (Doubt("holes", f"{holes.words}."),) if len(holes) else ()
    sources, untold = source_shares(shown, cast), not_told(cast)
    return replace(
        found,
        speed=found.duration_s / seconds,
        rate_hz=recording.rate_hz,
        filled=changed / max(len(solved), 1),
        sources=sources.shares,
        sources_by_angle=sources.by_angle,
        not_told=untold,
        files=tuple(files),
        notes=(*(doubt.text for doubt in told_of), *untold, *exported.warnings, *exported.notes),
        failed=failed,
        neutral=tuple(exported.neutral),
        losses=(*without, *(doubt for doubt in told_of if doubt.lost)),
    )


def _without(wrong: set[HandKey], solved: list[TrackedFrame], untracked: list[TrackedFrame]) -> list[TrackedFrame]:
    """The frames with some hands as they are where nothing is named: not tracked."""
    return [
        replace(
            frame,
            hands=tuple(
                none if hand.key in wrong else hand for hand, none in zip(frame.hands, nobody.hands, strict=True)
            ),
        )
        for frame, nobody in zip(solved, untracked, strict=True)
    ]


def _made(job: Job, labels: Names | None) -> Made | None:
    if job.origin is None:
        return None
    return made(job.origin, "given" if labels is not None else "live" if job.live_labels else "whole")


def _of_take(path: Path, cast: Cast) -> tuple[list[MarkerFrame], Cast, Holes, TakeInfo, tuple[Mark, ...], TakeCounts]:
    """The very frames that were recorded, with all their times, so that they solve to what was solved live; what was
    said of them, and what became of the others."""
    with open_take(path) as take:
        counts = take.counts or counts_found(take)
        return list(take.raw), cast or take.profiles, take.holes, take.info, take.marks, counts


def _counting(counts: TakeCounts | None, n: int) -> Callable[[TrackedCount], TakeCounts] | None:
    """The counts of a take that was solved again in all its n frames; None for a file of another program."""
    if counts is None:
        return None
    return lambda tracked: replace(counts, written=n, solved=n, unsolved={}, tracked=tracked.by_hand)
