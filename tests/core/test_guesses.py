"""Which angles count as guesses, by the normal equations alone."""

from __future__ import annotations

import numpy as np

from core.guesses import Guesses
from core.hand.poses import pose
from core.kinematics.solver import HandPose, HandSolver
from core.profile import load_profile
from core.track import tracking_solver

PROFILE = load_profile("han19")
NAMES = list(PROFILE.layout.marker_names)


def relaxed(solver: HandSolver) -> HandPose:
    made = HandPose.at_rest(len(solver.layout.joints))
    made.theta_rad[6:] = pose("relaxed")
    solver.place(made)
    return made


def seen_but(*hidden: str) -> np.ndarray:
    return np.array([name not in hidden for name in NAMES])


def test_nothing_is_a_guess_while_all_is_seen() -> None:
    solver = tracking_solver(PROFILE)
    assert not Guesses(solver).of(relaxed(solver), seen_but()).any()


def test_a_finger_without_its_markers_is_a_guess_and_no_other() -> None:
    solver = tracking_solver(PROFILE)
    guessed = Guesses(solver).of(relaxed(solver), seen_but("IndexMCP", "IndexPIP", "IndexTip"))
    np.testing.assert_array_equal(guessed, np.arange(20) // 4 == 1)


def test_a_marker_of_the_back_that_others_stand_in_for_makes_no_guess() -> None:
    solver = tracking_solver(PROFILE)
    assert not Guesses(solver).of(relaxed(solver), seen_but("BackHand2")).any()


def test_an_end_joint_is_a_guess_without_its_tip_while_the_thumb_is_not() -> None:
    solver = tracking_solver(PROFILE)
    guessed = Guesses(solver).of(relaxed(solver), seen_but("MiddleTip"))
    assert guessed[8 + 3]
    assert not guessed[:4].any()


def test_fingers_that_a_sparse_layout_infers_are_guesses_when_their_informants_go() -> None:
    """The ring finger of schroeder6 has no marker: it is told by its neighbours through the prior."""
    profile = load_profile("schroeder6")
    solver = tracking_solver(profile)
    seen = np.array([name not in ("middle_tip", "pinky_tip") for name in profile.layout.marker_names])
    guessed = Guesses(solver).of(relaxed(solver), seen)
    assert guessed[12:16].any()
    assert guessed[16:].any()


def test_what_is_a_guess_changes_only_with_what_is_seen() -> None:
    solver = tracking_solver(PROFILE)
    guesses = Guesses(solver)
    first = guesses.of(relaxed(solver), seen_but("IndexTip")).copy()
    fist = relaxed(solver)
    fist.theta_rad[6:] = pose("fist")
    solver.place(fist)
    np.testing.assert_array_equal(guesses.of(fist, seen_but("IndexTip")), first)
    assert not guesses.of(fist, seen_but()).any()
