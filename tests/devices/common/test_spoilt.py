"""One packet is not believed about many: a number, a time or a rate that is spoilt once."""

from __future__ import annotations

import math

import pytest

from devices.common.counting import Arrival, SequenceCounter

RATE_HZ = 120.0
NUMBERS = (50_105, 10**9, 0, -1, -(10**6), 140, 60)
CLOCKS = ("goes on", "stands still", "none")


def time_of(clock: str, k: int) -> float:
    return {"goes on": 5000 + k / RATE_HZ, "stands still": 7.0, "none": math.nan}[clock]


def heard(counter: SequenceCounter[int], rows: list[tuple[int, int, float]], lag: int = 0) -> list[tuple[int, Arrival]]:
    """What is handed on of (frame, its number, its time), one every 1 / RATE_HZ."""
    out = []
    for k, (frame, number, time_s) in enumerate(rows):
        out += counter.arrived(frame, number, time_s, (k + lag) / RATE_HZ, RATE_HZ)
    return out


@pytest.mark.parametrize("clock", CLOCKS)
@pytest.mark.parametrize("number", NUMBERS)
def test_a_number_spoilt_once_costs_that_frame_alone(number: int, clock: str) -> None:
    counter: SequenceCounter[int] = SequenceCounter()
    rows = [(k, number if k == 105 else k, time_of(clock, k)) for k in range(100, 200)]
    assert heard(counter, rows) == [(k, Arrival.NEXT) for k in range(100, 200) if k != 105]
    assert (counter.lost, counter.restarts) == (1, 0)
    assert counter.spoilt + counter.late == 1


@pytest.mark.parametrize("time_s", [0.0, -1e9, 1e12, math.inf, 5000 + 104 / RATE_HZ - 60, 5000 + 105 / RATE_HZ + 0.58])
def test_a_time_spoilt_once_costs_that_frame_alone(time_s: float) -> None:
    counter: SequenceCounter[int] = SequenceCounter()
    rows = [(k, k, time_s if k == 105 else time_of("goes on", k)) for k in range(100, 200)]
    assert heard(counter, rows) == [(k, Arrival.NEXT) for k in range(100, 200) if k != 105]
    assert (counter.lost, counter.spoilt, counter.restarts) == (1, 1, 0)


@pytest.mark.parametrize("clock", CLOCKS)
@pytest.mark.parametrize("number", NUMBERS[:5])
def test_one_frame_too_many_costs_none(number: int, clock: str) -> None:
    counter: SequenceCounter[int] = SequenceCounter()
    rows = [(k, k, time_of(clock, k)) for k in range(100, 200)]
    rows.insert(7, (-1, number, time_of(clock, 107)))
    assert heard(counter, rows) == [(k, Arrival.NEXT) for k in range(100, 200)]
    assert (counter.lost, counter.spoilt, counter.restarts) == (0, 1, 0)


@pytest.mark.parametrize("clock", CLOCKS)
def test_several_that_do_not_bear_each_other_out(clock: str) -> None:
    counter: SequenceCounter[int] = SequenceCounter()
    wild = {105: 50_000, 106: 3, 107: 900_000}
    rows = [(k, wild.get(k, k), time_of(clock, k)) for k in range(100, 200)]
    assert [frame for frame, _ in heard(counter, rows)] == [k for k in range(100, 200) if k not in wild]
    assert (counter.lost, counter.spoilt, counter.restarts) == (3, 3, 0)


@pytest.mark.parametrize("clock", CLOCKS)
def test_a_spoilt_frame_at_a_restart_hides_no_restart(clock: str) -> None:
    counter: SequenceCounter[int] = SequenceCounter()
    rows = [(k, k, time_of(clock, k)) for k in range(500, 600)] + [(600, 77_777, time_of(clock, 600))]
    rows += [(k, k - 601, time_of(clock, k)) for k in range(601, 700)]
    out = heard(counter, rows)
    assert [frame for frame, _ in out] == [k for k in range(500, 700) if k != 600]
    assert [frame for frame, said in out if said is Arrival.RESTART] == [601]
    assert (counter.lost, counter.spoilt, counter.restarts) == (0, 1, 1)


@pytest.mark.parametrize("clock", ["goes on", "none"])
def test_a_long_loss_is_one_when_the_next_frame_says_so(clock: str) -> None:
    """Numbers that nobody bears out by the time that passed are no loss, however many frames begin there."""
    counter: SequenceCounter[int] = SequenceCounter()
    heard(counter, [(k, k, time_of(clock, k)) for k in range(100)])
    later = [(k, k, time_of(clock, k)) for k in range(700, 800)]
    assert [frame for frame, _ in heard(counter, later, lag=700)] == list(range(700, 800))
    assert (counter.lost, counter.spoilt, counter.restarts) == (600, 0, 0)
    jumped = [(k, k + 50_000, time_of(clock, k)) for k in range(800, 900)]
    out = heard(counter, jumped, lag=800)
    assert out[:2] == [(800, Arrival.RESTART), (801, Arrival.NEXT)]
    assert (counter.lost, counter.spoilt, counter.restarts) == (600, 0, 1)


def test_what_is_held_when_the_stream_is_paused_is_counted() -> None:
    counter: SequenceCounter[int] = SequenceCounter()
    assert heard(counter, [(1, 1, 0.0), (2, 2, 1 / RATE_HZ), (3, 9_000, 2 / RATE_HZ)]) == [
        (1, Arrival.NEXT),
        (2, Arrival.NEXT),
    ]
    counter.forget()
    assert (counter.lost, counter.late, counter.spoilt) == (1, 1, 0)
