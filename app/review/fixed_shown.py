"""How far an angle shown may be off in all frames alike, worked out for the frame under the playhead alone."""

from __future__ import annotations

import numpy as np

from app.review.analysis import Analysis, Cell
from core.calibration.carried import Carrier, fixed_std
from core.cast import Cast
from core.frames import BoolArray, FloatArray
from core.hand.mirror import mirror_theta

SAMPLE = 200
"""Tracked frames, spread over the take, that the size of a hand is taken to rest on, where it was found."""


class FixedShown:
    """theta_std_fixed (core.takes.export.fixed_std) of the hands of a take whose profiles are `cast`."""

    def __init__(self, analysis: Analysis, cast: Cast) -> None:
        self.analysis = analysis
        self._cast = cast
        self._known: dict[int, tuple[Carrier, BoolArray, FloatArray]] = {}

    def std(self, hand: int, frame: int) -> FloatArray:
        """(26,) float64 [m for 0:3, else rad], of one hand of the analysis where it is tracked."""
        if hand not in self._known:
            self._known[hand] = self._learn(hand)
        carrier, shown, covariance = self._known[hand]
        std: FloatArray = fixed_std(self._carried(carrier, hand, np.asarray([frame]), shown), covariance)[0]
        return std

    def _learn(self, hand: int) -> tuple[Carrier, BoolArray, FloatArray]:
        analysis = self.analysis
        profile = self._cast[analysis.hands[hand].performer]
        carrier, tracked = Carrier(profile), np.flatnonzero(analysis.states[hand] == Cell.TRACKED)
        shown = analysis.observed[hand, tracked, : len(profile.layout.joints)].any(axis=0)
        if profile.scale is not None or not len(tracked):
            return carrier, shown, carrier.covariance
        sample = tracked[np.unique(np.linspace(0, len(tracked) - 1, min(SAMPLE, len(tracked))).astype(int))]
        return carrier, shown, carrier.sized(self._carried(carrier, hand, sample, shown, free_scale=True))

    def _carried(
        self, carrier: Carrier, hand: int, frames: np.ndarray, shown: BoolArray, *, free_scale: bool = False
    ) -> FloatArray:
        thetas = self.analysis.theta_rad[hand, frames].astype(np.float64)
        if self.analysis.hands[hand].side == "left":
            thetas = mirror_theta(thetas)
        weights = np.tile(shown.astype(np.float64), (len(frames), 1))
        scales = self.analysis.scales[hand, frames].astype(np.float64)
        return carrier.carried(thetas, scales, weights, free_scale=free_scale)
