"""A simulator on free ports and a client that listens to it, for tests over real sockets."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from core.frames import MarkerFrame
from devices.natnet.client import NatNetDevice
from devices.natnet.simulator import NatNetSimulator
from tests.devices.natnet.streams import read_while


def simulator(frames: list[MarkerFrame], rate_hz: float = 500.0, **options: object) -> NatNetSimulator:
    ports = {"command_port": 0, "data_port": 0}
    return NatNetSimulator(frames, rate_hz, **{**ports, **options})  # type: ignore[arg-type]


def client(server: NatNetSimulator, **settings: object) -> NatNetDevice:
    return NatNetDevice(command_port=server.command_port, data_port=server.data_port, **settings)


@contextmanager
def listening(server: NatNetSimulator, **settings: object) -> Iterator[NatNetDevice]:
    """A client that is open and started; closed at the end."""
    device = client(server, **settings)
    device.open()
    device.start()
    try:
        yield device
    finally:
        device.close()


def streaming(server: NatNetSimulator) -> Callable[[], bool]:
    return lambda: not server.finished


def heard(device: NatNetDevice, server: NatNetSimulator) -> list[MarkerFrame]:
    """All that arrives of what the server sends from now on."""
    server.start()
    return list(read_while(device, streaming(server)))
