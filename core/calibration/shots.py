"""Labelled right hands, one per hand and frame: what a performer is calibrated from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from core.frames import BoolArray, FloatArray, HandState, IntArray, MarkerFrame, TrackedFrame
from core.hand.mirror import mirror_points, mirror_theta

LEAST_SHARE = 0.6
"""Of a layout's markers that a shot to calibrate from must show."""

WORST_RATIO = 3.0
"""A shot that fits so many times worse than the median shot is no witness: its labels are wrong, or it is lost."""


@dataclass(frozen=True)
class Shots:
    """n labelled right hands; left ones are mirrored.

    thetas_rad (n, 26) float64, poses as they were tracked. points_m (n, m, 3) float64 [m], NaN where unseen. rms_m
    (n,) of the tracked poses. scales (n,) as tracked. frames (n,) int64, which frame each is of.
    """

    thetas_rad: FloatArray
    points_m: FloatArray
    rms_m: FloatArray
    scales: FloatArray
    frames: IntArray

    def __len__(self) -> int:
        return len(self.frames)

    def __getitem__(self, rows: IntArray) -> Shots:
        return Shots(self.thetas_rad[rows], self.points_m[rows], self.rms_m[rows], self.scales[rows], self.frames[rows])

    @property
    def scale(self) -> float:
        """Of the hand, over all shots."""
        return float(np.median(self.scales))

    @property
    def usable(self) -> BoolArray:
        """(n,) bool: tracked well enough, with markers enough."""
        seen = (~np.isnan(self.points_m[..., 0])).mean(axis=1)
        usable: BoolArray = (seen >= LEAST_SHARE) & (self.rms_m <= WORST_RATIO * np.median(self.rms_m))
        return usable


def shots_of(frames: Sequence[MarkerFrame], solved: Sequence[TrackedFrame], n_markers: int) -> Shots:
    """Every tracked hand of `solved`, with its points of `frames`."""
    thetas, points, rms, scales, numbers = [], [], [], [], []
    for number, (frame, tracked) in enumerate(zip(frames, solved, strict=True)):
        for hand in tracked.hands:
            if hand.state is not HandState.TRACKED or not np.isfinite(hand.rms_m):
                continue
            own = np.full((n_markers, 3), np.nan)
            own[hand.observed] = frame.points_m[hand.point[hand.observed]]
            left = hand.side == "left"
            thetas.append(mirror_theta(hand.theta_rad) if left else hand.theta_rad)
            points.append(mirror_points(own) if left else own)
            rms.append(hand.rms_m)
            scales.append(hand.scale)
            numbers.append(number)
    return Shots(
        np.asarray(thetas, dtype=np.float64).reshape(-1, 26),
        np.asarray(points, dtype=np.float64).reshape(-1, n_markers, 3),
        np.asarray(rms, dtype=np.float64),
        np.asarray(scales, dtype=np.float64),
        np.asarray(numbers, dtype=np.int64),
    )
