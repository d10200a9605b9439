"""Client and simulator over real sockets: what is sent is received."""

from __future__ import annotations

import socket
import sys
import threading
import time
from dataclasses import replace

import numpy as np
import pytest

from core.frames import NO_ID, MarkerFrame
from devices.common import udp
from devices.common.clock import host_clock
from devices.natnet import protocol
from devices.natnet.frames import decode_frame
from devices.natnet.protocol import Message
from tests.devices.natnet.served import client, heard, listening, simulator, streaming
from tests.devices.natnet.streams import (
    assert_same,
    make_frames,
    need_loopback_multicast,
    next_frame,
    read_until,
    read_while,
)


@pytest.mark.parametrize("multicast", [False, True], ids=["unicast", "multicast"])
@pytest.mark.parametrize("bitstream", [(3, 0), (4, 1), (4, 2)], ids=str)
def test_what_is_sent_is_received(multicast: bool, bitstream: tuple[int, int]) -> None:
    if multicast:
        need_loopback_multicast()
    frames = make_frames(300)
    with simulator(frames, bitstream=bitstream, multicast=multicast) as server, listening(server) as device:
        received = heard(device, server)
        health, described = device.health(), device.describe()
    assert server.error is None
    assert server.sent == len(received) + health.lost == 300
    assert health.received == len(received)
    assert health.rejected == 0
    for frame in received:
        assert_same(frame, frames[frame.sequence])
        assert frame.times.host_s <= frame.times.arrival_s
    for clock in ("device_s", "host_s", "arrival_s"):
        assert (np.diff([getattr(frame.times, clock) for frame in received]) >= 0).all()
    assert described.title == "Motive 3.1"
    assert described.rate_hz == 500
    assert described.details["Transmission"] == ("multicast" if multicast else "unicast")
    assert described.details["Bitstream"] == f"{bitstream[0]}.{bitstream[1]}"
    assert described.details["Rigid bodies"] == "Wand, Table"


@pytest.mark.parametrize("bitstream", [(2, 5), (2, 6), (2, 7), (2, 9), (2, 10)], ids=str)
def test_old_servers_send_points_without_ids(bitstream: tuple[int, int]) -> None:
    frames = make_frames(60)
    with simulator(frames, bitstream=bitstream) as server, listening(server) as device:
        received = heard(device, server)
        health = device.health()
    assert server.sent == len(received) + health.lost == 60
    for frame in received:
        assert np.array_equal(frame.points_m, frames[frame.sequence].points_m)
        assert (frame.ids == NO_ID).all()
        assert np.isnan(frame.residuals_m).all()
        assert [body.name for body in frame.rigid_bodies] == ["Wand", "Table"]


def test_a_hundred_points_at_120_hz_without_loss() -> None:
    frames = make_frames(480, points=100)
    with simulator(frames, 120.0) as server, listening(server) as device:
        received = heard(device, server)
        health = device.health()
    assert server.sent == 480
    assert (len(received), health.lost, health.rejected) == (480, 0, 0)
    for frame, sent in zip(received, frames, strict=True):
        assert_same(frame, sent)


def test_two_clients_on_one_multicast_stream() -> None:
    need_loopback_multicast()
    frames = make_frames(200)
    with simulator(frames, 200.0, multicast=True) as server:
        devices = [client(server), client(server, transmission="listen only", local="127.0.0.1")]
        got: list[list[MarkerFrame]] = [[], []]
        for device in devices:
            device.open()
            device.start()
        readers = [
            threading.Thread(target=lambda i=i: got[i].extend(read_while(devices[i], streaming(server))))
            for i in range(2)
        ]
        for reader in readers:
            reader.start()
        server.start()
        for reader in readers:
            reader.join()
        for device, received in zip(devices, got, strict=True):
            assert len(received) + device.health().lost == server.sent == 200
            for frame in received:
                assert np.array_equal(frame.points_m, frames[frame.sequence].points_m)
                assert np.array_equal(frame.ids, frames[frame.sequence].ids)
            device.close()


