"""Questions to the labelling network, counted: a frame may ask only so many, or the next one would wait."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from core.errors import FormatError
from core.frames import FloatArray, IntArray, Side
from core.labelling.network import MOST_POINTS, LabelNetwork, NamedHand, named, network_at
from core.labelling.sizes import Sized, size_of, sized, told_of
from core.markers.layout import MarkerLayout
from core.profile import Profile

QUESTIONS = 4
"""In one frame: about 2.5 ms on one thread, so that four hands keep 120 Hz while all of them are looked for. How large
a hand is counts as one: it takes four times as long as a name, about as long as a name and the fit that follows it."""


class Asker:
    """Asks the network of each performer for right hands; left ones are handed in mirrored, and get the same answer.

    networks: of each performer. found: size of the hands of performers, on top of their shape, as far as it is known;
    about: as far as a hand of theirs is tracked.
    Raises FormatError for a profile whose network cannot be run.
    """

    def __init__(self, profiles: Sequence[Profile]) -> None:
        self._used: dict[str | None, LabelNetwork] = {}
        self.change(profiles)
        self.next_frame({}, {})

    def change(self, profiles: Sequence[Profile]) -> None:
        """Ask for other performers. Raises FormatError, and goes on with those before."""
        networks = [self._network(profile.network) for profile in profiles]
        self._used = dict(zip((profile.network for profile in profiles), networks, strict=True))
        self.networks = networks
        self._layouts: list[MarkerLayout] = [told_of(profile) for profile in profiles]
        self._shapes = [size_of(profile.shape) for profile in profiles]
        # Who wears the same and has the same network shares what is found of a cloud's size.
        told = [
            (id(network), layout.positions_m.tobytes(), layout.joints.tobytes())
            for network, layout in zip(networks, self._layouts, strict=True)
        ]
        self._alike = [told.index(one) for one in told]

    def _network(self, path: str | None) -> LabelNetwork:
        """That of a file as it is now; as it was, where it is in use and its file cannot be read any more."""
        try:
            return network_at(path)
        except FormatError:
            if path not in self._used:
                raise
            return self._used[path]

    def alike(self, one: int, other: int) -> bool:
        """Do two performers wear the same, named by the same network?"""
        return self._alike[one] == self._alike[other]

    def next_frame(self, found: Mapping[int, float], about: Mapping[int, float]) -> None:
        """Another frame, another QUESTIONS. found, about: see there."""
        self.left = QUESTIONS
        self.found, self.about = found, about
        self._sized: dict[tuple[int, bytes], Sized] = {}

    def name(self, performer: int, points_m: FloatArray, scale: float) -> NamedHand | None:
        """The right hand of a performer among (n, 3) float64 [m] points; None where no question is left, or where
        there are more points than the network takes. scale: of the hand, on top of its shape."""
        if self.left == 0 or not 0 < len(points_m) <= MOST_POINTS:
            return None
        self.left -= 1
        size = (scale * self._shapes[performer],)
        (labels,) = self.networks[performer].labels_at(size, points_m, self._layouts[performer], "right")
        return named(labels, "right")

    def sized(self, performer: int, side: Side, points_m: FloatArray, rows: IntArray) -> tuple[float, float] | None:
        """Scale of the hand at `rows` of (n, 3) float64 [m] points, were it the performer's, and how sure it is that
        it is the one of this side; None as of `name`. Points of a left hand are in the mirror. Hands of either side and
        performers who wear the same share the answer, and only the first of them uses up a question."""
        key = self._alike[performer], rows.tobytes()
        known = self._sized.get(key)
        if known is None:
            if self.left == 0 or not 0 < len(rows) <= MOST_POINTS:
                return None
            self.left -= 1
            known = sized(self.networks[performer], points_m[rows], self._layouts[performer])
            if side == "left":
                known = replace(known, right=1.0 - known.right)
            self._sized[key] = known
        return known.size / self._shapes[performer], known.right if side == "right" else 1.0 - known.right
