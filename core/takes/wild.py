"""Points at places where nothing can be: a program's code for a missing point, read as a place, and single points that
leap out of the volume and back."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from core.frames import NO_ID, BoolArray, FloatArray, IntArray
from core.recording import Recording

LEAST_REPEATS = 3
"""So often the very same x = y = z does not come by chance: measured values have noise."""

_BULK = 90.0  # % of the points say how far a volume reaches
_BEYOND = 2.5  # times as far from their middle as they reach,
_LEAST_REACH_M = 2.0  # or as this, is no place in it
_CODE_BEYOND, _CODE_LEAST_M = 2.0, 0.5  # the same of a code, of which there can be no doubt otherwise
_LEAP_M, _FASTEST_M_S = 1.0, 20.0  # no marker on a hand gets farther than this, and so fast


def coded(recording: Recording) -> BoolArray:
    """(t, m) bool: which points stand at a place that says "missing": with x, y and z of the same amount, exactly the
    same again and again, and far from all that are not. Signs may differ, for axes may have been turned."""
    points, found = recording.points_m, np.zeros(recording.points_m.shape[:2], dtype=np.bool_)
    amounts = np.abs(points)
    alike = (amounts[:, :, 0] == amounts[:, :, 1]) & (amounts[:, :, 1] == amounts[:, :, 2])
    others = points[~np.isnan(points[:, :, 0]) & ~alike]
    if int(alike.sum()) < LEAST_REPEATS or not len(others):
        return found
    middle, reach_m = _middle_and_reach(others)
    places, counts = np.unique(points[alike], axis=0, return_counts=True)
    far = np.linalg.norm(places - middle, axis=1) > max(_CODE_BEYOND * reach_m, _CODE_LEAST_M)
    for place in places[far & (counts >= LEAST_REPEATS)]:
        found |= (points == place).all(axis=2)
    return found


def leaps(recording: Recording, usable: BoolArray) -> BoolArray:
    """(t, m) bool: which points are far out of the volume of all, where their own marker was not a moment before, or
    is not a moment later. A marker that is always there, or goes there, is none.

    usable: (t, m) bool, the points to look at. Points without labels are followed by their ids.
    """
    points, found = recording.points_m, np.zeros(recording.points_m.shape[:2], dtype=np.bool_)
    if not usable.any():
        return found
    middle, reach_m = _middle_and_reach(points[usable])
    with np.errstate(invalid="ignore"):
        out = np.linalg.norm(points - middle, axis=2) > _BEYOND * max(reach_m, _LEAST_REACH_M)
    out &= usable
    whose: IntArray = np.broadcast_to(recording.ids, out.shape)
    out &= whose != NO_ID
    frame, column = np.nonzero(usable & np.isin(whose, np.unique(whose[out])))
    if not len(frame):
        return found
    order = np.lexsort((frame, whose[frame, column]))
    frame, column = frame[order], column[order]
    one, far, time_s = whose[frame, column], out[frame, column], recording.times_s[frame]
    same = one[1:] == one[:-1]
    turns = same & (far[1:] != far[:-1])
    step_m = np.linalg.norm(np.diff(points[frame, column], axis=0), axis=1)
    leap = turns & (step_m > _LEAP_M + _FASTEST_M_S * np.diff(time_s))
    run = np.concatenate([[0], np.cumsum(turns | ~same)])
    leapt = np.zeros(run[-1] + 1, dtype=np.bool_)
    leapt[run[:-1][leap]] = leapt[run[1:][leap]] = True
    wild = far & leapt[run]
    found[frame[wild], column[wild]] = True
    return found


def wild_warnings(recording: Recording, codes: BoolArray) -> Iterator[str]:
    """Sentences on them. codes: as `coded` says."""
    places, counts = np.unique(recording.points_m[codes], axis=0, return_counts=True)
    for place, n in zip(places, counts.tolist(), strict=True):
        yield (
            f"{n:,} points stand at exactly {_place(place)} m ({1e3 * place[0]:.9g} in mm), far from all others: "
            "likely a code for a missing marker. Export it with such points left blank."
        )
    far = leaps(recording, ~np.isnan(recording.points_m[:, :, 0]) & ~codes)
    if n := int(far.sum()):
        frame, column = np.argwhere(far)[0]
        who = recording.labels[column] if recording.labels else f"point {recording.ids[frame, column]}"
        where = f"frame {recording.frame_numbers[frame]}: {who} at {_place(recording.points_m[frame, column], 4)} m"
        start = f"1 point leaps far away from all others, in {where}"
        yield f"{start if n == 1 else f'{n:,} points leap far away from all others, the first in {where}'}."


def _middle_and_reach(points_m: FloatArray) -> tuple[FloatArray, float]:
    """(3,) float64 [m] where (n, 3) points are, and how far most of them lie from there [m]."""
    middle: FloatArray = np.median(points_m, axis=0)
    return middle, float(np.percentile(np.linalg.norm(points_m - middle, axis=1), _BULK))


def _place(point_m: FloatArray, digits: int = 9) -> str:
    return " ".join(f"{value:.{digits}g}" for value in point_m)
