"""Only the chosen server is believed: packets of every kind from others change no point, no time and no title."""

from __future__ import annotations

import socket
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import pytest

from core.frames import MarkerFrame
from devices.common.addresses import local_addresses
from devices.common.clock_sync import ClockSync
from devices.common.udp import Datagram
from devices.device import Level
from devices.natnet import protocol
from devices.natnet.client import NatNetDevice
from devices.natnet.conversation import Conversation
from devices.natnet.frames import encode_frame
from devices.natnet.models import RigidBodyModel, encode_models
from devices.natnet.protocol import Message, Sender, ServerInfo
from devices.natnet.simulator import CLOCK_HZ, NatNetSimulator
from devices.natnet.wire import Version
from tests.devices.natnet.served import client, listening, simulator, streaming
from tests.devices.natnet.streams import (
    assert_same,
    free_port,
    make_frames,
    need_loopback_multicast,
    next_frame,
    read_until,
    read_while,
)

ANOTHER = ServerInfo(Sender("Mallory", (9, 9, 0, 0), (3, 0, 0, 0)), 999, 4242, True, "239.1.2.3")
needs_second_loopback = pytest.mark.skipif(sys.platform != "linux", reason="needs a second loopback address")


def spoofed_packets(version: Version) -> list[bytes]:
    """One of every kind that a server sends, each of them a lie."""
    frame = make_frames(1, points=3, seed=99, first=70_000)[0]
    with simulator([frame], bitstream=version) as server:
        lies = [server._record(number, frame, exposed_s) for number, exposed_s in ((70_000, 1.0), (0, 0.0), (5, 1e9))]
    models = encode_models([RigidBodyModel("Mallory", 7), RigidBodyModel("Mallory too", 8)], version)
    return [
        protocol.pack(Message.SERVERINFO, ANOTHER.encode()),
        protocol.pack(Message.SERVERINFO, replace(ANOTHER, sender=Sender("Old", (1, 0, 0, 0), (2, 5, 0, 0))).encode()),
        protocol.pack(Message.MODELDEF, models),
        protocol.pack(Message.RESPONSE, protocol.encode_float(25.4)),
        protocol.pack(Message.RESPONSE, protocol.encode_int(2)),
        protocol.pack(Message.RESPONSE, b"Bitstream,2.5.0.0\0"),
        protocol.pack(Message.ECHORESPONSE, protocol.encode_echo_response(int(time.perf_counter() * 1e9), 12345)),
        protocol.pack(Message.ECHORESPONSE, protocol.encode_echo_response(0, 1 << 60)),
        *(protocol.pack(Message.FRAMEOFDATA, encode_frame(lie, version)) for lie in lies),
        protocol.pack(Message.UNRECOGNIZED_REQUEST),
        protocol.pack(Message.MESSAGESTRING, b"I am your server\0"),
        protocol.pack(Message.DISCONNECTBYTIMEOUT),
        b"",
        b"\x07\x00\x10\x00nonsense",
    ]


def believed(device: NatNetDevice) -> tuple[object, ...]:
    """All that the frames of a session hang on, and what is said of the server."""
    talk = device._conversation
    assert talk is not None
    described = device.describe()
    details = {key: value for key, value in described.details.items() if "atency" not in key and key != "Round trip"}
    return described.title, talk.scale_m, talk.up_axis, talk.frame_rate_hz, talk.version, dict(talk.names), details


# ---- bit for bit


def opened(server: NatNetSimulator) -> tuple[NatNetDevice, Conversation]:
    """A client of a server that was asked everything, with a clock that is the same in every run."""
    device = client(server)
    device.open()
    device.start()
    talk = device._conversation
    assert talk is not None
    read_until(device, lambda: not talk._greeting)
    read_until(device, lambda: talk.settled)
    talk.clock = ClockSync()
    talk.clock.echo(999.9, 999.9003, 999.9005)
    return device, talk


def taken(device: NatNetDevice, talk: Conversation, datagrams: list[Datagram]) -> list[MarkerFrame]:
    return [frame for datagram in datagrams for frame in device._take(datagram, talk)]


