"""In how many solved frames of a take each hand is tracked: counted while it is written."""

from __future__ import annotations

from core.cast import Cast, hands_of
from core.frames import HandKey, HandState, TrackedFrame


class TrackedCount:
    """Counts frame by frame; every hand of the profiles is counted, if only as none."""

    def __init__(self, cast: Cast) -> None:
        self._several = len(cast) > 1
        self._frames = dict.fromkeys(hands_of(cast), 0)

    def add(self, frame: TrackedFrame) -> None:
        """One more solved frame."""
        for hand in frame.hands:
            if hand.state is HandState.TRACKED and hand.key in self._frames:
                self._frames[hand.key] += 1

    @property
    def by_hand(self) -> dict[str, int]:
        """As TakeCounts.tracked has it: "left", of several performers "2 left"."""
        return {self._name(key): n for key, n in self._frames.items()}

    def _name(self, key: HandKey) -> str:
        return f"{key.performer + 1} {key.side}" if self._several else key.side
