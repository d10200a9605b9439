from __future__ import annotations

import numpy as np
import pytest

from core.hand.model import template
from core.kinematics.forward import joints_world, markers_world
from core.kinematics.prior import (
    COUPLING_M2_PER_RAD2,
    DIP_PER_PIP,
    LEAST_RESIDUAL_RAD,
    REST_M2_PER_RAD2,
    REST_PRIOR,
    posture_prior,
)
from core.kinematics.solver import HandPose, HandSolver
from core.markers.layout import load_layout
from core.motion.library import ACTIVITIES, poses_of
from core.motion.subspace import Subspace, subspace_of
from tests.some import some

SKELETON = template().skeleton
LOW, HIGH = SKELETON.limits_rad.T


def test_rest_prior_is_a_pull_to_rest_and_a_coupling_of_end_joints() -> None:
    random = np.random.default_rng(0)
    for angles in some(random.normal(size=(10, 20))):
        off = angles - REST_PRIOR.mean_rad
        pull = REST_M2_PER_RAD2 * (angles**2).sum()
        coupling = COUPLING_M2_PER_RAD2 * sum(
            (angles[4 * g + 3] - DIP_PER_PIP * angles[4 * g + 2]) ** 2 for g in (1, 2, 3, 4)
        )
        assert off @ REST_PRIOR.precision_m2 @ off == pytest.approx(pull + coupling, rel=1e-12)


def test_posture_prior_is_the_gaussian_of_the_postures() -> None:
    random = np.random.default_rng(1)
    mixing = random.normal(size=(20, 20))
    postures = random.normal(size=(500, 20)) @ mixing
    subspace = subspace_of(postures, "any", dimensions=20)
    prior = posture_prior(subspace, noise_m=0.002)
    covariance = np.cov(postures.T) + LEAST_RESIDUAL_RAD**2 * np.eye(20)
    np.testing.assert_allclose(prior.precision_m2 @ covariance / 0.002**2, np.eye(20), atol=1e-8)
    np.testing.assert_array_equal(prior.mean_rad, postures.mean(0))
    np.testing.assert_array_equal(prior.precision_m2, prior.precision_m2.T)
    assert np.linalg.eigvalsh(prior.precision_m2)[0] > 0


def test_a_subspace_without_residuals_gives_a_prior_all_the_same() -> None:
    flat = Subspace("flat", "", np.zeros(20), np.zeros((20, 0)), np.zeros(0), np.zeros(20))
    np.testing.assert_allclose(
        posture_prior(flat, noise_m=0.001).precision_m2, (0.001 / LEAST_RESIDUAL_RAD) ** 2 * np.eye(20), atol=1e-12
    )


def held_out() -> tuple[Subspace, np.ndarray]:
    """A subspace of every activity but sign language, and the hand shapes of that."""
    known = np.stack([p.angles_rad for a in ACTIVITIES if a not in ("sign", "extreme") for p in poses_of(a)])
    return subspace_of(known, "known", variance=0.97), np.stack([p.angles_rad for p in poses_of("sign")])


def errors_m(layout_name: str, prior: object, postures: np.ndarray, noise_m: float) -> np.ndarray:
    """(n, 15) distances of the joints of the digits, solved from markers with noise, from where they are."""
    random = np.random.default_rng(0)
    layout = load_layout(layout_name)
    solver = HandSolver(SKELETON, layout) if prior is None else HandSolver(SKELETON, layout, prior)
    errors = []
    for angles in postures:
        theta = np.concatenate([np.zeros(6), np.clip(angles, LOW, HIGH)])
        targets = markers_world(SKELETON, theta, layout.joints, layout.positions_m)
        pose = HandPose.at_rest(len(targets))
        pose.theta_rad[:] = theta
        targets += random.normal(0, noise_m, targets.shape)
        solver.solve(pose, targets, np.ones(len(targets)), iterations=100, tolerance=1e-9)
        errors.append(np.linalg.norm(pose.joints_world[1:, :3, 3] - joints_world(SKELETON, theta)[1:, :3, 3], axis=1))
    return np.asarray(errors)


def test_dense_markers_are_not_bent_by_what_other_postures_did() -> None:
    """Postures the prior has never seen, 19 markers: without noise the joints are where they were to a fraction of
    a millimetre, with noise they are no worse than without this prior."""
    subspace, postures = held_out()
    prior = posture_prior(subspace)
    assert errors_m("han19", prior, postures, 0.0).mean() < 0.0004
    assert errors_m("han19", prior, postures, 0.001).mean() < 1.02 * errors_m("han19", None, postures, 0.001).mean()


def test_sparse_markers_are_completed() -> None:
    subspace, postures = held_out()
    with_prior = errors_m("schroeder8", posture_prior(subspace), postures, 0.001).mean()
    assert with_prior < 0.85 * errors_m("schroeder8", None, postures, 0.001).mean()