def test_a_client_may_ask_for_an_older_bitstream() -> None:
    with simulator(make_frames(2000), 200.0, bitstream=(4, 1)) as server, listening(server, bitstream="4.0") as device:
        server.start()
        read_until(device, lambda: device.health().received >= 20)
        assert device.health().rejected == 0
        assert device.describe().details["Bitstream"] == "4.0"


def test_stop_and_start_count_no_loss() -> None:
    with simulator(make_frames(20_000, points=3), 300.0) as server:
        device = client(server)
        device.open()
        server.start()
        for _ in range(3):
            device.start()
            before = device.health().received
            read_until(device, lambda before=before: device.health().received >= before + 20)
            device.stop()
            assert next_frame(device, 0.0) is None
            time.sleep(0.1)
        assert device.health().lost == 0
        device.close()
        device.close()


def test_a_body_that_appears_in_mid_stream_gets_its_name() -> None:
    """The server says that its models have changed; the client asks for them again."""
    frames = make_frames(1200, points=2)
    for i, frame in enumerate(frames):
        frames[i] = replace(frame, rigid_bodies=frame.rigid_bodies[: 1 + (i > 100)])
    with simulator(frames, 300.0) as server:
        device = client(server)
        device.open()
        assert device.describe().details["Rigid bodies"] == "Wand"
        device.start()
        server.start()
        read_until(device, lambda: device.describe().details["Rigid bodies"] == "Wand, Table")
        last = next_frame(device, 1.0)
        assert last is not None
        assert [body.name for body in last.rigid_bodies] == ["Wand", "Table"]
        device.close()


def test_without_kernel_stamps(monkeypatch: pytest.MonkeyPatch) -> None:
    """As on Windows and macOS."""
    monkeypatch.setattr(udp, "_receive", udp._receive_plain)
    frames = make_frames(100)
    with simulator(frames) as server, listening(server) as device:
        received = heard(device, server)
    assert [frame.sequence for frame in received] == list(range(100))
    assert all(frame.times.host_s <= frame.times.arrival_s for frame in received)


def test_kernel_stamps_are_earlier_than_the_reading() -> None:
    with simulator(make_frames(20), 200.0) as server, listening(server) as device:
        server.start()
        assert server.wait(10)
        time.sleep(0.2)
        now = host_clock()
        stamps = [frame.times.arrival_s for frame in read_while(device, lambda: False)]
    assert len(stamps) == 20
    if sys.platform == "linux":
        assert max(stamps) < now - 0.1
        assert stamps == sorted(stamps)


def test_goodbye_ends_the_unicast_stream() -> None:
    with simulator([]) as server:
        device = client(server)
        device.open()
        assert len(server.clients) == 1
        device.close()
        end = time.monotonic() + 5
        while server.clients and time.monotonic() < end:
            time.sleep(0.01)
        assert server.clients == ()


def test_frame_on_the_wire_is_a_server_s() -> None:
    """Frames come from the data port, end with the mark that vendor clients insist on, and list points twice."""
    with simulator(make_frames(5), 100.0) as server, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as plain:
        plain.bind(("127.0.0.1", 0))
        plain.settimeout(5)
        plain.sendto(protocol.pack(Message.CONNECT, b"Ping\0"), ("127.0.0.1", server.command_port))
        message, payload = protocol.unpack(plain.recv(65535))
        assert message == Message.SERVERINFO
        assert len(payload) == 279
        server.start()
        packet, source = plain.recvfrom(65535)
    assert source == ("127.0.0.1", server.data_port)
    message, payload = protocol.unpack(packet)
    assert message == Message.FRAMEOFDATA
    assert payload[-4:] == bytes(4)
    frame = decode_frame(payload, (4, 1))
    assert np.array_equal(frame.unlabelled, frame.labelled["position"])
    assert set(frame.labelled["params"].tolist()) == {0x12}
