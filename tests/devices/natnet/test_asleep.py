"""A process that did not run for twenty seconds: its frames waited, and their times are right or said to be unknown."""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import threading
import time
from contextlib import ExitStack
from dataclasses import dataclass
from multiprocessing.connection import Connection

import numpy as np
import pytest

from core.frames import FloatArray, IntArray
from devices.common import udp
from devices.device import Health, Level
from devices.natnet.client import NatNetDevice
from devices.natnet.wire import Version
from tests.devices.natnet.served import simulator
from tests.devices.natnet.streams import make_frames, next_frame

pytestmark = pytest.mark.skipif(not hasattr(signal, "SIGSTOP"), reason="this system cannot stop a process")

ASLEEP_S, AFTER_S = 22.0, 5.0
RATE_HZ = 50.0


@dataclass(frozen=True)
class Kind:
    """bitstream: of the server. stamped: the kernel stamps what it receives, as on Linux."""

    bitstream: Version
    stamped: bool


KINDS = {
    "clock and stamps": Kind((4, 1), True),
    "clock without stamps": Kind((4, 1), False),
    "timestamps and stamps": Kind((2, 9), True),
    "timestamps without stamps": Kind((2, 9), False),
    "neither clock nor stamps": Kind((2, 5), False),
}


@dataclass(frozen=True)
class Heard:
    """(n,) each, of the frames in their order; read_s: when they were read. health: at the end; woken: just after the
    sleep; awake: a while after it."""

    sequence: IntArray
    device_s: FloatArray
    host_s: FloatArray
    arrival_s: FloatArray
    read_s: FloatArray
    health: Health
    woken: Health
    awake: Health


def serve(pipe: Connection) -> None:
    """One server of each bitstream."""
    with ExitStack() as closing:
        for bitstream in pipe.recv():
            server = simulator(make_frames(100, points=5), RATE_HZ, bitstream=bitstream, loop=True)
            closing.enter_context(server)
            server.start()
            pipe.send(server.command_port)
        pipe.poll(300)


def hear(pipe: Connection, ports: list[int], stamped: bool) -> None:
    """One client of each server, until told that it is enough."""
    if not stamped:
        udp._receive = udp._receive_plain
    enough = threading.Event()
    heard: dict[int, tuple[list[tuple[float, ...]], Health, Health, Health]] = {}

    def listen(port: int) -> None:
        device = NatNetDevice(command_port=port)
        device.open()
        device.start()
        rows: list[tuple[float, ...]] = []
        last_s, woken, woken_s, awake = time.perf_counter(), None, 0.0, None
        frame = None
        while frame is not None or not enough.is_set():  # to the last that was taken
            frame = next_frame(device, 0.0 if enough.is_set() else 0.05)
            now = time.perf_counter()
            if frame is not None:
                rows.append((frame.sequence, frame.times.device_s, frame.times.host_s, frame.times.arrival_s, now))
            if now - last_s > 5.0:
                woken, woken_s = device.health(), now
            if woken is not None and awake is None and now - woken_s > 2.0:
                awake = device.health()
            last_s = now
        assert woken is not None and awake is not None
        heard[port] = rows, device.health(), woken, awake
        device.close()

    threads = [threading.Thread(target=listen, args=(port,)) for port in ports]
    for thread in threads:
        thread.start()
    pipe.send("listening")
    pipe.poll(300)
    enough.set()
    for thread in threads:
        thread.join()
    pipe.send([heard[port] for port in ports])


@pytest.fixture(scope="module")
def slept() -> dict[str, Heard]:
    """Every kind of server and system at once: heard for some seconds, stopped, and woken up."""
    context = multiprocessing.get_context("spawn")
    here, there = context.Pipe()
    processes = [context.Process(target=serve, args=(there,))]
    clients = []
    try:
        processes[0].start()
        here.send([kind.bitstream for kind in KINDS.values()])
        ports = {name: here.recv() for name in KINDS}
        for stamped in (True, False):
            names = [name for name, kind in KINDS.items() if kind.stamped == stamped]
            near, far = context.Pipe()
            processes.append(context.Process(target=hear, args=(far, [ports[name] for name in names], stamped)))
            processes[-1].start()
            clients.append((names, near, processes[-1]))
        for _, pipe, _ in clients:
            assert pipe.poll(120)
            pipe.recv()
        time.sleep(4.0)
        for _, _, process in clients:
            os.kill(process.pid, signal.SIGSTOP)
        time.sleep(ASLEEP_S)
        for _, _, process in clients:
            os.kill(process.pid, signal.SIGCONT)
        time.sleep(AFTER_S)
        heard = {}
        for names, pipe, _ in clients:
            pipe.send("enough")
            assert pipe.poll(120)
            for name, (rows, *healths) in zip(names, pipe.recv(), strict=True):
                columns = np.array(rows).T
                heard[name] = Heard(columns[0].astype(np.int64), *columns[1:], *healths)
        return heard
    finally:
        for process in processes:
            process.kill()
            process.join()


