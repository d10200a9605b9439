"""A simulated server in a process of its own, and the real client connected to it over loopback."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from core.errors import DeviceError
from devices.natnet.client import NatNetDevice


@contextmanager
def serving(options: Sequence[str]) -> Iterator[tuple[int, int]]:
    """Command port and data port of a `phalanx simulate natnet` with these options, in a process of its own.

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
            yield ports[0], ports[1]
        finally:
            server.terminate()


@contextmanager
def served(options: Sequence[str]) -> Iterator[NatNetDevice]:
    """The open client of such a server. Raises DeviceError if it does not start or cannot be reached."""
    with serving(options) as (command_port, data_port):
        device = NatNetDevice(command_port=command_port, data_port=data_port)
        device.open()
        try:
            yield device
        finally:
            device.stop()
            device.close()
