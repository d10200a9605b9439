"""Which joint angles of a hand are guesses: nothing that is seen tells of them as it does with every marker seen.

Schröder 2017 ("Fully automatic tracking") names two kinds, and both are found here by the normal equations alone:
angles of the chain of a hidden marker, and angles that such a marker told of through the prior.
"""

from __future__ import annotations

import numpy as np

from core.frames import BoolArray
from core.hand.skeleton import N_DOFS, N_ROOT_DOFS
from core.kinematics.solver import HandPose, HandSolver

POINT_NOISE_M = 0.0005
"""Spread of a point's coordinate about its marker against which postures are weighed: what a marker that sits well
does on skin. A hand whose shape is not known fits worse, but not at random: its digits must not be bent for it."""

LESS_SURE = 1.25
"""An angle is a guess when its standard deviation is so many times what it is with every marker seen,"""

UNSURE_RAD = 0.03
"""and at least this. An angle known to 2 degrees is better than any guess."""

STILL = 0.85
"""Share of both limits that a guess must fall below to count as seen: what is a guess stays one in case of doubt."""


class Guesses:
    """Follows one hand. Judges anew only when other markers are seen: the pose alone changes nothing."""

    def __init__(self, solver: HandSolver) -> None:
        self._solver = solver
        self._all = np.ones(len(solver.layout.marker_names))
        self.reset()

    def reset(self) -> None:
        """Another hand, or the same after a break."""
        self._seen: BoolArray = self._all.astype(np.bool_)
        self._guessed: BoolArray = np.zeros(N_DOFS - N_ROOT_DOFS, dtype=np.bool_)
        self.mark()

    def mark(self) -> None:
        """A frame begins: what is judged in it may be taken back."""
        self._marked = self._seen, self._guessed

    def take_back(self) -> None:
        """As it was when the frame began."""
        self._seen, self._guessed = self._marked

    def of(self, pose: HandPose, seen: BoolArray) -> BoolArray:
        """(20,) bool, not to be written to, of a right hand in `pose` whose markers `seen` (m,) have points."""
        if not np.array_equal(seen, self._seen):
            self._seen = seen.copy()
            if seen.all():
                self._guessed = np.zeros_like(self._guessed)
            else:
                self._guessed = self._judge(pose, seen)
        return self._guessed

    def _judge(self, pose: HandPose, seen: BoolArray) -> BoolArray:
        # Of one noise for all: what is a guess must not depend on how well a glove fits.
        best, _ = self._solver.uncertainty(pose, self._all, POINT_NOISE_M)
        now, _ = self._solver.uncertainty(pose, seen.astype(np.float64), POINT_NOISE_M)
        ratio = np.minimum(now / (LESS_SURE * best), now / UNSURE_RAD)[N_ROOT_DOFS:]
        guessed: BoolArray = ratio > np.where(self._guessed, STILL, 1.0)
        return guessed
