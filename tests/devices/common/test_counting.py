"""Rates and gaps, as every device counts them."""

from __future__ import annotations

import math
import random
import time
from dataclasses import dataclass

import pytest

from core.frames import Standstill
from devices.common.clock import StandstillWatch, host_clock, waking_clock
from devices.common.counting import Arrival, SequenceCounter
from devices.common.rate import RateMeter


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


NEXT, RESTART = Arrival.NEXT, Arrival.RESTART


def feed(counter: SequenceCounter[int], numbers, begin_s: float = 0.0, rate_hz: float = 120.0) -> list[int]:
    """Frames that are handed on of a source with these numbers, its clock by them; they arrive at its rate."""
    out = []
    for k, number in enumerate(numbers):
        ready = counter.arrived(number, number, number / rate_hz, begin_s + k / rate_hz, rate_hz)
        out += [frame for frame, _ in ready]
    return out


def test_received_and_lost_make_up_what_was_sent() -> None:
    chance = random.Random(4)
    for _ in range(50):
        counter: SequenceCounter[int] = SequenceCounter()
        kept = [n for n in range(1000) if chance.random() > 0.2]
        assert len(feed(counter, kept)) + counter.lost == kept[-1] - kept[0] + 1


def test_duplicates_and_overtaken_frames_are_not_handed_on() -> None:
    counter: SequenceCounter[int] = SequenceCounter()
    assert feed(counter, [1, 2, 2, 4, 3, 5]) == [1, 2, 4, 5]
    assert (counter.lost, counter.late, counter.repeated, counter.restarts) == (1, 1, 1, 0)


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
    counter: SequenceCounter[str] = SequenceCounter()
    for n in range(1000, 1010):
        counter.arrived("old", n, 100 + (n - 1000) / 120, n / 120, 120.0)
    assert counter.arrived("first", number, time_s, 2000 / 120, 120.0) == []  # it alone may be spoilt
    both = [("first", RESTART), ("next", NEXT)]
    assert counter.arrived("next", number + 1, time_s + 1 / 120, 2001 / 120, 120.0) == both
    assert counter.arrived("third", number + 2, time_s + 2 / 120, 2002 / 120, 120.0) == [("third", NEXT)]
    assert (counter.lost, counter.restarts) == (0, 1)


def test_an_outage_is_a_loss() -> None:
    counter: SequenceCounter[str] = SequenceCounter()
    counter.arrived("", 0, 0.0, 0.0, 120.0)
    assert counter.arrived("", 600, 5.0, 5.0, 120.0) == [("", NEXT)]
    assert counter.lost == 599


def test_a_source_without_a_clock() -> None:
    counter: SequenceCounter[int] = SequenceCounter()
    for k, n in enumerate((1, 2, 5, 5, 6)):
        counter.arrived(n, n, math.nan, k / 100, 100.0)
    assert (counter.lost, counter.repeated) == (2, 1)


def test_playback_may_jump() -> None:
    counter: SequenceCounter[int] = SequenceCounter()
    for k, n in enumerate((5, 500, 3, 3, 4)):
        assert counter.arrived(n, n, n / 120, k / 120, 120.0, live=False) == [(n, NEXT)]
    assert counter.lost == 0


def test_a_pause_of_ours_is_no_loss() -> None:
    counter: SequenceCounter[int] = SequenceCounter()
    counter.arrived(1, 1, 0.0, 0.0, 120.0)
    counter.forget()
    assert counter.arrived(700, 700, 6.0, 6.0, 120.0) == [(700, NEXT)]
    assert counter.lost == 0


def test_a_frame_that_the_restart_overtook_is_late_and_no_jump() -> None:
    counter: SequenceCounter[int] = SequenceCounter()
    assert feed(counter, [*range(118), 0, 118, 117, 1, 2, 3]) == [*range(119), 0, 1, 2, 3]
    assert (counter.lost, counter.late, counter.repeated, counter.restarts) == (0, 0, 1, 1)


def test_what_waits_for_its_successors_is_counted_when_the_stream_is_paused() -> None:
    counter: SequenceCounter[int] = SequenceCounter()
    assert feed(counter, [1, 2, 4, 3]) == [1, 2, 4]
    counter.forget()
    assert (counter.lost, counter.late) == (1, 1)


@dataclass
class Passed:
    """What became of a looping source: frames sent and received, in what order they were handed on, and its counts."""

    sent: int
    received: int
    out: list[int]
    counter: SequenceCounter[int]
    held: int


CLOCKS = ("anew", "goes on", "stands still", "none")


