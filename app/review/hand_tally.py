"""How well the hands of a recording are seen, counted while it is solved: no frame need be kept."""

from __future__ import annotations

import math
from pathlib import Path

from app.tracking_figures import HandFigures, TrackFigures
from core.cast import Cast, hand_names
from core.frames import HandKey, HandState, TrackedFrame
from core.recording import Recording


class HandTally:
    """Counts frame by frame, as the engine solved them."""

    def __init__(self, cast: Cast) -> None:
        self._names = hand_names(cast)
        self._hands: dict[HandKey, _Count] = {}
        self._frames = self._tracked = 0

    def add(self, frame: TrackedFrame) -> None:
        """The next frame."""
        tracked = [hand for hand in frame.hands if hand.state is HandState.TRACKED and hand.key in self._names]
        for hand in tracked:
            count = self._hands.setdefault(hand.key, _Count(self._frames))
            observed = int(hand.observed.sum())
            count.frames += 1
            count.markers += len(hand.point)
            count.observed += observed
            if math.isfinite(hand.rms_m):
                count.square_m2 += observed * hand.rms_m**2
        self._frames += 1
        self._tracked += bool(tracked)

    def figures(self, path: Path, recording: Recording) -> TrackFigures:
        """What became of the recording at `path`; only the hands that were found."""
        n = max(self._frames, 1)
        hands = {
            name: HandFigures(
                count.frames / n,
                float(recording.times_s[count.first] - recording.times_s[0]),
                _rms_m(count),
                1.0 - count.observed / max(count.markers, 1),
            )
            for key, name in self._names.items()
            if (count := self._hands.get(key)) is not None
        }
        return TrackFigures(
            path, self._frames, recording.duration_s, self._tracked / n, _rms_m(*self._hands.values()), hands
        )


class _Count:
    """Of one hand, over the frames in which it is tracked. first: the row of the first of them."""

    def __init__(self, first: int) -> None:
        self.first = first
        self.frames = self.markers = self.observed = 0
        self.square_m2 = 0.0


def _rms_m(*counts: _Count) -> float:
    observed = sum(count.observed for count in counts)
    return math.sqrt(sum(count.square_m2 for count in counts) / observed) if observed else math.nan
