"""Live streams that begin anew again and again, over real sockets: no frame of theirs is late for ever."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import pytest

from core.frames import MarkerFrame
from devices.common.clock import host_clock
from devices.natnet.client import NatNetDevice
from devices.natnet.records import FrameOfData
from devices.natnet.simulator import CLOCK_HZ, NatNetSimulator
from tests.data import case_path
from tests.devices.natnet.served import client, heard
from tests.devices.natnet.streams import PATIENCE_S, free_port, make_frames, next_frame, read_until

RATE_HZ = 300.0


class Looping(NatNetSimulator):
    """Its exposure clock begins anew with its numbers."""

    begun_s = 5000.0

    def _record(self, number: int, frame: MarkerFrame, exposed_s: float) -> FrameOfData:
        ticks = int((self.begun_s + number / self.rate_hz) * CLOCK_HZ)
        return replace(
            super()._record(number, frame, exposed_s),
            mid_exposure_ticks=ticks,
            data_received_ticks=ticks + 5000,
            transmit_ticks=ticks + 9000,
        )


class LoopingNow(Looping):
    """Its first pass is stamped rightly, the others as the first."""

    def start(self) -> None:
        self.begun_s = host_clock()
        super().start()


def numbered(numbers: Iterator[int] | list[int]) -> list[MarkerFrame]:
    return [replace(frame, sequence=n) for frame, n in zip(make_frames(300, points=3), numbers, strict=False)]


@contextmanager
def listening(server: NatNetSimulator) -> Iterator[NatNetDevice]:
    with server:
        device = client(server)
        device.open()
        device.start()
        try:
            yield device
        finally:
            device.close()


@pytest.mark.parametrize("bitstream", [(2, 9), (4, 1)])
@pytest.mark.parametrize("kind", [NatNetSimulator, Looping, LoopingNow])
@pytest.mark.parametrize("loop", [20, 240])
def test_a_loop_is_handed_on_whole(kind: type[NatNetSimulator], loop: int, bitstream: tuple[int, int]) -> None:
    sent = numbered([k % loop for k in range(300)])
    server = kind(sent, RATE_HZ, command_port=0, data_port=0, bitstream=bitstream)
    with listening(server) as device:
        got = heard(device, server)
        health = device.health()
        told = health.heard
    assert [frame.sequence for frame in got] == [frame.sequence for frame in sent]
    for received, frame in zip(got, sent, strict=True):
        assert np.array_equal(received.points_m, frame.points_m)
    assert (health.received, health.lost, health.late, health.repeated) == (300, 0, 0, 0)
    assert f"{299 // loop} times the server counted anew" in told
    host_s = np.array([frame.times.host_s for frame in got])
    # Each pass is timed as it came, and does not stand still until the clock has passed where it was.
    assert np.all(np.diff(host_s) >= 0)
    assert abs((host_s[-1] - host_s[0]) - 299 / RATE_HZ) < 0.25
    assert np.count_nonzero(np.diff(host_s) == 0) < 40


def test_frames_that_came_late_are_in_the_counts() -> None:
    numbers = [0, 1, 2, 4, 3, 5, 6, 6, 7, 10, 9, 11, *range(12, 60)]
    server = NatNetSimulator(numbered(numbers), RATE_HZ, command_port=0, data_port=0, bitstream=(2, 9))
    with listening(server) as device:
        got = heard(device, server)
        health = device.health()
    assert [frame.sequence for frame in got] == [0, 1, 2, 4, 5, 6, 7, 10, 11, *range(12, 60)]
    assert (health.lost, health.late, health.repeated) == (3, 2, 1)
    assert health.received + health.late + health.repeated == len(numbers)
    assert health.received + health.lost == 60
    assert "2 came too late; 1 came twice" in health.heard


def test_the_server_of_the_case_is_heard_to_its_end() -> None:
    program = case_path("files", "16-short-loop-of-a-live-stream", "fakesrv.py")
    port = free_port()
    server = subprocess.Popen([sys.executable, str(program), "looptick", str(port), "3"], stderr=subprocess.PIPE)
    device = NatNetDevice(command_port=port, data_port=port + 1)
    try:
        for _ in range(5):
            try:
                device.open()
                break
            except Exception:  # it is being started
                continue
        device.start()
        got = read_until(device, lambda: server.poll() is not None)
        while (frame := next_frame(device, 0.2)) is not None:
            got.append(frame)
        assert server.stderr is not None
        sent = int(server.stderr.read().split()[2])
        health = device.health()
    finally:
        device.close()
        server.kill()
        server.wait(PATIENCE_S)
    first = got[0].sequence
    assert [frame.sequence for frame in got] == [k % 120 for k in range(first, first + len(got))]
    assert len(got) + first == sent
    assert (health.lost, health.late) == (0, 0)
