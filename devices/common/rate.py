"""How many frames a second come in."""

from __future__ import annotations

from collections import deque


class RateMeter:
    """Frames per second over the last second."""

    def __init__(self, window_s: float = 1.0) -> None:
        self._window_s = window_s
        self._stamps: deque[float] = deque()

    def add(self, now_s: float) -> None:
        """Count one frame."""
        self._stamps.append(now_s)
        self._trim(now_s)

    def rate_hz(self, now_s: float) -> float:
        """Rate at `now_s` [Hz]; while the window fills, of what there is."""
        self._trim(now_s)
        n = len(self._stamps)
        if n < 2:
            return 0.0
        span = self._stamps[-1] - self._stamps[0]
        return (n - 1) / span if span > 0 else 0.0

    def _trim(self, now_s: float) -> None:
        stamps = self._stamps
        while stamps and stamps[0] <= now_s - self._window_s:
            stamps.popleft()
