"""A simulated server in a process of its own, and the real client connected to it over loopback."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import NamedTuple

from core.errors import DeviceError
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
