import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.review.player import Player
from tests.some import some

TIMES = np.arange(101) / 100


@pytest.fixture
def player():
    return Player(TIMES)


def test_time_passes_at_the_speed_chosen(player):
    player.play()
    player.advance(0.2)
    assert (player.time_s, player.frame) == (pytest.approx(0.2), 20)
    player.set_speed(0.1)
    player.advance(0.2)
    assert player.time_s == pytest.approx(0.22)
    player.set_speed(4.0)
    player.advance(0.1)
    assert player.frame == 62
    player.pause()
    player.advance(0.1)
    assert player.frame == 62


def test_it_stops_at_the_end_and_plays_again_from_the_start(player):
    player.play()
    player.advance(5.0)
    assert (player.playing, player.frame) == (False, 100)
    player.play()
    assert (player.playing, player.frame) == (True, 0)


def test_the_loop_returns_to_the_in_point_and_loses_no_time(player):
    player.set_range(20, 40)
    player.set_loop(True)
    player.play()
    assert player.frame == 20
    player.advance(0.25)
    assert player.playing and player.time_s == pytest.approx(0.25)
    player.advance(10.0)
    assert player.playing and 20 <= player.frame <= 40


def test_playing_from_outside_the_range_begins_at_its_in_point(player):
    player.set_range(20, 40)
    player.seek_frame(90)
    player.play()
    assert player.frame == 20
    player.advance(1.0)
    assert (player.frame, player.playing) == (40, False)


def test_in_and_out_follow_the_playhead(player):
    player.seek_frame(30)
    player.set_in()
    player.seek_frame(60)
    player.set_out()
    assert (player.in_frame, player.out_frame, player.ranged) == (30, 60, True)
    player.seek_frame(80)
    player.set_in()
    assert (player.in_frame, player.out_frame) == (80, 100)
    player.seek_frame(10)
    player.set_out()
    assert (player.in_frame, player.out_frame) == (0, 10)
    player.go_to_out()
    assert player.frame == 10
    player.clear_range()
    assert not player.ranged


def test_steps_pause_and_stay_inside(player):
    player.play()
    player.step(-1)
    assert (player.frame, player.playing) == (0, False)
    player.go_to_end()
    player.step(3)
    assert player.frame == 100
    player.step(-1)
    assert player.time_s == TIMES[99]


def test_an_empty_take_does_nothing():
    player = Player()
    for do in (player.play, player.toggle, player.go_to_end, player.set_in, player.set_out, player.clear_range):
        do()
    player.step(1)
    player.seek_time(3.0)
    player.advance(1.0)
    assert (player.frame, player.time_s, player.playing) == (0, 0.0, False)


def test_a_clock_that_steps_back_stands_still():
    player = Player(np.array([0.0, 0.1, 0.05, 0.2]))
    assert player.times_s.tolist() == [0.0, 0.1, 0.1, 0.2]
    assert player.frame_at(0.15) == 2


def test_one_frame_can_be_looped_without_end():
    player = Player(np.array([1.0]))
    player.set_loop(True)
    player.play()
    player.advance(1.0)
    assert player.frame == 0


def test_every_change_is_told(player):
    told = []
    player.subscribe(lambda: told.append(player.frame))
    player.seek_frame(3)
    player.play()
    player.advance(0.01)
    player.set_loop(True)
    assert told == [3, 3, 4, 4]


MOVES = st.tuples(st.sampled_from(["seek", "step", "in", "out", "advance", "play"]), st.integers(-200, 200))


@given(st.lists(MOVES, min_size=1))
def test_whatever_is_done_it_stays_in_the_take(moves):
    player = Player(TIMES)
    for what, n in some(moves):
        {
            "seek": lambda n: player.seek_time(n / 50),
            "step": player.step,
            "in": lambda n: player.set_in(),
            "out": lambda n: player.set_out(),
            "advance": lambda n: player.advance(abs(n) / 100),
            "play": lambda n: player.toggle(),
        }[what](n)
        assert 0 <= player.in_frame <= player.out_frame <= 100
        assert 0 <= player.frame <= 100
        assert player.times_s[player.frame] <= player.time_s + 1e-9
