"""What the standard deviations of a hand rest on, where the truth is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from core.doubt import UNLIKE, Doubt, placement_m
from core.guesses import POINT_NOISE_M
from core.hand.shape import HandShape
from core.kinematics.prior import MotionPrior
from core.kinematics.solver import HandPose, spread_m
from core.profile import Profile, load_profile
from core.track import tracking_solver

HAN19 = load_profile("han19")
NONE = np.zeros(20, dtype=np.bool_)
EXPECTED = MotionPrior(np.zeros(20), np.zeros(20))
STILL = np.zeros(20)


def posture(usual: float, seed: int) -> np.ndarray:
    """(26,): drawn from the posture prior, so many times as far from its mean as it says."""
    prior = tracking_solver(HAN19).prior
    away = np.linalg.cholesky(np.linalg.inv(prior.precision_m2)) @ np.random.default_rng(seed).normal(size=20)
    low, high = HAN19.hand.skeleton.limits_rad.T
    return np.concatenate([np.zeros(6), np.clip(prior.mean_rad + usual * POINT_NOISE_M * away, low, high)])


def followed(
    noise_m: float, seen: np.ndarray, frames: int = 300, usual: float = 1.0, seed: int = 0
) -> tuple[Doubt, np.ndarray]:
    """A hand whose points are off by `noise_m` per axis, and ratios (frames, 20) of true errors to stated ones."""
    solver, random = tracking_solver(HAN19), np.random.default_rng(seed)
    doubt, ratios = Doubt(solver, 0.0), []
    pose = HandPose.at_rest(19)
    for i in range(frames):
        theta = posture(usual, seed + i // 10)
        truth = HandPose.at_rest(19)
        truth.theta_rad[:] = theta
        solver.place(truth)
        targets = truth.markers_world_m + random.normal(0.0, noise_m, (19, 3))
        pose.theta_rad[:] = theta
        solver.solve(pose, targets, seen.astype(np.float64), iterations=20)
        theta_std, _ = doubt.of(pose, targets, seen, NONE, EXPECTED, STILL, STILL)
        ratios.append((pose.theta_rad - theta)[6:] / theta_std[6:])
        doubt.learn()
    return doubt, np.array(ratios)


@pytest.mark.parametrize("noise_m", [0.0003, 0.001])
@pytest.mark.parametrize("n", [19, 13])
def test_noise_is_found_however_few_markers_are_seen(noise_m: float, n: int) -> None:
    """The distances from the fit alone would be a third too small with 13 of them."""
    seen = np.zeros(19, dtype=np.bool_)
    seen[np.random.default_rng(1).permutation(19)[:n]] = True
    doubt, ratios = followed(noise_m, seen)
    assert doubt.noise_m == pytest.approx(noise_m, rel=0.2)
    settled = np.abs(ratios[100:])
    assert 0.93 < (settled < 2.0).mean() < 0.99
    assert np.sqrt(np.square(settled).mean()) == pytest.approx(1.0, abs=0.2)


def hidden_index_std(doubt: Doubt) -> np.ndarray:
    """(4,) [rad]: how sure this one is of the angles of an index finger of which nothing but postures tells."""
    pose = HandPose.at_rest(19)
    pose.theta_rad[6:] = tracking_solver(HAN19).prior.mean_rad
    tracking_solver(HAN19).place(pose)
    seen = ~np.isin(HAN19.layout.joints, [4, 5, 6])
    return doubt.of(pose, pose.markers_world_m.copy(), seen, NONE, EXPECTED, STILL, STILL)[0][10:14]


def test_unusual_postures_are_less_sure_and_calm_ones_no_surer() -> None:
    every = np.ones(19, dtype=np.bool_)
    calm, usual, unusual = (followed(POINT_NOISE_M, every, usual=times)[0] for times in (0.2, 1.0, 2.0))
    fresh = hidden_index_std(Doubt(tracking_solver(HAN19), 0.0))
    assert (hidden_index_std(calm) > 0.99 * fresh).all()
    assert (hidden_index_std(usual) < 1.3 * fresh).all()
    assert (hidden_index_std(unusual) > 1.3 * fresh).all()
    assert calm.unusual == 1.0 and usual.unusual < 1.3 < unusual.unusual


def still_hand(doubt: Doubt, pose: HandPose, targets: np.ndarray, frames: int = 1) -> tuple[np.ndarray, np.ndarray]:
    for _ in range(frames):
        told = doubt.of(pose, targets, np.ones(19, dtype=np.bool_), NONE, EXPECTED, STILL, STILL)
        doubt.learn()
    return told


def test_a_wrong_name_makes_its_frame_unsure_at_once() -> None:
    solver = tracking_solver(HAN19)
    doubt, pose = Doubt(solver, 0.0), HandPose.at_rest(19)
    pose.theta_rad[:] = posture(1.0, 3)
    solver.place(pose)
    targets = pose.markers_world_m + np.random.default_rng(3).normal(0.0, 0.0004, (19, 3))
    solver.solve(pose, targets, np.ones(19), iterations=20)
    usual, _ = still_hand(doubt, pose, targets, 50)
    wrong = targets.copy()
    wrong[[5, 8]] = wrong[[8, 5]]
    solver.solve(pose, wrong, np.ones(19), iterations=20)
    unsure, _ = doubt.of(pose, wrong, np.ones(19, dtype=np.bool_), NONE, EXPECTED, STILL, STILL)
    more = unsure[6:] / usual[6:]
    assert more.min() > 2.0 and np.median(more) > 4.0


@pytest.mark.parametrize("speed_radps", [0.0, 3.0])
def test_a_held_angle_is_no_surer_than_when_it_was_seen(speed_radps: float) -> None:
    """Known to 2 degrees, hidden for a millisecond: it is not known to a hundredth."""
    solver = tracking_solver(HAN19)
    doubt, pose = Doubt(solver, 0.0), HandPose.at_rest(19)
    pose.theta_rad[:] = posture(0.5, 3)
    solver.place(pose)
    targets = pose.markers_world_m.copy()
    index = slice(10, 14)
    speed = np.full(20, speed_radps)
    doubt.of(pose, targets, np.ones(19, dtype=np.bool_), NONE, EXPECTED, STILL, speed)
    doubt.learn()
    seen = ~np.isin(HAN19.layout.joints, [4, 5, 6])
    guessed = np.zeros(20, dtype=np.bool_)
    guessed[4:8] = True
    last = still_hand(Doubt(solver, 0.0), pose, targets)[0][index]
    for unseen_s in (0.001, 0.02, 0.1, 0.4):
        stiffness = np.where(guessed, np.square(POINT_NOISE_M / (1.5 * unseen_s**1.5)), 0.0)
        motion = MotionPrior(pose.theta_rad[6:].copy(), stiffness)
        std, _ = doubt.of(pose, targets, seen, guessed, motion, np.full(20, unseen_s), STILL)
        assert (std[index] > 0.8 * last).all()
        if unseen_s > 0.05:
            assert (std[index] > last).all() and (std[index] > 1.3 * last).any()
        last = std[index]


def test_an_angle_that_only_postures_tell_of_is_less_sure_than_postures_say() -> None:
    """Hidden for so long that where it was last seen tells nothing; angles that are seen are as sure as ever."""
    solver, pose = tracking_solver(HAN19), HandPose.at_rest(19)
    pose.theta_rad[6:] = solver.prior.mean_rad
    solver.place(pose)
    targets, seen, guessed = pose.markers_world_m.copy(), np.ones(19, dtype=np.bool_), NONE.copy()
    seen[[i for i, joint in enumerate(HAN19.layout.joints) if 4 <= joint <= 6]] = False  # of the index finger
    guessed[4:8] = True
    lost = MotionPrior(pose.theta_rad[6:].copy(), np.where(guessed, 1e-12, 0.0))
    plain, less = Doubt(solver, 0.0), Doubt(solver, 0.0)
    told, _ = plain.of(pose, targets, seen, NONE, lost, STILL, STILL)
    found, _ = less.of(pose, targets, seen, guessed, lost, np.full(20, 100.0), STILL)
    np.testing.assert_allclose(found[10:14], UNLIKE * told[10:14], rtol=1e-3)
    others = np.r_[0:10, 14:26]
    np.testing.assert_allclose(found[others], told[others], rtol=1e-6)


def test_markers_are_placed_by_eye_until_they_are_seen() -> None:
    by_eye_m = placement_m(HAN19)
    assert by_eye_m == pytest.approx(0.0052, abs=1e-5)
    solver = tracking_solver(HAN19)
    known, unknown, pose = Doubt(solver, 0.0), Doubt(solver, by_eye_m), HandPose.at_rest(19)
    solver.place(pose)
    targets, seen = pose.markers_world_m.copy(), np.arange(19) != 6

    def cov(doubt: Doubt) -> np.ndarray:
        return doubt.of(pose, targets, seen, NONE, EXPECTED, STILL, STILL)[1]

    np.testing.assert_allclose(cov(unknown)[6] - cov(known)[6], by_eye_m**2 * np.eye(3), rtol=1e-9, atol=1e-15)
    np.testing.assert_array_equal(cov(unknown)[seen], cov(known)[seen])
    for _ in range(100):
        unknown.placed(np.ones(19, dtype=np.bool_), 0.03)
    assert spread_m(cov(unknown))[6] == pytest.approx(spread_m(cov(known))[6], rel=0.1)
    unknown.begin()
    assert spread_m(cov(unknown))[6] > by_eye_m


def test_calibrated_markers_are_known() -> None:
    moved = replace(HAN19.layout, positions_m=HAN19.layout.positions_m + 0.001)
    calibrated = replace(HAN19, layout=moved, shape=HandShape.uniform(1.05))
    assert placement_m(calibrated) == 0.0
    measured: Profile = replace(HAN19, shape=HandShape.uniform(1.05))  # its size by a tape, its markers by eye
    assert placement_m(measured) > 0.0
    assert placement_m(replace(HAN19, layout=moved)) > 0.0  # a layout of one's own on nobody's hand
