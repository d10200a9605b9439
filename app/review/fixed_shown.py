"""How far an angle shown may be off in all frames alike, worked out for the frame under the playhead alone."""

from __future__ import annotations

import numpy as np

from app.review.analysis import Analysis, Cell
from core.calibration.fixed_error import SAMPLE, FixedError
from core.frames import FloatArray
from core.hand.skeleton import N_ROOT_DOFS


class FixedShown:
    """theta_std_fixed (core.takes.export.fixed_std) of the hands of a take."""

    def __init__(self, analysis: Analysis) -> None:
        self.analysis = analysis
        self._known: dict[int, FixedError] = {}

    def std(self, hand: int, frame: int) -> FloatArray:
        """(26,) float64 [m for 0:3, else rad], of one hand of the analysis where it is tracked."""
        if hand not in self._known:
            self._known[hand] = self._learn(hand)
        std: FloatArray = self._known[hand].std(*self._poses(hand, np.asarray([frame])))[0]
        return std

    def _learn(self, hand: int) -> FixedError:
        analysis, key = self.analysis, self.analysis.hands[hand]
        profile, tracked = analysis.cast[key.performer], np.flatnonzero(analysis.states[hand] == Cell.TRACKED)
        shown = analysis.observed[hand, tracked, : len(profile.layout.joints)].any(axis=0)
        sample = tracked[np.unique(np.linspace(0, len(tracked) - 1, min(SAMPLE, len(tracked))).astype(int))]
        neutral = None if profile.neutral is None else profile.neutral.hands.get(key.side)
        return FixedError(profile, key.side, *self._poses(hand, sample), shown, neutral)

    def _poses(self, hand: int, frames: np.ndarray) -> tuple[FloatArray, FloatArray]:
        """theta_rad (f, 26), as tracked: the analysis holds what is reported, less the zeros. Scales (f,)."""
        thetas, key = self.analysis.theta_rad[hand, frames].astype(np.float64), self.analysis.hands[hand]
        neutral = self.analysis.cast[key.performer].neutral
        if neutral is not None and key.side in neutral.hands:
            thetas[:, N_ROOT_DOFS:] += neutral.hands[key.side].zero_rad
        return thetas, self.analysis.scales[hand, frames].astype(np.float64)
