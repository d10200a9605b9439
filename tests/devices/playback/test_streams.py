"""A recording of several streams: each at its own times, all by one clock."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
import pytest

from core.errors import DeviceError
from core.frames import InertialFrame, Times
from core.streams import ClockSample, Record, Sample, StreamInfo
from devices.device import Level
from devices.playback.client import PlaybackDevice
from devices.playback.timeline import LONGEST_PAUSE_S, Track, timeline
from tests.core.takes.frames import bits
from tests.devices.natnet.streams import make_frames
from tests.some import some

POINTS = StreamInfo("natnet-1/markers", "natnet", "Motive 3.1", "markers", 120.0, "sight", "residual", clock_hz=1e7)
BONES = StreamInfo(
    "neuron-1/right", "neuron", "Perception Neuron", "inertial", 50.0, rotations="parent", bone_names=("a", "b"),
    sides=("right",), axes="right-handed, Y up",
)  # fmt: skip


def points(n: int, from_s: float = 100.0) -> list[Record]:
    """At 120 Hz by a host's clock that begins at from_s; the device's own is another."""
    return [
        replace(frame, times=Times(7.0 + i / 120, from_s + i / 120, from_s + i / 120 + 0.003))
        for i, frame in enumerate(make_frames(n, points=3))
    ]


def bones(n: int, from_s: float = 100.05, rate_hz: float = 50.0, first: int = 40) -> list[Record]:
    """A glove that begins later, and has no clock."""
    rng = np.random.default_rng(3)
    times = [Times(math.nan, from_s + i / rate_hz, from_s + i / rate_hz + 0.01) for i in range(n)]
    return [
        InertialFrame(first + i, one, ("a", "b"), rng.normal(size=(2, 4)), "right", positions_m=rng.normal(size=(2, 3)))
        for i, one in enumerate(times)
    ]


def played(device: PlaybackDevice, at_most: int = 10**9) -> list[Sample]:
    """What comes of a device that is open."""
    device.start()
    got: list[Sample] = []
    while not device.finished and len(got) < at_most:
        sample = device.read(0.1)
        if sample is not None:
            got.append(sample)
    return got


def of(samples: Sequence[Sample], info: StreamInfo) -> list[Record]:
    return [sample.frame for sample in samples if sample.stream == info.key]


@pytest.mark.parametrize("speed", [1.0, 4.0])
def test_every_stream_at_its_own_times_by_one_clock(speed: float) -> None:
    sent = {POINTS: points(60), BONES: bones(20)}
    device = PlaybackDevice([Track(info, records) for info, records in sent.items()], "take", speed=speed)
    assert device.streams() == ()
    device.open()
    named = device.streams()
    assert [info.key for info in named] == [POINTS.key, BONES.key]
    for info, before in zip(named, sent, strict=True):
        assert info.rate_hz == before.rate_hz * speed
        assert replace(info, kind=before.kind, title=before.title, rate_hz=before.rate_hz) == before
        assert (info.kind, info.title) == ("playback", "take")
    got = played(device)
    begins_s = []
    for info, records in sent.items():
        frames = of(got, info)
        assert len(frames) == len(records) == device.stream_health(info.key).received
        for frame, record in zip(frames, records, strict=True):
            assert bits(replace(frame, times=record.times)) == bits(record)
            assert frame.times.device_s == record.times.device_s or math.isnan(record.times.device_s)
            assert frame.times.host_s <= frame.times.arrival_s
        host_s = np.array([frame.times.host_s for frame in frames])
        own_s = np.array([record.times.host_s for record in records])
        assert np.abs((host_s - host_s[0]) - (own_s - own_s[0]) / speed).max() < 1e-6
        begins_s.append(host_s[0])
    assert begins_s[1] - begins_s[0] == pytest.approx(0.05 / speed, abs=1e-6)
    arrivals = [sample.frame.times.host_s for sample in got]
    assert arrivals == sorted(arrivals)
    assert device.health().received == 80 and device.health().lost == 0


def test_bones_come_as_they_were_sent() -> None:
    sent = bones(12)
    device = PlaybackDevice([Track(BONES, sent)])
    device.open()
    for got, frame in zip(of(played(device), BONES), some(sent), strict=True):
        assert isinstance(got, InertialFrame) and isinstance(frame, InertialFrame)
        assert (got.sequence, got.bone_names, got.side) == (frame.sequence, frame.bone_names, frame.side)
        assert got.rotations_wxyz is frame.rotations_wxyz and got.positions_m is frame.positions_m
        assert got.state is frame.state


def test_comparisons_of_clocks_come_along_by_our_clock() -> None:
    """Where each was: also one made before the frame that came before it."""
    records = points(10)
    records.insert(0, ClockSample(6.99, 99.99, 0.001))
    records.insert(5, ClockSample(7.0 + 3.1 / 120, 100 + 3.1 / 120, 0.002))
    records.insert(8, ClockSample(7.0 + 3.2 / 120, 100 + 3.2 / 120, math.nan))
    device = PlaybackDevice([Track(POINTS, records)], speed=2.0)
    device.open()
    got = of(played(device), POINTS)
    frames = [one for one in got if not isinstance(one, ClockSample)]
    samples = [one for one in got if isinstance(one, ClockSample)]
    assert len(frames) == 10 and device.health().received == 10
    at_s = np.array([one.host_s for one in samples]) - frames[0].times.host_s
    assert at_s == pytest.approx([-0.005, 3.1 / 240, 3.2 / 240], abs=1e-6)
    assert [one.device_s for one in samples] == [one.device_s for one in records if isinstance(one, ClockSample)]
    assert samples[0].round_trip_s == 0.001 and math.isnan(samples[2].round_trip_s)


def test_a_loop_goes_on_with_all_of_them_together() -> None:
    device = PlaybackDevice([Track(POINTS, points(12)), Track(BONES, lambda: iter(bones(6)))], loop=True, speed=20.0)
    device.open()
    got = played(device, 54)
    assert not device.finished
    optical, glove = of(got, POINTS), of(got, BONES)
    assert [one.sequence for one in optical] == list(range(36)) and len(glove) == 18
    assert [one.sequence for one in glove] == list(range(40, 58))
    # The later of the two ends the round: the glove, 0.05 s after the points, for 6 / 50 s.
    begins = [optical[12 * i].times for i in range(3)]
    assert np.diff([one.host_s for one in begins]) == pytest.approx([0.17 / 20] * 2, abs=1e-6)
    assert np.diff([one.device_s for one in begins]) == pytest.approx([0.17] * 2, abs=1e-9)
    lag_s = [glove[6 * i].times.host_s - optical[12 * i].times.host_s for i in range(3)]
    assert lag_s == pytest.approx([0.05 / 20] * 3, abs=1e-6)


def test_a_stream_that_is_silent_for_long_while_others_go_on_keeps_its_time() -> None:
    far_s = LONGEST_PAUSE_S + 100
    late = [*bones(2, rate_hz=50.0), *bones(2, from_s=100.05 + far_s, first=42)]
    steady = points(2) + [
        replace(frame, times=Times(i, 100.0 + i, 100.0 + i)) for i, frame in enumerate(make_frames(int(far_s) + 2), 1)
    ]
    due = list(timeline([Track(POINTS, steady), Track(BONES, late)], loop=False))
    at_s = [one.at_s for one in due if one.track.info is BONES]
    assert at_s == pytest.approx([0.05, 0.07, far_s + 0.05, far_s + 0.07])
    # Nothing of any stream for so long is a clock that jumped.
    due = list(timeline([Track(POINTS, points(2)), Track(BONES, late)], loop=False))
    assert [one.at_s for one in due] == pytest.approx([0.0, 1 / 120, 0.05, 0.07, 0.09, 0.11])


@pytest.mark.parametrize("bad", [math.nan, -50.0, 0.0])
def test_where_one_stream_has_no_time_the_other_keeps_its_own(bad: float) -> None:
    glove = bones(10)
    glove[4] = replace(glove[4], times=Times(math.nan, bad, 0.0))
    due = list(timeline([Track(POINTS, points(30)), Track(BONES, glove)], loop=False))
    assert len(due) == 40
    assert [one.at_s for one in due if one.track.info is POINTS] == pytest.approx(np.arange(30) / 120)
    at_s = [one.at_s for one in due if one.track.info is BONES]
    assert at_s[:5] == pytest.approx(0.05 + np.arange(5) / 50) and at_s == sorted(at_s)


def test_a_fault_of_one_stream_is_told_and_ends_the_playback() -> None:
    def broken() -> Iterator[Record]:
        yield from bones(2)
        raise ValueError("record 3 is damaged")

    device = PlaybackDevice([Track(POINTS, points(600)), Track(BONES, broken)], "take.mcap", speed=20.0)
    device.open()
    got = played(device)
    assert len(of(got, BONES)) == 2 and 0 < len(of(got, POINTS)) < 600
    assert device.health().level is Level.PROBLEM
    assert "take.mcap could not be read on: record 3 is damaged" in device.health().reason
    assert device.finished


def test_what_cannot_be_played() -> None:
    with pytest.raises(DeviceError, match="streams of one name"):
        PlaybackDevice([Track(POINTS, []), Track(replace(BONES, key=POINTS.key), [])], "take")
    with pytest.raises(DeviceError, match="nan Hz cannot be played"):
        PlaybackDevice([Track(POINTS, []), Track(replace(BONES, rate_hz=math.nan), [])], "take")
    for tracks in some(([], [Track(POINTS, []), Track(BONES, [])])):
        device = PlaybackDevice(tracks, "take")
        device.open()
        with pytest.raises(DeviceError, match="take has no frames"):
            device.start()