@pytest.mark.parametrize("bitstream", [(2, 9), (3, 0), (4, 1)], ids=str)
@pytest.mark.parametrize("whose", ["another address", "another port"])
def test_points_times_and_title_are_bit_for_bit_those_without(bitstream: Version, whose: str) -> None:
    frames = make_frames(120)
    with simulator(frames, 120.0, bitstream=bitstream) as server:
        true: list[Datagram] = []
        for frame in frames:
            record = replace(
                server._record(frame.sequence, frame, 1000 + frame.sequence / 120),
                transmit_ticks=int((1000.005 + frame.sequence / 120) * CLOCK_HZ),
            )
            packet = protocol.pack(Message.FRAMEOFDATA, encode_frame(record, bitstream))
            arrival_s = 1000.0052 + frame.sequence / 120
            true.append(Datagram(packet, "127.0.0.1", arrival_s, True, server.data_port))
        device, talk = opened(server)
        without = taken(device, talk, true)
        before = believed(device)
        device.close()

        address = "127.0.0.2" if whose == "another address" else "127.0.0.1"
        lies = spoofed_packets(bitstream)
        mixed: list[Datagram] = []
        for k, datagram in enumerate(true):
            mixed.append(datagram)
            for packet in lies if k % 10 == 5 else lies[k % len(lies) :][:1]:
                mixed.append(Datagram(packet, address, datagram.arrival_s + 0.001, True, 4711))
        device, talk = opened(server)
        with_lies = taken(device, talk, mixed)
        after, health = believed(device), device.health()
        device.close()
    assert len(without) == 120
    assert [frame.times for frame in with_lies] == [frame.times for frame in without]
    for got, expected in zip(with_lies, without, strict=True):
        assert got.sequence == expected.sequence
        assert got.points_m.tobytes() == expected.points_m.tobytes()
        assert got.ids.tobytes() == expected.ids.tobytes()
        assert [(body.name, body.position_m.tobytes()) for body in got.rigid_bodies] == [
            (body.name, body.position_m.tobytes()) for body in expected.rigid_bodies
        ]
    assert after == before
    assert (health.received, health.lost, health.rejected, health.late) == (120, 0, 0, 0)
    assert "(another server, not used)" in health.heard


# ---- over sockets


