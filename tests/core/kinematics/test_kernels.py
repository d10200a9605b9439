"""The compiled kernels against finite differences, a slow reference, and what must always hold."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from core.hand.model import template
from core.hand.skeleton import JOINT_PARENTS
from core.kinematics import kernels
from core.kinematics.forward import joints_world, markers_world, rest_offsets
from core.kinematics.prior import COUPLING_M2_PER_RAD2, DIP_PER_PIP, REST_M2_PER_RAD2
from core.kinematics.solver import HandPose, HandSolver
from core.markers.layout import load_layout
from core.motion.subspace import subspace_of
from tests.some import some

SKELETON = template().skeleton
LAYOUT = load_layout("han19")


def random_theta(random: np.random.Generator) -> np.ndarray:
    low, high = SKELETON.limits_rad.T
    return np.concatenate([random.normal(size=3), random.normal(size=3), random.uniform(low, high)])


@pytest.mark.parametrize("seed", range(20))
def test_rotation_vector_round_trip_and_agreement_with_scipy(seed: int) -> None:
    random = np.random.default_rng(seed)
    vector = random.normal(size=3)
    vector *= [1e-9, 1e-3, 1.0, np.pi - 1e-7, np.pi - 1e-3][seed % 5] / np.linalg.norm(vector)
    matrix, back = np.empty((3, 3)), np.empty(3)
    kernels.rotation_from_vector(vector, matrix)
    np.testing.assert_allclose(matrix, Rotation.from_rotvec(vector).as_matrix(), atol=1e-14)
    kernels.vector_from_rotation(matrix, back)
    np.testing.assert_allclose(back, vector, atol=1e-9)


def test_rest_is_the_skeleton_itself() -> None:
    joints = joints_world(SKELETON, np.zeros(26))
    np.testing.assert_allclose(joints[:, :3, 3], SKELETON.joint_positions_m, atol=1e-15)
    np.testing.assert_allclose(joints[:, :3, :3], np.broadcast_to(np.eye(3), (16, 3, 3)), atol=1e-15)


@pytest.mark.parametrize("seed", range(10))
def test_bone_lengths_are_constant_and_joints_rigid(seed: int) -> None:
    joints = joints_world(SKELETON, random_theta(np.random.default_rng(seed)))
    parents = np.asarray(JOINT_PARENTS[1:])
    lengths = np.linalg.norm(joints[1:, :3, 3] - joints[parents, :3, 3], axis=1)
    np.testing.assert_allclose(lengths, SKELETON.bone_lengths_m[1:], atol=1e-14)
    np.testing.assert_allclose(
        joints[:, :3, :3] @ joints[:, :3, :3].swapaxes(1, 2), np.eye(3)[None].repeat(16, 0), atol=1e-12
    )
    np.testing.assert_allclose(np.linalg.det(joints[:, :3, :3]), 1.0, atol=1e-12)


def evaluate(
    t: np.ndarray, r: np.ndarray, angles: np.ndarray, scale: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    joint_r, joint_p, axes_w = np.empty((16, 3, 3)), np.empty((16, 3)), np.empty((20, 3))
    x = np.empty((len(LAYOUT.joints), 3))
    local = LAYOUT.positions_m - SKELETON.joint_positions_m[LAYOUT.joints]
    kernels.forward(t, r, angles, scale, rest_offsets(SKELETON), SKELETON.axes, joint_r, joint_p, axes_w)
    kernels.markers(joint_r, joint_p, scale, len(x), LAYOUT.joints, local, x)
    return x, joint_p, axes_w


@pytest.mark.parametrize("seed", range(5))
def test_jacobian_equals_finite_differences(seed: int) -> None:
    random = np.random.default_rng(seed)
    theta, scale, h = random_theta(random), 1.1, 1e-6
    root = Rotation.from_rotvec(theta[3:6])
    x, joint_p, axes_w = evaluate(theta[:3], root.as_matrix(), theta[6:], scale)
    for i, joint in some(enumerate(LAYOUT.joints)):
        row = np.empty((3, 27))
        kernels.marker_jacobian(x[i], joint, theta[:3], joint_p, axes_w, row)
        for c in range(27):
            sides = []
            for sign in (1.0, -1.0):
                step = np.zeros(27)
                step[c] = sign * h
                turned = (Rotation.from_rotvec(step[23:26]) * root).as_matrix()
                sides.append(
                    evaluate(theta[:3] + step[20:23], turned, theta[6:] + step[:20], scale * np.exp(step[26]))[0][i]
                )
            np.testing.assert_allclose(row[:, c], (sides[0] - sides[1]) / (2 * h), atol=1e-8)


@pytest.mark.parametrize("seed", range(5))
def test_normal_equations_equal_those_of_finite_differences(seed: int) -> None:
    """In angles and (eq. 4) in the coordinates of a subspace, by differences through the compiled kinematics."""
    random = np.random.default_rng(seed)
    theta, h = random_theta(random), 1e-6
    solver, pose = HandSolver(SKELETON, LAYOUT), HandPose.at_rest(19)
    low, high = SKELETON.limits_rad.T
    subspace = subspace_of(0.5 * (low + high) + 0.02 * random.normal(size=(50, 20)), "any", dimensions=6)
    alpha = random.normal(size=6) * subspace.std_rad
    theta[6:] = subspace.mean_rad + subspace.basis @ alpha  # well within the limits
    pose.theta_rad[:], pose.scale = theta, 1.1
    targets, weights = random.normal(0, 0.1, (19, 3)), random.choice([0.0, 0.5, 2.0], 19)
    solver.solve_subspace(pose, targets, weights, subspace, iterations=0)
    desk = solver._desk
    hand, space, task, work = desk._hands[0], solver._space[0], desk._tasks[0], desk._works[0]
    kernels.normal_equations(hand, task, work)
    normal = work["normal"].copy()
    kernels._hold(hand, space, work, True, True)
    kernels._project(space, work)
    projected = work["system"].copy()
    projected[range(6), range(6)] -= space["stiffness_m2"][:6]
    projected[:6, 27] += space["stiffness_m2"][:6] * work["posture"][:6]

    root = Rotation.from_rotvec(theta[3:6])
    x, _, _ = evaluate(theta[:3], root.as_matrix(), theta[6:], 1.1)
    jacobian, subspace_jacobian = np.empty((57, 27)), np.empty((57, 13))
    m = np.zeros((27, 13))
    m[:20, :6], m[20:, 6:] = subspace.basis, np.eye(7)
    for steps, out in ((np.eye(27), jacobian), (m, subspace_jacobian)):
        for c, step in enumerate(steps.T * h):
            sides = [
                evaluate(
                    theta[:3] + sign * step[20:23],
                    (Rotation.from_rotvec(sign * step[23:26]) * root).as_matrix(),
                    theta[6:] + sign * step[:20],
                    1.1 * np.exp(sign * step[26]),
                )[0]
                for sign in (1.0, -1.0)
            ]
            out[:, c] = ((sides[0] - sides[1]) / (2 * h)).ravel()
    w = np.repeat(weights, 3)
    np.testing.assert_allclose(np.triu(normal[:, :27]), np.triu(jacobian.T @ (w[:, None] * jacobian)), atol=1e-8)
    np.testing.assert_allclose(normal[:, 27], jacobian.T @ (w * (targets - x).ravel()), atol=1e-8)
    rows = np.r_[:6, 20:27]
    np.testing.assert_allclose(
        np.triu(projected[np.ix_(rows, rows)]),
        np.triu(subspace_jacobian.T @ (w[:, None] * subspace_jacobian)),
        atol=1e-8,
    )
    np.testing.assert_allclose(projected[rows, 27], subspace_jacobian.T @ (w * (targets - x).ravel()), atol=1e-8)


@pytest.mark.parametrize("seed", range(8))
def test_solver_finds_the_minimum_that_a_slow_reference_finds(seed: int) -> None:
    """scipy's trust region with bounds on the same energy, from the same start, by finite differences."""
    random = np.random.default_rng(seed)
    truth = random_theta(random)
    truth[6:] *= 0.6
    targets = markers_world(SKELETON, truth, LAYOUT.joints, LAYOUT.positions_m) + random.normal(0, 0.002, (19, 3))
    weights = (random.random(19) > 0.15).astype(float)
    start = truth + np.concatenate([random.normal(0, 0.01, 3), random.normal(0, 0.1, 23)])
    start[6:] = np.clip(start[6:], SKELETON.limits_rad[:, 0] + 1e-3, SKELETON.limits_rad[:, 1] - 1e-3)
    solver = HandSolver(SKELETON, LAYOUT)
    pose = HandPose.at_rest(19)
    pose.theta_rad[:] = start
    solver.solve(pose, targets, weights, iterations=300, tolerance=0.0)

    def residuals(theta: np.ndarray) -> np.ndarray:
        x = markers_world(SKELETON, theta, LAYOUT.joints, LAYOUT.positions_m)
        angles = theta[6:]
        rest = np.sqrt(REST_M2_PER_RAD2) * angles
        coupled = np.sqrt(COUPLING_M2_PER_RAD2) * (angles[7::4] - DIP_PER_PIP * angles[6::4])
        return np.concatenate([(np.sqrt(weights)[:, None] * (x - targets)).ravel(), rest, coupled])

    free = np.full((6, 2), [-np.inf, np.inf])
    bounds = np.vstack([free, SKELETON.limits_rad]).T
    slow = least_squares(residuals, start, bounds=bounds, xtol=1e-14, ftol=1e-14, gtol=1e-14, max_nfev=2000)
    ours = 0.5 * (residuals(pose.theta_rad) ** 2).sum()
    assert ours <= slow.cost * (1 + 1e-4)


