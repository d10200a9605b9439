"""What an error of measures and marker places makes of angles."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from app.reconstruction.known_hands import made
from core.calibration.carried import Carrier
from core.frames import FloatArray
from core.hand.model import template
from core.hand.poses import pose as posture
from core.hand.shape import N_SHAPE, HandShape
from core.hand.skeleton import N_DOFS, N_ROOT_DOFS
from core.kinematics.forward import markers_world
from core.kinematics.solver import HandPose
from core.profile import Profile
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