@contextmanager
def attacked(server: NatNetSimulator, addresses: list[str]) -> Iterator[None]:
    """Lies to every client of the server from the moment it connects, a thousand a second."""
    lies, done = spoofed_packets(server.bitstream), threading.Event()
    sockets = []
    for address in addresses:
        sockets.append(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
        sockets[-1].bind((address, 0))

    def attack() -> None:
        while not done.is_set():
            for packet in lies:
                for target in server.clients:
                    for attacker in sockets:
                        attacker.sendto(packet, target)
                time.sleep(0.001)

    thread = threading.Thread(target=attack)
    thread.start()
    try:
        yield
    finally:
        done.set()
        thread.join()
        for attacker in sockets:
            attacker.close()


@needs_second_loopback
@pytest.mark.parametrize("bitstream", [(2, 9), (4, 1)], ids=str)
def test_a_session_under_attack_is_the_session_without(bitstream: Version) -> None:
    """From before it is set up to its end; the server streams all the while."""
    frames = make_frames(4000, points=6)
    with simulator(frames, 200.0, bitstream=bitstream) as server:
        server.start()
        with listening(server) as device:
            undisturbed = believed(device)
        with attacked(server, ["127.0.0.1", "127.0.0.2"]), listening(server) as device:
            received = read_until(device, lambda: device.health().received >= 400)
            health = device.health()
            assert believed(device) == undisturbed
    assert received[-1].sequence - received[0].sequence + 1 == len(received) + health.lost
    assert (health.rejected, health.reconnects) == (0, 0)
    assert health.level is Level.WARNING
    assert "127.0.0.2" in health.heard
    assert "127.0.0.1 port " in health.heard
    if not health.lost:
        assert "another sender, 127.0.0." in health.reason
    for frame in received:
        assert np.array_equal(frame.points_m, frames[frame.sequence].points_m)
        assert [body.name for body in frame.rigid_bodies] == ["Wand", "Table"]
        if bitstream >= (3, 0):
            assert_same(frame, frames[frame.sequence])
            # Both are of this machine: the simulated server's clock is ours.
            assert abs(frame.times.host_s - frame.times.device_s) < 0.005


def test_the_second_is_taken_up_after_a_second_of_silence() -> None:
    """A server that is started anew may send from another port."""
    frames = make_frames(20_000, points=3)
    with simulator(frames, 100.0) as server, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as second:
        second.bind(("127.0.0.1", 0))
        records = [server._record(k, make_frames(1, points=9)[0], time.perf_counter()) for k in range(400)]
        packets = [protocol.pack(Message.FRAMEOFDATA, encode_frame(record, (4, 1))) for record in records]
        with listening(server) as device:
            target = server.clients[0]
            server.start()
            read_until(device, lambda: device.health().received >= 10)
            got: list[MarkerFrame] = []
            for packet in packets[:50]:
                second.sendto(packet, target)
                got += [frame] if (frame := next_frame(device, 0.01)) else []
            assert {len(frame.points_m) for frame in got} == {3}
            assert device.health().level is Level.WARNING
            assert f"127.0.0.1 port {second.getsockname()[1]}: 50 packets (another server, not used)" in (
                device.health().heard
            )
            server.stop()
            while next_frame(device, 0.05) is not None:
                pass
            for packet in packets[50:80]:
                second.sendto(packet, target)
                assert next_frame(device, 0.01) is None
            got = []
            for packet in packets[80:]:
                time.sleep(0.005)
                second.sendto(packet, target)
                got += [frame] if (frame := next_frame(device, 0.005)) else []
            assert len(got) > 50
            assert {len(frame.points_m) for frame in got} == {9}


@needs_second_loopback
def test_a_server_with_several_network_cards() -> None:
    """Its frames come from another address than its answers: they are used, since its own sends none."""
    silent = simulator([])
    with silent, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as card:
        card.bind(("127.0.0.2", 0))
        records = [silent._record(k, make_frames(1, points=5)[0], time.perf_counter()) for k in range(300)]
        with listening(silent) as device:
            target, got = silent.clients[0], []
            for record in records:
                card.sendto(protocol.pack(Message.FRAMEOFDATA, encode_frame(record, (4, 1))), target)
                got += [frame] if (frame := next_frame(device, 0.01)) else []
            health = device.health()
            assert len(got) > 100
            assert health.connected
            # Once the server's own address sends it is the server.
            server_frames = make_frames(300, points=7)
            silent._frames = server_frames
            silent.start()
            time.sleep(0.2)
            for record in records:
                card.sendto(protocol.pack(Message.FRAMEOFDATA, encode_frame(record, (4, 1))), target)
            after = list(read_while(device, streaming(silent)))[50:]
            assert {len(frame.points_m) for frame in after} == {7}


@needs_second_loopback
def test_of_two_groups_the_first_is_listened_to() -> None:
    need_loopback_multicast()
    port = free_port()
    first = simulator(make_frames(20_000, points=3), 100.0, multicast=True)
    second = simulator(make_frames(20_000, points=9), 100.0, multicast=True, host="127.0.0.2")
    first.data_port = second.data_port = port
    with first, second:
        device = NatNetDevice(transmission="listen only", local="127.0.0.1", data_port=port)
        device.open()
        device.start()
        first.start()
        read_until(device, lambda: device.health().received >= 5)
        second.start()
        got = read_until(device, lambda: device.health().received >= 100)
        health = device.health()
        assert {len(frame.points_m) for frame in got} == {3}
        assert health.level is Level.WARNING
        assert "127.0.0.2" in health.reason
        first.stop()
        read_until(device, lambda: len(device.latest.labelled) == 9 if device.latest else False)
        read_until(device, lambda: "sends no frames any more: these come from 127.0.0.2" in device.health().reason)
        assert device.health().level is Level.WARNING
        device.close()


@needs_second_loopback
def test_a_stranger_taken_up_is_amber_and_hides_no_silence() -> None:
    """The chosen server is gone; whoever sends then is used, and nobody takes it for the server."""
    need_loopback_multicast()
    port = free_port()
    chosen = simulator(make_frames(20_000, points=3), 100.0, multicast=True)
    other = simulator(make_frames(20_000, points=9), 100.0, multicast=True, host="127.0.0.2")
    chosen.data_port = other.data_port = port
    with chosen, other:
        device = client(chosen)
        device.open()
        device.start()
        chosen.start()
        other.start()
        got = read_until(device, lambda: device.health().received >= 50)
        assert {len(frame.points_m) for frame in got} == {3}
        chosen.stop()
        read_until(device, lambda: "these come from 127.0.0.2" in device.health().reason)
        assert device.health().level is Level.WARNING
        chosen.close()
        read_until(device, lambda: device.health().level is Level.PROBLEM)
        assert "has been silent" in device.health().reason
        device.close()


def test_unicast_is_bound_to_the_interface_of_the_server() -> None:
    with simulator([]) as server, listening(server) as device:
        assert device._sockets is not None
        address, port = device._sockets.speaking.getsockname()
        assert address == "127.0.0.1"
        others = [one for one in local_addresses() if not one.startswith("127.")]
        if not others:
            pytest.skip("this machine has no other network")
        before = device.health().heard
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
            for packet in spoofed_packets((4, 1)):
                stranger.sendto(packet, (others[0], port))
        assert next_frame(device, 0.3) is None
        assert "not used" not in before + device.health().heard


# ---- what was asked, and only that


def test_answers_from_another_port_count_where_none_comes_from_the_one_asked() -> None:
    """Never by a fixed port: some servers answer from another."""
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as ear,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as mouth,
        simulator(make_frames(1)) as server,
    ):
        ear.bind(("127.0.0.1", 0))
        mouth.bind(("127.0.0.1", 0))
        ear.settimeout(0.05)
        done = threading.Event()

        def answer() -> None:
            while not done.is_set():
                try:
                    packet, address = ear.recvfrom(65535)
                except TimeoutError:
                    continue
                reply = server._reply(*protocol.unpack(packet), address)
                if reply is not None:
                    mouth.sendto(reply, address)

        thread = threading.Thread(target=answer)
        thread.start()
        device = NatNetDevice(command_port=ear.getsockname()[1])
        try:
            device.open()
            device.start()
            talk = device._conversation
            assert talk is not None
            read_until(device, lambda: talk.frame_rate_hz == 500.0 and bool(talk.names))
            assert device.describe().title == "Motive 3.1"
        finally:
            device.close()
            done.set()
            thread.join()