@pytest.mark.parametrize("name", KINDS)
def test_what_did_not_arrive_is_lost(slept: dict[str, Heard], name: str) -> None:
    """The server gave the client up after ten seconds, and numbered its frames on."""
    heard = slept[name]
    print(heard.sequence[0], heard.sequence[-1], heard.health)
    assert heard.health.received == len(heard.sequence)
    assert np.all(np.diff(heard.sequence) > 0)
    assert heard.health.received + heard.health.lost == heard.sequence[-1] - heard.sequence[0] + 1
    assert heard.health.lost > 0.3 * ASLEEP_S * RATE_HZ
    assert heard.health.rejected == 0
    assert heard.health.untimed == np.count_nonzero(np.isnan(heard.host_s))
    assert "another server" not in heard.health.heard


@pytest.mark.parametrize("name", KINDS)
def test_it_is_said_that_nobody_read_and_not_that_the_network_lost(slept: dict[str, Heard], name: str) -> None:
    heard = slept[name]
    print(heard.health.standstills, heard.awake)
    (one,) = heard.health.standstills
    assert ASLEEP_S - 0.1 < one.seconds < ASLEEP_S + 2.0
    assert one.lost == heard.health.unread == heard.health.lost
    assert heard.awake.level is Level.WARNING
    assert heard.awake.reason.startswith(f"Phalanx stood still for {one.seconds:.1f} s (the computer slept, or")
    assert f"{one.lost:,} frames of that time are lost" in heard.awake.reason
    assert "on the way" not in heard.awake.reason


@pytest.mark.parametrize("name", ["clock and stamps", "clock without stamps"])
def test_times_are_right_to_five_milliseconds(slept: dict[str, Heard], name: str) -> None:
    """The simulated server's clock is that of this machine: its exposures are the truth."""
    heard = slept[name]
    late_s = heard.read_s - heard.device_s
    assert np.count_nonzero(late_s > 10.0) > 100  # they had waited for longer than that
    assert np.isfinite(heard.host_s).all()
    assert np.abs(heard.host_s - heard.device_s).max() < 0.005
    assert np.all(np.diff(heard.host_s) >= 0)
    if KINDS[name].stamped and sys.platform == "linux":
        assert np.all((heard.read_s - heard.arrival_s)[late_s > 10.0] > 9.0)


@pytest.mark.parametrize("name", ["timestamps and stamps", "timestamps without stamps"])
def test_times_of_old_servers_too(slept: dict[str, Heard], name: str) -> None:
    """Their clock begins with their frames: what it is ahead of ours is the same before, in and after the sleep."""
    heard = slept[name]
    ahead_s = (heard.host_s - heard.device_s)[int(RATE_HZ) :]  # by then a quick packet has come
    known = np.isfinite(ahead_s)
    assert np.abs(ahead_s[known] - np.median(ahead_s[known])).max() < 0.005
    waited_s = heard.read_s[int(RATE_HZ) :] - heard.host_s[int(RATE_HZ) :]
    assert np.count_nonzero(waited_s > 10.0) > 100


def test_times_that_nothing_tells_are_said_to_be_unknown(slept: dict[str, Heard]) -> None:
    heard = slept["neither clock nor stamps"]
    unknown = np.isnan(heard.host_s)
    asleep = int(np.argmax(np.diff(heard.read_s))) + 1
    assert unknown[asleep : asleep + 100].all()
    assert np.all((heard.read_s - heard.host_s)[~unknown] < 0.5)
    assert not unknown[: int(RATE_HZ)].all()
    assert f"{heard.health.untimed} of unknown time" in heard.health.heard
    assert heard.woken.level is Level.WARNING
