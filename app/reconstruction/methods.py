"""The ways to a pose that the experiments compare, and how far the hand that they give lies from the true one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from core.frames import BoolArray, FloatArray, IntArray
from core.hand.model import HandModel
from core.hand.poses import pose as pose_named
from core.hand.skeleton import N_JOINTS, N_ROOT_DOFS, Skeleton
from core.kinematics.forward import joints_world, markers_world
from core.kinematics.prior import posture_prior
from core.kinematics.solver import HandPose, HandSolver
from core.markers.layout import MarkerLayout
from core.motion.subspace import Subspace

FIRST_ITERATIONS, ITERATIONS = 100, 30
"""In the first frame of a motion, and in every other from the frame before: enough for every method to settle."""

TOLERANCE = 1e-6

Step = Callable[[HandPose, FloatArray, FloatArray, bool, int], None]
"""Moves a pose to the targets (m, 3) with weights (m,), its root free or not, in so many iterations."""


ASTRAY_M = 0.003
"""Markers without noise that are left further off (RMS) were not reached: there is another start to try."""


@dataclass(frozen=True)
class Method:
    """title: in a table. make: the step for a hand, its markers and a subspace. informed: it knows the subspace."""

    title: str
    make: Callable[[Skeleton, MarkerLayout, Subspace], Step]
    informed: bool = True

    def neutral_rad(self, subspace: Subspace) -> FloatArray:
        """(20,) float64, the digit angles to begin at: the subspace's mean, or relaxed for who knows none."""
        return subspace.mean_rad if self.informed else pose_named("relaxed")


def _standard(skeleton: Skeleton, layout: MarkerLayout, subspace: Subspace) -> Step:
    solver = HandSolver(skeleton, layout)

    def step(pose: HandPose, targets_m: FloatArray, weights: FloatArray, free_root: bool, iterations: int) -> None:
        solver.solve(pose, targets_m, weights, free_root=free_root, iterations=iterations, tolerance=TOLERANCE)

    return step


def _subspace(skeleton: Skeleton, layout: MarkerLayout, subspace: Subspace) -> Step:
    solver = HandSolver(skeleton, layout)

    def step(pose: HandPose, targets_m: FloatArray, weights: FloatArray, free_root: bool, iterations: int) -> None:
        solver.solve_subspace(
            pose, targets_m, weights, subspace, free_root=free_root, iterations=iterations, tolerance=TOLERANCE
        )

    return step


def _layered(skeleton: Skeleton, layout: MarkerLayout, subspace: Subspace) -> Step:
    solver = HandSolver(skeleton, layout)

    def step(pose: HandPose, targets_m: FloatArray, weights: FloatArray, free_root: bool, iterations: int) -> None:
        solver.solve_layered(
            pose, targets_m, weights, subspace, free_root=free_root, iterations=iterations, tolerance=TOLERANCE
        )

    return step


def _map(skeleton: Skeleton, layout: MarkerLayout, subspace: Subspace) -> Step:
    solver = HandSolver(skeleton, layout, posture_prior(subspace))

    def step(pose: HandPose, targets_m: FloatArray, weights: FloatArray, free_root: bool, iterations: int) -> None:
        solver.solve(pose, targets_m, weights, free_root=free_root, iterations=iterations, tolerance=TOLERANCE)

    return step


STANDARD = Method("standard", _standard, informed=False)
SUBSPACE = Method("subspace", _subspace)
LAYERED = Method("layered", _layered)
MAP = Method("posture prior", _map)
METHODS = (STANDARD, SUBSPACE, LAYERED, MAP)
"""Standard: all angles, weakly pulled to rest (Schröder 2017, eq. 1-2). Subspace: eq. 3-4. Layered: the subspace, then
all angles. Posture prior: all angles at once, the most probable given the markers and the Gaussian of the postures."""


def reconstructed(
    method: Method,
    skeleton: Skeleton,
    layout: MarkerLayout,
    subspace: Subspace,
    motions: Sequence[FloatArray],
) -> list[FloatArray]:
    """Every motion (t, 26) again, from the markers of `layout` on it and its root, which is given.

    The paper gives the root by an anchor marker on the forearm, for its layouts tell articulation alone. Every frame
    begins at the one before; the first, and any whose markers are not reached, at the method's neutral pose, and the
    better fit is kept: no method is judged by where it happened to get stuck.
    """
    step, weights = method.make(skeleton, layout, subspace), np.ones(len(layout.joints))

    def afresh(targets_m: FloatArray, root: FloatArray) -> HandPose:
        pose = HandPose.at_rest(len(layout.joints))
        pose.theta_rad[:N_ROOT_DOFS], pose.theta_rad[N_ROOT_DOFS:] = root, method.neutral_rad(subspace)
        step(pose, targets_m, weights, False, FIRST_ITERATIONS)
        return pose

    found = []
    for theta in motions:
        solved, pose = theta.copy(), None
        for t in range(len(theta)):
            targets_m, root = markers_world(skeleton, theta[t], layout.joints, layout.positions_m), theta[t, :6]
            if pose is not None:
                pose.theta_rad[:N_ROOT_DOFS] = root
                step(pose, targets_m, weights, False, ITERATIONS)
            if pose is None or pose.rms_m > ASTRAY_M:
                other = afresh(targets_m, root)
                pose = other if pose is None or other.rms_m < pose.rms_m else pose
            solved[t] = pose.theta_rad
        found.append(solved)
    return found


