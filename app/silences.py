"""Long stretches without frames of a take that runs, as they are heard."""

from __future__ import annotations

import math

import numpy as np

from core.takes.holes import Holes

LONG_SILENCE_S = 0.5
"""Without frames for so long a take says so while it runs, and goes on saying it [s]."""


class Silences:
    """All times by the host's clock [s]. Not for several threads at once.

    Long silences alone are kept: the time of every frame would take 24 MB an hour at 836 Hz.
    """

    def __init__(self, begun_s: float) -> None:
        self._begun_s = self._arrived_s = begun_s
        self._found: list[tuple[float, float]] = []

    def arrived(self, came_s: float, now_s: float) -> None:
        """A frame is here now that came then: it may have waited to be read. A file's own times are not believed."""
        if not self._begun_s <= came_s <= now_s:
            came_s = now_s
        if came_s - self._arrived_s >= LONG_SILENCE_S:
            self._found.append((self._arrived_s, came_s))
        self._arrived_s = max(came_s, self._arrived_s)

    def since_s(self, now_s: float) -> float:
        """How long none has come [s]."""
        return now_s - self._arrived_s

    @property
    def seconds(self) -> float:
        """Of all that are over [s]."""
        return sum(end_s - begin_s for begin_s, end_s in self._found)

    def holes(self, end_s: float, first_s: float, rate_hz: float) -> Holes:
        """Those up to the end of the take, in its own time. first_s: of its first frame. rate_hz: NaN if unknown."""
        tail = [(self._arrived_s, end_s)] if end_s - self._arrived_s >= LONG_SILENCE_S else []
        from_s, to_s = np.array([*self._found, *tail]).reshape(-1, 2).T - first_s
        frames = (to_s - from_s) * (rate_hz if math.isfinite(rate_hz) else 0.0)
        return Holes(from_s, to_s, np.rint(frames).astype(np.int64))
