"""A take takes no more memory the longer it gets, and still knows where nothing came."""

from __future__ import annotations

import math
import os
import time
import tracemalloc
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from app.process_memory import memory_of
from app.recording import Recorder
from core.cast import cast_of
from core.errors import PhalanxError
from core.frames import MarkerFrame, Times
from core.profile import load_profile
from core.takes.reader import open_take
from core.takes.take import TakeInfo
from devices.common.clock import host_clock
from tests.app.stage import until

FRAMES = 20_000


def frame(number: int, host_s: float) -> MarkerFrame:
    return MarkerFrame(number, Times(host_s, host_s, host_s), np.zeros((1, 3)), np.array([1]), np.zeros(1))


def feed(recorder: Recorder, first: int, began_s: float, n: int = FRAMES) -> None:
    """So many frames at 836 Hz, each of which is on the disk afterwards."""
    for number in range(first, first + n):
        while recorder.numbers().queue_depth > 1000:
            time.sleep(0.01)
        recorder.raw("", frame(number, began_s + number / 836.0))
        recorder.unsolved("not asked for")
    while recorder.numbers().written < first + n:
        time.sleep(0.01)


def test_memory_does_not_grow_with_the_frames_of_a_take(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "long.mcap", TakeInfo("long", rate_hz=836.0), cast_of(load_profile("han19")))
    began_s = host_clock()
    tracemalloc.start()
    try:
        feed(recorder, 0, began_s)
        before, _ = tracemalloc.get_traced_memory()
        feed(recorder, FRAMES, began_s)
        after, _ = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
        recorder.stop().result(120.0)
    assert after - before < 2 * FRAMES, f"{after - before} bytes more after {FRAMES} frames more"  # a time is 8 bytes


def test_what_a_take_says_of_time_without_frames_is_what_its_file_says(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "hole.mcap", TakeInfo("hole", rate_hz=100.0), cast_of(load_profile("han19")))
    began_s = host_clock()
    for number in range(100):
        recorder.raw("", frame(number, began_s + number / 100.0 + (3.0 if number >= 50 else 0.0)))
        recorder.unsolved("not asked for")
    summary = recorder.stop().result(120.0)
    with open_take(summary.path) as take:
        assert summary.sealed and len(summary.holes) == 1 and summary.holes.words == take.holes.words
        assert summary.holes.from_s == pytest.approx(take.holes.from_s)
        assert summary.verdict == take.verdict


def test_frames_of_unknown_time_are_counted_and_marks_stay_where_they_were_set(tmp_path: Path) -> None:
    """The first frames came while the clock could not be trusted: the take begins with them all the same."""
    recorder = Recorder(tmp_path / "asleep.mcap", TakeInfo("asleep", rate_hz=100.0), cast_of(load_profile("han19")))
    began_s = host_clock() - 2.0
    for number in range(200):
        known = frame(number, began_s + number / 100.0)
        recorder.raw("", known if number >= 100 else replace(known, times=replace(known.times, host_s=math.nan)))
        recorder.unsolved("not asked for")
    until(lambda: recorder.numbers().written == 200, "the frames to be written")
    mark = recorder.mark("now")
    assert 2.0 <= mark.time_s < 10.0
    summary = recorder.stop().result(120.0)
    assert summary.sealed and summary.untimed == 100 and not summary.verdict.whole
    assert "100 of unknown time" in summary.verdict.headline
    with open_take(summary.path) as take:
        assert take.verdict == summary.verdict and take.counts.untimed == 100
        assert take.marks == (mark,) and take.raw.times_s[100] == pytest.approx(1.0)


def test_a_take_that_cannot_be_sealed_says_the_silences_that_were_heard(tmp_path: Path) -> None:
    path = tmp_path / "unsealed.mcap"
    recorder = Recorder(path, TakeInfo("unsealed", rate_hz=100.0), cast_of(load_profile("han19")))
    recorder.raw("", frame(0, host_clock()))
    recorder.unsolved("not asked for")
    time.sleep(0.7)
    recorder.raw("", frame(1, host_clock()))
    recorder.unsolved("not asked for")
    path.with_name(path.name + ".sealing").mkdir()  # the sealed copy has no place
    summary = recorder.stop().result(120.0)
    assert not summary.sealed
    assert len(summary.holes) == 1 and 0.6 < summary.holes.seconds < 5.0 and summary.holes.missing > 50
    assert summary.holes.from_s[0] == pytest.approx(0.0, abs=0.1)


def test_the_memory_of_a_process_is_told_or_the_reason_why_not() -> None:
    memory = memory_of(os.getpid())
    assert 0 < memory.own <= memory.resident
    with pytest.raises(PhalanxError, match="cannot be read"):
        memory_of(2**31 - 1)