class Surface:
    """The skin of a hand over many poses at once."""

    CHUNK = 100

    def __init__(self, hand: HandModel) -> None:
        v = len(hand.vertices_m)
        self._skeleton = hand.skeleton
        self._carriers = hand.skin_joints[:, 0]
        shares = np.zeros((v, N_JOINTS))
        np.put_along_axis(shares, hand.skin_joints, hand.skin_weights, axis=1)
        rest = hand.vertices_m[:, None] - hand.skeleton.joint_positions_m  # (v, 16, 3)
        terms = np.concatenate([shares[..., None] * rest, shares[..., None]], axis=2)
        self._terms = terms.reshape(v, 4 * N_JOINTS).astype(np.float32)

    def vertices_m(self, thetas_rad: FloatArray) -> np.ndarray:
        """(v, t, 3) float32 [m] of poses (t, 26)."""
        frames = np.stack([joints_world(self._skeleton, theta) for theta in thetas_rad])
        stacked = frames[:, :, :3].transpose(1, 3, 0, 2).reshape(4 * N_JOINTS, -1)
        return (self._terms @ stacked.astype(np.float32)).reshape(len(self._terms), -1, 3)

    def error(self, found: Sequence[FloatArray], true: Sequence[FloatArray]) -> SurfaceError:
        """Distances of all vertices in all poses from where they truly are; the wrist counts as the same."""
        means, worst, places = [], [], []
        for a, b in zip(found, true, strict=True):
            digits_a, digits_b = a.copy(), b.copy()
            digits_a[:, :N_ROOT_DOFS] = digits_b[:, :N_ROOT_DOFS] = 0.0
            for i in range(0, len(a), self.CHUNK):
                part = slice(i, i + self.CHUNK)
                apart = np.linalg.norm(self.vertices_m(digits_a[part]) - self.vertices_m(digits_b[part]), axis=2)
                means.append(apart.mean(axis=0))
                worst.append(apart.max(axis=0))
                places.append(apart.argmax(axis=0))
        return SurfaceError(
            1e3 * np.concatenate(means).astype(np.float64),
            1e3 * np.concatenate(worst).astype(np.float64),
            self._carriers[np.concatenate(places)],
        )


@dataclass(frozen=True)
class SurfaceError:
    """mean_mm, worst_mm: (t,) float64 [mm], mean over the vertices of each pose, and its worst vertex. worst_joint:
    (t,) int64, the joint that carries the worst vertex most."""

    mean_mm: FloatArray
    worst_mm: FloatArray
    worst_joint: IntArray

    def figures(self) -> dict[str, float]:
        """Over all poses: mean_mm; max_mm, the worst vertex of the worst pose; p95_mm, 95 % of poses have a better
        worst vertex."""
        return {
            "mean_mm": float(self.mean_mm.mean()),
            "max_mm": float(self.worst_mm.max()),
            "p95_mm": float(np.percentile(self.worst_mm, 95)),
        }

    def on_unmarked(self, layout: MarkerLayout) -> float:
        """Share of the poses in which the worst vertex lies on a digit without a marker."""
        marked = {(int(joint) - 1) // 3 for joint in layout.joints if joint > 0}
        return float(np.mean([joint > 0 and (joint - 1) // 3 not in marked for joint in self.worst_joint.tolist()]))


def markers_of(layout: MarkerLayout, names: Sequence[str], name: str) -> MarkerLayout:
    """Only these markers of a layout, under a name of their own."""
    rows: IntArray = np.asarray([layout.marker_names.index(marker) for marker in names])
    return MarkerLayout(name, "", layout.sides, tuple(names), layout.joints[rows], layout.positions_m[rows])


def on_digits(layout: MarkerLayout) -> int:
    """Markers that tell of a digit; the others of the root alone, which is given."""
    carried: BoolArray = layout.joints > 0
    return int(carried.sum())
