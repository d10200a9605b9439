"""The solver against the slow reference, and what must hold whatever it is asked."""

from __future__ import annotations

import os
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from core.errors import PhalanxError
from core.hand.model import template
from core.hand.skeleton import JOINT_PARENTS
from core.kinematics import kernels
from core.kinematics.forward import markers_world
from core.kinematics.prior import MotionPrior, posture_prior
from core.kinematics.solver import HandPose, HandSolver, solve_hands
from core.markers.layout import MarkerLayout, load_layout
from core.motion.library import LIBRARY
from core.motion.subspace import subspace_of
from tests.core.kinematics.reference import Reference
from tests.data import ROOT
from tests.some import some

SKELETON = template().skeleton
LOW, HIGH = SKELETON.limits_rad.T
POSTURES = np.stack([pose.angles_rad for pose in LIBRARY.values()])
SUBSPACE = subspace_of(POSTURES, "library", dimensions=8)
HAN19, SPARSE = load_layout("han19"), load_layout("schroeder6")


def case(seed: int, layout: MarkerLayout) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Truth, start, targets, weights."""
    random = np.random.default_rng(seed)
    truth = np.concatenate([random.normal(size=6), POSTURES[random.integers(len(POSTURES))]])
    truth[6:] = np.clip(truth[6:] + random.normal(0, 0.05, 20), LOW, HIGH)
    targets = markers_world(SKELETON, truth, layout.joints, layout.positions_m)
    targets += random.normal(0, 0.001, targets.shape)
    weights = np.where(random.random(len(targets)) < 0.15, 0.0, random.uniform(0.5, 1.5, len(targets)))
    targets[weights == 0] = np.nan  # a marker without a point may hold anything
    start = truth + np.concatenate([random.normal(0, 0.01, 3), random.normal(0, 0.15, 23)])
    return truth, start, targets, weights


def posed(theta: np.ndarray, n_markers: int, scale: float = 1.0) -> HandPose:
    pose = HandPose.at_rest(n_markers)
    pose.theta_rad[:] = theta
    pose.scale = scale
    return pose


def motion_of(seed: int) -> MotionPrior:
    random = np.random.default_rng(seed)
    return MotionPrior(random.uniform(LOW, HIGH), 1e-5 * random.random(20))


PRIORS = {"rest": None, "subspace": posture_prior(SUBSPACE)}


@pytest.mark.parametrize("layout", [HAN19, SPARSE], ids=["han19", "schroeder6"])
@pytest.mark.parametrize("prior", PRIORS)
@pytest.mark.parametrize("free_scale", [False, True], ids=["", "scale"])
@pytest.mark.parametrize("free_root", [True, False], ids=["", "root"])
@pytest.mark.parametrize("seed", range(3))
def test_equals_the_reference(layout: MarkerLayout, prior: str, free_scale: bool, free_root: bool, seed: int) -> None:
    """Step by step: after few iterations the two have taken the same way, not only found the same end."""
    _, start, targets, weights = case(seed, layout)
    options = {"free_scale": free_scale, "free_root": free_root, "iterations": 4, "tolerance": 0.0}
    arguments = () if PRIORS[prior] is None else (PRIORS[prior],)
    pose = posed(start, len(weights), 1.05)
    HandSolver(SKELETON, layout, *arguments).solve(pose, targets, weights, motion=motion_of(seed), **options)
    theta, scale = Reference(SKELETON, layout, *arguments).solve(
        start, targets, weights, scale=1.05, motion=motion_of(seed), **options
    )
    np.testing.assert_allclose(pose.theta_rad, theta, atol=1e-7)
    assert pose.scale == pytest.approx(scale, abs=1e-8)


@pytest.mark.parametrize("layout", [HAN19, SPARSE], ids=["han19", "schroeder6"])
@pytest.mark.parametrize("dimensions", [3, 5, 8])
@pytest.mark.parametrize("layered", [False, True], ids=["subspace", "layered"])
@pytest.mark.parametrize("seed", range(3))
def test_subspace_and_layers_equal_the_reference(
    layout: MarkerLayout, dimensions: int, layered: bool, seed: int
) -> None:
    _, start, targets, weights = case(seed, layout)
    subspace = SUBSPACE.truncated(dimensions)
    options = {"iterations": 4, "tolerance": 0.0, "motion": motion_of(seed), "free_scale": seed == 2}
    pose = posed(start, len(weights))
    solver = HandSolver(SKELETON, layout)
    (solver.solve_layered if layered else solver.solve_subspace)(pose, targets, weights, subspace, **options)
    theta, scale = Reference(SKELETON, layout).solve(
        start, targets, weights, subspace=subspace, layered=layered, **options
    )
    np.testing.assert_allclose(pose.theta_rad, theta, atol=1e-7)
    assert pose.scale == pytest.approx(scale, abs=1e-8)


@pytest.mark.parametrize("seed", range(10))
def test_a_subspace_of_all_dimensions_is_the_most_probable_pose(seed: int) -> None:
    """Where no angle meets a limit, the Gaussian prior in 20 coordinates of its own is the Gaussian of the angles."""
    random = np.random.default_rng(seed)
    low, high = SKELETON.limits_rad.T
    postures = 0.5 * (low + high) + 0.03 * (high - low) * random.normal(size=(200, 20))
    subspace = subspace_of(postures, "whole", dimensions=20)
    scaled = subspace.basis / subspace.std_rad
    gaussian = type(PRIORS["subspace"])(subspace.mean_rad, 0.001**2 * scaled @ scaled.T)
    truth = np.concatenate([random.normal(size=6), postures[0]])
    targets = markers_world(SKELETON, truth, SPARSE.joints, SPARSE.positions_m) + random.normal(0, 0.001, (6, 3))
    poses = [posed(truth, 6) for _ in range(2)]
    options = {"iterations": 100, "tolerance": 0.0}
    HandSolver(SKELETON, SPARSE).solve_subspace(poses[0], targets, np.ones(6), subspace, **options)
    HandSolver(SKELETON, SPARSE, gaussian).solve(poses[1], targets, np.ones(6), **options)
    np.testing.assert_allclose(poses[0].theta_rad, poses[1].theta_rad, atol=1e-6)


@pytest.mark.parametrize("seed", range(10))
def test_a_subspace_pose_is_in_the_subspace_but_for_the_limits(seed: int) -> None:
    _, start, targets, weights = case(seed, HAN19)
    pose = posed(start, 19)
    HandSolver(SKELETON, HAN19).solve_subspace(pose, targets, weights, SUBSPACE, iterations=30)
    angles = pose.theta_rad[6:]
    inside = (angles > LOW) & (angles < HIGH)
    assert inside.sum() > SUBSPACE.dimensions
    basis, off = SUBSPACE.basis[inside], (angles - SUBSPACE.mean_rad)[inside]
    alpha, *_ = np.linalg.lstsq(basis, off, rcond=None)
    np.testing.assert_allclose(basis @ alpha, off, atol=1e-9)


@pytest.mark.parametrize("seed", range(10))
def test_the_second_layer_leaves_alone_what_no_marker_speaks_of(seed: int) -> None:
    """A digit without markers keeps the posture of the subspace; the markers of the others fit no worse."""
    _, start, targets, weights = case(seed, HAN19)
    ring = (HAN19.joints - 1) // 3 == 3
    weights[ring & (HAN19.joints > 0)] = 0.0
    first, second = posed(start, 19), posed(start, 19)
    solver = HandSolver(SKELETON, HAN19)
    solver.solve_subspace(first, targets, weights, SUBSPACE, iterations=30, tolerance=0.0)
    solver.solve_layered(second, targets, weights, SUBSPACE, iterations=30, tolerance=0.0)
    np.testing.assert_allclose(second.theta_rad[18:22], first.theta_rad[18:22], atol=1e-9)
    assert second.rms_m <= first.rms_m


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    spread=st.sampled_from([1e-3, 0.1, 10.0, 1e6, 1e150, 1e300]),
    junk=st.sampled_from([0.0, np.nan, np.inf, -np.inf]),
    how=st.sampled_from(["solve", "subspace", "layered"]),
    free=st.booleans(),
)
def test_no_target_leads_beyond_the_limits(seed: int, spread: float, junk: float, how: str, free: bool) -> None:
    random = np.random.default_rng(seed)
    targets = random.normal(0, spread, (19, 3))
    targets[random.random((19, 3)) < 0.1] += junk
    weights = random.choice([0.0, 1e-12, 1.0, 1e12], 19)
    pose = posed(np.concatenate([random.normal(size=6), random.uniform(LOW - 1, HIGH + 1)]), 19)
    again = pose.copy()
    solver = HandSolver(SKELETON, HAN19)
    for one in (pose, again):
        if how == "solve":
            solver.solve(one, targets, weights, free_scale=free, free_root=not free)
        elif how == "subspace":
            solver.solve_subspace(one, targets, weights, SUBSPACE, free_scale=free)
        else:
            solver.solve_layered(one, targets, weights, SUBSPACE, free_scale=free)
        assert (one.theta_rad[6:] >= LOW).all()
        assert (one.theta_rad[6:] <= HIGH).all()
        assert np.isfinite(one.theta_rad).all()
        assert np.isfinite(one.joints_world).all()
        assert kernels.SMALLEST <= one.scale <= kernels.LARGEST
        parents = np.asarray(JOINT_PARENTS[1:])
        joints = one.joints_world[:, :3, 3]
        size = 1e-12 * max(1.0, np.abs(joints).max())
        np.testing.assert_allclose(
            np.linalg.norm(joints[1:] - joints[parents], axis=1), one.scale * SKELETON.bone_lengths_m[1:], atol=size
        )
    assert pose.theta_rad.tobytes() == again.theta_rad.tobytes()
    assert pose.markers_world_m.tobytes() == again.markers_world_m.tobytes()


def test_what_was_solved_before_leaves_no_trace() -> None:
    """The buffers of a solver are no memory: the same bits from a new one and from one that has seen other hands."""
    _, start, targets, weights = case(0, HAN19)
    used, new = HandSolver(SKELETON, HAN19), HandSolver(SKELETON, HAN19)
    used.solve_layered(posed(start + 0.3, 19), targets * 2.0, np.ones(19), SUBSPACE, motion=motion_of(1))
    used.uncertainty(posed(start, 19), weights, 0.001)
    poses = [posed(start, 19), posed(start, 19)]
    for solver, pose in zip((used, new), poses, strict=True):
        solver.solve(pose, targets, weights)
    assert poses[0].theta_rad.tobytes() == poses[1].theta_rad.tobytes()
    assert poses[0].rms_m == poses[1].rms_m


@pytest.mark.parametrize("count", [1, 2, 4])
def test_hands_solved_together_equal_hands_solved_alone(count: int) -> None:
    """Different layouts, priors and sizes in one call, to the bit."""
    solvers = [
        HandSolver(SKELETON, HAN19),
        HandSolver(SKELETON.scaled(1.1), SPARSE, posture_prior(SUBSPACE)),
        HandSolver(SKELETON, load_layout("qualisys13")),
        HandSolver(SKELETON, HAN19, posture_prior(SUBSPACE)),
    ][:count]
    cases = [case(seed, solver.layout) for seed, solver in enumerate(solvers)]
    motions = [None, motion_of(1), None, motion_of(3)][:count]
    alone, together = ([posed(c[1], len(c[3])) for c in cases] for _ in range(2))
    for solver, pose, (_, _, targets, weights), motion in zip(solvers, alone, cases, motions, strict=True):
        solver.solve(pose, targets, weights, motion=motion, iterations=6)
    solve_hands(solvers, together, [c[2] for c in cases], [c[3] for c in cases], motions=motions, iterations=6)
    for one, other in some(zip(alone, together, strict=True)):
        for name in ("theta_rad", "joints_world", "markers_world_m"):
            assert getattr(one, name).tobytes() == getattr(other, name).tobytes()
        assert (one.scale, one.rms_m) == (other.scale, other.rms_m)


def test_a_fixed_root_stays() -> None:
    _, start, targets, weights = case(1, HAN19)
    pose = posed(start, 19)
    HandSolver(SKELETON, HAN19).solve(pose, targets, weights, free_root=False)
    np.testing.assert_allclose(pose.theta_rad[:6], start[:6], atol=1e-12)
    assert np.abs(pose.theta_rad[6:] - start[6:]).max() > 0.01


def test_an_expected_angle_is_taken_where_nothing_is_seen() -> None:
    weights = np.ones(19)
    index = (HAN19.joints - 1) // 3 == 1
    weights[index & (HAN19.joints > 0)] = 0.0
    truth, start, targets, _ = case(2, HAN19)
    expected = np.clip(truth[6:], LOW + 0.1, HIGH - 0.1)
    pose = posed(start, 19)
    HandSolver(SKELETON, HAN19).solve(
        pose, np.nan_to_num(targets), weights * (1 - np.isnan(targets[:, 0])), iterations=30,
        motion=MotionPrior(expected, np.full(20, 1.0)),
    )  # fmt: skip
    np.testing.assert_allclose(pose.theta_rad[10:14], expected[4:8], atol=1e-3)


def hidden(layout: MarkerLayout, digit: int) -> np.ndarray:
    weights = np.ones(len(layout.joints))
    weights[(layout.joints > 0) & ((layout.joints - 1) // 3 == digit)] = 0.0
    return weights


@pytest.mark.parametrize("layout", [HAN19, SPARSE], ids=["han19", "schroeder6"])
@pytest.mark.parametrize("prior", PRIORS)
@pytest.mark.parametrize("seed", range(4))
def test_uncertainty_equals_the_inverse_of_the_normal_equations(layout: MarkerLayout, prior: str, seed: int) -> None:
    random = np.random.default_rng(seed)
    arguments = () if PRIORS[prior] is None else (PRIORS[prior],)
    theta = np.concatenate([random.normal(size=6), random.uniform(LOW, HIGH)])
    weights = random.choice([0.0, 0.5, 1.0], len(layout.joints)) if seed else np.zeros(len(layout.joints))
    pose = posed(theta, len(weights))
    solver = HandSolver(SKELETON, layout, *arguments)
    solver.place(pose)
    theta_std, marker_std_m = solver.uncertainty(pose, weights, 0.002, motion_of(seed))
    found = solver.appraise(pose, pose.markers_world_m, weights, 0.002, motion_of(seed))
    expected = Reference(SKELETON, layout, *arguments).uncertainty(theta, weights, 0.002, motion=motion_of(seed))
    np.testing.assert_allclose(theta_std, expected[0], rtol=1e-6)
    np.testing.assert_allclose(found.marker_cov_m2, expected[1], rtol=1e-6, atol=1e-6 * float(expected[1].max()))
    np.testing.assert_array_equal(found.marker_cov_m2, found.marker_cov_m2.mT)
    np.testing.assert_allclose(marker_std_m, np.sqrt(np.trace(expected[1], axis1=1, axis2=2)), rtol=1e-6)


@pytest.mark.parametrize("layout", [HAN19, SPARSE], ids=["han19", "schroeder6"])
@pytest.mark.parametrize("prior", PRIORS)
@pytest.mark.parametrize("seed", range(4))
def test_how_a_pose_stands_to_its_points(layout: MarkerLayout, prior: str, seed: int) -> None:
    random = np.random.default_rng(seed)
    arguments = () if PRIORS[prior] is None else (PRIORS[prior],)
    theta = np.concatenate([random.normal(size=6), random.uniform(LOW, HIGH)])
    weights = random.choice([0.0, 0.5, 1.0], len(layout.joints)) if seed else np.zeros(len(layout.joints))
    pose = posed(theta, len(weights))
    solver = HandSolver(SKELETON, layout, *arguments)
    solver.place(pose)
    targets = pose.markers_world_m + random.normal(0.0, 0.002, (len(weights), 3))
    found = solver.appraise(pose, targets, weights, 0.002, motion_of(seed))
    reference = Reference(SKELETON, layout, *arguments)
    missed, told, postural, unusual_m2 = reference.balance(theta, targets, weights, 0.002, motion=motion_of(seed))
    np.testing.assert_allclose(found.missed, missed, rtol=1e-6, atol=1e-12)
    assert found.told == pytest.approx(told, rel=1e-6, abs=1e-9)
    assert found.postural == pytest.approx(postural, rel=1e-6)
    assert found.unusual_m2 == pytest.approx(unusual_m2, rel=1e-9)
    assert 0.0 <= found.told + 1e-9 <= 26.0
    alone = solver.uncertainty(pose, weights, 0.002, motion_of(seed))
    np.testing.assert_array_equal(found.theta_std, alone[0])
    np.testing.assert_array_equal(found.marker_std_m, alone[1])


def test_a_solved_pose_has_missed_nothing() -> None:
    """Where the noise is what the priors were weighed against, the pose is where markers and priors balance."""
    theta = np.concatenate([np.zeros(6), 0.5 * (LOW + HIGH)])
    solver = HandSolver(SKELETON, HAN19, posture_prior(SUBSPACE))
    pose = posed(theta, 19)
    solver.place(pose)
    targets = pose.markers_world_m + np.random.default_rng(4).normal(0.0, 0.001, (19, 3))
    solver.solve(pose, targets, np.ones(19), iterations=60, tolerance=0.0)
    found = solver.appraise(pose, targets, np.ones(19), 0.001)
    assert np.abs(found.missed / found.theta_std).max() < 0.05
    other = solver.appraise(pose, targets, np.full(19, 4.0), 0.001)  # markers that were trusted too little
    assert np.abs(other.missed / other.theta_std).max() > 0.2


@pytest.mark.parametrize("prior", PRIORS)
@pytest.mark.parametrize("seed", range(5))
def test_uncertainty_grows_as_markers_vanish(prior: str, seed: int) -> None:
    """One by one, down to none: no standard deviation ever shrinks, and all stay finite."""
    random = np.random.default_rng(seed)
    arguments = () if PRIORS[prior] is None else (PRIORS[prior],)
    solver = HandSolver(SKELETON, HAN19, *arguments)
    pose = posed(np.concatenate([random.normal(size=6), random.uniform(LOW, HIGH)]), 19)
    solver.place(pose)
    weights = np.ones(19)
    theta_std, marker_std_m = solver.uncertainty(pose, weights, 0.001)
    np.testing.assert_allclose(marker_std_m, np.sqrt(3) * 0.001, rtol=1e-12)
    for marker in random.permutation(19):
        weights[marker] = 0.0
        new_theta, new_marker = solver.uncertainty(pose, weights, 0.001)
        assert (new_theta >= theta_std * (1 - 1e-9)).all()
        assert (new_marker >= marker_std_m * (1 - 1e-9)).all()
        assert new_marker[marker] > marker_std_m[marker]
        theta_std, marker_std_m = new_theta, new_marker
    assert np.isfinite(theta_std).all()
    assert np.isfinite(marker_std_m).all()
    assert (marker_std_m > 1.0).all()
    assert (theta_std[:3] > 0.9).all()


def test_a_hidden_digit_is_unsure_and_the_others_are_not() -> None:
    solver = HandSolver(SKELETON, HAN19)
    pose = posed(np.zeros(26), 19)
    solver.place(pose)
    seen, _ = solver.uncertainty(pose, np.ones(19), 0.001)
    unseen, markers = solver.uncertainty(pose, hidden(HAN19, 2), 0.001)
    middle = slice(6 + 8, 6 + 12)
    assert (unseen[middle] > 3.0 * seen[middle]).all()
    others = np.r_[6:14, 18:26]
    assert (unseen[others] < 1.3 * seen[others]).all()
    assert markers[hidden(HAN19, 2) == 0].min() > 0.005


def test_uncertainty_is_the_spread_of_solved_poses() -> None:
    """The hand solved from 400 draws of the noise: each angle scatters as told (linear: the noise is small)."""
    random = np.random.default_rng(0)
    solver = HandSolver(SKELETON, HAN19)
    truth = np.concatenate([np.zeros(6), 0.5 * (LOW + HIGH)])
    targets = markers_world(SKELETON, truth, HAN19.joints, HAN19.positions_m)
    noise = 0.0002
    solved = []
    for _ in range(400):
        pose = posed(truth, 19)
        solver.solve(pose, targets + random.normal(0, noise, (19, 3)), np.ones(19), tolerance=0.0)
        solved.append(pose.theta_rad[6:])
    told, _ = solver.uncertainty(posed(truth, 19), np.ones(19), noise)
    spread = np.std(solved, axis=0)
    # A prior that outweighs the noise makes the told spread the larger: it also counts what the prior may get wrong.
    assert (spread < 1.15 * told[6:]).all()
    assert (spread > 0.3 * told[6:]).all()


def test_noise_that_is_none_is_refused() -> None:
    pose = posed(np.zeros(26), 19)
    for noise in (0.0, -1.0, float("nan"), float("inf")):
        with pytest.raises(PhalanxError, match="Noise"):
            HandSolver(SKELETON, HAN19).uncertainty(pose, np.ones(19), noise)


def test_a_size_is_found_in_a_subspace_too() -> None:
    random = np.random.default_rng(5)
    theta = np.concatenate(
        [random.normal(size=6), SUBSPACE.mean_rad + 0.5 * SUBSPACE.basis[:, 0] * SUBSPACE.std_rad[0]]
    )
    targets = markers_world(SKELETON.scaled(1.15), theta, HAN19.joints, HAN19.positions_m * 1.15)
    pose = posed(theta, 19)
    HandSolver(SKELETON, HAN19).solve_subspace(
        pose, targets, np.ones(19), SUBSPACE, free_scale=True, iterations=60, tolerance=0.0
    )
    assert pose.scale == pytest.approx(1.15, abs=0.01)


ALLOCATIONS = """
import numpy as np
from numba import njit
from numba.core.runtime import rtsys
from core.hand.model import template
from core.kinematics import kernels
from core.kinematics.solver import WHOLE, HandPose, HandSolver
from core.markers.layout import load_layout
from core.motion.subspace import shipped_subspace

