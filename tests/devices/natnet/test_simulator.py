"""The simulated server: pacing, numbers, ports, faults; and in a process of its own."""

from __future__ import annotations

import multiprocessing
import socket
import time
from collections.abc import Iterator
from multiprocessing.connection import Connection

import numpy as np
import pytest

from core.errors import DeviceError, FormatError
from core.frames import MarkerFrame
from devices.natnet import protocol
from devices.natnet.client import NatNetDevice
from devices.natnet.protocol import Connect, Message, Sender
from devices.natnet.simulator import NatNetSimulator
from tests.devices.natnet.streams import make_frames, next_frame, read_until

WHO = Sender("test", (1, 0, 0, 0), (4, 2, 0, 0))


def ask(server: NatNetSimulator, message: int, payload: bytes = b"") -> tuple[int, bytes]:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as plain:
        plain.settimeout(5)
        plain.sendto(protocol.pack(message, payload), ("127.0.0.1", server.command_port))
        return protocol.unpack(plain.recv(65535))


@pytest.fixture
def server() -> Iterator[NatNetSimulator]:
    with NatNetSimulator(make_frames(3), 120.0, command_port=0, data_port=0) as server:
        yield server


def test_answers(server: NatNetSimulator) -> None:
    message, payload = ask(server, Message.CONNECT, Connect(WHO).encode())
    info = protocol.decode_server_info(payload)
    assert message == Message.SERVERINFO
    assert info.data_port == server.data_port
    assert info.clock_hz == 10_000_000
    assert not info.multicast
    assert ask(server, Message.REQUEST, b"FrameRate\0") == (Message.RESPONSE, protocol.encode_float(120.0))
    assert ask(server, Message.REQUEST, b"UnitsToMillimeters\0") == (Message.RESPONSE, protocol.encode_float(1000.0))
    assert ask(server, Message.REQUEST, b"UpAxis\0") == (Message.RESPONSE, protocol.encode_int(1))
    assert ask(server, Message.REQUEST, b"Bitstream\0") == (Message.RESPONSE, b"Bitstream,4.1.0.0\0")
    assert ask(server, Message.REQUEST, b"MakeCoffee\0")[0] == Message.UNRECOGNIZED_REQUEST
    ticks = []
    for client in (77, 78):
        message, payload = ask(server, Message.ECHOREQUEST, protocol.encode_echo_request(client))
        assert message == Message.ECHORESPONSE
        echoed, now = protocol.decode_echo_response(payload)
        assert echoed == client
        ticks.append(now)
    assert ticks == sorted(ticks)


def test_keepalive_and_nonsense_get_no_answer(server: NatNetSimulator) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as plain:
        plain.settimeout(5)
        target = ("127.0.0.1", server.command_port)
        for packet in (b"", b"?", protocol.pack(Message.KEEPALIVE), protocol.pack(Message.ECHOREQUEST, b"short")):
            plain.sendto(packet, target)
        plain.sendto(protocol.pack(Message.REQUEST, b"UpAxis\0"), target)
        assert protocol.unpack(plain.recv(65535))[0] == Message.RESPONSE


def test_numbers_go_on_where_the_frames_begin_again() -> None:
    with NatNetSimulator(make_frames(7, first=40), 500.0, command_port=0, data_port=0, loop=True) as server:
        device = NatNetDevice(command_port=server.command_port)
        device.open()
        device.start()
        server.start()
        got = read_until(device, lambda: device.health().received >= 30)
        assert device.health().lost == 0
        assert [frame.sequence for frame in got] == list(range(40, 40 + len(got)))
        assert not server.finished
        server.stop()
        device.close()


def test_frames_leave_at_their_rate() -> None:
    """Mean rate exact by absolute deadlines: the last frame is due (n - 1) periods after the first."""
    with NatNetSimulator(make_frames(101), 200.0, command_port=0, data_port=0) as server:
        device = NatNetDevice(command_port=server.command_port)
        device.open()
        device.start()
        server.start()
        stamps = []
        while not server.finished or len(stamps) < 101:
            frame = next_frame(device, 0.2)
            if frame is None:
                break
            stamps.append(frame.times.device_s)
        device.close()
    assert len(stamps) == 101
    moved = ~np.isclose(np.diff(stamps), 0.005, rtol=0, atol=2e-7)
    assert moved.sum() == server.slipped  # none, unless this machine stood still


