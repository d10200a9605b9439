"""What every device counts and measures of its stream: time, rate, gaps."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable
from enum import Enum

host_clock: Callable[[], float] = time.perf_counter
"""This machine's monotonic clock [s], the one of `Times.host_s` and `Times.arrival_s`.

On Linux and macOS it is the clock of time.monotonic() to the bit. On Windows, before Python 3.13, that one ticks every
15.6 ms only, longer than a frame.
"""


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


class Arrival(Enum):
    """What the number of a frame says of it."""

    NEXT = "next"  # newer than the last
    LATE = "late"  # a duplicate, or overtaken on the way: newer frames have been handed on
    RESTART = "restart"  # the source began to count anew


class SequenceCounter:
    """Counts, by the stream's own frame numbers, what was sent and never arrived."""

    LATE_S = 1.0
    """A frame this much older than the last has not been overtaken on the way: its source began anew [s]."""

    GAP_S = 600.0
    """A gap longer than this is another stream, not a loss [s]."""

    def __init__(self) -> None:
        self.lost = 0
        self.late = 0
        self._last: int | None = None
        self._last_time_s = 0.0

    def forget(self) -> None:
        """The next frame is taken as it comes: the stream was paused here."""
        self._last = None

    def arrived(self, sequence: int, time_s: float, rate_hz: float, *, live: bool = True) -> Arrival:
        """Count frame `sequence`, taken at `time_s` by its source's clock (NaN if it has none).

        A source that is started anew counts from zero; by the time it is heard again its numbers may have passed
        the last one, but not by as many as the clock has gone on. In playback (not `live`) numbers jump as the
        operator scrubs.
        """
        last, last_time = self._last, self._last_time_s
        rate_hz = max(rate_hz, 1.0)
        step = 1 if last is None else sequence - last
        if live and step <= 0 and not time_s > last_time and step > -rate_hz * self.LATE_S:
            self.late += 1
            return Arrival.LATE
        self._last, self._last_time_s = sequence, time_s
        if not live or last is None:
            return Arrival.NEXT
        elapsed = (time_s - last_time) * rate_hz  # frames by the clock
        if step <= 0 or step > rate_hz * self.GAP_S or elapsed < 0 or step < 0.5 * elapsed - 2:
            return Arrival.RESTART
        self.lost += step - 1
        return Arrival.NEXT
