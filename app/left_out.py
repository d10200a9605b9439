"""Given names that were not borne out, counted while a recording is solved."""

from __future__ import annotations

from collections import Counter

from core.frames import NO_POINT, HandState, MarkerFrame, TrackedFrame
from core.labelling.given import Names, key_of
from core.recording import Recording


class LeftOutTally:
    """Points that carry the name of a marker of a tracked hand and are not it."""

    def __init__(self, recording: Recording, given: Names) -> None:
        named = zip(recording.labels, recording.ids.tolist(), strict=False)
        self._owners = {
            identity: (label, key_of(given[identity][0]), given[identity][1])
            for label, identity in named
            if identity in given
        }
        self.counts: Counter[str] = Counter()
        """By label."""

    def add(self, raw: MarkerFrame, solved: TrackedFrame) -> None:
        """The next frame."""
        tracked = {hand.key: hand for hand in solved.hands if hand.state is HandState.TRACKED}
        for identity in raw.ids.tolist():
            label, key, marker = self._owners.get(identity, ("", None, 0))
            if key in tracked and tracked[key].point[marker] == NO_POINT:
                self.counts[label] += 1
