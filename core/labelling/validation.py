"""Is a solved hand a hand? (Han 2018, 4.4.)

A pose whose points lie more than 8 mm from the model is none. Before it is given up, single points far off are
unlabelled, and a hand that leaves points and markers unexplained side by side, or fits worse than it did, is looked
for again: near where it is, and now and then everywhere.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from core.frames import NO_POINT, BoolArray, FloatArray, HandKey, IntArray

if TYPE_CHECKING:
    from core.stages import Finder
    from core.track import HandTrack

MAX_RMS_M = 0.008
"""Han 2018, 4.4."""

LEAST_POINTS = 4
DOUBT_RMS_M = 0.0015
DOUBT_RATIO = 1.5
"""A hand that fits so much worse than it used to, and worse than skin slides, has wrong labels."""

LONGEST_PAUSE = 8
"""Frames between two looks at what stays unexplained, such as a ghost beside a hidden marker."""

WORSE_PAUSE = 2
"""The same for a hand that fits worse than it did."""

THOROUGH_PAUSE = 10
"""Frames between two searches everywhere: each costs as much as many frames of tracking."""

MANY_UNEXPLAINED = 3
"""Fewer are rather ghosts beside hidden markers than wrong labels."""

NEAR_M = 0.090
"""A thumb that opens wide is so far from where a hand without its markers is thought to have it."""


@dataclass
class Doubts:
    """When a hand was last looked for again, and how much stood unexplained then."""

    unexplained: int = 0
    wait: int = 0
    pause: int = 0
    since_thorough: int = THOROUGH_PAUSE

    def due(self, unexplained: int) -> bool:
        """Is it time to look near? At once if more is unexplained than before, else after a growing pause."""
        self.wait = max(self.wait - 1, 0)
        return unexplained > self.unexplained or self.wait == 0

    def settle(self, unexplained: int, mended: bool, longest: int) -> None:
        """Take note of what came of it. longest: pause in frames that may follow."""
        self.unexplained = unexplained
        self.pause = 0 if mended else min(max(1, 2 * self.pause), longest)
        self.wait = self.pause


class Validation:
    """Judges each solved hand, and mends wrong labels where it can."""

    def __init__(self, finder: Finder) -> None:
        self._finder = finder
        self.reset()

    def reset(self) -> None:
        """Forget what was doubted before."""
        self._doubts: dict[HandKey, Doubts] = {}

    def accept(self, track: HandTrack, points_m: FloatArray, free: BoolArray) -> bool:
        """True if the pose stands; its labels may have been mended."""
        if track.observed.sum() >= LEAST_POINTS:
            self._drop_outliers(track, points_m)
        rows = self._near(track, points_m, free)
        doubts = self._doubts.setdefault(track.key, Doubts())
        doubts.since_thorough += 1
        unexplained = self._unexplained(track, rows)
        if unexplained == 0 and not self._worse(track):
            doubts.settle(0, mended=True, longest=0)
        elif doubts.due(unexplained):
            mended = self._finder.improve(track, points_m, rows, thorough=False)
            many = self._unexplained(track, rows) >= MANY_UNEXPLAINED
            if doubts.since_thorough > THOROUGH_PAUSE and (many or self._worse(track)):
                doubts.since_thorough = 0
                mended |= self._finder.improve(track, points_m, rows, thorough=True)
            longest = WORSE_PAUSE if self._worse(track) else LONGEST_PAUSE
            doubts.settle(self._unexplained(track, rows), mended, longest)
        few = track.observed.sum() < LEAST_POINTS
        fits = not few and track.pose.rms_m <= MAX_RMS_M
        if fits:
            track.why = "searching" if self._worse(track) else ""
        elif few:
            track.why = "too few markers" if len(rows) else "no points"
        else:
            track.why = "out of shape"
        return bool(fits)

    @staticmethod
    def _drop_outliers(track: HandTrack, points_m: FloatArray) -> None:
        errors = track.errors_m(points_m)
        seen = track.observed
        limit = track.outlier_m
        if np.nanmax(errors) <= limit:
            return
        wrong = seen & (errors > max(limit, 3.0 * float(np.median(errors[seen]))))
        if wrong.any() and (seen & ~wrong).sum() >= LEAST_POINTS:
            track.point[wrong] = NO_POINT
            track.solve(points_m)

    @staticmethod
    def _worse(track: HandTrack) -> bool:
        """Does the hand fit worse than it did, or not at all?"""
        limit = max(DOUBT_RMS_M, DOUBT_RATIO * track.typical_rms_m)
        return bool(track.observed.sum() < LEAST_POINTS or track.pose.rms_m > limit)

    @staticmethod
    def _unexplained(track: HandTrack, rows: IntArray) -> int:
        """Points without a marker while there are markers without a point: as many labels may be missing."""
        n_seen = int(track.observed.sum())
        return min(len(track.point) - n_seen, len(rows) - n_seen)

    @staticmethod
    def _near(track: HandTrack, points_m: FloatArray, free: BoolArray) -> IntArray:
        """Sorted rows of the hand's own points and of the free ones around it."""
        near = np.zeros(len(points_m), dtype=np.bool_)
        spare = np.flatnonzero(free)
        gaps = np.linalg.norm(points_m[spare][:, None] - track.pose.markers_world_m[None], axis=2)
        near[spare] = gaps.min(axis=1) < NEAR_M
        near[track.point[track.observed]] = True
        return np.flatnonzero(near)
