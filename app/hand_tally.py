"""How well each hand of a recording is seen, counted while it is solved: no frame need be kept."""

from __future__ import annotations

import math
from array import array
from dataclasses import dataclass

import numpy as np

from core.cast import Cast, hand_names
from core.frames import FloatArray, HandKey, HandState, TrackedFrame


@dataclass(frozen=True)
class HandFigures:
    """One hand over a recording.

    tracked: share of the frames that should be there with a pose, 0..1. first_s: time of its first pose [s]. rms_m:
    over all observed markers [m]. hidden: share of its markers that no point explained while it was tracked, 0..1.
    length_m: from the wrist to the tip of the middle finger, median over its tracked frames [m]; NaN if not known.
    """

    tracked: float
    first_s: float
    rms_m: float
    hidden: float
    length_m: float = math.nan


class HandTally:
    """Counts frame by frame, as the engine solved them. frames: how many. tracked: those in which any hand is."""

    def __init__(self, cast: Cast) -> None:
        self._names = hand_names(cast)
        self._cast = cast
        self._hands: dict[HandKey, _Count] = {}
        self.frames = self.tracked = 0

    def add(self, frame: TrackedFrame) -> None:
        """The next frame."""
        tracked = [hand for hand in frame.hands if hand.state is HandState.TRACKED and hand.key in self._names]
        for hand in tracked:
            count = self._hands.setdefault(hand.key, _Count(self.frames))
            observed = int(hand.observed.sum())
            count.frames += 1
            count.scales.append(hand.scale)
            count.markers += len(hand.point)
            count.observed += observed
            if math.isfinite(hand.rms_m):
                count.fitted += observed
                count.square_m2 += observed * hand.rms_m**2
        self.frames += 1
        self.tracked += bool(tracked)

    @property
    def rms_m(self) -> float:
        """Over every observed marker of every hand [m]; NaN if there is none."""
        return _rms_m(*self._hands.values())

    def hands(self, times_s: FloatArray, expected: int) -> dict[str, HandFigures]:
        """The hands that were found at all, as "right", of several performers as "Anna right".

        times_s: (t,) float64 [s], of the frames that were counted. expected: how many there should be.
        """
        return {
            name: HandFigures(
                count.frames / max(expected, 1),
                float(times_s[count.first] - times_s[0]),
                _rms_m(count),
                1.0 - count.observed / max(count.markers, 1),
                float(np.median(count.scales)) * self._cast[key.performer].hand.skeleton.length_m,
            )
            for key, name in self._names.items()
            if (count := self._hands.get(key)) is not None
        }


class _Count:
    """Of one hand, over the frames in which it is tracked. first: the row of the first of them."""

    def __init__(self, first: int) -> None:
        self.first = first
        self.frames = self.markers = self.observed = self.fitted = 0
        self.square_m2 = 0.0
        self.scales = array("d")


def _rms_m(*counts: _Count) -> float:
    fitted = sum(count.fitted for count in counts)
    return math.sqrt(sum(count.square_m2 for count in counts) / fitted) if fitted else math.nan