@pytest.mark.parametrize("seed", range(10))
def test_limits_hold_and_equal_input_gives_equal_bits(seed: int) -> None:
    random = np.random.default_rng(seed)
    targets = random.normal(0, 0.1, (19, 3))  # no hand at all
    solver = HandSolver(SKELETON, LAYOUT)
    poses = [HandPose.at_rest(19) for _ in range(2)]
    for pose in poses:
        solver.solve(pose, targets, np.ones(19), free_scale=True, iterations=20)
        assert np.all(pose.theta_rad[6:] >= SKELETON.limits_rad[:, 0])
        assert np.all(pose.theta_rad[6:] <= SKELETON.limits_rad[:, 1])
        assert np.all(np.isfinite(pose.theta_rad))
    assert poses[0].theta_rad.tobytes() == poses[1].theta_rad.tobytes()
    assert poses[0].markers_world_m.tobytes() == poses[1].markers_world_m.tobytes()


def test_more_iterations_never_cost_more() -> None:
    random = np.random.default_rng(3)
    targets = markers_world(SKELETON, random_theta(random), LAYOUT.joints, LAYOUT.positions_m)
    solver, last = HandSolver(SKELETON, LAYOUT), np.inf
    for iterations in range(1, 30):
        pose = HandPose.at_rest(19)
        solver.solve(pose, targets, np.ones(19), iterations=iterations, tolerance=0.0)
        # The priors are far smaller than the first steps of the data term.
        assert pose.rms_m <= last + 1e-3
        last = pose.rms_m


def test_scale_is_found() -> None:
    theta = np.zeros(26)
    theta[6:] = 0.2
    targets = markers_world(SKELETON.scaled(1.15), theta, LAYOUT.joints, LAYOUT.positions_m * 1.15)
    pose = HandPose.at_rest(19)
    HandSolver(SKELETON, LAYOUT).solve(pose, targets, np.ones(19), free_scale=True, iterations=100, tolerance=0.0)
    assert pose.scale == pytest.approx(1.15, abs=0.01)


@pytest.mark.parametrize("seed", range(5))
def test_a_step_leads_from_one_pose_to_the_other(seed: int) -> None:
    random = np.random.default_rng(seed)
    before, after, step = random_theta(random), random_theta(random), np.empty(26)
    kernels.pose_step(before, after, step)
    moved = before.copy()
    kernels.pose_moved(moved, step)
    np.testing.assert_allclose(joints_world(SKELETON, moved), joints_world(SKELETON, after), atol=1e-9)
    turn = Rotation.from_rotvec(after[3:6]) * Rotation.from_rotvec(before[3:6]).inv()
    np.testing.assert_allclose(step[3:6], turn.as_rotvec(), atol=1e-9)
