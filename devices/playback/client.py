"""A recording as a device: its frames come at their own rate, as if they were captured now."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace

from core.errors import DeviceError
from core.frames import MarkerFrame, Times
from devices.device import Description, Device, Health, Level, Parameter
from devices.stream import RateMeter, host_clock

SLIP_S = 0.25
"""Later than this the schedule is moved instead of handing on the backlog at once [s]."""


class PlaybackDevice(Device):
    """Frames held in memory, or made one by one.

    Every frame is handed on, in order, never before its time. Numbers and device times go on increasing where the
    recording begins anew.
    """

    kind = "playback"
    title = "Playback"
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
        self._period_s = 1.0 / (rate_hz * float(self.settings["speed"]))
        self._open = False
        self._playing: Iterator[MarkerFrame] | None = None
        self._next: MarkerFrame | None = None
        self._due_s = 0.0
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
        self._next = next(self._playing, None)
        if self._next is None:
            self._playing = None
            raise DeviceError(f"{self._name} has no frames.", "Choose another recording.")
        self._finished = False
        self._due_s = host_clock()

    def read(self, timeout_s: float) -> MarkerFrame | None:
        """The next frame when its time has come."""
        frame = self._next
        if frame is None or self._playing is None:
            if self._finished:
                time.sleep(max(0.0, min(timeout_s, 0.1)))  # as a silent device, so that its reader does not spin
            return None
        wait = self._due_s - host_clock()
        if wait > timeout_s:
            time.sleep(max(0.0, timeout_s))
            return None
        if wait > 0:
            time.sleep(wait)
        elif -wait > SLIP_S:
            self._due_s -= wait
        exposed, now = self._due_s, host_clock()
        self._due_s += self._period_s
        try:
            self._next = next(self._playing, None)
        except Exception as error:  # frames are made by others; a fault ends the playback, not the session
            self._next = None
            self._last_error = f"{self._name} could not be read on: {error}"
        self._finished = self._next is None
        self._received += 1
        self._rate.add(now)
        self._rate_hz, self._rate_at_s = self._rate.rate_hz(now), now
        return replace(frame, times=Times(frame.times.device_s, min(exposed, now), now))

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
        speed = float(self.settings["speed"])
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
            latency_s=0.0,
            last_error=self._last_error,
            heard=f"{self._received} frames of {self._name}.",
        )

    def _numbered(self) -> Iterator[MarkerFrame]:
        """The frames, again and again if they loop; numbers and device times ever increasing."""
        number, seconds = 0, 0.0  # added to those of the recording
        last: MarkerFrame | None = None
        while True:
            first = True
            for frame in self._frames() if callable(self._frames) else self._frames:
                if first and last is not None:
                    number = last.sequence + 1 - frame.sequence
                    seconds = last.times.device_s + 1.0 / self._recorded_hz - frame.times.device_s
                first = False
                times = Times(frame.times.device_s + seconds, frame.times.host_s, frame.times.arrival_s)
                last = replace(frame, sequence=frame.sequence + number, times=times)
                yield last
            if first or not self.settings["loop"]:
                return
