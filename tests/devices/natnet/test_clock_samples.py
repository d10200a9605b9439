"""Comparisons of the server's clock with ours, handed on beside the frames; and the timecode of the frames."""

from __future__ import annotations

import time
from dataclasses import replace

import pytest

from core.frames import MarkerFrame
from core.streams import ClockSample, Sample
from devices.natnet.client import MARKERS, NatNetDevice
from devices.natnet.convert import Conversion
from devices.natnet.records import FrameOfData
from devices.natnet.simulator import NatNetSimulator
from tests.devices.natnet.served import listening, simulator
from tests.devices.natnet.streams import PATIENCE_S, make_frames, read_until
from tests.some import some


def samples(device: NatNetDevice, server: NatNetSimulator) -> list[Sample]:
    """All that comes until the last frame was sent and nothing comes any more but comparisons of the clocks."""
    got: list[Sample] = []
    quiet_s, end = time.monotonic(), time.monotonic() + PATIENCE_S
    while not server.finished or time.monotonic() - quiet_s < 0.3:
        assert time.monotonic() < end
        sample = device.read(0.1)
        if sample is not None:
            got.append(sample)
            if isinstance(sample.frame, MarkerFrame):
                quiet_s = time.monotonic()
    return got


def test_clock_samples_come_beside_frames_that_are_all_in_order() -> None:
    with simulator(make_frames(300), 200.0) as server, listening(server) as device:
        server.start()
        got = samples(device, server)
        frames = [one.frame for one in got if isinstance(one.frame, MarkerFrame)]
        clock = [one.frame for one in got if isinstance(one.frame, ClockSample)]
        (info,) = device.streams()
        health = device.health()
    assert {one.stream for one in got} == {info.key} == {MARKERS}
    assert [frame.sequence for frame in frames] == list(range(300))
    assert len(frames) + len(clock) == len(got)
    assert (health.received, health.lost) == (300, 0)
    assert len(clock) >= 6  # those of the start, closer together than the others
    # Simulator and client read one clock: what each sample says of it is true to half its round trip.
    for sample in some(clock):
        assert 0 <= sample.round_trip_s < 1.0
        assert abs(sample.device_s - sample.host_s) <= sample.round_trip_s / 2 + 1e-6
    hosts = [sample.host_s for sample in clock]
    assert hosts == sorted(hosts)


def test_none_is_handed_on_before_the_start_or_after_the_stop() -> None:
    with simulator(make_frames(2000), 200.0, loop=True) as server:
        device = NatNetDevice(**server.settings)
        device.open()
        try:
            assert device.read(0.7) is None
            device.start()
            server.start()
            read_until(device, lambda: device.health().received > 3)
            device.stop()
            assert device.read(0.7) is None
        finally:
            device.close()


def test_a_server_without_a_clock_sends_none() -> None:
    with simulator(make_frames(100), 200.0, bitstream=(2, 9)) as server, listening(server) as device:
        server.start()
        got = samples(device, server)
    assert [one.frame.sequence for one in got if isinstance(one.frame, MarkerFrame)] == list(range(100))
    assert len(got) == 100


@pytest.mark.parametrize(
    ("timecode", "said"),
    [
        (0, ""),  # none
        (0x01020304, "01:02:03:04"),
        (0x17_3B_3B_77, "23:59:59:119"),
        (0x18_00_00_00, ""),  # no hour
        (0x00_3C_00_00, ""),
        (0x00_00_00_78, ""),
        (0xFFFFFFFF, ""),
    ],
)
def test_timecode(timecode: int, said: str) -> None:
    frame = FrameOfData(1, timecode=timecode)
    assert Conversion().frame(frame, make_frames(1)[0].times, {}).timecode == said


def test_timecode_goes_over_the_wire() -> None:
    frames = [replace(frame, timecode=f"10:20:30:{frame.sequence:02}") for frame in make_frames(20)]
    frames[4] = replace(frames[4], timecode="")
    with simulator(frames, 200.0) as server, listening(server) as device:
        server.start()
        got = read_until(device, lambda: device.health().received == 20)
    assert [frame.timecode for frame in got] == [frame.timecode for frame in frames]
