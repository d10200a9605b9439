"""A recording as a device."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from core.errors import DeviceError
from core.frames import MarkerFrame
from devices.device import Level
from devices.playback.client import PlaybackDevice
from tests.devices.natnet.streams import make_frames


def play(device: PlaybackDevice, at_most: int = 10**9) -> list[MarkerFrame]:
    got: list[MarkerFrame] = []
    while not device.finished and len(got) < at_most:
        frame = device.read(0.1)
        if frame is not None:
            got.append(frame)
    return got


def test_every_frame_once_in_order_never_early() -> None:
    frames = make_frames(60)
    device = PlaybackDevice(frames, 300.0, "take 1")
    device.open()
    device.start()
    got = play(device)
    assert device.read(0.0) is None
    for received, sent in zip(got, frames, strict=True):
        assert received.sequence == sent.sequence
        assert received.points_m is sent.points_m
        assert received.ids is sent.ids
        assert received.rigid_bodies is sent.rigid_bodies
        assert received.times.device_s == sent.times.device_s
        assert received.times.host_s <= received.times.arrival_s
    # Sent at the recording's rate: frame k comes no sooner than k periods after the first.
    host = np.array([frame.times.host_s for frame in got])
    arrival = np.array([frame.times.arrival_s for frame in got])
    assert (np.diff(host) > 0).all()
    assert (arrival - host[0] >= np.arange(60) / 300.0 - 1e-6).all()
    health = device.health()
    assert (health.received, health.lost) == (60, 0)
    assert health.level is Level.IDLE
    assert "take 1 was played to its end" in health.reason
    device.close()
    device.close()
    assert device.health().reason == "take 1 was played to its end."


def test_speed() -> None:
    device = PlaybackDevice(make_frames(30), 100.0, speed=4.0)
    device.open()
    device.start()
    host = [frame.times.host_s for frame in play(device)]
    assert np.diff(host).min() >= 0.0025 - 1e-9
    assert device.describe().rate_hz == 400.0
    assert device.describe().details["Speed"] == "4 x"


def test_loops_go_on_counting() -> None:
    frames = make_frames(10, first=100)
    device = PlaybackDevice(frames, 1000.0, loop=True)
    device.open()
    device.start()
    got = play(device, 35)
    assert not device.finished
    assert [frame.sequence for frame in got] == list(range(100, 135))
    assert np.allclose(np.diff([frame.times.device_s for frame in got])[[8, 10]], 1 / 120)
    assert (np.diff([frame.times.device_s for frame in got]) > 0).all()
    assert np.array_equal(got[20].points_m, frames[0].points_m)
    device.stop()
    assert device.read(0.0) is None


def test_start_begins_again() -> None:
    device = PlaybackDevice(make_frames(5), 1000.0)
    device.open()
    for _ in range(2):
        device.start()
        assert [frame.sequence for frame in play(device)] == list(range(5))
        device.stop()


def test_frames_may_be_made_one_by_one() -> None:
    made = 0

    def frames() -> Iterator[MarkerFrame]:
        nonlocal made
        for frame in make_frames(20):
            made += 1
            yield frame

    device = PlaybackDevice(frames, 1000.0, loop=True)
    device.open()
    device.start()
    assert len(play(device, 50)) == 50
    assert made == 51


def test_a_fault_of_the_frames_is_told_and_ends_the_playback() -> None:
    def frames() -> Iterator[MarkerFrame]:
        yield from make_frames(3)
        raise ValueError("row 4 has no numbers")

    device = PlaybackDevice(frames, 1000.0, "broken.csv")
    device.open()
    device.start()
    assert len(play(device)) == 3
    health = device.health()
    assert health.level is Level.PROBLEM
    assert "broken.csv could not be read on: row 4 has no numbers" in health.reason


def test_a_reader_that_stalls_gets_every_frame() -> None:
    """Nothing is dropped; the schedule moves."""
    import time

    device = PlaybackDevice(make_frames(40), 200.0)
    device.open()
    device.start()
    got = play(device, 5)
    time.sleep(0.4)
    got += play(device)
    assert [frame.sequence for frame in got] == list(range(40))


def test_what_cannot_be_played() -> None:
    with pytest.raises(DeviceError, match="0 Hz cannot be played"):
        PlaybackDevice(make_frames(1), 0.0)
    with pytest.raises(DeviceError, match="out of range"):
        PlaybackDevice(make_frames(1), 100.0, speed=100.0)
    with pytest.raises(DeviceError, match="no setting 'colour'"):
        PlaybackDevice(make_frames(1), 100.0, colour="red")
    empty = PlaybackDevice([], 100.0, "empty.trc")
    with pytest.raises(DeviceError, match="not open"):
        empty.start()
    empty.open()
    with pytest.raises(DeviceError, match=r"empty\.trc has no frames"):
        empty.start()
