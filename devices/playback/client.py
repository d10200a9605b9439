"""A recording as a device: its frames come at their own times, as if they were captured now."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace

from core.errors import DeviceError
from core.frames import MarkerFrame, Times
from core.streams import Sample, StreamInfo
from devices.common.clock import host_clock
from devices.common.rate import RateMeter
from devices.device import Description, Device, Health, Level, Parameter

LONGEST_PAUSE_S = 600.0
"""A longer step from frame to frame is a clock that jumped, and nobody waits for it [s]."""

CATCH_UP = 2.0
"""A reader that was held up gets what waited no faster than this many times the pace: all of it at once would choke
whoever solves it."""


MARKERS = "markers"
"""Key of its stream."""


class PlaybackDevice(Device):
    """Frames held in memory, or made one by one.

    Every frame is handed on, in order, never before its time. Its times are those of the recording: `device_s` as it
    was, `host_s` counted from the start by the recording's own steps, however late its reader was; time without frames
    stays so. Where the recording says no time, or a step back, its rate does. Numbers and device times go on increasing
    where the recording begins anew.
    """

    kind = "playback"
    title = "Playback"
    has_end = True
    parameters = (
        Parameter("loop", "Loop", False, help="Begin again at the end."),
        Parameter(
            "speed",
            "Speed",
            1.0,
            unit="x",
            minimum=0.05,
            maximum=20.0,
            step=0.05,
            help="1 is the recording's own rate.",
        ),
    )

    def __init__(
        self,
        frames: Iterable[MarkerFrame] | Callable[[], Iterable[MarkerFrame]],
        rate_hz: float,
        name: str = "",
        **settings: object,
    ) -> None:
        """Frames: a sequence, or a function that gives them from the start each time it is called.

        rate_hz: of the recording. name: what people see. Raises DeviceError for a setting or rate out of range.
        """
        super().__init__(**settings)
        if not 0 < rate_hz <= 10_000:
            raise DeviceError(f"A recording of {rate_hz} Hz cannot be played.", "The rate must be up to 10000 Hz.")
        self._frames = frames
        self._recorded_hz = rate_hz
        self._name = name or "recording"
        self._speed = float(self.settings["speed"])
        self._open = False
        self._playing: Iterator[tuple[MarkerFrame, float]] | None = None
        self._next: MarkerFrame | None = None
        self._due_s = self._earliest_s = 0.0  # of the next frame: when it was exposed, and may be handed on
        self._latency_s = 0.0
        self._finished = False
        self._received = 0
        self._last_error = ""
        self._rate = RateMeter()
        self._rate_hz = 0.0
        self._rate_at_s = 0.0

    def open(self) -> None:
        """Nothing to reach."""
        self._open = True
        self._finished = False

    def start(self) -> None:
        """Play from the beginning. Raises DeviceError for an empty recording."""
        if not self._open:
            raise DeviceError(f"{self._name} is not open.", "Connect it first.")
        self._last_error = ""
        self._playing = self._numbered()
        self._next, _ = next(self._playing, (None, 0.0))
        if self._next is None:
            self._playing = None
            raise DeviceError(f"{self._name} has no frames.", "Choose another recording.")
        self._finished = False
        self._due_s = self._earliest_s = host_clock()

    def streams(self) -> tuple[StreamInfo, ...]:
        """The points of the recording."""
        if not self._open:
            return ()
        rate_hz = self._recorded_hz * self._speed
        return (StreamInfo(MARKERS, self.kind, self._name, "markers", rate_hz, "sight", "residual"),)

    def read(self, timeout_s: float) -> Sample | None:
        """The next frame when its time has come."""
        frame = self._next
        if frame is None or self._playing is None:
            if self._finished:
                time.sleep(max(0.0, min(timeout_s, 0.1)))  # as a silent device, so that its reader does not spin
            return None
        wait = max(self._due_s, self._earliest_s) - host_clock()
        if wait > timeout_s:
            time.sleep(max(0.0, timeout_s))
            return None
        if wait > 0:
            time.sleep(wait)
        exposed, now = self._due_s, host_clock()
        try:
            self._next, step_s = next(self._playing, (None, 0.0))
        except Exception as error:  # frames are made by others; a fault ends the playback, not the session
            self._next, step_s = None, 0.0
            self._last_error = f"{self._name} could not be read on: {error}"
        self._due_s += step_s / self._speed
        self._earliest_s = now + step_s / self._speed / CATCH_UP
        self._finished = self._next is None
        self._received += 1
        self._rate.add(now)
        self._rate_hz, self._rate_at_s = self._rate.rate_hz(now), now
        times = Times(frame.times.device_s, min(exposed, now), now)
        self._latency_s = times.latency_s
        return Sample(MARKERS, replace(frame, times=times))

    def stop(self) -> None:
        """Play no more."""
        self._playing = None
        self._next = None

    def close(self) -> None:
        """Stop."""
        self.stop()
        self._open = False

    @property
    def finished(self) -> bool:
        """Whether the last frame was handed on."""
        return self._finished

    def describe(self) -> Description:
        """The recording."""
        speed = self._speed
        details = {"Recording": self._name, "Recorded at": f"{self._recorded_hz:g} Hz"}
        if speed != 1.0:
            details["Speed"] = f"{speed:g} x"
        return Description(f"{self.title}: {self._name}", self._recorded_hz * speed, details)

    def health(self) -> Health:
        """Playing, or why not."""
        playing = self._playing is not None and not self._finished
        if self._last_error:
            level, reason = Level.PROBLEM, self._last_error
        elif playing:
            level, reason = Level.GOOD, f"Playing {self._name}."
        elif self._finished:
            level, reason = Level.IDLE, f"{self._name} was played to its end."
        else:
            level, reason = Level.IDLE, "Ready to play." if self._open else "Not connected."
        return Health(
            level=level,
            reason=reason,
            connected=self._open,
            received=self._received,
            rate_hz=self._rate_hz if host_clock() - self._rate_at_s < 1.0 else 0.0,
            rejected=1 if self._last_error else 0,
            latency_s=self._latency_s,
            last_error=self._last_error,
            heard=f"{self._received:,} frames of {self._name}.",
        )

    def _numbered(self) -> Iterator[tuple[MarkerFrame, float]]:
        """The frames, again and again if they loop, and how long each is after the one before it in the recording [s];
        numbers and device times ever increasing."""
        period_s = 1.0 / self._recorded_hz
        number, seconds = 0, 0.0  # added to those of the recording
        last: MarkerFrame | None = None
        while True:
            before_s = math.nan
            first = True
            for frame in self._frames() if callable(self._frames) else self._frames:
                if first and last is not None:
                    number = last.sequence + 1 - frame.sequence
                    seconds = last.times.device_s + period_s - frame.times.device_s
                first = False
                step_s = frame.times.host_s - before_s
                before_s = frame.times.host_s
                if not 0.0 < step_s <= LONGEST_PAUSE_S:
                    step_s = period_s
                times = Times(frame.times.device_s + seconds, frame.times.host_s, frame.times.arrival_s)
                last = replace(frame, sequence=frame.sequence + number, times=times)
                yield last, step_s
            if first or not self.settings["loop"]:
                return
