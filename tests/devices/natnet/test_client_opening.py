"""What a client finds and what it cannot open."""

from __future__ import annotations

import socket

import pytest

from core.errors import DeviceError
from devices.device import Level
from devices.natnet import protocol
from devices.natnet.client import NatNetDevice
from tests.devices.natnet.served import simulator
from tests.devices.natnet.streams import (
    free_port,
)


def test_unreachable_server() -> None:
    device = NatNetDevice(command_port=free_port())
    with pytest.raises(DeviceError, match=r"No NatNet server answers at 127\.0\.0\.1, port \d+.* Start Motive"):
        device.open()
    assert device.health().level is Level.IDLE
    device.close()


def test_wrong_interface() -> None:
    with pytest.raises(
        DeviceError, match=r"203\.0\.113\.7 is not an address of this machine\. Choose one of .*127\.0\.0\.1"
    ):
        NatNetDevice(local="203.0.113.7").open()


@pytest.mark.parametrize("address", ["", "300.1.2.3", "192.168.0", "no such name.invalid"])
def test_bad_address(address: str) -> None:
    with pytest.raises(DeviceError, match="IPv4"):
        NatNetDevice(server=address).open()


def test_bad_group() -> None:
    with pytest.raises(DeviceError, match="no multicast group"):
        NatNetDevice(group="192.168.0.1")


def test_data_port_in_use() -> None:
    with simulator([], multicast=True) as server, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as holder:
        holder.bind(("", 0))
        taken = holder.getsockname()[1]
        device = NatNetDevice(command_port=server.command_port, data_port=taken, transmission="multicast")
        with pytest.raises(DeviceError, match=f"data port {taken} is in use"):
            device.open()


def test_start_before_open() -> None:
    with pytest.raises(DeviceError, match="not open"):
        NatNetDevice().start()


def test_discovery_finds_a_server_on_the_usual_port() -> None:
    try:
        server = simulator([], command_port=protocol.COMMAND_PORT)
        server.open()
    except DeviceError:
        pytest.skip(f"port {protocol.COMMAND_PORT} of this machine is taken")
    with server:
        found = NatNetDevice.discover(0.5)
    ours = [one for one in found if one.settings["server"] == "127.0.0.1"]
    assert [one.title for one in ours] == ["Motive 3.1 at 127.0.0.1"]
    NatNetDevice(**ours[0].settings)
