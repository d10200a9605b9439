"""Given names that were not borne out, counted while a recording is solved: no frame need be kept."""

from __future__ import annotations

from core.frames import NO_POINT, HandState, IntArray, TrackedFrame
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
        self._counts = dict.fromkeys(recording.labels, 0)

    @property
    def counts(self) -> dict[str, int]:
        """How many points, by label, in the order of the file; labels that lost none are not among them."""
        return {label: count for label, count in self._counts.items() if count}

    def add(self, ids: IntArray, solved: TrackedFrame) -> None:
        """The next frame. ids: (n,) int64, of its points."""
        tracked = {hand.key: hand for hand in solved.hands if hand.state is HandState.TRACKED}
        for identity in ids.tolist():
            label, key, marker = self._owners.get(identity, ("", None, 0))
            if key in tracked and tracked[key].point[marker] == NO_POINT:
                self._counts[label] += 1
