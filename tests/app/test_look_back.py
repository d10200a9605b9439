"""The ring of the last seconds: how long, how much, whose, and what was lost meanwhile."""

from __future__ import annotations

import math
import threading
import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

from app.look_back import HEALTH_S, LOOK_BACK_S, LookBack
from core.frames import InertialFrame, MarkerFrame, Standstill, Times
from core.streams import ClockSample, StreamInfo
from devices.device import Health
from tests.some import some

CAMERAS = StreamInfo("natnet-1/markers", "natnet", "Stage", "markers", 100.0)
GLOVE = StreamInfo("playback-1/bones", "playback", "Glove", "inertial", 60.0)


def nothing_lost(key: str) -> Health:
    return Health()


class Clock:
    """Goes where it is told."""

    def __init__(self) -> None:
        self.now_s = 1000.0

    def __call__(self) -> float:
        return self.now_s


class Stage:
    """Cameras and a glove that send into a ring, one record at a time."""

    def __init__(self, **bounds: float) -> None:
        self.clock = Clock()
        self.ring = LookBack(clock=self.clock, **bounds)
        self.health = Health()
        self.number = 0

    def frame(self, points: int = 2, after_s: float = 0.01, skip: int = 0) -> MarkerFrame:
        """The next one of the cameras comes."""
        self.clock.now_s += after_s
        self.number += 1 + skip
        now_s = self.clock.now_s
        made = MarkerFrame(
            self.number, Times(math.nan, now_s - 0.004, now_s), np.zeros((points, 3)),
            np.arange(points), np.zeros(points),
        )  # fmt: skip
        self.ring.add(CAMERAS, made, lambda key: self.health)
        return made

    def bones(self) -> InertialFrame:
        """One of the glove comes at the same moment."""
        made = InertialFrame(self.number, Times(math.nan, self.clock.now_s, self.clock.now_s), ("a",), np.eye(1, 4))
        self.ring.add(GLOVE, made, nothing_lost)
        return made


def test_what_came_in_the_last_thirty_seconds_is_there_and_is_what_came() -> None:
    stage = Stage()
    sent = [stage.frame() for _ in range(4000)]
    past = stage.ring.recent()
    assert len(past.kept) == round(LOOK_BACK_S * 100) + 1
    assert all(kept.record is frame for kept, frame in zip(past.kept, sent[-len(past.kept) :], strict=True))
    assert past.begin_s == sent[-len(past.kept)].times.arrival_s and past.end_s == stage.clock.now_s
    assert stage.ring.seconds == pytest.approx(LOOK_BACK_S)
    assert past.streams == {CAMERAS.key: CAMERAS} and past.frames(CAMERAS.key) == list(sent[-len(past.kept) :])


def test_an_empty_ring_has_nothing_and_says_so() -> None:
    ring = LookBack()
    assert ring.recent().kept == () and ring.recent().streams == {}
    assert ring.seconds == 0.0 and ring.silent_s == math.inf


def test_frames_whose_times_are_no_times_stay_as_long_as_others() -> None:
    """It is this machine's clock that counts: a time that a device made up keeps nothing, and drops nothing."""
    stage = Stage()
    wild = [replace(stage.frame(), times=Times(nan, nan, nan)) for nan in (math.nan, math.inf, -1e300)]
    stage = Stage()
    for frame in wild:
        stage.clock.now_s += 1.0
        stage.ring.add(CAMERAS, frame, nothing_lost)
    assert [kept.record for kept in stage.ring.recent().kept] == wild
    stage.frame(after_s=LOOK_BACK_S + 2.5)
    assert len(stage.ring.recent().kept) == 1


