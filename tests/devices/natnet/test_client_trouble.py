"""Client and simulator over real sockets: servers that vanish, lie or say nothing, readers that are late."""

from __future__ import annotations

import multiprocessing
import random
import re
import socket
import struct
import threading
import time
from dataclasses import replace
from multiprocessing.connection import Connection

import pytest

from core.frames import MarkerFrame
from devices.device import Level
from devices.natnet import protocol
from devices.natnet.client import NatNetDevice
from devices.natnet.frames import encode_frame
from devices.natnet.protocol import Message
from devices.natnet.records import FrameOfData
from devices.natnet.simulator import NatNetSimulator
from tests.devices.natnet.served import client, heard, listening, simulator, streaming
from tests.devices.natnet.streams import assert_same, make_frames, next_frame, read_until, read_while


def test_server_killed_and_restarted() -> None:
    frames = make_frames(20_000, points=5)
    first = simulator(frames, 200.0)
    first.start()
    ports = {"command_port": first.command_port, "data_port": first.data_port}
    device = client(first)
    device.open()
    device.start()
    read_until(device, lambda: device.health().received >= 20)
    first.close()
    read_until(device, lambda: device.health().level is Level.PROBLEM)
    gone = device.health()
    assert not gone.connected
    assert "silent" in gone.reason
    assert "127.0.0.1" in gone.reason

    again = simulator(make_frames(20_000, points=7, seed=2), 200.0, **ports)
    again.start()
    resumed = read_until(device, lambda: device.health().received >= gone.received + 50)
    health = device.health()
    device.close()
    again.close()
    assert health.connected
    assert health.reconnects == 1
    assert health.lost == gone.lost  # a server that counts anew has lost nothing
    assert {len(frame.points_m) for frame in resumed} == {7}
    assert [frame.sequence for frame in resumed] == sorted({frame.sequence for frame in resumed})


def test_server_restarted_before_its_silence_is_noticed() -> None:
    """A new server on the old address answers but knows no clients: it is greeted again."""
    first = simulator(make_frames(20_000, points=5), 200.0)
    first.start()
    ports = {"command_port": first.command_port, "data_port": first.data_port}
    device = client(first)
    device.open()
    device.start()
    read_until(device, lambda: device.health().received >= 20)
    first.close()
    again = simulator(make_frames(20_000, points=7, seed=2), 200.0, bitstream=(3, 0), **ports)
    again.start()
    read_until(device, lambda: device.describe().details["Bitstream"] == "3.0")
    resumed = read_until(device, lambda: device.health().received >= 200)
    assert {len(frame.points_m) for frame in resumed} == {7}
    device.close()
    again.close()