def test_a_stalled_source_moves_the_schedule_instead_of_bursting() -> None:
    def stalling() -> Iterator[MarkerFrame]:
        for frame in make_frames(40):
            if frame.sequence == 20:
                time.sleep(0.5)
            yield frame

    with NatNetSimulator(stalling(), 200.0, command_port=0, data_port=0) as server:
        server.start()
        assert server.wait(20)
        assert (server.sent, server.error) == (40, None)
        assert server.slipped >= 1


def test_a_fault_of_the_frames_is_told() -> None:
    def broken() -> Iterator[MarkerFrame]:
        yield from make_frames(2)
        raise RuntimeError("the file ends here")

    with NatNetSimulator(broken(), 500.0, command_port=0, data_port=0) as server:
        server.start()
        assert server.wait(20)
        assert server.sent == 2
        assert "the file ends here" in str(server.error)


def test_ids_that_do_not_fit_are_told() -> None:
    frame = make_frames(1)[0]
    frame.ids[0] = 1 << 40
    with NatNetSimulator([frame], 500.0, command_port=0, data_port=0) as server:
        server.start()
        assert server.wait(20)
        assert isinstance(server.error, FormatError)
        assert "1099511627776 is too large" in str(server.error)


def test_more_points_than_a_datagram_holds_are_told() -> None:
    with NatNetSimulator(make_frames(1, points=3000), 500.0, command_port=0, data_port=0) as server:
        ask(server, Message.CONNECT, Connect(WHO).encode())
        server.start()
        assert server.wait(20)
        assert "Send fewer points" in str(server.error)


def test_ports_in_use() -> None:
    with NatNetSimulator([], 100.0, command_port=0, data_port=0) as server:
        with pytest.raises(DeviceError, match=f"Port {server.command_port} of 127.0.0.1 cannot be taken"):
            NatNetSimulator([], 100.0, command_port=server.command_port, data_port=0).open()
        with pytest.raises(DeviceError, match=f"Port {server.data_port} "):
            NatNetSimulator([], 100.0, command_port=0, data_port=server.data_port).open()
    with pytest.raises(DeviceError, match="cannot be taken"):
        NatNetSimulator([], 100.0, host="203.0.113.7", command_port=0, data_port=0).open()


def test_what_cannot_be_simulated() -> None:
    with pytest.raises(DeviceError, match="rate of 0 Hz"):
        NatNetSimulator([], 0)
    with pytest.raises(DeviceError, match=r"Bitstream 5\.0"):
        NatNetSimulator([], 100.0, bitstream=(5, 0))


def test_ports_are_free_again_after_closing() -> None:
    server = NatNetSimulator(make_frames(2), 100.0, command_port=0, data_port=0)
    for _ in range(3):
        server.start()
        server.close()
    assert server.clients == ()


def serve(pipe: Connection) -> None:
    with NatNetSimulator(make_frames(5_000, points=4), 200.0, command_port=0, data_port=0) as server:
        server.start()
        pipe.send_bytes(server.command_port.to_bytes(2, "big"))
        pipe.poll(60)


def test_in_a_process_of_its_own() -> None:
    """Another process's clock is mapped onto ours, and its killing is noticed."""
    context = multiprocessing.get_context("spawn")
    here, there = context.Pipe()
    process = context.Process(target=serve, args=(there,))
    process.start()
    try:
        assert here.poll(60)
        device = NatNetDevice(command_port=int.from_bytes(here.recv_bytes(), "big"))
        device.open()
        device.start()
        got = read_until(device, lambda: device.health().received >= 60)
        assert all(frame.times.host_s <= frame.times.arrival_s for frame in got)
        assert device.health().lost == 0
        process.kill()
        read_until(device, lambda: not device.health().connected)
        assert "silent" in device.health().reason
        device.close()
    finally:
        process.kill()
        process.join()
