"""Questions to the labelling network, counted: a frame may ask only so many, or the next one would wait."""

from __future__ import annotations

from collections.abc import Sequence

from core.frames import FloatArray
from core.labelling.network import MOST_POINTS, NamedHand, named, network_at
from core.markers.layout import MarkerLayout
from core.profile import Profile

QUESTIONS = 4
"""In one frame: about 2.5 ms on one thread, so that four hands keep 120 Hz while all of them are looked for."""


class Asker:
    """Asks the network of each performer for right hands; left ones are handed in mirrored, and get the same answer.

    Raises FormatError for a profile whose network cannot be run.
    """

    def __init__(self, profiles: Sequence[Profile]) -> None:
        self._networks = [network_at(profile.network) for profile in profiles]
        self._layouts: list[MarkerLayout] = [profile.worn for profile in profiles]
        self.next_frame()

    def next_frame(self) -> None:
        """Another frame, another QUESTIONS."""
        self.left = QUESTIONS

    def name(self, performer: int, points_m: FloatArray) -> NamedHand | None:
        """The right hand of a performer among (n, 3) float64 [m] points; None where no question is left, or where
        there are more points than the network takes."""
        if self.left == 0 or not 0 < len(points_m) <= MOST_POINTS:
            return None
        self.left -= 1
        return named(self._networks[performer].labels(points_m, self._layouts[performer], "right"), "right")
