"""This machine's clocks, and whether this program ran all the time."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable

from core.frames import Standstill

host_clock: Callable[[], float] = time.perf_counter
"""This machine's monotonic clock [s], the one of `Times.host_s` and `Times.arrival_s`.

On Linux and macOS it is the clock of time.monotonic() to the bit. On Windows, before Python 3.13, that one ticks every
15.6 ms only, longer than a frame.
"""


def _waking_clock() -> Callable[[], float]:
    """A clock [s] that goes on while the machine sleeps, as `host_clock` does on Windows alone."""
    for name in ("CLOCK_BOOTTIME", "CLOCK_MONOTONIC") if sys.platform != "win32" else ():
        if (clock := getattr(time, name, None)) is not None:
            return lambda: time.clock_gettime(clock)
    return host_clock


waking_clock = _waking_clock()


class StandstillWatch:
    """Notices that the thread which takes its turns here did not run: the process was halted, or the machine slept.

    clock: of `host_clock`. waking_clock: goes on while the machine sleeps. Both [s].
    """

    LEAST_S = 0.5
    """A receiver waits for a tenth of a second at most: what takes so long is none of its doing [s]."""

    def __init__(
        self, clock: Callable[[], float] = host_clock, waking_clock: Callable[[], float] = waking_clock
    ) -> None:
        self._clock, self._waking_clock = clock, waking_clock
        self.begin()

    def begin(self) -> None:
        """Turns are taken from now on; what was before is no standstill."""
        self._last_s, self._last_waking_s = self._clock(), self._waking_clock()

    def turn(self) -> Standstill | None:
        """It runs: the standstill that is over now, if there was one."""
        before_s, before_waking_s = self._last_s, self._last_waking_s
        self.begin()
        seconds = max(self._last_s - before_s, self._last_waking_s - before_waking_s)
        return Standstill(before_s, self._last_s, seconds) if seconds >= self.LEAST_S else None