def test_a_rate_spoilt_once_is_asked_for_again() -> None:
    """As is whatever changes the points of the whole session."""
    answers: list[str] = []

    class Spoilt(NatNetSimulator):
        def _respond(self, command: str, address: tuple[str, int]) -> bytes:
            answers.append(command)
            if answers.count(command) == 1:
                if command in ("FrameRate", "UnitsToMillimeters"):
                    return protocol.pack(Message.RESPONSE, protocol.encode_float(25.4))
                if command == "UpAxis":
                    return protocol.pack(Message.RESPONSE, protocol.encode_int(2))
            return super()._respond(command, address)

    with Spoilt(make_frames(100), 500.0, command_port=0, data_port=0) as server, listening(server) as device:
        talk = device._conversation
        assert talk is not None
        assert (talk.frame_rate_hz, talk.scale_m, talk.up_axis) == (500.0, 1.0, 1)
        assert answers.count("FrameRate") == 3


def test_a_server_that_never_says_the_same_twice_is_not_asked_for_ever() -> None:
    class Fickle(NatNetSimulator):
        def _respond(self, command: str, address: tuple[str, int]) -> bytes:
            self.rate_hz += 1
            return super()._respond(command, address)

    with Fickle(make_frames(100), 500.0, command_port=0, data_port=0) as server, listening(server) as device:
        talk = device._conversation
        assert talk is not None
        read_until(device, lambda: talk.settled)
        assert talk.frame_rate_hz == 0.0
        assert "answers FrameRate differently each time" in device.health().last_error
        assert server.rate_hz < 530
