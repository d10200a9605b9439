"""Rates and gaps, as every device counts them."""

from __future__ import annotations

import math
import random
import time

import pytest

from devices.stream import Arrival, RateMeter, SequenceCounter, host_clock


def test_host_clock_is_monotonic_and_fine() -> None:
    stamps = [host_clock() for _ in range(1000)]
    assert stamps == sorted(stamps)
    assert time.get_clock_info("perf_counter").resolution < 1e-5


def test_rate() -> None:
    meter = RateMeter()
    assert meter.rate_hz(0.0) == 0.0
    for i in range(500):
        meter.add(i / 120)
    assert meter.rate_hz(499 / 120) == pytest.approx(120)
    assert meter.rate_hz(499 / 120 + 2) == 0.0


def test_received_and_lost_make_up_what_was_sent() -> None:
    chance = random.Random(4)
    for _ in range(50):
        counter, got = SequenceCounter(), 0
        kept = [n for n in range(1000) if chance.random() > 0.2]
        for n in kept:
            got += counter.arrived(n, n / 120, 120.0) is Arrival.NEXT
        assert got + counter.lost == kept[-1] - kept[0] + 1


def test_duplicates_and_overtaken_frames_are_not_handed_on() -> None:
    counter = SequenceCounter()
    order = [1, 2, 2, 4, 3, 5]
    said = [counter.arrived(n, n / 120, 120.0) for n in order]
    late = Arrival.LATE
    assert said == [Arrival.NEXT, Arrival.NEXT, late, Arrival.NEXT, late, Arrival.NEXT]
    assert (counter.lost, counter.late) == (1, 2)


@pytest.mark.parametrize(
    ("number", "time_s"),
    [
        (0, 100.2),  # counts anew, clock goes on
        (0, 0.0),  # both anew
        (1200, 120.0),  # passed the last number while it was not heard
        (2000, 5.0),  # another clock
        (10**9, 101.0),  # nonsense
    ],
)
def test_a_source_started_anew_has_lost_nothing(number: int, time_s: float) -> None:
    counter = SequenceCounter()
    for n in range(1000, 1010):
        counter.arrived(n, 100 + (n - 1000) / 120, 120.0)
    assert counter.arrived(number, time_s, 120.0) is Arrival.RESTART
    assert counter.arrived(number + 1, time_s + 1 / 120, 120.0) is Arrival.NEXT
    assert counter.lost == 0


def test_an_outage_is_a_loss() -> None:
    counter = SequenceCounter()
    counter.arrived(0, 0.0, 120.0)
    assert counter.arrived(600, 5.0, 120.0) is Arrival.NEXT
    assert counter.lost == 599


def test_a_source_without_a_clock() -> None:
    counter = SequenceCounter()
    assert [counter.arrived(n, math.nan, 100.0) for n in (1, 2, 5, 5)][-1] is Arrival.LATE
    assert counter.lost == 2


def test_playback_may_jump() -> None:
    counter = SequenceCounter()
    for n in (5, 500, 3, 3, 4):
        assert counter.arrived(n, n / 120, 120.0, live=False) is Arrival.NEXT
    assert counter.lost == 0


def test_a_pause_of_ours_is_no_loss() -> None:
    counter = SequenceCounter()
    counter.arrived(1, 0.0, 120.0)
    counter.forget()
    assert counter.arrived(700, 6.0, 120.0) is Arrival.NEXT
    assert counter.lost == 0
