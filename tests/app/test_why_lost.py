"""Why a hand is lost, in words with numbers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from app.why_lost import Missing, needed_markers, points_seen, unnamed_points, why_words
from core.frames import WHY_LOST, HandState, Times
from tests.app.hand_frames import hand_frame, sample
from tests.app.test_props_shown import with_box

LOST = hand_frame("right", state=HandState.LOST, hidden=tuple(range(19)))
SEARCHING = replace(LOST, state=HandState.SEARCHING)


def at(hand, n: int, far: int = 0):
    """A left hand that is tracked, `n` points where the right one was lost, `far` elsewhere."""
    return sample(hand_frame("left"), hand, extra_m=[*hand.markers_world_m[:n], *np.full((far, 3), 3.0)])


@pytest.mark.parametrize(
    ("why", "words"),
    [
        ("no points", "none of its markers is seen. Is the hand in view?"),
        ("too few markers", "6 of 19 markers seen, needs 12. Is the hand in view?"),
        ("out of shape", "6 points seen, but no such hand fits them. Check hand size and marker layout."),
        ("two hands alike", "left or right cannot be told yet. Open the hand and turn it a little."),
        ("left the volume", "it left the volume. Bring it back into view."),
        ("searching", "6 points are tried. Hold the hand open and relaxed."),
        ("", "show the hand open, it is found again by itself."),
    ],
)
def test_every_reason_has_its_words(why, words):
    assert why_words(replace(LOST, why=why), 6) == f"Lost: {words}"


def test_no_reason_is_left_without_words():
    told = {why_words(replace(LOST, why=why), 6) for why in WHY_LOST}
    assert len(told) == len(WHY_LOST)


def test_words_tell_how_long_and_what_has_been_lost():
    few = replace(LOST, why="too few markers")
    assert why_words(few, 6, 0.4).startswith("Lost: ")
    assert why_words(few, 6, 3.2).startswith("Lost for 3 s: 6 of 19")
    assert why_words(replace(SEARCHING, why="searching"), 30, 4.0) == (
        "Searching for 4 s: 30 points are tried, nothing fits yet. Open the hand; check hand size and layout."
    )
    scattered = why_words(few, 14)
    assert scattered == "Lost: 14 points seen, but not 12 of one hand together. Is the whole hand in view?"


def test_what_is_needed_is_what_the_search_asks_for():
    assert [needed_markers(n) for n in (6, 13, 17, 19)] == [4, 8, 11, 12]


def test_points_are_counted_where_the_hand_was_lost():
    frame, solved = at(LOST, 6, far=5)
    assert len(unnamed_points(frame, solved)) == 11
    assert points_seen(solved.hands[1], frame, solved) == 6
    assert points_seen(replace(SEARCHING, markers_world_m=LOST.markers_world_m), frame, solved) == 11
    frame, solved = at(LOST, 0, far=5)
    assert points_seen(solved.hands[1], frame, solved) == 5
    frame.points_m[-1] = np.nan
    assert points_seen(solved.hands[1], frame, solved) == 4


def test_points_of_props_are_no_hands():
    for tracked, n in ((True, 0), (False, 3)):
        frame, solved = with_box(tracked)
        assert len(unnamed_points(frame, solved)) == n


def test_time_is_counted_from_the_first_frame_without_the_hand():
    missing = Missing()
    said = []
    for i, state in enumerate([HandState.SEARCHING] * 3 + [HandState.TRACKED] + [HandState.LOST] * 4):
        solved = sample(replace(LOST, state=state), hand_frame("left"))[1]
        solved = replace(solved, times=Times(i / 2, 100 + i / 2, 100 + i / 2))
        missing.take(solved)
        said.append([missing.seconds(hand.key, solved) for hand in solved.hands])
    assert [right for right, _ in said] == [0.0, 0.5, 1.0, 0.0, 0.0, 0.5, 1.0, 1.5]
    assert {left for _, left in said} == {0.0}
    missing.forget()
    assert missing.seconds(LOST.key, solved) == 0.0