def looping(loop: int, rate_hz: float, clock: str, loss: float = 0.0, swaps: float = 0.0, twice: float = 0.0) -> Passed:
    """Three seconds, or three passes, of a source that numbers its frames anew every `loop` frames; on the way a share
    is lost, overtaken by one or two others, or doubled."""
    chance = random.Random(f"{loop} {rate_hz} {clock}")
    sent = max(int(3 * rate_hz), 3 * loop)
    stamps = {"anew": lambda k: 5000 + k % loop / rate_hz, "goes on": lambda k: 5000 + k / rate_hz}
    stamp = stamps.get(clock, lambda k: 7.0 if clock == "stands still" else math.nan)
    way = [k for k in range(sent) if chance.random() >= loss]
    i = 0
    while i < len(way) - 3:
        if chance.random() < swaps:
            by = chance.choice([1, 1, 2])
            way.insert(i + by, way.pop(i))
            i += by
        i += 1
    counter: SequenceCounter[int] = SequenceCounter()
    out: list[int] = []
    received, arrival_s = 0, 0.0
    for k in way:
        arrival_s = max(arrival_s, k / rate_hz + 0.2 * chance.random() / rate_hz)
        for _ in range(1 + (chance.random() < twice)):
            received += 1
            out += [f for f, _ in counter.arrived(k, k % loop, stamp(k), arrival_s, rate_hz)]
    known = counter.late + counter.repeated
    counter.forget()  # what is still held is told as well
    return Passed(sent, received, out, counter, counter.late + counter.repeated - known)


@pytest.mark.parametrize("rate_hz", [30, 120, 240, 960])
@pytest.mark.parametrize("clock", CLOCKS)
def test_every_frame_of_a_loop_is_handed_on_however_short_it_is(rate_hz: int, clock: str) -> None:
    for loop in sorted({2, 3, 5, 12, rate_hz // 10, rate_hz // 4, rate_hz // 2, rate_hz, 3 * rate_hz, 10 * rate_hz}):
        passed = looping(loop, rate_hz, clock)
        kept = passed.sent - passed.held  # the very last may wait to be told
        assert passed.held <= max(SequenceCounter.HOLD_FRAMES, SequenceCounter.HOLD_S * rate_hz + 1)
        assert passed.out == list(range(kept)), (loop, passed.counter.__dict__)
        assert passed.counter.restarts == (kept - 1) // loop


@pytest.mark.parametrize("rate_hz", [30, 120, 240, 960])
@pytest.mark.parametrize("clock", CLOCKS)
def test_loops_on_a_bad_network_are_accounted_for(rate_hz: int, clock: str) -> None:
    """Whatever arrives is handed on, late or twice; in loops longer than what may be overtaken, rightly."""
    for loop in sorted({2, 3, 5, 12, rate_hz // 10, rate_hz // 4, rate_hz // 2, rate_hz, 3 * rate_hz}):
        passed = looping(loop, rate_hz, clock, loss=0.02, swaps=0.03, twice=0.02)
        counter = passed.counter
        assert len(passed.out) + counter.late + counter.repeated + counter.spoilt == passed.received
        assert counter.late <= counter.lost
        assert len(passed.out) >= 0.85 * passed.received
        if loop >= rate_hz / 2:
            assert counter.restarts == (passed.sent - 1) // loop
            assert passed.out == sorted(passed.out)
            assert len(passed.out) + counter.lost <= passed.sent
            assert len(passed.out) + counter.lost >= passed.sent - 4 * (counter.restarts + 1)  # lost at the loop's ends


def test_a_thread_that_did_not_run_is_noticed() -> None:
    watch = StandstillWatch()
    assert watch.turn() is None
    time.sleep(0.05)
    assert watch.turn() is None
    time.sleep(0.6)
    one = watch.turn()
    assert one is not None and one.seconds >= 0.6 and abs(one.to_s - one.from_s - one.seconds) < 0.05
    time.sleep(0.6)
    watch.begin()  # it was not to run before
    assert watch.turn() is None


def test_a_machine_that_slept_is_noticed_by_a_clock_that_did_not() -> None:
    now = {"ours": 100.0, "waking": 5000.0}
    watch = StandstillWatch(lambda: now["ours"], lambda: now["waking"])
    now["ours"] += 0.125
    now["waking"] += 0.125
    assert watch.turn() is None
    now["ours"] += 0.125
    now["waking"] += 3600.125
    assert watch.turn() == Standstill(100.125, 100.25, 3600.125)
    assert watch.turn() is None


def test_both_clocks_run_alike_while_the_machine_is_awake() -> None:
    begin = host_clock(), waking_clock()
    time.sleep(0.2)
    assert host_clock() - begin[0] == pytest.approx(waking_clock() - begin[1], abs=0.02)
