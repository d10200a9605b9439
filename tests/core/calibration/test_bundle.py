from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from core.calibration.bundle import OUTLIER_SIGMAS, Bundle, Priors
from core.calibration.geometry import Estimate
from core.frames import FloatArray
from core.hand.model import template
from core.hand.shape import N_SHAPE, shaped_points, shaped_skeleton
from core.hand.skeleton import N_DOFS
from core.kinematics.forward import markers_world
from core.markers.layout import load_layout
from tests.some import some

LAYOUT = load_layout("han19")
SKELETON = template().skeleton
M = len(LAYOUT.joints)
SHOTS = 5


def _priors() -> Priors:
    marker = np.tile(np.diag([1.0, 4.0, 1.0]) / 0.005**2, (M, 1, 1))
    return Priors(np.full(N_SHAPE, 0.02), np.eye(N_SHAPE) / 0.1**2, marker, np.full(20, 0.2), np.eye(20) / 1.0**2)


def _estimate(seed: int = 0) -> Estimate:
    random = np.random.default_rng(seed)
    thetas = random.normal(0.0, 0.4, (SHOTS, N_DOFS))
    low, high = SKELETON.limits_rad.T
    thetas[:, 6:] = low + (0.2 + 0.5 * random.random((SHOTS, 20))) * (high - low)
    at = Estimate.of_poses(thetas, random.normal(0.0, 0.1, N_SHAPE), M)
    return replace(at, moved_m=random.normal(0.0, 0.004, (M, 3)))


def _bundle(at: Estimate, noise_m: float = 0.0, seed: int = 0) -> Bundle:
    """What the model at an estimate would show, a tenth of it hidden."""
    random = np.random.default_rng(seed)
    blank = Bundle(SKELETON, LAYOUT.joints, LAYOUT.positions_m, np.zeros((SHOTS, M, 3)), _priors())
    points = blank.place(at).markers_m + random.normal(0.0, noise_m, (SHOTS, M, 3))
    points[random.random((SHOTS, M)) < 0.1] = np.nan
    return Bundle(SKELETON, LAYOUT.joints, LAYOUT.positions_m, points, _priors())


def test_places_markers_where_the_shaped_hand_has_them() -> None:
    at = _estimate()
    placed = _bundle(at).place(at).markers_m
    skeleton = shaped_skeleton(SKELETON, at.shape)
    worn = shaped_points(SKELETON, at.shape, LAYOUT.joints, LAYOUT.positions_m + at.moved_m)
    for theta, markers in some(zip(at.thetas_rad, placed, strict=True)):
        np.testing.assert_allclose(markers, markers_world(skeleton, theta, LAYOUT.joints, worn), atol=1e-12)


def _moved(at: Estimate, pose: FloatArray, shared: FloatArray) -> Estimate:
    return Estimate(
        at.roots_m + pose[:, :3],
        Rotation.from_rotvec(pose[:, 3:6]).as_matrix() @ at.turns,
        at.angles_rad + pose[:, 6:],
        at.log_shape + shared[:N_SHAPE],
        at.moved_m + shared[N_SHAPE:].reshape(-1, 3),
    )


@pytest.mark.parametrize("seed", [0, 1])
def test_jacobians_are_those_of_finite_differences(seed: int) -> None:
    at, step = _estimate(seed), 1e-6
    bundle = _bundle(at)
    by_pose, by_shared = bundle.jacobians(at, bundle.place(at))
    no_pose, no_shared = np.zeros((SHOTS, N_DOFS)), np.zeros(bundle.n_shared)
    for d in range(N_DOFS):
        pose = no_pose.copy()
        pose[:, d] = step
        ahead, behind = (bundle.place(_moved(at, sign * pose, no_shared)).markers_m for sign in (1, -1))
        np.testing.assert_allclose(by_pose[..., d], (ahead - behind) / (2 * step), atol=1e-8)
    for d in range(bundle.n_shared):
        shared = no_shared.copy()
        shared[d] = step
        ahead, behind = (bundle.place(_moved(at, no_pose, sign * shared)).markers_m for sign in (1, -1))
        np.testing.assert_allclose(by_shared[..., d], (ahead - behind) / (2 * step), atol=1e-8)


