"""Frames over the real wire: served from a file by a process of its own, received by the real client."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from app.loopback import next_frame, served
from core.errors import DeviceError
from core.frames import MarkerFrame
from core.takes.formats.points_csv import HEADER

QUIET_S = 3.0
"""No frame for so long: all have come."""


@contextmanager
def written(frames: Sequence[MarkerFrame], rate_hz: float) -> Iterator[Path]:
    """The frames as a points.csv, numbered from 0, each at its time."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "points.csv"
        with path.open("w", encoding="utf-8") as file:
            print(HEADER, file=file)
            for number, frame in enumerate(frames):
                begin = f"{number},{number / rate_hz:.6f}"
                if len(frame.ids) == 0:
                    print(begin + ",,,,", file=file)
                for id_, (x, y, z) in zip(frame.ids.tolist(), frame.points_m.tolist(), strict=True):
                    print(f"{begin},{id_},{x:.7f},{y:.7f},{z:.7f}", file=file)
        yield path


def received(frames: Sequence[MarkerFrame], rate_hz: float) -> Iterator[MarkerFrame]:
    """The frames as the client hands them on, in real time; `sequence` counts from 0. Raises DeviceError if none
    comes."""
    with written(frames, rate_hz) as path, served(["--motion", str(path), "--once"]) as device:
        device.start()
        last, none = time.monotonic(), True
        while time.monotonic() - last < QUIET_S:
            frame = next_frame(device, 0.1)
            if frame is not None:
                last, none = time.monotonic(), False
                yield frame
        if none:
            raise DeviceError("No frame arrived.", device.health().reason)
