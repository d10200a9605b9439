"""What the engine asks of its replaceable parts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

from core.frames import BoolArray, FloatArray, HandKey, IntArray
from core.track import HandTrack


class Stage(Protocol):
    """What every part remembers from frame to frame, and how it is told of what is no frame."""

    def reset(self) -> None:
        """Forget what was seen before."""

    def skip(self, frames: int) -> None:
        """So many frames went by unseen: what counts frames counts them."""

    def keep(self, hands: Mapping[HandKey, HandKey]) -> None:
        """Of the hands known go on with these, under the keys that they have from now on; forget all others."""


class Labeller(Stage, Protocol):
    """Names the points of hands that are tracked."""

    def pass_over(self, ids: frozenset[int], tracks: Sequence[HandTrack]) -> None:
        """A frame went by of whose points only the ids are looked at (NO_ID is not among them). tracks: those that are
        tracked; each has been told."""

    def label(self, points_m: Sequence[FloatArray], ids: IntArray, tracks: Sequence[HandTrack]) -> None:
        """Write `point` of every track. points_m: per track (n, 3) float64 [m], as its hand sees them; ids: (n,)."""


class Validator(Stage, Protocol):
    """Judges a solved hand."""

    def accept(self, track: HandTrack, points_m: FloatArray, free: BoolArray) -> bool:
        """Is this a pose? May mend labels and solve again. points_m: (n, 3) [m]; free: (n,), points without label."""


class Finder(Stage, Protocol):
    """Looks for hands that are not tracked."""

    def find(self, points_m: Sequence[FloatArray], ids: IntArray, free: IntArray, tracks: Sequence[HandTrack]) -> None:
        """Begin every track whose hand is found among the points `free` (rows).

        points_m: per track (n, 3) float64 [m], as its hand sees them; ids: (n,).
        """
