"""Client and simulator over real sockets."""

from __future__ import annotations

import multiprocessing
import random
import socket
import struct
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from multiprocessing.connection import Connection

import numpy as np
import pytest

from core.errors import DeviceError
from core.frames import NO_ID, MarkerFrame
from devices.device import Level
from devices.natnet import protocol, transport
from devices.natnet.client import NatNetDevice
from devices.natnet.frames import decode_frame, encode_frame
from devices.natnet.protocol import Message
from devices.natnet.simulator import NatNetSimulator
from devices.stream import host_clock
from tests.devices.natnet.streams import (
    assert_same,
    free_port,
    make_frames,
    need_loopback_multicast,
    read_until,
    read_while,
)


def simulator(frames: list[MarkerFrame], rate_hz: float = 500.0, **options: object) -> NatNetSimulator:
    ports = {"command_port": 0, "data_port": 0}
    return NatNetSimulator(frames, rate_hz, **{**ports, **options})  # type: ignore[arg-type]


def client(server: NatNetSimulator, **settings: object) -> NatNetDevice:
    return NatNetDevice(command_port=server.command_port, data_port=server.data_port, **settings)


def streaming(server: NatNetSimulator) -> Callable[[], bool]:
    return lambda: not server.finished


@pytest.mark.parametrize("multicast", [False, True], ids=["unicast", "multicast"])
@pytest.mark.parametrize("bitstream", [(3, 0), (4, 1), (4, 2)], ids=str)
def test_what_is_sent_is_received(multicast: bool, bitstream: tuple[int, int]) -> None:
    if multicast:
        need_loopback_multicast()
    frames = make_frames(300)
    with simulator(frames, bitstream=bitstream, multicast=multicast) as server:
        device = client(server)
        device.open()
        device.start()
        server.start()
        received = list(read_while(device, streaming(server)))
        health, described = device.health(), device.describe()
        device.close()
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
    with simulator(frames, bitstream=bitstream) as server:
        device = client(server)
        device.open()
        device.start()
        server.start()
        received = list(read_while(device, streaming(server)))
        health = device.health()
        device.close()
    assert server.sent == len(received) + health.lost == 60
    for frame in received:
        assert np.array_equal(frame.points_m, frames[frame.sequence].points_m)
        assert (frame.ids == NO_ID).all()
        assert np.isnan(frame.residuals_m).all()
        assert [body.name for body in frame.rigid_bodies] == ["Wand", "Table"]


def test_a_hundred_points_at_120_hz_without_loss() -> None:
    frames = make_frames(480, points=100)
    with simulator(frames, 120.0) as server:
        device = client(server)
        device.open()
        device.start()
        server.start()
        received = list(read_while(device, streaming(server)))
        health = device.health()
        device.close()
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


def test_hostile_packets_in_mid_stream() -> None:
    frames = make_frames(400)
    hostile = hostile_packets()
    with simulator(frames, 400.0) as server, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as attacker:
        device = client(server)
        device.open()
        device.start()
        target = server.clients[0]
        server.start()
        received: list[MarkerFrame] = []
        for packet in hostile:
            attacker.sendto(packet, target)
            if (frame := device.read(0.01)) is not None:
                received.append(frame)
        received += read_while(device, streaming(server))
        health = device.health()
        device.close()
    assert health.rejected == len(hostile)
    assert health.last_error.startswith("A packet from 127.0.0.1 was not understood.")
    assert server.sent == len(received) + health.lost == 400
    for frame in received:
        assert_same(frame, frames[frame.sequence])


def test_nothing_understood_says_so() -> None:
    with simulator(make_frames(2000), 200.0, bitstream=(3, 0)) as server:
        device = client(server, bitstream="2.7")
        device.open()
        device.start()
        server.start()
        assert read_until(device, lambda: device.health().level is Level.PROBLEM) == []
        health = device.health()
        device.close()
    assert health.rejected > 0
    assert "NatNet 3.0: set the bitstream version to auto" in health.reason
    assert "127.0.0.1: " in health.heard


def test_a_client_may_ask_for_an_older_bitstream() -> None:
    with simulator(make_frames(2000), 200.0, bitstream=(4, 1)) as server:
        device = client(server, bitstream="4.0")
        device.open()
        device.start()
        server.start()
        read_until(device, lambda: device.health().received >= 20)
        assert device.health().rejected == 0
        assert device.describe().details["Bitstream"] == "4.0"
        device.close()


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
    assert "Motive 3.1 at 127.0.0.1" in health.reason
    assert device.health().level is Level.IDLE


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
            assert device.read(0.0) is None
            time.sleep(0.1)
        assert device.health().lost == 0
        device.close()
        device.close()


def test_gaps_of_the_source_are_lost_frames() -> None:
    frames = [frame for frame in make_frames(300) if frame.sequence % 10 != 5]
    with simulator(frames) as server:
        device = client(server)
        device.open()
        device.start()
        server.start()
        received = list(read_while(device, streaming(server)))
        health = device.health()
        device.close()
    assert len(received) + health.lost == 300


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
        last = device.read(1.0)
        assert last is not None
        assert [body.name for body in last.rigid_bodies] == ["Wand", "Table"]
        device.close()


def test_a_reader_that_pauses_finds_its_frames_waiting() -> None:
    """Three seconds without a read: the kernel has kept the frames, and it was no silence of the server's."""
    frames = make_frames(500, points=30)
    with simulator(frames, 100.0) as server:
        device = client(server)
        device.open()
        device.start()
        server.start()
        received = read_until(device, lambda: device.health().received >= 20)
        time.sleep(3.0)
        received += read_while(device, streaming(server))
        health = device.health()
        device.close()
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


def test_without_kernel_stamps(monkeypatch: pytest.MonkeyPatch) -> None:
    """As on Windows and macOS."""
    monkeypatch.setattr(transport, "_receive", transport._receive_plain)
    frames = make_frames(100)
    with simulator(frames) as server:
        device = client(server)
        device.open()
        device.start()
        server.start()
        received = list(read_while(device, streaming(server)))
        device.close()
    assert [frame.sequence for frame in received] == list(range(100))
    assert all(frame.times.host_s <= frame.times.arrival_s for frame in received)


def test_kernel_stamps_are_earlier_than_the_reading() -> None:
    with simulator(make_frames(20), 200.0) as server:
        device = client(server)
        device.open()
        device.start()
        server.start()
        assert server.wait(10)
        time.sleep(0.2)
        now = host_clock()
        stamps = [frame.times.arrival_s for frame in read_while(device, lambda: False)]
        device.close()
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


# ---- what cannot be opened


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
