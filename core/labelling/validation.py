"""Is a solved hand a hand? (Han 2018, 4.4.)

A pose whose points lie more than 8 mm from the model is none. Before it is given up, single points far off are
unlabelled, and a hand that leaves points and markers unexplained side by side, or fits worse than it did, is looked
for again: near where it is, and now and then everywhere.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from core.frames import NO_POINT, BoolArray, FloatArray, IntArray

if TYPE_CHECKING:
    from core.stages import Finder
    from core.track import HandTrack

MAX_RMS_M = 0.008
"""Han 2018, 4.4."""

LEAST_POINTS = 4
DOUBT_RMS_M = 0.0015
DOUBT_RATIO = 1.5
"""A hand that fits so much worse than it used to, and worse than skin slides, has wrong labels."""

THOROUGH_PAUSE = 10
"""Frames between two searches everywhere: each costs as much as many frames of tracking."""

MANY_UNEXPLAINED = 3
"""Fewer are rather ghosts beside hidden markers than wrong labels."""

NEAR_M = 0.050


class Validation:
    """Judges each solved hand, and mends wrong labels where it can."""

    def __init__(self, finder: Finder) -> None:
        self._finder = finder
        self._since_thorough: dict[str, int] = {}

    def accept(self, track: HandTrack, points_m: FloatArray, free: BoolArray) -> bool:
        """True if the pose stands; its labels may have been mended."""
        since = self._since_thorough.get(track.side, THOROUGH_PAUSE) + 1
        if track.observed.sum() >= LEAST_POINTS:
            self._drop_outliers(track, points_m)
        rows = self._near(track, points_m, free)
        if self._worse(track) or self._unexplained(track, rows) > 0:
            self._finder.improve(track, points_m, rows, thorough=False)
            if since > THOROUGH_PAUSE and (self._worse(track) or self._unexplained(track, rows) >= MANY_UNEXPLAINED):
                since = 0
                self._finder.improve(track, points_m, rows, thorough=True)
        self._since_thorough[track.side] = since
        return bool(track.observed.sum() >= LEAST_POINTS and track.pose.rms_m <= MAX_RMS_M)

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
