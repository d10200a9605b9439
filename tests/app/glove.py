"""An inertial glove for tests: a device of the contract, at its pace, that may be told to misbehave."""

from __future__ import annotations

import time
from collections import deque
from dataclasses import replace
from typing import Any

from core.frames import Times
from core.streams import ClockSample, Sample, StreamInfo
from devices.common.clock import host_clock
from devices.device import Description, Device, Health, Level
from tests.core.takes.frames import BONES, plain_bones

RATE_HZ = 60.0


class Glove(Device):
    """Sends a frame every sixtieth of a second, and a clock sample with every thirtieth.

    next: what it sends before anything else; an exception is raised. silent: it sends nothing of its own.
    """

    kind = "glove"
    title = "Test glove"
    parameters = ()

    def __init__(self, **settings: object) -> None:
        super().__init__(**settings)
        self.next: deque[Any] = deque()
        self.silent = False
        self.lost = 0
        self._open = self._streaming = False
        self._n = 0
        self._due_s = 0.0

    def open(self) -> None:
        self._open = True

    def start(self) -> None:
        self._streaming, self._due_s = True, host_clock()

    def streams(self) -> tuple[StreamInfo, ...]:
        if not self._open:
            return ()
        info = StreamInfo("right", self.kind, self.title, "inertial", RATE_HZ, rotations="parent", sides=("right",))
        return (replace(info, bone_names=BONES),)

    def read(self, timeout_s: float) -> Sample | None:
        if self.next:
            one = self.next.popleft()
            if isinstance(one, Exception):
                raise one
            return one
        wait_s = self._due_s - host_clock()
        if self.silent or wait_s > timeout_s:
            time.sleep(min(timeout_s, 0.02))
            return None
        time.sleep(max(wait_s, 0.0))
        exposed_s, now_s = self._due_s, host_clock()
        self._due_s += 1.0 / RATE_HZ
        self._n += 1
        if self._n % 30 == 0:
            self.next.append(Sample("right", ClockSample(self._n / RATE_HZ, now_s, 1e-4)))
        frame = plain_bones(self._n)
        return Sample("right", replace(frame, times=Times(self._n / RATE_HZ, exposed_s, now_s)))

    def stop(self) -> None:
        self._streaming = False

    def close(self) -> None:
        self._open = self._streaming = False

    def describe(self) -> Description:
        return Description(self.title, RATE_HZ, {"Hand": "right"})

    def health(self) -> Health:
        level = Level.GOOD if self._streaming else Level.IDLE
        return Health(level, "Worn.", self._streaming, self._n, self.lost, rate_hz=RATE_HZ if self._streaming else 0.0)
