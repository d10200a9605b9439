"""A recording as a device: what it holds comes at its own times, as if it were captured now."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import replace

from core.errors import DeviceError
from core.frames import Times
from core.streams import ClockSample, Sample, StreamInfo
from devices.common.clock import host_clock
from devices.common.rate import RateMeter
from devices.device import Description, Device, Health, Level, Parameter
from devices.playback.timeline import Due, Track, timeline

CATCH_UP = 2.0
"""A reader that was held up gets what waited no faster than this many times the pace: all of it at once would choke
whoever solves it."""

MOST_HZ = 10_000.0
"""Of a stream that can be played [Hz]."""


class PlaybackDevice(Device):
    """Streams held in memory, or read one record after the other.

    Every record is handed on, those of a stream in order, none before its time. Times are those of the recording:
    `device_s` as it was, `host_s` counted from the start by the recording's own steps, however late its reader was;
    time without frames stays so.
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

    def __init__(self, tracks: Sequence[Track], name: str = "", **settings: object) -> None:
        """name: what people see. Raises DeviceError for a setting or a rate out of range, or streams of one key."""
        super().__init__(**settings)
        self._tracks = tuple(tracks)
        self._name = name or "recording"
        for track in self._tracks:
            if not 0 < track.info.rate_hz <= MOST_HZ:
                raise DeviceError(
                    f"{self._name}: a recording of {track.info.rate_hz} Hz cannot be played.",
                    f"The rate must be up to {MOST_HZ:.0f} Hz.",
                )
        self._figures = {track.info.key: _Figures() for track in self._tracks}
        if len(self._figures) < len(self._tracks):
            raise DeviceError(f"{self._name} has streams of one name.", "Choose another recording.")
        self._speed = float(self.settings["speed"])
        self._open = False
        self._playing: Iterator[Due] | None = None
        self._next: Due | None = None
        self._begin_s = self._earliest_s = 0.0  # of the recording; before which the next record is not handed on
        self._finished = False
        self._last_error = ""
        self._all = _Figures()

    def open(self) -> None:
        """Nothing to reach."""
        self._open = True
        self._finished = False

    def start(self) -> None:
        """Play from the beginning. Raises DeviceError for an empty recording."""
        if not self._open:
            raise DeviceError(f"{self._name} is not open.", "Connect it first.")
        self._last_error = ""
        self._playing = timeline(self._tracks, bool(self.settings["loop"]))
        self._advance()
        if self._next is None:
            self._playing = None
            raise DeviceError(self._last_error or f"{self._name} has no frames.", "Choose another recording.")
        self._finished = False
        self._begin_s = self._earliest_s = host_clock()

    def streams(self) -> tuple[StreamInfo, ...]:
        """Those of the recording, at the speed at which it is played."""
        if not self._open:
            return ()
        infos = (track.info for track in self._tracks)
        return tuple(
            replace(info, kind=self.kind, title=self._name, rate_hz=info.rate_hz * self._speed) for info in infos
        )

    def read(self, timeout_s: float) -> Sample | None:
        """The next record when its time has come."""
        due = self._next
        if due is None or self._playing is None:
            if self._finished:
                time.sleep(max(0.0, min(timeout_s, 0.1)))  # as a silent device, so that its reader does not spin
            return None
        exposed_s = self._begin_s + due.at_s / self._speed
        wait = max(exposed_s, self._earliest_s) - host_clock()
        if wait > timeout_s:
            time.sleep(max(0.0, timeout_s))
            return None
        if wait > 0:
            time.sleep(wait)
        now = host_clock()
        self._advance()
        step_s = self._next.at_s - due.at_s if self._next is not None else 0.0
        self._earliest_s = now + max(step_s, 0.0) / self._speed / CATCH_UP
        self._finished = self._next is None
        key, record = due.track.info.key, due.record
        if isinstance(record, ClockSample):
            return Sample(key, replace(record, host_s=exposed_s))
        times = Times(record.times.device_s, min(exposed_s, now), now)
        for figures in (self._all, self._figures[key]):
            figures.add(times)
        return Sample(key, replace(record, times=times))

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
        """Whether the last record was handed on."""
        return self._finished

    def describe(self) -> Description:
        """The recording. Its rate is that of its first stream."""
        speed = self._speed
        rates = {track.info.key: f"{track.info.rate_hz:g} Hz" for track in self._tracks}
        details = {"Recording": self._name}
        if len(rates) == 1:
            details["Recorded at"] = "".join(rates.values())
        else:
            details |= {f"Stream {key}": rate for key, rate in rates.items()}
        if speed != 1.0:
            details["Speed"] = f"{speed:g} x"
        rate_hz = self._tracks[0].info.rate_hz if self._tracks else 0.0
        return Description(f"{self.title}: {self._name}", rate_hz * speed, details)

    def health(self) -> Health:
        """Playing, or why not."""
        return self._health(self._all)

    def stream_health(self, key: str) -> Health:
        """The same of one stream; of one that it does not have, that nothing came."""
        return self._health(self._figures.get(key) or _Figures())

    def _health(self, figures: _Figures) -> Health:
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
            received=figures.received,
            rate_hz=figures.rate_hz if host_clock() - figures.at_s < 1.0 else 0.0,
            rejected=1 if self._last_error else 0,
            latency_s=figures.latency_s,
            last_error=self._last_error,
            heard=f"{figures.received:,} frames of {self._name}.",
        )

    def _advance(self) -> None:
        """Have the next record ready."""
        assert self._playing is not None
        try:
            self._next = next(self._playing, None)
        except Exception as error:  # frames are made by others; a fault ends the playback, not the session
            self._next = None
            self._last_error = f"{self._name} could not be read on: {error}"


class _Figures:
    """What was handed on. Counted by the reading thread, read by any."""

    def __init__(self) -> None:
        self.received = 0
        self.rate_hz = self.latency_s = 0.0
        self.at_s = 0.0  # when the last frame came
        self._rate = RateMeter()

    def add(self, times: Times) -> None:
        """Count one frame."""
        self.received += 1
        self._rate.add(times.arrival_s)
        self.rate_hz, self.at_s = self._rate.rate_hz(times.arrival_s), times.arrival_s
        self.latency_s = times.latency_s
