"""When something came, by our clock: from the stamp that the kernel put on it by the wall clock, or without one."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import NamedTuple

from devices.common.clock import host_clock

SET_S = 0.002
"""The two clocks part by a step only: the wall clock was set, or this machine slept and ours stood still. Less than
this is how badly they can be compared [s]."""

BUSY_S = 0.25
"""So late a busy process may come to read. Has no stamp what waited for longer, its arrival is unknown [s]."""

_UNINTERRUPTED_S = 20e-6


class Came(NamedTuple):
    """When it came [s]: at `latest_s`, or so much before that as `slack_s`. Mostly 0: it is known."""

    latest_s: float
    slack_s: float = 0.0


class Unstamped:
    """Tells it of what bears no stamp: it came since nothing waited, so just now, unless this process did not run."""

    def __init__(self, clock: Callable[[], float] = host_clock) -> None:
        self._clock = clock
        self._empty_s = clock()

    def emptied(self, at_s: float) -> None:
        """Nothing waits that came before `at_s`."""
        self._empty_s = at_s

    def arrival(self) -> Came:
        """Of what was just read."""
        now = self._clock()
        slack_s = now - self._empty_s
        return Came(now, slack_s if slack_s > BUSY_S else 0.0)


class _Step(NamedTuple):
    """The wall clock was `old_s` ahead of ours until some moment between the two."""

    old_s: float
    from_s: float
    to_s: float


class Stamps:
    """Turns times of the wall clock into ours.

    The kernel stamps what it receives while this process does something else, or nothing: it may have been stopped
    for minutes. A step of the wall clock meanwhile is no age; of what waited through one the stamp alone cannot always
    tell on which side of it it came.
    """

    def __init__(self, wall_clock: Callable[[], int] = time.time_ns, clock: Callable[[], float] = host_clock) -> None:
        self._wall_clock = wall_clock  # [ns]
        self._clock = clock
        self._base_ns = wall_clock()  # small differences keep their nanoseconds
        self._ahead_s, self._seen_s = self._compare()
        self._step: _Step | None = None

    def emptied(self, at_s: float) -> None:
        """Nothing waits that came before `at_s`."""
        self._look()
        if self._step is not None and self._step.to_s <= at_s:
            self._step = None

    def arrival(self, wall_ns: int) -> Came:
        """Of a datagram that was just read."""
        now = self._look()
        stamp = (wall_ns - self._base_ns) * 1e-9
        came = stamp - self._ahead_s
        if self._step is None:
            return Came(min(came, now))
        old_s, from_s, to_s = self._step
        before = stamp - old_s
        possible = [at for at, last in ((before, to_s), (came, now)) if from_s - SET_S <= at <= last + SET_S]
        if not possible:
            return Came(now, now - from_s)
        return Came(min(max(possible), now), max(possible) - min(possible))

    def _look(self) -> float:
        """Whether the clocks have parted; now, by ours."""
        ahead_s, now = self._compare()
        if abs(ahead_s - self._ahead_s) > SET_S:
            old = self._step
            self._step = _Step(self._ahead_s, self._seen_s, now) if old is None else old._replace(to_s=now)
        self._ahead_s, self._seen_s = ahead_s, now
        return now

    def _compare(self) -> tuple[float, float]:
        """How far the wall clock is ahead of ours [s], and when that was."""
        best, ahead, now = math.inf, 0.0, 0.0
        for _ in range(3):
            before = self._clock()
            wall = self._wall_clock()
            now = self._clock()
            if now - before < best:
                best, ahead = now - before, (wall - self._base_ns) * 1e-9 - (before + now) / 2
            if best < _UNINTERRUPTED_S:
                break  # no other thread ran between the two clocks
        return ahead, now
