from dataclasses import replace

import numpy as np
import pytest

from app.viewport.marker_states import GHOST_RADIUS_M, NO_DIGIT, MarkerState, hand_points_m, marker_view
from core.frames import HandState
from core.hand.skeleton import JOINT_NAMES
from tests.app.hand_frames import hand_frame, profile, sample
from tests.some import some

LAYOUT = profile().layout


def test_every_marker_and_every_point_is_shown_once():
    right, left = hand_frame("right", hidden=(3, 5)), hand_frame("left", hidden=(0,))
    near = right.markers_world_m[7] + (0, GHOST_RADIUS_M * 0.9, 0)
    frame, tracked = sample(right, left, extra_m=[near, (0, 2, 0)])
    view = marker_view(frame, tracked, LAYOUT)
    assert view.counts().tolist() == [2 * 19 - 3, 3, 1, 1]
    assert len(view.positions_m) == 2 * 19 + 2
    labelled = view.states == MarkerState.LABELLED
    for i in np.flatnonzero(labelled):
        source = tracked.hands[view.hands[i]].point[view.markers[i]]
        assert (view.positions_m[i] == frame.points_m[source]).all()
    assert view.positions_m[view.states == MarkerState.GHOST] == pytest.approx(near[None])
    assert view.markers[view.states == MarkerState.PREDICTED].tolist() == [3, 5, 0]


def test_ghosts_are_those_that_a_slow_search_finds():
    rng = np.random.default_rng(4)
    hands = hand_frame("right", hidden=(1,)), hand_frame("left")
    extra = rng.uniform((-0.3, 0.9, -0.2), (0.3, 1.2, 0.2), (200, 3))
    frame, tracked = sample(*hands, extra_m=extra)
    view = marker_view(frame, tracked, LAYOUT)
    markers = [m for hand in hands for m in hand.markers_world_m]
    expected = [min(np.linalg.norm(p - m) for m in markers) < GHOST_RADIUS_M for p in extra]
    assert (view.states[-200:] == MarkerState.GHOST).tolist() == expected
    assert 10 < sum(expected) < 190


@pytest.mark.parametrize("state", [HandState.LOST, HandState.SEARCHING])
def test_a_hand_that_is_not_tracked_names_no_marker_and_makes_no_ghost(state):
    frame, tracked = sample(hand_frame("right", state=state))
    view = marker_view(frame, tracked, LAYOUT)
    assert view.counts().tolist() == [0, 0, 19, 0]
    assert len(hand_points_m(tracked)) == 0


def test_digits_come_from_the_joint_that_carries_the_marker():
    _, tracked = sample(hand_frame("left"))
    view = marker_view(None, tracked, LAYOUT)
    for digit, joint in some(zip(view.digits, LAYOUT.joints, strict=True)):
        name = JOINT_NAMES[joint]
        assert digit == (
            NO_DIGIT if name == "wrist" else ("thumb", "index", "middle", "ring", "pinky").index(name.split("_")[0])
        )


def test_nothing_and_half_of_something_are_shown_as_they_are():
    frame, tracked = sample(hand_frame("right"))
    assert marker_view(None, None, None).counts().tolist() == [0, 0, 0, 0]
    assert marker_view(frame, None, LAYOUT).counts().tolist() == [0, 0, 19, 0]
    assert marker_view(None, tracked, None).counts().tolist() == [19, 0, 0, 0]


def test_a_source_point_that_the_frame_does_not_have_explains_nothing():
    frame, tracked = sample(hand_frame("right"))
    short = replace(frame, points_m=frame.points_m[:5], ids=frame.ids[:5], residuals_m=frame.residuals_m[:5])
    assert marker_view(short, tracked, LAYOUT).counts()[MarkerState.UNLABELLED] == 0


def test_a_marker_without_a_position_is_left_out():
    hand = hand_frame("right")
    hand.markers_world_m[4] = np.nan
    view = marker_view(None, sample(hand)[1], LAYOUT)
    assert len(view.positions_m) == 18 and 4 not in view.markers
    assert np.isfinite(hand_points_m(sample(hand)[1])).all()
