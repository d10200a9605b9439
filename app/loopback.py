"""A simulated server in a process of its own, and the real client connected to it over loopback."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import NamedTuple

from core.errors import DeviceError
from core.frames import MarkerFrame
from devices.device import Device
from devices.natnet.client import NatNetDevice


class Served(NamedTuple):
    """Where a simulated server is reached, and its process."""

    command_port: int
    data_port: int
    pid: int

    @property
    def settings(self) -> dict[str, object]:
        """Of the client that connects to it."""
        return {"command_port": self.command_port, "data_port": self.data_port}


@contextmanager
def serving(options: Sequence[str]) -> Iterator[Served]:
    """A `phalanx simulate natnet` with these options, in a process of its own.

    Raises DeviceError if it does not start.
    """
    command = [sys.executable, "-m", "app", "simulate", "natnet", "--command-port", "0", "--data-port", "0", *options]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as server:
        try:
            assert server.stdout is not None
            words = server.stdout.readline().replace(",", " ").replace(".", " ").split()
            ports = [int(words[i + 1]) for i, word in enumerate(words) if word == "port"]
            if len(ports) != 2:
                raise DeviceError("The simulated server did not start.", "Run phalanx simulate natnet to see why.")
            yield Served(ports[0], ports[1], server.pid)
        finally:
            server.terminate()


def next_frame(device: Device, timeout_s: float) -> MarkerFrame | None:
    """The next frame of points, waiting at most `timeout_s`; what else the device sends is passed over."""
    end = time.monotonic() + timeout_s
    while (sample := device.read(max(end - time.monotonic(), 0.0))) is not None:
        if isinstance(sample.frame, MarkerFrame):
            return sample.frame
    return None


@contextmanager
def served(options: Sequence[str]) -> Iterator[NatNetDevice]:
    """The open client of such a server. Raises DeviceError if it does not start or cannot be reached."""
    with serving(options) as server:
        device = NatNetDevice(**server.settings)
        device.open()
        try:
            yield device
        finally:
            device.stop()
            device.close()
