"""Time without frames, at every rate, with the clocks of real devices."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from core.frames import Standstill
from core.takes.holes import LEAST_HOLE_S, NO_HOLES, Holes, hole_words, holes_of, is_hole

RATES = (30.0, 59.94, 100.0, 120.0, 240.0, 480.0, 960.0)


def steady(rate_hz, seconds, start_s=0.0):
    return start_s + np.arange(round(seconds * rate_hz)) / rate_hz


def without(times_s, from_s, to_s):
    return times_s[(times_s < from_s) | (times_s >= to_s)]


@pytest.mark.parametrize("rate", RATES)
@pytest.mark.parametrize("stated", [True, False])
def test_a_silence_is_as_long_as_it_was(rate, stated):
    times = without(steady(rate, 47.0), 5.0, 39.4)
    holes = holes_of(times, rate if stated else float("nan"))
    assert len(holes) == 1
    assert holes.seconds == pytest.approx(34.4, abs=2.0 / rate)
    assert holes.missing == pytest.approx(34.4 * rate, abs=2.0)
    assert holes.from_s[0] == pytest.approx(5.0, abs=2.0 / rate) and holes.to_s[0] == pytest.approx(
        39.4, abs=2.0 / rate
    )


def test_the_words():
    holes = holes_of(without(steady(100.0, 47.0), 5.0, 39.4), 100.0)
    assert holes.words == "34.4 s without frames, about 3,440"
    assert hole_words(holes, 0) == "Nothing came for 34.4 s, about 3,440 frames."
    assert NO_HOLES.words == ""


@pytest.mark.parametrize("rate", RATES)
def test_jitter_single_losses_and_a_clock_off_its_rate_are_no_holes(rate):
    random = np.random.default_rng(0)
    times = steady(rate * 0.999, 20.0) + random.uniform(-0.2, 0.2, round(20 * rate * 0.999)) / rate
    assert len(holes_of(times, rate)) == 0
    kept = random.random(len(times)) > 0.02
    kept[1:][~kept[:-1]] = True  # never two in a row
    assert len(holes_of(times[kept], rate)) == 0


@pytest.mark.parametrize("times_faster", [1.7, 2.0, 2.4, 3.5])
def test_a_server_that_comes_back_faster_stood_still_all_the_same(times_faster):
    """What comes sooner for seconds is another rate, and nothing that was held up."""
    times = np.concatenate([np.arange(600) / 100, 8.0 + np.arange(500) / (100 * times_faster)])
    holes = holes_of(times, 100.0)
    assert len(holes) == 1
    assert (holes.from_s[0], holes.to_s[0]) == (pytest.approx(6.0, abs=0.011), 8.0)


@pytest.mark.parametrize("rate", RATES)
def test_frames_held_up_that_come_in_a_burst_are_late_and_not_missing(rate):
    times = steady(rate, 10.0)
    late = (times >= 4.0) & (times < 4.3)
    times[late] = 4.3 + np.arange(late.sum()) * 1e-5
    assert len(holes_of(times, rate)) == 0
    # Of a second that stood still only what comes later is there.
    times = without(times, 4.4, 5.4)
    assert holes_of(times, rate).seconds == pytest.approx(1.0, abs=2.0 / rate)


def test_silence_at_both_ends_counts_once_the_recorder_says_when_it_ran():
    times = steady(120.0, 2.0)
    assert len(holes_of(times, 120.0)) == 0
    holes = holes_of(times, 120.0, -3.0, 12.0)
    assert holes.from_s.tolist() == [-3.0, pytest.approx(2.0)] and holes.to_s.tolist() == [0.0, 12.0]
    assert holes.missing == pytest.approx(13 * 120, abs=2)
    assert len(holes_of(times, 120.0, -0.05, 2.05)) == 0  # frames on their way


def test_a_recording_without_any_frame_is_one_hole():
    holes = holes_of(np.empty(0), 120.0, 0.0, 5.0)
    assert (holes.seconds, holes.missing) == (5.0, 600)
    assert len(holes_of(np.empty(0), 120.0)) == 0
    assert holes_of(np.empty(0), float("nan"), 0.0, 5.0).words == "5.0 s without frames"


@pytest.mark.parametrize("bad", [float("nan"), float("inf"), -float("inf"), -5.0, 1e9, 7.0])
def test_one_bad_time_makes_no_hole_and_hides_none(bad):
    times = without(steady(100.0, 10.0), 6.0, 8.0)
    times[200] = bad
    holes = holes_of(times, 100.0)
    assert len(holes) == 1 and holes.seconds == pytest.approx(2.0, abs=0.02)


def test_a_clock_that_steps_back_for_good_makes_no_hole():
    times = np.concatenate([steady(100.0, 5.0, 100.0), steady(100.0, 5.0, 2.0)])
    assert len(holes_of(times, 100.0)) == 0


def test_a_clock_that_jumps_further_than_the_recording_was_long_makes_no_hole():
    times = np.concatenate([steady(100.0, 5.0), steady(100.0, 5.0, 300.0)])
    assert len(holes_of(times, 100.0)) == 1
    assert len(holes_of(times, 100.0, 0.0, 10.0)) == 0
    assert len(holes_of(np.concatenate([steady(100.0, 5.0), steady(100.0, 5.0, 3000.0)]), 100.0)) == 0


def test_holes_in_which_this_program_stood_still_are_its_own():
    times = without(without(steady(100.0, 60.0), 10.0, 20.0), 30.0, 32.0)
    holes = holes_of(times, 100.0)
    assert not holes.own.any() and not holes_of(times, 100.0).owned([Standstill(40.0, 45.0, 5.0)]).own.any()
    for standstills in (
        [Standstill(8.0, 20.0, 12.0)],  # the first two seconds waited, and were read
        [Standstill(15.0, 20.0, 5.0), Standstill(8.0, 14.9, 6.9)],
        [Standstill(8.0, 21.0, 13.0), Standstill(9.0, 12.0, 3.0)],
        [Standstill(30.5, 30.7, 0.2), Standstill(10.0, 19.0, 9.0)],
    ):
        found = holes.owned(standstills)
        assert found.own.tolist() == [True, False]
        assert hole_words(found, 0) == "Phalanx stood still here: 10.0 s without frames, about 1,000."
        assert hole_words(found, 1) == "Nothing came for 2.0 s, about 200 frames."
        assert found.standing.missing == pytest.approx(1000, abs=1)
        assert found.shifted(5.0).own.tolist() == [True, False]
        assert found.within(25.0, 60.0).own.tolist() == [False]
    assert holes.owned([Standstill(11.0, 13.0, 2.0)]).own.tolist() == [False, False]  # nothing came anyway


def test_asking_for_a_moment_and_a_part():
    holes = Holes(np.array([1.0, 5.0]), np.array([2.0, 9.0]), np.array([100, 400]))
    assert [holes.at(t) for t in (0.5, 1.0, 1.99, 2.0, 4.9, 6.0, 9.0)] == [None, 0, 0, None, None, 1, None]
    part = holes.within(1.5, 6.0)
    assert part.from_s.tolist() == [1.5, 5.0] and part.to_s.tolist() == [2.0, 6.0] and part.frames.tolist() == [50, 100]
    assert len(holes.within(2.5, 4.0)) == 0
    assert holes.shifted(-1.0).from_s.tolist() == [0.0, 4.0]


@given(
    rate=st.sampled_from(RATES),
    silences=st.lists(st.tuples(st.floats(0.5, 50.0), st.floats(0.12, 5.0)), max_size=4),
    noise=st.floats(0.0, 0.1),
    seed=st.integers(0, 1000),
)
def test_frames_there_and_frames_missing_are_all_frames(rate, silences, noise, seed):
    """Whatever is cut out, what is counted as missing is what was cut out."""
    every = steady(rate, 60.0)
    kept = np.ones(len(every), dtype=bool)
    for from_s, length_s in silences:
        kept &= (every < from_s) | (every >= from_s + length_s)
    kept[0] = kept[-1] = True
    jitter = np.random.default_rng(seed).uniform(-noise, noise, len(every)) / rate
    times = (every + jitter)[kept]
    cut = np.diff(np.flatnonzero(kept)) - 1
    long = (cut + 1) / rate >= max(LEAST_HOLE_S, 3.0 / rate) + 1.0 / rate
    assert is_hole(times, rate)[long].all()
    holes = holes_of(times, rate)
    assert holes.missing == pytest.approx(cut[is_hole(times, rate)].sum(), abs=len(holes))
    assert (holes.to_s > holes.from_s).all() and (np.diff(holes.from_s) > 0).all()
