"""What a recording holds, and whether it is what it should be: for people, before they work with it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from core.frames import BoolArray, FloatArray
from core.recording import Recording
from core.takes.holes import Holes, holes_of
from core.takes.rate import rate_warning
from core.takes.verify import Finding
from core.takes.wild import coded, wild_warnings

FARTHEST_CAPTURE_M = 50.0
"""Half of the points lie nearer than this to the origin in any capture volume: else the unit is wrong."""

SMALLEST_CAPTURE_M = 0.01
"""What moves in less room than this is no hand: the unit is wrong."""

_MOST_NAMED = 5


@dataclass(frozen=True)
class MarkerGaps:
    """Where one marker is not seen. share: of the frames, 0..1. longest_s: until it is seen again or the end [s]."""

    name: str
    share: float
    longest_s: float


@dataclass(frozen=True)
class Overview:
    """A recording in a few figures.

    markers: gaps of each labelled one that has any, the worst first. holes: time without frames. points: least, median
    and most in a frame. empty: frames without any. reach_m: (2, 3) float64 [m], the box that holds all points, NaN
    where there is none.
    """

    markers: tuple[MarkerGaps, ...]
    holes: Holes
    points: tuple[int, int, int]
    empty: int
    reach_m: FloatArray


def overview(recording: Recording) -> Overview:
    """Its figures."""
    present = ~np.isnan(recording.points_m[:, :, 0])
    per_frame = present.sum(axis=1)
    points = recording.points_m[present]
    reach = np.stack([points.min(axis=0), points.max(axis=0)]) if len(points) else np.full((2, 3), np.nan)
    return Overview(
        tuple(sorted(_marker_gaps(recording), key=lambda one: (-one.share, -one.longest_s))),
        holes_of(recording.times_s, recording.rate_hz),
        (int(per_frame.min()), int(np.median(per_frame)), int(per_frame.max())),
        int((per_frame == 0).sum()),
        reach,
    )


def warnings_of(recording: Recording) -> tuple[str, ...]:
    """What is amiss in its times and places, beside what its reader says, in sentences; the figures of an overview say
    the rest."""
    rate = rate_warning(recording.frame_numbers, recording.times_s, recording.rate_hz)
    codes = coded(recording)
    return (*([rate] if rate else ()), *unit_warnings(recording, codes), *wild_warnings(recording, codes))


def findings(recording: Recording, seen: Overview) -> tuple[Finding, ...]:
    """What is worth knowing before a recording of another program is used."""
    return tuple(_findings(recording, seen))


def _marker_gaps(recording: Recording) -> Iterator[MarkerGaps]:
    """Of each labelled marker that is not seen everywhere."""
    until_s = np.append(recording.times_s, recording.times_s[-1] + 1.0 / recording.rate_hz)
    for column, name in enumerate(recording.labels):
        gone = np.isnan(recording.points_m[:, column, 0])
        if not gone.any():
            continue
        edges = np.flatnonzero(np.diff(np.concatenate([[False], gone, [False]])))
        begin, end = edges[0::2], edges[1::2]
        yield MarkerGaps(name, float(gone.mean()), float((until_s[end] - until_s[begin]).max()))


def _findings(recording: Recording, seen: Overview) -> Iterator[Finding]:
    for text in recording.warnings:
        yield Finding("warning", text)
    yield from _time_findings(recording, seen.holes)
    for text in warnings_of(recording):
        yield Finding("warning", text)
    never = [marker.name for marker in seen.markers if marker.share == 1.0]
    if never:
        others = f" and {len(never) - _MOST_NAMED} more" if len(never) > _MOST_NAMED else ""
        yield Finding("warning", f"Never seen: {', '.join(never[:_MOST_NAMED])}{others}.")
    if seen.empty:
        frames = "1 frame is" if seen.empty == 1 else f"{seen.empty:,} frames are"
        yield Finding("note", f"{frames} without any point.")
    if recording.gaps.total:
        yield Finding("note", f"{recording.gaps.words}, {100 * recording.gap_figures['share']:.1f} % of its points.")


def _time_findings(recording: Recording, holes: Holes) -> Iterator[Finding]:
    if len(holes):
        yield Finding("warning", f"{holes.words}, the longest {holes.longest_s:.2f} s.")
    steps = np.diff(recording.frame_numbers)
    usual = int(np.median(steps)) if len(steps) else 1  # every second frame was exported: 2
    skips = np.flatnonzero(steps > usual)
    if len(skips):
        missing = int(np.round(steps[skips] / usual - 1).sum())
        frames = "1 frame" if missing == 1 else f"{missing:,} frames"
        after = int(recording.frame_numbers[skips[0]])
        yield Finding("warning", f"Its frame numbers skip {frames}, first after frame {after}.")


def unit_warnings(recording: Recording, codes: BoolArray) -> Iterator[str]:
    """Sentences where its points lie as those of no hand do. codes: (t, m) bool, the points that are none."""
    points = recording.points_m[~np.isnan(recording.points_m[:, :, 0]) & ~codes]
    if not len(points):
        yield "It holds no point at all."
        return
    middle = np.median(points, axis=0)
    away_m, spread = float(np.linalg.norm(middle)), np.percentile(points, [5, 95], axis=0)
    room_m = float(np.linalg.norm(spread[1] - spread[0]))
    if away_m > FARTHEST_CAPTURE_M:
        yield f"Its points lie {away_m:.0f} m from the origin: check the unit of the export."
    elif recording.points_m.shape[1] > 2 and room_m < SMALLEST_CAPTURE_M:
        yield f"Its points lie within {1e3 * room_m:.3g} mm: check the unit of the export."