def test_gradient_is_that_of_the_cost() -> None:
    """Robust weights and all priors included: half the cost's fall per step is the right side of the equations."""
    truth = _estimate()
    bundle, at = _bundle(truth, 0.002), _moved(truth, np.full((SHOTS, N_DOFS), 0.01), np.full(N_SHAPE + 3 * M, 0.002))
    sigma, step = 0.001, 1e-6
    placed = bundle.place(at)
    normal = bundle.normal_equations(at, placed, bundle.residuals_m(placed), sigma)

    def cost(pose: FloatArray, shared: FloatArray) -> float:
        there = _moved(at, pose, shared)
        return bundle.cost(there, bundle.residuals_m(bundle.place(there)), sigma)

    no_pose, no_shared = np.zeros((SHOTS, N_DOFS)), np.zeros(bundle.n_shared)
    for d in range(bundle.n_shared):
        shared = no_shared.copy()
        shared[d] = step
        slope = (cost(no_pose, shared) - cost(no_pose, -shared)) / (2 * step)
        assert normal.shared_gradient[d] == pytest.approx(-0.5 * slope, rel=1e-4, abs=1e-2)
    for d in range(N_DOFS):
        pose = no_pose.copy()
        pose[2, d] = step
        slope = (cost(pose, no_shared) - cost(-pose, no_shared)) / (2 * step)
        assert normal.pose_gradient[2, d] == pytest.approx(-0.5 * slope, rel=1e-4, abs=1e-2)


def test_eliminating_poses_solves_the_whole_system() -> None:
    """Schur complement against one dense matrix of every unknown."""
    at = _estimate()
    bundle = _bundle(at, 0.001)
    placed = bundle.place(at)
    normal = bundle.normal_equations(at, placed, bundle.residuals_m(placed), 0.001)
    poses, shared = SHOTS * N_DOFS, bundle.n_shared
    whole = np.zeros((poses + shared, poses + shared))
    for f in range(SHOTS):
        rows = slice(f * N_DOFS, (f + 1) * N_DOFS)
        whole[rows, rows] = normal.pose[f]
        whole[rows, poses:] = normal.cross[f]
        whole[poses:, rows] = normal.cross[f].T
    whole[poses:, poses:] = normal.shared
    damped = whole.copy()
    damped[np.diag_indices(len(damped))] *= 1.0 + 1e-3
    step = np.linalg.solve(damped, np.concatenate([normal.pose_gradient.ravel(), normal.shared_gradient]))
    pose_step, shared_step = normal.solved(1e-3, np.ones(shared, dtype=np.bool_))
    np.testing.assert_allclose(pose_step.ravel(), step[:poses], rtol=1e-5, atol=1e-8)
    np.testing.assert_allclose(shared_step, step[poses:], rtol=1e-5, atol=1e-8)


def test_the_cost_never_rises_and_limits_hold() -> None:
    truth = _estimate(3)
    bundle = _bundle(truth, 0.0005)
    start = Estimate.of_poses(truth.thetas_rad + 0.1, np.zeros(N_SHAPE), M)
    asked = 0

    def count() -> None:
        nonlocal asked
        asked += 1

    found, costs = bundle.solve(start, 0.001, np.ones(bundle.n_shared, dtype=np.bool_), each=count)
    assert costs == sorted(costs, reverse=True)
    assert costs[-1] < 0.2 * costs[0]
    assert asked >= len(costs) - 1
    low, high = SKELETON.limits_rad.T
    assert (found.angles_rad >= low).all()
    assert (found.angles_rad <= high).all()
    np.testing.assert_allclose(found.turns @ found.turns.swapaxes(1, 2), np.tile(np.eye(3), (SHOTS, 1, 1)), atol=1e-12)
    placed = bundle.place(found)
    assert bundle.cost(found, bundle.residuals_m(placed), 0.001) == costs[-1]


def test_what_is_not_free_stays() -> None:
    truth = _estimate(4)
    bundle, start = _bundle(truth), Estimate.of_poses(truth.thetas_rad + 0.05, np.zeros(N_SHAPE), M)
    shape_only = np.arange(bundle.n_shared) < N_SHAPE
    assert np.array_equal(bundle.solve(start, 0.001, shape_only)[0].moved_m, start.moved_m)
    poses_only, costs = bundle.solve(start, 0.001, np.zeros(bundle.n_shared, dtype=np.bool_))
    assert np.array_equal(poses_only.log_shape, start.log_shape)
    assert costs[-1] < costs[0]


def test_a_far_point_loses_its_weight() -> None:
    at = _estimate()
    bundle = _bundle(at)
    residuals = np.zeros((SHOTS, M, 3))
    residuals[0, 0, 0] = OUTLIER_SIGMAS * 0.001
    residuals[1, 0, 0] = 0.03
    weights = bundle.weights(residuals, 0.001)
    assert np.array_equal(weights[2:], bundle.seen[2:].astype(np.float64))
    assert weights[0, 0] == pytest.approx(0.25 * bundle.seen[0, 0])
    assert weights[1, 0] < 0.0015
