"""Points that somebody pointed at in one frame, followed through the frames before and after: are they one thing?"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from core.errors import CancelledError, PhalanxError
from core.frames import NO_ID, NO_POINT, FloatArray, IntArray, MarkerFrame
from core.gaps import present
from core.props.define import RIGID_M
from core.props.prop import LEAST_MARKERS, MOST_MARKERS, Prop
from core.props.rigid import aligned, mean_shape, moved
from core.props.tracker import PropTracker

Progress = Callable[[float], bool]
"""Told the share done, 0 to 1; False stops."""

STEP_M = 0.03
"""A point without an id is the nearest one in the next frame, no further away than this."""

STILL_M, STILL_RAD = 0.02, float(np.radians(10.0))
"""Points that moved less would look rigid whatever they are on."""

_TELL_EVERY = 200
_FEW = 300


@dataclass(frozen=True)
class Stretch:
    """The unbroken stretch of frames about a moment in which all picked points are seen.

    first: index of its first frame. samples_m: (t, m, 3) float64 [m], the points in the order they were picked.
    """

    first: int
    samples_m: FloatArray


@dataclass(frozen=True)
class Followed:
    """A prop as it would be tracked through all frames.

    times_s: (n,) float64 [s]. rms_m: (n,) float64 [m], distance of its seen markers from their places, NaN where it is
    not tracked. samples_m: (n, m, 3) float64 [m], NaN where a marker is not seen.
    """

    times_s: FloatArray
    rms_m: FloatArray
    samples_m: FloatArray

    @property
    def tracked_share(self) -> float:
        """Share of the frames in which it is tracked, 0 to 1."""
        return float(np.isfinite(self.rms_m).mean()) if len(self.rms_m) else 0.0


def stretch_about(
    frames: Sequence[MarkerFrame], at: int, rows: Sequence[int], progress: Progress = lambda share: True
) -> Stretch:
    """Follow the points `rows` of frame `at` by their ids, or by nearness where a device gives none, both ways.

    Raises PhalanxError for fewer than three or more than sixteen of them, CancelledError if stopped.
    """
    if not LEAST_MARKERS <= len(rows) <= MOST_MARKERS:
        count = "One point is" if len(rows) == 1 else f"{len(rows) or 'No'} points are"
        raise PhalanxError(f"{count} chosen.", f"Choose {LEAST_MARKERS} to {MOST_MARKERS}: the markers of one thing.")
    start = frames[at]
    chosen = np.asarray(rows, dtype=np.int64)
    ids, here_m = start.ids[chosen], start.points_m[chosen]
    seen: dict[int, FloatArray] = {at: here_m}
    for step, end in ((-1, -1), (1, len(frames))):
        points_m = here_m
        for i in range(at + step, end, step):
            if len(seen) % _TELL_EVERY == 0 and not progress(len(seen) / len(frames)):
                raise CancelledError
            found = _next(frames[i], ids, points_m)
            if found is None:
                break
            seen[i] = points_m = found
    first = min(seen)
    return Stretch(first, np.stack([seen[i] for i in range(first, first + len(seen))]))


def _next(frame: MarkerFrame, ids: IntArray, points_m: FloatArray) -> FloatArray | None:
    """(m, 3) [m]: the same points in a neighbouring frame; None if one is missing."""
    rows: list[int] = []
    for id_, point_m in zip(ids.tolist(), points_m, strict=True):
        if id_ != NO_ID:
            known = np.flatnonzero(frame.ids == id_)
            row = int(known[0]) if len(known) == 1 else NO_POINT
        else:
            gaps_m = np.linalg.norm(frame.points_m - point_m, axis=1)
            gaps_m[~present(frame.points_m)] = np.inf
            row = int(gaps_m.argmin()) if len(gaps_m) and gaps_m.min() <= STEP_M else NO_POINT
        if row == NO_POINT or row in rows or not present(frame.points_m[row]):
            return None
        rows.append(row)
    found: FloatArray = frame.points_m[rows]
    return found


def loosest(samples_m: FloatArray) -> tuple[int, float, bool]:
    """Which of the points (t, m, 3) [m] moves against the others, by how many metres at most, and whether the others
    are rigid without it. Three points or more; that of three is judged by its distances to the other two."""
    some = samples_m[:: max(1, len(samples_m) // _FEW)]
    m = some.shape[1]
    if m == LEAST_MARKERS:
        apart_m = np.linalg.norm(some[:, :, None] - some[:, None], axis=3)
        range_m = np.ptp(apart_m, axis=0)
        return int(range_m.sum(axis=0).argmax()), float(range_m.max()), False
    best, best_rms_m, best_way_m = 0, np.inf, 0.0
    for k in range(m):
        others = np.delete(some, k, axis=1)
        shape_m, errors_m = mean_shape(others)
        rms_m = float(np.sqrt(np.square(errors_m).mean()))
        if rms_m < best_rms_m:
            own_m = moved(some[:, k : k + 1], aligned(others, shape_m))[:, 0]
            best, best_rms_m = k, rms_m
            best_way_m = float(np.linalg.norm(own_m - np.median(own_m, axis=0), axis=1).max())
    return best, best_way_m, best_rms_m <= RIGID_M


def check_rigid(samples_m: FloatArray) -> None:
    """Raises PhalanxError naming the point, by the number in which it was picked, that moves against the others
    (t, m, 3) [m]."""
    _, errors_m = mean_shape(samples_m)
    if np.sqrt(np.square(errors_m).mean()) <= RIGID_M:
        return
    k, way_m, others_rigid = loosest(samples_m)
    what = f"These points are not rigid: point {k + 1} moves by {1e3 * way_m:.1f} mm against the others."
    if samples_m.shape[1] == LEAST_MARKERS:
        raise PhalanxError(what, "Choose points that sit on one rigid thing.")
    if others_rigid:
        raise PhalanxError(what, "Take it out of the selection (Shift+click), then try again.")
    raise PhalanxError(f"{what} The others move among themselves too.", "Choose points that sit on one rigid thing.")


def moved_by(samples_m: FloatArray) -> tuple[float, float]:
    """The way [m] of the middle of points (t, m, 3) [m] from where it began, and their turn [rad]: the largest."""
    some = samples_m[:: max(1, len(samples_m) // _FEW)]
    way_m = np.linalg.norm(some.mean(axis=1) - some[0].mean(axis=0), axis=1).max()
    traces = np.trace(aligned(some, some[0])[:, :3, :3], axis1=1, axis2=2)
    return float(way_m), float(np.arccos(np.clip(0.5 * (traces - 1.0), -1.0, 1.0)).max())


def still_words(samples_m: FloatArray) -> str:
    """A warning where the points hardly moved, else ""."""
    way_m, turn_rad = moved_by(samples_m)
    if way_m >= STILL_M or turn_rad >= STILL_RAD:
        return ""
    return (
        f"The points moved only {1e3 * way_m:.0f} mm and {np.degrees(turn_rad):.0f}° in {len(samples_m):,} frames: "
        "whether they sit on one thing shows when it is turned about."
    )


def followed(
    frames: Iterable[MarkerFrame], n_frames: int, prop: Prop, progress: Progress = lambda share: True
) -> Followed:
    """Track a prop through all frames, as the engine does before it looks for hands. Raises CancelledError."""
    tracker, m = PropTracker(prop), len(prop.markers_m)
    times_s, rms_m = np.full(n_frames, np.nan), np.full(n_frames, np.nan)
    samples_m = np.full((n_frames, m, 3), np.nan)
    before_s = np.nan
    for i, frame in enumerate(frames):
        if i % _TELL_EVERY == 0 and not progress(i / n_frames):
            raise CancelledError
        usable = np.flatnonzero(present(frame.points_m))
        points_m = frame.points_m[usable]
        tracker.step(points_m, frame.ids[usable], np.ones(len(usable), dtype=np.bool_), frame.times.host_s - before_s)
        times_s[i] = before_s = frame.times.host_s
        if tracker.tracked:
            rms_m[i] = tracker.rms_m
            seen = tracker.point != NO_POINT
            samples_m[i, seen] = points_m[tracker.point[seen]]
    return Followed(times_s, rms_m, samples_m)
