"""Both hands of a performer in one crowd of points, asked about in turn.

Asked for one hand among the points of two, the network takes those of the other for what they are only where they are
few. So each hand is asked about among the points that the other one left, there and back again.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from core.frames import NO_POINT, IntArray
from core.labelling.network import NamedHand

LEAST_TURNS, MOST_TURNS = 2, 4
"""Once each, and once more each: of Han's users 1 to 3 beside each other a third answer of each changed little."""


@dataclass(frozen=True)
class Share:
    """What one of two hands has of a crowd. rows: (k,) of the crowd's n points, those that the other one left; name:
    its names among these."""

    rows: IntArray
    name: NamedHand

    @property
    def point(self) -> IntArray:
        """(m,) int64, row of the crowd for each marker, NO_POINT for none."""
        point: IntArray = np.where(self.name.point == NO_POINT, NO_POINT, self.rows[self.name.point])
        return point

    @property
    def among_all(self) -> NamedHand:
        """Its names among all points of the crowd."""
        return replace(self.name, point=self.point)

    @property
    def named(self) -> IntArray:
        """Rows of the crowd that carry a name."""
        point = self.point
        rows: IntArray = point[point != NO_POINT]
        return rows


def in_turn(ask: Callable[[int, IntArray], NamedHand | None], n: int) -> tuple[Share, Share] | None:
    """What each of two hands has of n points. ask: for the first (0) or the second hand (1) among some rows; None when
    no more may be asked, and then the last answers stand. None where there were not two."""
    everything = np.arange(n)
    shares: dict[int, Share] = {}
    for turn in range(MOST_TURNS):
        hand = turn % 2
        other = shares.get(1 - hand)
        rows = everything if other is None else np.setdiff1d(everything, other.named, assume_unique=True)
        before = shares.get(hand)
        if before is not None and np.array_equal(before.rows, rows):
            break  # the answer would be the same
        name = ask(hand, rows)
        if name is None:
            break
        shares[hand] = Share(rows, name)
    return (shares[0], shares[1]) if len(shares) == 2 else None
