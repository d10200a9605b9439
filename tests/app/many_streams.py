"""A device of two streams, as two camera groups behind one box are: one flows, the other has fallen silent."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

from core.streams import Sample, StreamInfo
from devices.device import Description, Device, Health, Level
from devices.playback.client import PlaybackDevice
from devices.playback.timeline import Track
from tests.app.stage import RATE_HZ, performance


class TwoStreams(Device):
    """The performance as its left stream; nothing ever comes of its right one."""

    kind = "two"
    title = "Two streams"
    parameters = ()
    SILENT: ClassVar[str] = "Nothing comes of it. Plug it in."

    def __init__(self, **settings: object) -> None:
        super().__init__(**settings)
        info = StreamInfo("left", "natnet", "Stage", "markers", RATE_HZ, ids="sight", quality="residual")
        self._inner = PlaybackDevice([Track(info, performance())], loop=True)

    def open(self) -> None:
        self._inner.open()

    def start(self) -> None:
        self._inner.start()

    def streams(self) -> tuple[StreamInfo, ...]:
        return tuple(replace(info, key=key) for info in self._inner.streams() for key in ("left", "right"))

    def read(self, timeout_s: float) -> Sample | None:
        sample = self._inner.read(timeout_s)
        return sample and Sample("left", sample.frame)

    def stop(self) -> None:
        self._inner.stop()

    def close(self) -> None:
        self._inner.close()

    def describe(self) -> Description:
        return Description(self.title, RATE_HZ)

    def health(self) -> Health:
        return replace(self._inner.health(), level=Level.WARNING, reason="One of its streams is silent.")

    def stream_health(self, key: str) -> Health:
        return self._inner.health() if key == "left" else Health(Level.PROBLEM, self.SILENT, connected=True)
