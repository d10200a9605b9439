from __future__ import annotations

import math
import shutil
from pathlib import Path

import pytest

from core.takes.disk import STOP_BELOW, DiskMeter, disk_state, duration_text, free_bytes, size_text

GB = 10**9


def feed(meter: DiskMeter, rates: list[float], step_s: float = 0.25) -> None:
    """A recording of one rate per second, told four times a second."""
    now, size = 100.0, 0.0
    meter.add(now, 0)
    for rate in rates:
        for _ in range(round(1 / step_s)):
            now += step_s
            size += rate * step_s
            meter.add(now, round(size))


def test_the_rate_is_the_median_of_the_last_thirty_seconds() -> None:
    meter = DiskMeter()
    assert math.isnan(meter.bytes_per_s)
    feed(meter, [5e6] * 100 + [1e6] * 20 + [0, 0, 9e9, 0] + [1e6] * 6)
    assert meter.bytes_per_s == pytest.approx(1e6)


def test_a_new_take_begins_at_zero_again() -> None:
    meter = DiskMeter()
    feed(meter, [1e6] * 10)
    meter.add(200.0, 0)
    meter.add(201.0, 1_000_000)
    assert meter.bytes_per_s == pytest.approx(1e6)


def test_time_left_keeps_room_to_seal() -> None:
    # 101 GB free, 20 GB recorded: sealing them takes 20, each byte more takes 2, 1 stays.
    state = disk_state(101 * GB, 20 * GB, 10e6)
    assert state.time_left_s == pytest.approx(80 * GB / 20e6)
    assert state.level == "good" and not state.stop
    assert state.text == "101 GB free, time for 67 min"


def test_levels() -> None:
    assert disk_state(50 * GB).level == "good" and math.isnan(disk_state(50 * GB).time_left_s)
    assert disk_state(3 * GB, 0, 2e6).level == "warning"
    assert disk_state(STOP_BELOW, 0, 2e6).level == "warning" and not disk_state(STOP_BELOW, 0, 2e6).stop
    state = disk_state(STOP_BELOW - 1, 0, 1.0)
    assert state.level == "problem" and state.stop and "free some space" in state.text


def test_free_bytes_of_a_folder_that_is_yet_to_be_made(tmp_path: Path) -> None:
    free = free_bytes(tmp_path / "a" / "b")
    assert free is not None and abs(free - shutil.disk_usage(tmp_path).free) < 2 * GB


def test_texts() -> None:
    assert [size_text(n) for n in (0, 999, 1000, 12_345_678, 2.5e12)] == ["0 B", "999 B", "1 kB", "12.3 MB", "2.5 TB"]
    assert [duration_text(s) for s in (0, 119, 600, 7200 * 2)] == ["0 s", "119 s", "10 min", "4 h"]