def hostile_packets() -> list[bytes]:
    chance = random.Random(7)
    frame = make_frames(1)[0]
    with simulator([frame]) as server:
        record = server._record(0, frame, 0.0)
    payload = encode_frame(record, (4, 1))
    whole = protocol.pack(Message.FRAMEOFDATA, payload)
    huge = struct.pack("<ii", 3, 0x7FFFFFFF)
    return [
        b"",
        b"\x07",
        whole[: len(whole) // 2],
        whole + b"\0",
        protocol.pack(Message.FRAMEOFDATA),
        protocol.pack(Message.FRAMEOFDATA, huge + bytes(200)),
        protocol.pack(Message.FRAMEOFDATA, struct.pack("<ii", 3, -1) + bytes(200)),
        protocol.pack(Message.FRAMEOFDATA, payload[:-1]),
        protocol.pack(Message.MODELDEF, huge),
        protocol.pack(Message.SERVERINFO, b"Motive"),
        protocol.pack(Message.ECHORESPONSE, b"123"),
        *(chance.randbytes(chance.randrange(5, 1400)) for _ in range(50)),
        *(protocol.pack(Message.FRAMEOFDATA, chance.randbytes(chance.randrange(5, 1400))) for _ in range(50)),
    ]


@pytest.mark.parametrize("whose", ["the server's", "a stranger's"])
def test_hostile_packets_in_mid_stream(whose: str) -> None:
    frames = make_frames(400)
    hostile = hostile_packets()
    with (
        simulator(frames, 400.0) as server,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as attacker,
        listening(server) as device,
    ):
        target = server.clients[0]
        server.start()
        received: list[MarkerFrame] = []
        received += read_until(device, lambda: device.health().received > 5)
        sender = server._data if whose == "the server's" else attacker
        assert sender is not None
        for packet in hostile:
            sender.sendto(packet, target)
            if (frame := next_frame(device, 0.01)) is not None:
                received.append(frame)
        received += read_while(device, streaming(server))
        health = device.health()
    unused = int((re.search(r"(\d+) packets \(another server", health.heard) or [0, 0])[1])
    if whose == "the server's":
        assert len(hostile) - 3 <= health.rejected <= len(hostile)  # answers nobody asked for are not even read
        assert health.last_error.startswith("A packet from 127.0.0.1 was not understood.")
    else:
        assert (health.rejected, unused) == (0, len(hostile))
    assert server.sent == len(received) + health.lost == 400
    for frame in received:
        assert_same(frame, frames[frame.sequence])


def test_nothing_understood_says_so() -> None:
    with simulator(make_frames(2000), 200.0, bitstream=(3, 0)) as server, listening(server, bitstream="2.7") as device:
        server.start()
        said = "NatNet 3.0: set the bitstream version to auto"  # of frames; models are not understood either
        told = []

        def problem() -> bool:
            told.append(device.health())
            return told[-1].level is Level.PROBLEM and said in told[-1].reason

        assert read_until(device, problem) == []
        health = told[-1]
    assert health.rejected > 0
    assert "127.0.0.1: " in health.heard


def test_answers_without_frames_say_what_to_check() -> None:
    with simulator([]) as server:
        device = client(server)
        device.open()
        assert device.health().level is Level.IDLE
        device.start()
        read_until(device, lambda: device.health().level is Level.WARNING and "no frames" in device.health().reason)
        health = device.health()
        device.close()
    assert health.connected
    assert f"Motive 3.1 at 127.0.0.1:{server.command_port}" in health.reason
    assert device.health().level is Level.IDLE


def test_gaps_of_the_source_are_lost_frames() -> None:
    frames = [frame for frame in make_frames(300) if frame.sequence % 10 != 5]
    with simulator(frames) as server, listening(server) as device:
        received = heard(device, server)
        health = device.health()
    assert len(received) + health.lost == 300


def test_a_reader_that_pauses_finds_its_frames_waiting() -> None:
    """Three seconds without a read: the kernel has kept the frames, and it was no silence of the server's."""
    frames = make_frames(500, points=30)
    with simulator(frames, 100.0) as server, listening(server) as device:
        server.start()
        received = read_until(device, lambda: device.health().received >= 20)
        time.sleep(3.0)
        received += read_while(device, streaming(server))
        health = device.health()
    assert [frame.sequence for frame in received] == list(range(500))
    assert (health.lost, health.reconnects) == (0, 0)


def test_a_busy_interpreter_loses_nothing() -> None:
    """500 Hz from another process while a thread here holds the interpreter: the kernel keeps and stamps."""
    stop = threading.Event()

    def hog() -> None:
        while not stop.is_set():
            sum(range(20_000))

    hogs = [threading.Thread(target=hog) for _ in range(2)]
    context = multiprocessing.get_context("spawn")
    here, there = context.Pipe()
    process = context.Process(target=serve_on_demand, args=(there,))
    process.start()
    try:
        assert here.poll(60)
        device = NatNetDevice(command_port=int.from_bytes(here.recv_bytes(), "big"))
        device.open()
        device.start()
        for thread in hogs:
            thread.start()
        here.send_bytes(b"go")
        received = read_until(device, lambda: device.health().received + device.health().lost >= 1000)
        assert [frame.sequence for frame in received] == list(range(1000))
        device.close()
    finally:
        stop.set()
        process.kill()
        process.join()
        for thread in hogs:
            thread.join()


def serve_on_demand(pipe: Connection) -> None:
    with simulator(make_frames(1000), 500.0) as server:
        pipe.send_bytes(server.command_port.to_bytes(2, "big"))
        pipe.recv_bytes()
        server.start()
        pipe.poll(60)


def test_health_and_description_may_be_read_by_any_thread() -> None:
    stop = threading.Event()
    failures: list[BaseException] = []
    with simulator(make_frames(600, points=5), 300.0) as server:
        device = client(server)

        def watch() -> None:
            try:
                while not stop.is_set():
                    health = device.health()
                    assert health.reason
                    assert device.describe().title
            except BaseException as error:
                failures.append(error)

        watchers = [threading.Thread(target=watch) for _ in range(2)]
        for watcher in watchers:
            watcher.start()
        device.open()
        device.start()
        server.start()
        received = list(read_while(device, streaming(server)))
        health = device.health()
        device.close()
        stop.set()
        for watcher in watchers:
            watcher.join()
    assert failures == []
    assert len(received) + health.lost == server.sent == 600


class Spoiling(NatNetSimulator):
    """One frame says another number than it has, one another time."""

    def _record(self, number: int, frame: MarkerFrame, exposed_s: float) -> FrameOfData:
        record = super()._record(number, frame, exposed_s)
        if number == 100:
            return replace(record, number=50_100)
        return replace(record, mid_exposure_ticks=7, timestamp_s=1e7) if number == 150 else record


@pytest.mark.parametrize("bitstream", [(2, 5), (2, 9), (4, 1)], ids=str)
def test_a_spoilt_frame_is_rejected_alone(bitstream: tuple[int, int]) -> None:
    frames = make_frames(300, points=5)
    spoilt = {100} if bitstream == (2, 5) else {100, 150}  # before 2.6 there are no times
    with (
        Spoiling(frames, 300.0, command_port=0, data_port=0, bitstream=bitstream) as server,
        listening(server) as device,
    ):
        received = heard(device, server)
        health = device.health()
    assert [frame.sequence for frame in received] == [n for n in range(300) if n not in spoilt]
    assert (health.lost, health.rejected, health.late) == (len(spoilt), len(spoilt), 0)
    assert "not borne out by the frames behind it" in health.last_error
    assert "counted anew" not in health.heard
