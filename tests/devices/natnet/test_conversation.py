"""Servers that answer late, twice, never, with nonsense; two servers in one network."""

from __future__ import annotations

import socket
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

import numpy as np
import pytest

from core.errors import FormatError
from devices.device import Level
from devices.natnet import protocol
from devices.natnet.client import NatNetDevice
from devices.natnet.convert import UpAxis
from devices.natnet.frames import encode_frame
from devices.natnet.protocol import Message, Sender, ServerInfo
from devices.natnet.records import LABELLED, FrameOfData
from devices.natnet.simulator import NatNetSimulator
from tests.devices.natnet.streams import free_port, make_frames, need_loopback_multicast, read_until

Answer = Callable[[int, bytes], list[tuple[float, bytes]]]
INFO = ServerInfo(Sender("Motive", (3, 1, 0, 0), (4, 1, 0, 0)), 0, 1511, False, "")


@contextmanager
def scripted(answer: Answer) -> Iterator[int]:
    """A server whose every answer is scripted: (delay, packet). Gives its port."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as server:
        server.bind(("127.0.0.1", 0))
        server.settimeout(0.02)
        done = threading.Event()

        def serve() -> None:
            waiting: list[tuple[float, bytes, tuple[str, int]]] = []
            while not done.is_set():
                with suppress(TimeoutError, FormatError):
                    packet, address = server.recvfrom(65535)
                    for delay, reply in answer(*protocol.unpack(packet)):
                        waiting.append((time.monotonic() + delay, reply, address))
                for entry in [entry for entry in waiting if entry[0] <= time.monotonic()]:
                    waiting.remove(entry)
                    server.sendto(entry[1], entry[2])

        thread = threading.Thread(target=serve)
        thread.start()
        try:
            yield server.getsockname()[1]
        finally:
            done.set()
            thread.join()


def plain_answers(message: int, payload: bytes) -> list[tuple[float, bytes]]:
    """A server without models whose world is in millimetres, Z up."""
    values = {
        "FrameRate": protocol.encode_float(100.0),
        "UnitsToMillimeters": protocol.encode_float(1.0),
        "UpAxis": protocol.encode_int(2),
        "CurrentMode": protocol.encode_int(0),
        "Bitstream": b"Bitstream,4.1.0.0\0",
    }
    match message:
        case Message.CONNECT:
            return [(0.0, protocol.pack(Message.SERVERINFO, INFO.encode()))]
        case Message.REQUEST_MODELDEF:
            return [(0.0, protocol.pack(Message.MODELDEF, bytes(4)))]
        case Message.REQUEST:
            return [(0.0, protocol.pack(Message.RESPONSE, values[protocol.decode_request(payload)]))]
    return []


def talk_of(device: NatNetDevice) -> tuple[float, float, UpAxis, int]:
    talk = device._conversation
    assert talk is not None
    return talk.frame_rate_hz, talk.scale_m, talk.up_axis, talk.mode


def test_units_and_axis_of_the_server() -> None:
    with scripted(plain_answers) as port:
        device = NatNetDevice(command_port=port)
        device.open()
        assert talk_of(device) == (100.0, 0.001, UpAxis.Z, 0)
        assert device.describe().details["Up axis"] == "Z, turned to Y"
        device.close()


def test_a_late_answer_is_not_taken_for_the_next() -> None:
    """The first answer comes after the question was repeated, so that there are two; units would become the rate."""

    def late(message: int, payload: bytes) -> list[tuple[float, bytes]]:
        slow = message == Message.REQUEST and payload == b"FrameRate\0"
        return [(1.2 if slow else 0.0, packet) for _, packet in plain_answers(message, payload)]

    with scripted(late) as port:
        device = NatNetDevice(command_port=port)
        device.open()
        device.start()
        read_until(device, lambda: talk_of(device) == (100.0, 0.001, UpAxis.Z, 0))
        assert device.health().rejected == 0
        device.close()


def test_a_server_that_answers_nothing_but_hello() -> None:
    """Opened all the same, with what every server has by default."""

    def curt(message: int, payload: bytes) -> list[tuple[float, bytes]]:
        return plain_answers(message, payload) if message == Message.CONNECT else []

    with scripted(curt) as port:
        device = NatNetDevice(command_port=port)
        device.open()
        assert talk_of(device)[1:3] == (1.0, UpAxis.Y)
        device.close()


def test_an_old_server_answers_only_the_short_form() -> None:
    """Two of the tries are in the form of clients before 4.0."""

    def old(message: int, payload: bytes) -> list[tuple[float, bytes]]:
        return [] if message == Message.CONNECT and len(payload) != 264 else plain_answers(message, payload)

    with scripted(old) as port:
        device = NatNetDevice(command_port=port)
        device.open()
        assert device.describe().title == "Motive 3.1"
        assert device.health().reconnects == 0
        device.close()


def test_nonsense_answers_are_counted_and_change_nothing() -> None:
    def nonsense(message: int, payload: bytes) -> list[tuple[float, bytes]]:
        if message == Message.REQUEST:
            return [(0.0, protocol.pack(Message.RESPONSE, b"what did you say?"))]
        if message == Message.REQUEST_MODELDEF:
            return [(0.0, protocol.pack(Message.MODELDEF, b"\xff\xff\xff\x7f"))]
        return plain_answers(message, payload)

    with scripted(nonsense) as port:
        device = NatNetDevice(command_port=port)
        device.open()
        health = device.health()
        assert talk_of(device)[1:3] == (1.0, UpAxis.Y)
        assert health.rejected > 0
        assert "packets not understood" in health.heard
        device.close()


def test_a_broadcasting_server_says_nonsense_of_its_group() -> None:
    """As captured: name of the library, data port 105, its own address as the group. Our own settings hold then."""
    need_loopback_multicast()
    info = ServerInfo(Sender("NatNetLib", (3, 1, 0, 0), (4, 1, 0, 0)), 0, 105, True, "127.0.0.1")

    def broadcasting(message: int, payload: bytes) -> list[tuple[float, bytes]]:
        if message == Message.CONNECT:
            return [(0.0, protocol.pack(Message.SERVERINFO, info.encode()))]
        return plain_answers(message, payload)

    labelled = np.zeros(1, LABELLED)
    labelled["id"], labelled["params"] = 4, 0x12
    data_port, group = free_port(), "239.255.42.97"
    with scripted(broadcasting) as port, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        sender.bind(("127.0.0.1", 0))
        sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton("127.0.0.1"))
        device = NatNetDevice(command_port=port, data_port=data_port, group=group)
        device.open()
        device.start()
        for i in range(5):
            record = FrameOfData(number=i, timestamp_s=i / 100, labelled=labelled)
            sender.sendto(protocol.pack(Message.FRAMEOFDATA, encode_frame(record, (4, 1))), (group, data_port))
        got = read_until(device, lambda: device.health().received == 5)
        device.close()
    assert [frame.sequence for frame in got] == list(range(5))
    assert all(frame.ids.tolist() == [4] for frame in got)


def test_listening_to_nobody_says_what_to_check() -> None:
    need_loopback_multicast()
    device = NatNetDevice(transmission="listen only", local="127.0.0.1", data_port=free_port())
    device.open()
    device.start()
    read_until(device, lambda: device.health().level is Level.WARNING)
    health = device.health()
    assert not health.connected
    assert "239.255.42.99 is silent. Check that streaming is on" in health.reason
    assert "on the network of 127.0.0.1" in health.reason
    assert health.heard == "127.0.0.1 hears nothing."
    device.close()


@pytest.mark.skipif(sys.platform != "linux", reason="needs a second loopback address")
def test_another_server_on_the_group_is_heard_and_not_used() -> None:
    need_loopback_multicast()
    data_port = free_port()
    ours = NatNetSimulator(make_frames(400, points=3), 200.0, command_port=0, data_port=0, multicast=True)
    other = NatNetSimulator(
        make_frames(400, points=9), 200.0, host="127.0.0.2", command_port=0, data_port=0, multicast=True
    )
    ours.data_port = other.data_port = data_port
    with ours, other:
        device = NatNetDevice(command_port=ours.command_port, data_port=data_port)
        device.open()
        device.start()
        ours.start()
        read_until(device, lambda: device.health().received >= 5)
        other.start()
        got = read_until(device, lambda: ours.finished)
        health = device.health()
        device.close()
    assert {len(frame.points_m) for frame in got} == {3}
    assert "127.0.0.2: " in health.heard
    assert "(another server, not used)" in health.heard
    assert health.lost == health.rejected == 0
