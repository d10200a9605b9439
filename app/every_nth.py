"""Which frames of a stream are solved: every n-th, by choice, where cameras are faster than the solver."""

from __future__ import annotations

from typing import TYPE_CHECKING

from core.errors import PhalanxError
from core.words import ordinal

if TYPE_CHECKING:
    from core.frames import MarkerFrame

MOST = 8
"""480 Hz leave 60: hands that move are not followed at less."""


class EveryNth:
    """The first frame and every n-th after it. One thread asks; any may choose."""

    def __init__(self) -> None:
        self._n = 1
        self._era: int | None = None
        self._between: list[MarkerFrame] = []

    @property
    def n(self) -> int:
        """1: all frames."""
        return self._n

    def choose(self, n: int) -> None:
        """From the next frame on. Raises PhalanxError for what cannot be chosen."""
        if not 1 <= n <= MOST:
            raise PhalanxError(
                f"Every n-th frame is solved with n from 1 to {MOST}, not {n}.", "Choose 1 for all frames."
            )
        self._n = n

    def next(self, frame: MarkerFrame, era: int) -> tuple[MarkerFrame, ...] | None:
        """None where this frame is left out, else those left out since the last one that was not, in their order.

        era: frames of another one are not before this one, and nobody asks for those that were left out of it.
        """
        if era != self._era:
            self._era, self._between = era, []
        elif len(self._between) + 1 < self._n:
            self._between.append(frame)
            return None
        between, self._between = tuple(self._between), []
        return between


def every_words(n: int, rate_hz: float) -> str:
    """'Every 4th frame is solved: 120 Hz of 480 Hz'. rate_hz: of the stream, 0 if none flows."""
    rates = f": {rate_hz / n:.0f} Hz of {rate_hz:.0f} Hz" if rate_hz > 0 else ""
    return (f"Every {ordinal(n)} frame is solved" if n > 1 else "Every frame is solved") + rates
