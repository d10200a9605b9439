"""What an error of measures and marker places makes of angles."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from app.reconstruction.known_hands import made
from core.calibration.carried import Carrier, fixed_std
from core.calibration.hand import calibrate_hand
from core.frames import FloatArray
from core.hand.model import template
from core.hand.poses import pose as posture
from core.hand.shape import N_SHAPE, HandShape
from core.hand.skeleton import N_DOFS, N_ROOT_DOFS
from core.kinematics.forward import markers_world
from core.kinematics.solver import HandPose
from core.profile import Profile
from core.takes.reprocess import solve
from core.track import tracking_solver

M = 19
ANGLES = slice(N_ROOT_DOFS, N_DOFS)


def _postures() -> FloatArray:
    """Within the limits, at which the solver would hold an angle."""
    random = np.random.default_rng(0)
    thetas = np.concatenate([random.normal(0.0, 0.4, (3, 6)), np.stack([posture("relaxed")] * 3)], axis=1)
    thetas[:, 6:] += random.normal(0.0, 0.05, (3, 20))
    low, high = template().skeleton.limits_rad.T
    thetas[:, 6:] = np.clip(thetas[:, 6:], low + 0.1, high - 0.1)
    return thetas


def _solved(profile: Profile, thetas: FloatArray, scale: float, points: FloatArray, free_scale: bool) -> FloatArray:
    """(f, 27), last the logarithm of the scale."""
    solver, found = tracking_solver(profile), []
    for theta, targets in zip(thetas, points, strict=True):
        pose = HandPose.at_rest(M)
        pose.theta_rad[:], pose.scale = theta, scale
        solver.solve(pose, targets, np.ones(M), iterations=300, tolerance=1e-15, free_scale=free_scale)
        found.append([*pose.theta_rad, np.log(pose.scale)])
    return np.asarray(found)


def _with(profile: Profile, shared: int, change: float) -> Profile:
    """The profile with one of its ratios, or one coordinate of a marker's place, another."""
    if shared < N_SHAPE:
        ratios = profile.shape.ratios.copy()
        ratios[shared] *= np.exp(change)
        return replace(profile, shape=HandShape(ratios))
    places = profile.layout.positions_m.copy()
    places[divmod(shared - N_SHAPE, 3)] += change
    return replace(profile, layout=replace(profile.layout, positions_m=places))


@pytest.mark.parametrize(("scale", "free_scale"), [(1.0, False), (1.1, False), (1.0, True)])
def test_what_is_carried_is_how_the_solver_answers(scale: float, free_scale: bool) -> None:
    """Finite differences of solved poses, by measures of palm, thumb and index, a girth, and places of markers."""
    true, thetas = made(1).truth, _postures()
    points = np.stack([
        markers_world(true.hand.skeleton.scaled(scale), theta, true.layout.joints, scale * true.worn.positions_m)
        for theta in thetas
    ])  # fmt: skip
    base = _solved(true, thetas, scale, points, free_scale)
    carried = Carrier(true).carried(base[:, :N_DOFS], np.exp(base[:, N_DOFS]), np.ones((3, M)), free_scale=free_scale)
    rows = [*range(N_ROOT_DOFS, N_DOFS), *([N_DOFS] if free_scale else [])]
    step = 1e-4
    for shared in (0, 1, 4, 7, 19, N_SHAPE, N_SHAPE + 13, N_SHAPE + 41):
        ahead, behind = (
            _solved(_with(true, shared, sign * step), base[:, :N_DOFS], scale, points, free_scale) for sign in (1, -1)
        )
        slopes = (ahead - behind)[:, rows] / (2 * step)
        far = np.abs(slopes).max()
        np.testing.assert_allclose(carried[:, rows, shared], slopes, atol=0.03 * far)


def test_a_size_found_from_the_motion_takes_up_a_wrong_size() -> None:
    """Of a hand whose size alone is unknown nothing is left that would turn an angle."""
    carrier, thetas = Carrier(made(1).given), _postures()
    by_size = np.zeros(len(carrier.covariance))
    by_size[:N_SHAPE] = 0.1
    carrier.covariance = np.outer(by_size, by_size)
    carried = carrier.carried(thetas, np.ones(3), np.ones((3, M)), free_scale=True)
    alone = fixed_std(carrier.carried(thetas, np.ones(3), np.ones((3, M))), carrier.covariance)
    sized = fixed_std(carrier.carried(thetas, np.ones(3), np.ones((3, M))), carrier.sized(carried))
    assert np.degrees(alone[:, ANGLES]).max() > 5.0
    assert np.degrees(sized[:, ANGLES]).max() < 0.2


@pytest.mark.parametrize("layout", ["han19", "qualisys13"])
def test_errors_of_calibrated_angles_are_as_large_as_is_said(layout: str) -> None:
    """Of people that were made, calibrated from 15 s: angles differ from those of their own hand, solved alike, by what
    the calibration left open. Each person is one draw, so shares scatter between people."""
    within, scores = [], []
    for seed in (21, 22, 23):
        scene = made(seed, layout, swapped=0.0)
        found = calibrate_hand(scene.frames[:200], scene.given, labels=scene.labels).profile
        ours, theirs = (
            np.stack([frame.hands[0].theta_rad for frame in solve(scene.frames, profile, labels=scene.labels)])
            for profile in (found, scene.truth)
        )
        carrier = Carrier(found)
        ours, theirs = ours[::4], theirs[::4]
        carried = carrier.carried(ours, np.ones(len(ours)), np.ones((len(ours), len(found.layout.joints))))
        score = ((ours - theirs) / fixed_std(carried, carrier.covariance))[:, ANGLES]
        within.append((np.abs(score) <= 2.0).mean())
        scores.append(np.square(score).mean())
    assert np.mean(within) > 0.9
    assert 0.5 < np.sqrt(np.mean(scores)) < 1.3
