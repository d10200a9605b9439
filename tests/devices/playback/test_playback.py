"""A recording as a device."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace

import numpy as np
import pytest

from core.errors import DeviceError
from core.frames import MarkerFrame, Times
from core.streams import StreamInfo
from devices.device import Level
from devices.playback.client import PlaybackDevice
from devices.playback.timeline import Track
from tests.devices.natnet.streams import make_frames


def playback(
    frames: Iterable[MarkerFrame] | Callable[[], Iterable[MarkerFrame]], rate_hz: float, name: str = "",
    **settings: object,
) -> PlaybackDevice:  # fmt: skip
    """A device that plays one stream of points."""
    info = StreamInfo("markers", "natnet", "Motive", "markers", rate_hz, ids="sight", quality="residual")
    return PlaybackDevice([Track(info, frames)], name, **settings)


def play(device: PlaybackDevice, at_most: int = 10**9) -> list[MarkerFrame]:
    got: list[MarkerFrame] = []
    while not device.finished and len(got) < at_most:
        sample = device.read(0.1)
        if sample is not None:
            assert sample.stream == "markers"
            got.append(sample.frame)
    return got


def test_every_frame_once_in_order_never_early() -> None:
    frames = make_frames(60)
    device = playback(frames, 300.0, "take 1")
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
    # At the recording's own times (120 Hz), which its stated rate does not change.
    host = np.array([frame.times.host_s for frame in got])
    arrival = np.array([frame.times.arrival_s for frame in got])
    assert np.abs(host - host[0] - np.arange(60) / 120.0).max() < 1e-6
    assert (arrival - host[0] >= np.arange(60) / 120.0 - 1e-6).all()
    health = device.health()
    assert (health.received, health.lost) == (60, 0)
    assert health.level is Level.IDLE
    assert "take 1 was played to its end" in health.reason
    device.close()
    device.close()
    assert device.health().reason == "take 1 was played to its end."


def test_speed() -> None:
    device = playback(make_frames(30), 100.0, speed=4.0)
    device.open()
    device.start()
    host = [frame.times.host_s for frame in play(device)]
    assert np.allclose(np.diff(host), 1 / 480, atol=1e-6)
    assert device.describe().rate_hz == 400.0
    assert device.describe().details["Speed"] == "4 x"


def test_loops_go_on_counting() -> None:
    frames = make_frames(10, first=100)
    device = playback(frames, 1000.0, loop=True)
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
    device = playback(make_frames(5), 1000.0)
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

    device = playback(frames, 1000.0, loop=True)
    device.open()
    device.start()
    assert len(play(device, 50)) == 50
    assert made == 51


def test_a_fault_of_the_frames_is_told_and_ends_the_playback() -> None:
    def frames() -> Iterator[MarkerFrame]:
        yield from make_frames(3)
        raise ValueError("row 4 has no numbers")

    device = playback(frames, 1000.0, "broken.csv")
    device.open()
    device.start()
    assert len(play(device)) == 3
    health = device.health()
    assert health.level is Level.PROBLEM
    assert "broken.csv could not be read on: row 4 has no numbers" in health.reason
    assert health.rejected == 1


def at(times_s: list[float]) -> list[MarkerFrame]:
    """Frames at these times of the recording's host; its device's clock is another one, and NaN at the third."""
    made = make_frames(len(times_s), points=2)
    device_s = [4000.0 + 1.0001 * t if i != 2 else float("nan") for i, t in enumerate(times_s)]
    return [replace(frame, times=Times(d, t, t + 0.004)) for frame, d, t in zip(made, device_s, times_s, strict=True)]


def test_the_recordings_own_times_are_kept() -> None:
    """Jitter, a change of rate, and half a second in which nothing came."""
    steps = [0.01, 0.011, 0.009, 0.01, 0.5, 0.01, 0.004, 0.005, 0.004, 0.0041]
    times = np.concatenate([[77.0], 77.0 + np.cumsum(steps)])
    for speed in (1.0, 5.0):
        device = playback(at(times.tolist()), 100.0, speed=speed)
        device.open()
        device.start()
        got = play(device)
        host = np.array([frame.times.host_s for frame in got])
        assert np.abs((host - host[0]) - (times - times[0]) / speed).max() < 1e-6
        device_s = [frame.times.device_s for frame in got]
        assert np.array_equal(device_s, [frame.times.device_s for frame in at(times.tolist())], equal_nan=True)
        assert all(frame.times.arrival_s >= frame.times.host_s for frame in got)


@pytest.mark.parametrize("bad", [float("nan"), -3.0, 0.0, 5e6])
def test_where_the_recording_says_no_time_its_rate_does(bad: float) -> None:
    times = [0.0, 0.02, 0.04, 0.06]
    times[2] = bad
    device = playback(at(times), 100.0, speed=2.0)
    device.open()
    device.start()
    host = [frame.times.host_s for frame in play(device)]
    assert len(host) == 4
    assert np.diff(host)[:2] == pytest.approx([0.01, 0.005], abs=1e-6)


def test_a_reader_that_stalls_gets_every_frame_with_its_own_time_and_not_all_at_once() -> None:
    device = playback([replace(f, times=Times(*[f.sequence / 200] * 3)) for f in make_frames(120)], 200.0)
    device.open()
    device.start()
    got = play(device, 5)
    time.sleep(0.3)
    got += play(device)
    assert [frame.sequence for frame in got] == list(range(120))
    host = np.array([frame.times.host_s for frame in got])
    arrival = np.array([frame.times.arrival_s for frame in got])
    assert np.abs(host - host[0] - np.arange(120) / 200).max() < 1e-6
    assert arrival[5] - host[5] > 0.25
    assert np.diff(arrival)[5:].min() >= 1 / 400 - 1e-6


def test_what_cannot_be_played() -> None:
    with pytest.raises(DeviceError, match="0 Hz cannot be played"):
        playback(make_frames(1), 0.0)
    with pytest.raises(DeviceError, match="out of range"):
        playback(make_frames(1), 100.0, speed=100.0)
    with pytest.raises(DeviceError, match="no setting 'colour'"):
        playback(make_frames(1), 100.0, colour="red")
    empty = playback([], 100.0, "empty.trc")
    with pytest.raises(DeviceError, match="not open"):
        empty.start()
    empty.open()
    with pytest.raises(DeviceError, match=r"empty\.trc has no frames"):
        empty.start()
