"""Names of points as numbers, for all hands of a cast: one for each marker of each hand."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from core.cast import Cast, hands_of
from core.frames import NO_POINT, HandKey, HandState, IntArray, Side, TrackedFrame
from core.labelling.given import Names

NOBODY: Final = -1
"""A point that is looked at and has no name."""

UNKNOWN: Final = -2
"""A point of which nothing is said: no hand is known near it."""


@dataclass(frozen=True)
class Naming:
    """first: the name of marker k of a hand is first[hand] + k. n_names: of all hands together."""

    first: Mapping[HandKey, int]
    n_names: int
    labels: Names

    @classmethod
    def of(cls, cast: Cast) -> Naming:
        """For every hand of a cast."""
        first: dict[HandKey, int] = {}
        labels: dict[int, tuple[Side | HandKey, int]] = {}
        for key in hands_of(cast):
            first[key] = len(labels)
            labels |= {first[key] + k: (key, k) for k in range(len(cast[key.performer].layout.marker_names))}
        return cls(first, len(labels), labels)

    def n_markers(self, hand: HandKey) -> int:
        """Names of one hand."""
        following = [first for first in self.first.values() if first > self.first[hand]]
        return min(following, default=self.n_names) - self.first[hand]

    def given(self, frame: TrackedFrame, n_points: int) -> IntArray:
        """(n_points,) int64, the name that each point of a solved frame carries, NOBODY for none."""
        names = np.full(n_points, NOBODY, dtype=np.int64)
        for hand in frame.hands:
            if hand.state is HandState.TRACKED:
                seen = np.flatnonzero(hand.point != NO_POINT)
                names[hand.point[seen]] = self.first[hand.key] + seen
        return names