@pytest.mark.parametrize("points", [0, 40, 3000])
def test_memory_is_bounded_however_fast_and_however_much_comes(points: int) -> None:
    """The bound is counted; what it counts is what Python holds, within a third."""
    most = 3_000_000
    stage = Stage(most_bytes=most)
    tracemalloc.start()
    try:
        for _ in range(max(4 * most // (1000 + 40 * points), 8)):
            stage.frame(points, after_s=1e-6)
        held, _ = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert 0.4 * most < held < 1.35 * most
    assert stage.ring.recent().kept[-1].record.sequence == stage.number


def test_a_record_that_is_larger_than_all_that_may_be_kept_is_not() -> None:
    stage = Stage(most_bytes=10_000)
    stage.frame(points=1000)
    assert stage.ring.recent().kept == ()
    small = stage.frame()
    assert [kept.record for kept in stage.ring.recent().kept] == [small]


def test_streams_share_the_ring_and_one_that_fell_out_stays_for_as_long_as_the_others_have_it() -> None:
    stage = Stage()
    bones = [(stage.frame(), stage.bones())[1] for _ in range(500)]
    last = [stage.frame() for _ in range(1000)]
    sample = ClockSample(1.0, stage.clock.now_s, 0.001)
    stage.ring.add(CAMERAS, sample, nothing_lost)
    past = stage.ring.recent()
    assert list(past.streams) == [CAMERAS.key, GLOVE.key]
    assert past.frames(GLOVE.key) == bones and past.frames(CAMERAS.key)[-1] is last[-1]
    assert past.kept[-1].record is sample
    for _ in range(2600):
        stage.frame()
    assert list(stage.ring.recent().streams) == [CAMERAS.key]


def test_what_came_before_everything_fell_silent_stays() -> None:
    """A cable falls out; whoever is to plug it in again takes his time, and asks for the seconds before."""
    stage = Stage()
    sent = [stage.frame() for _ in range(300)]
    stage.clock.now_s += 3600.0
    assert stage.ring.silent_s == 3600.0 and stage.ring.seconds == pytest.approx(2.99)
    assert stage.ring.recent().frames(CAMERAS.key) == sent
    after = stage.frame()
    assert stage.ring.recent().frames(CAMERAS.key) == [after]


def test_losses_are_those_of_the_time_that_is_kept() -> None:
    stage = Stage()
    stage.health = Health(lost=100, rejected=7, late=50, repeated=3, standstills=(Standstill(1.0, 2.0, 1.0, 100),))
    for _ in range(4000):
        stage.frame()
    stage.health = replace(
        stage.health, lost=104, rejected=9, late=51, repeated=4,
        standstills=(*stage.health.standstills, Standstill(stage.clock.now_s, stage.clock.now_s + 0.6, 0.6, 2)),
    )  # fmt: skip
    stage.frame(after_s=0.6, skip=4)
    counted = stage.ring.recent().counted(CAMERAS.key)
    assert (counted.lost, counted.rejected, counted.late, counted.repeated) == (4, 2, 1, 1)
    assert [one.lost for one in counted.standstills] == [2] and counted.unread == 2


def test_numbers_that_leap_in_playback_are_no_losses_and_losses_of_before_are_not_counted() -> None:
    stage = Stage()
    stage.frame()
    stage.frame(skip=500)  # its device says nothing of it
    assert stage.ring.recent().counted(CAMERAS.key).lost == 0
    stage = Stage()
    stage.frame()
    stage.health = Health(lost=3, late=3)
    stage.frame(after_s=LOOK_BACK_S - HEALTH_S / 2, skip=3)
    stage.frame(after_s=HEALTH_S)  # the first of them has gone, and with it the gap
    counted = stage.ring.recent().counted(CAMERAS.key)
    assert counted.lost == counted.late == 0


def test_all_frames_about_one_are_found_by_it_alone() -> None:
    stage = Stage()
    sent = [(stage.frame(), stage.bones())[0] for _ in range(200)]
    found = stage.ring.about(sent[150])
    assert found is not None
    frames, at = found
    assert frames == sent and at == 150
    assert stage.ring.about(replace(sent[150])) is None


def test_threads_that_add_and_one_that_looks_do_not_hinder_each_other() -> None:
    ring, n = LookBack(), 3000

    def send(stream: StreamInfo) -> None:
        for number in range(n):
            frame = MarkerFrame(number, Times(0.0, 0.0, 0.0), np.empty((0, 3)), np.empty(0, np.int64), np.empty(0))
            ring.add(stream, frame, nothing_lost)

    streams = [replace(CAMERAS, key=f"natnet-{i}/markers") for i in range(3)]
    threads = [threading.Thread(target=send, args=(stream,)) for stream in streams]
    for thread in threads:
        thread.start()
    seen = []
    while any(thread.is_alive() for thread in threads) or not seen:
        seen.append(ring.recent())
    for thread in threads:
        thread.join()
    for past in some([*seen, ring.recent()]):
        came = [kept.came_s for kept in past.kept]
        assert came == sorted(came)
        for key in past.streams:
            numbers = [frame.sequence for frame in past.frames(key)]
            assert numbers == list(range(len(numbers)))
    assert {key: len(ring.recent().frames(key)) for key in ring.recent().streams} == {s.key: n for s in streams}
