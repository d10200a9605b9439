"""Questions to the labelling network, counted: a frame may ask only so many, or the next one would wait."""

from __future__ import annotations

from collections.abc import Sequence

from core.errors import FormatError
from core.frames import FloatArray
from core.labelling.network import MOST_POINTS, LabelNetwork, NamedHand, network_at
from core.labelling.sizes import SIZES, named_at, size_of, told_of
from core.markers.layout import MarkerLayout
from core.profile import Profile

QUESTIONS = 4
"""In one frame, of one cloud each: about 2.5 ms on one thread, so that four hands keep 120 Hz while all of them are
looked for."""

OF_UNKNOWN_SIZE = 2
"""So many questions is one counted about a hand of unknown size: four clouds at once."""


class Asker:
    """Asks the network of each performer for right hands; left ones are handed in mirrored, and get the same answer.

    networks: of each performer. Raises FormatError for a profile whose network cannot be run.
    """

    def __init__(self, profiles: Sequence[Profile]) -> None:
        self._used: dict[str | None, LabelNetwork] = {}
        self.change(profiles)
        self.next_frame()

    def change(self, profiles: Sequence[Profile]) -> None:
        """Ask for other performers. Raises FormatError, and goes on with those before."""
        networks = [self._network(profile.network) for profile in profiles]
        self._used = dict(zip((profile.network for profile in profiles), networks, strict=True))
        self.networks = networks
        self._layouts: list[MarkerLayout] = [told_of(profile) for profile in profiles]
        self._shapes = [size_of(profile.shape) for profile in profiles]

    def _network(self, path: str | None) -> LabelNetwork:
        """That of a file as it is now; as it was, where it is in use and its file cannot be read any more."""
        try:
            return network_at(path)
        except FormatError:
            if path not in self._used:
                raise
            return self._used[path]

    def next_frame(self) -> None:
        """Another frame, another QUESTIONS."""
        self.left = QUESTIONS

    def name(self, performer: int, points_m: FloatArray, scale: float | None) -> NamedHand | None:
        """The right hand of a performer among (n, 3) float64 [m] points; None where too few questions are left, or
        where there are more points than the network takes.

        scale: of the performer's hand, on top of its shape; None while it is not known.
        """
        count = OF_UNKNOWN_SIZE if scale is None else 1
        if self.left < count or not 0 < len(points_m) <= MOST_POINTS:
            return None
        self.left -= count
        sizes = SIZES if scale is None else (scale * self._shapes[performer],)
        return named_at(sizes, self.networks[performer], points_m, self._layouts[performer], "right")