solver, pose = HandSolver(template().skeleton, load_layout("han19")), HandPose.at_rest(19)
solver.solve_subspace(pose, np.full((19, 3), 0.1), np.ones(19), shipped_subspace("generic"))
desk, space = solver._desk, solver._space

@njit
def run(count, hands, whole, space, tasks, works, theta, step, shapes, out):
    for _ in range(count):
        kernels.solve(hands, whole, whole, tasks, works, False, True, True, 5, 0.0)
        kernels.solve(hands, whole, space, tasks, works, True, True, True, 5, 0.0)
        kernels.uncertainty(hands, whole, tasks, works, 0.001)
        kernels.markers_by_digit(hands, works, theta, 1.0, 2, shapes, out)
        kernels.pose_moved(theta, step)
        kernels.pose_step(tasks[0].theta, theta, step)

def allocated(count):
    before = rtsys.get_allocation_stats().alloc
    run(count, desk._hands, WHOLE, space, desk._tasks, desk._works, np.zeros(26), np.zeros(26), np.zeros((3, 4)),
        np.zeros((3, 19, 3)))
    return rtsys.get_allocation_stats().alloc - before

allocated(0)
assert allocated(0) == allocated(100), (allocated(0), allocated(100))  # handing arrays over is all that costs
"""


def test_kernels_allocate_nothing() -> None:
    environment = os.environ | {"NUMBA_NRT_STATS": "1"}
    run = subprocess.run(
        [sys.executable, "-c", ALLOCATIONS], cwd=ROOT, env=environment, capture_output=True, text=True, check=False
    )
    assert run.returncode == 0, run.stderr[-2000:]


def test_a_subspace_changed_between_calls_is_used() -> None:
    """The solver keeps the last subspace ready; another one must not be taken for it."""
    _, start, targets, weights = case(4, HAN19)
    solver = HandSolver(SKELETON, HAN19)
    small, large = SUBSPACE.truncated(2), SUBSPACE
    results = []
    for subspace in (small, large, small):
        pose = posed(start, 19)
        solver.solve_subspace(pose, targets, weights, subspace)
        results.append(pose.theta_rad.tobytes())
    assert results[0] == results[2] != results[1]
