from __future__ import annotations

import math
import shutil
from pathlib import Path

import pytest

from core.takes.disk import DiskMeter, duration_text, free_bytes

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
    assert meter.bytes_per_s == 0.0
    feed(meter, [5e6] * 100 + [1e6] * 20 + [0, 0, 9e9, 0] + [1e6] * 6)
    assert meter.bytes_per_s == pytest.approx(1e6)


def test_time_left_keeps_room_to_seal() -> None:
    # 101 GB free, 20 GB recorded: sealing them takes 20, each byte more takes 2, 1 stays.
    meter = DiskMeter()
    feed(meter, [10e6] * 2000)
    assert meter.room(101 * GB) == 80 * GB
    assert meter.time_left_s(101 * GB) == pytest.approx(80 * GB / 20e6)
    assert meter.room(21 * GB) == 0 and meter.time_left_s(21 * GB) == meter.time_left_s(0) == 0.0
    assert meter.room(21 * GB - 1) < 0


def test_before_the_first_second_the_time_left_is_unknown() -> None:
    meter = DiskMeter(reserve=3 * GB)
    meter.add(5.0, 400)
    assert math.isinf(meter.time_left_s(4 * GB)) and meter.room(4 * GB) == GB - 400


def test_free_bytes_of_a_folder_that_is_yet_to_be_made(tmp_path: Path) -> None:
    free = free_bytes(tmp_path / "a" / "b")
    assert free is not None and abs(free - shutil.disk_usage(tmp_path).free) < 2 * GB


def test_durations() -> None:
    assert [duration_text(s) for s in (0, 119, 600, 7200 * 2, 3e5)] == ["0 s", "119 s", "10 min", "4 h", "3 days"]
    assert duration_text(math.inf) == "999 days"
