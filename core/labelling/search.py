"""Finding a hand in a cluster of unlabelled points, from nothing but its shape.

The layout's markers in a few typical poses are laid onto the cluster from many directions by iterated closest
points; the best few are refined by assignment and inverse kinematics in turn, with a closing gate
(Schröder 2017, "Fully automatic tracking": match every model to every cluster, keep the lowest distance).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.spatial.transform import Rotation

from core.frames import NO_POINT, FloatArray, IntArray
from core.hand.poses import POSE_NAMES, pose
from core.hand.skeleton import DIGITS, Skeleton
from core.kinematics.forward import markers_world
from core.kinematics.solver import HandPose, HandSolver, solve_hands
from core.labelling import kernels
from core.labelling.assignment import assign
from core.markers.layout import MarkerLayout
from core.profile import Profile

N_DIRECTIONS = 72
ICP_GATE_M = 0.030
ICP_ITERATIONS = 12
N_REFINED = 12
N_PARTS, N_REFINED_PER_PART = 7, 2
"""A whole search takes as long as several frames; in parts it takes as many frames, and none of them waits."""

GATES_M = (0.045, 0.035, 0.028, 0.022, 0.020, 0.020)
"""How far a point may be from its marker, by round of refinement."""

LEAST_POINTS = 4

N_STARTS = 3
"""Usual postures from which a hand is solved whose points have names."""

MOST_WRONG_NAMES = 3

BEND_GATE_M = 0.035
N_BENT = 3
"""Shapes of a digit without labels that are refined."""

NEAR_GATE_M = 0.060
"""How far a hand may have jumped between two frames, as a whole."""

N_AT_ONCE = 8
"""Sets of labels that are solved in one call."""

SCALE_RANGE = (0.65, 1.4)
"""Of a hand of unknown size when it is looked for: hands 120 to 260 mm long, on the generic hand."""


@dataclass(frozen=True)
class Hypothesis:
    """A right hand that may explain a cluster.

    point: (m,) int64, index into the cluster's points, NO_POINT for a marker not seen.
    cost_m2: explanation_cost_m2 of the two, capped at the last gate.
    """

    pose: HandPose
    point: IntArray
    cost_m2: float

    @property
    def n_labelled(self) -> int:
        """Markers that have a point."""
        return int((self.point != NO_POINT).sum())


def directions(count: int) -> FloatArray:
    """(count, 3, 3) rotations spread evenly over all (super-Fibonacci spiral, Alexa 2022, algorithm 1)."""
    phi, psi = np.sqrt(2.0), 1.533751168755204288118041
    s = np.arange(count) + 0.5
    r, big_r = np.sqrt(s / count), np.sqrt(1.0 - s / count)
    alpha, beta = 2.0 * np.pi * s / phi, 2.0 * np.pi * s / psi
    quaternions = np.stack([r * np.sin(alpha), r * np.cos(alpha), big_r * np.sin(beta), big_r * np.cos(beta)], axis=1)
    matrices: FloatArray = Rotation.from_quat(quaternions).as_matrix()
    return matrices


def finger_exchanges(layout: MarkerLayout) -> list[tuple[IntArray, IntArray]]:
    """Pairs of sets of markers that neighbouring fingers may take for each other's: the last, the last two, ..."""
    exchanges = []
    fingers = [np.flatnonzero((layout.joints - 1) // 3 == g) for g in range(1, len(DIGITS))]
    for finger, neighbour in pairwise(fingers):
        # From the tip to the palm; in the hand frame a finger points along -z.
        a = finger[np.argsort(layout.positions_m[finger, 2])]
        b = neighbour[np.argsort(layout.positions_m[neighbour, 2])]
        exchanges += [(a[:n], b[:n]) for n in range(1, min(len(a), len(b)) + 1)]
    return exchanges


def digit_shapes(limits_rad: FloatArray) -> FloatArray:
    """(81, 4) float64 [rad]: a digit's four angles at a low, a middle and a high value each, (4, 2) its limits."""
    low, high = limits_rad.T
    levels = low + np.array([[0.15], [0.5], [0.85]]) * (high - low)  # (3, 4)
    return np.stack([grid.ravel() for grid in np.meshgrid(*levels.T, indexing="ij")], axis=1)


class TemplateSearch:
    """Finds right hands of one skeleton and layout; a left hand is handed in mirrored."""

    def __init__(self, skeleton: Skeleton, layout: MarkerLayout, solver: HandSolver) -> None:
        self._solver = solver
        self._angles = np.asarray([pose(name) for name in POSE_NAMES])
        theta = np.zeros(26)
        self._templates = np.empty((len(self._angles), len(layout.marker_names), 3))
        for k, angles in enumerate(self._angles):
            theta[6:] = angles
            self._templates[k] = markers_world(skeleton, theta, layout.joints, layout.positions_m)
        self._directions = directions(N_DIRECTIONS)
        self._digits = np.where(layout.joints > 0, (layout.joints - 1) // 3, -1)
        self.n_parts = N_PARTS
        self._exchanges = finger_exchanges(layout)
        self._shapes = [digit_shapes(skeleton.limits_rad[4 * g : 4 * g + 4]) for g in range(len(DIGITS))]

    @classmethod
    def of(cls, profile: Profile) -> TemplateSearch:
        """For one performer. The solver must not prefer usual postures: the labels would follow."""
        skeleton, layout = profile.hand.skeleton, profile.worn
        return cls(skeleton, layout, HandSolver(skeleton, layout))

    def find(self, points_m: FloatArray, scale: float | None, part: int | None = None) -> Hypothesis | None:
        """The best right hand for a cluster (n, 3) float64 [m]; None if nothing fits at all.

        scale: of the hand, None if it is to be found. part: search only this one of N_PARTS, for a search that goes
        on over as many frames; None: all of them.
        """
        postures = (
            np.arange(len(self._angles)) if part is None else np.arange(part % N_PARTS, len(self._angles), N_PARTS)
        )
        refined = N_REFINED if part is None else N_REFINED_PER_PART
        return self._best_of(self._align(points_m, scale, postures, refined), points_m, scale is None)

    def find_near(self, points_m: FloatArray, near: HandPose) -> Hypothesis | None:
        """The hand `near` a known pose, moved as a whole onto the points first and then joint by joint."""
        markers = near.markers_world_m[None]
        costs, r, t, s = np.empty(1), np.empty((1, 3, 3)), np.empty((1, 3)), np.empty(1)
        kernels.align_templates(
            np.ascontiguousarray(points_m), markers, np.eye(3)[None], 1.0, 1.0, NEAR_GATE_M,
            ICP_ITERATIONS, costs, r, t, s,
        )  # fmt: skip
        moved = near.copy()
        moved.theta_rad[:3] = r[0] @ near.theta_rad[:3] + t[0]
        moved.theta_rad[3:6] = (Rotation.from_matrix(r[0]) * Rotation.from_rotvec(near.theta_rad[3:6])).as_rotvec()
        return self._best_of([near.copy(), moved], points_m, False)

    def exchanged(self, point: IntArray) -> list[IntArray]:
        """The labels (m,) with two neighbouring fingers exchanged, tips alone or more: fingers that crossed while they
        were hidden come back under each other's names."""
        found = []
        for one, other in self._exchanges:
            swapped = point.copy()
            swapped[one], swapped[other] = point[other], point[one]
            if not np.array_equal(swapped, point):
                found.append(swapped)
        return found

    def solve_all(self, near: HandPose, points_m: FloatArray, labellings: Sequence[IntArray]) -> list[HandPose]:
        """The hand under each of several sets of labels (m,) for the points (n, 3) float64 [m], from one pose on."""
        poses = [near.copy() for _ in labellings]
        for k in range(0, len(poses), N_AT_ONCE):
            some, theirs = poses[k : k + N_AT_ONCE], list(labellings[k : k + N_AT_ONCE])
            spare = N_AT_ONCE - len(some)  # one size for all calls, for which buffers are kept
            some += [near.copy() for _ in range(spare)]
            theirs += [np.full(len(near.markers_world_m), NO_POINT, dtype=np.int64)] * spare
            weights = [(point != NO_POINT).astype(np.float64) for point in theirs]
            solve_hands([self._solver] * N_AT_ONCE, some, [points_m[point] for point in theirs], weights, iterations=12)
        return poses

    def fit_named(self, points_m: FloatArray, point: IntArray, scale: float | None) -> list[Hypothesis]:
        """Poses for a cluster (n, 3) float64 [m] whose points were given names by someone who may err, point (m,):
        with these names, less those that no pose explains; and with the names that the pose so found suggests. The
        best first; empty where too few names are left.
        """
        point = point.copy()
        pose = self.pose_of_names(points_m, point, scale)
        if pose is None:
            return []
        for _ in range(MOST_WRONG_NAMES):
            seen = np.flatnonzero(point != NO_POINT)
            off_m = np.linalg.norm(pose.markers_world_m[seen] - points_m[point[seen]], axis=1)
            worst = int(np.argmax(off_m))
            if off_m[worst] < max(GATES_M[-1], 3.0 * float(np.median(off_m))) or len(seen) <= LEAST_POINTS:
                break
            point[seen[worst]] = NO_POINT
            self._solver.solve(
                pose, points_m[point], (point != NO_POINT).astype(np.float64), free_scale=scale is None, iterations=8
            )
        as_named = Hypothesis(pose, point, explanation_cost_m2(pose, points_m, point, GATES_M[-1]))
        by_shape = self.refined(pose, points_m, scale)
        found = [as_named] if by_shape is None else [as_named, by_shape]
        return sorted(found, key=lambda hypothesis: hypothesis.cost_m2)

    def refined(self, pose: HandPose, points_m: FloatArray, scale: float | None) -> Hypothesis | None:
        """The hand about where `pose` has it, its points named by nearness."""
        return self._refine(pose.copy(), points_m, scale is None, GATES_M[-3:])

    def pose_of_names(self, points_m: FloatArray, point: IntArray, scale: float | None) -> HandPose | None:
        """The pose whose markers fit points (n, 3) float64 [m] best that carry their names, point (m,), from the usual
        postures laid onto them; None where they are too few."""
        seen = point != NO_POINT
        if seen.sum() < LEAST_POINTS:
            return None
        targets = points_m[point[seen]]
        centre = targets.mean(axis=0)
        local = self._templates[:, seen]
        middles = local.mean(axis=1)
        local = local - middles[:, None]
        u, stretch, vt = np.linalg.svd(np.einsum("kna,nb->kab", local, targets - centre))
        flip = np.sign(np.linalg.det(u) * np.linalg.det(vt))
        u[:, :, 2] *= flip[:, None]
        turns = np.einsum("kab,kbc->kca", u, vt)  # a proper rotation each: template to points
        stretch[:, 2] *= flip
        spread = np.square(local).sum(axis=(1, 2))
        scales = (
            np.full(len(local), scale) if scale is not None else np.clip(stretch.sum(axis=1) / spread, *SCALE_RANGE)
        )
        # What is left of the points' spread once the template explains what it can.
        left_m2 = scales**2 * spread - 2.0 * scales * stretch.sum(axis=1)
        starts = []
        for k in np.argsort(left_m2, kind="stable")[:N_STARTS]:
            start = HandPose.at_rest(len(point))
            start.scale = float(scales[k])
            start.theta_rad[:3] = centre - start.scale * (turns[k] @ middles[k])
            start.theta_rad[3:6] = Rotation.from_matrix(turns[k]).as_rotvec()
            start.theta_rad[6:] = self._angles[k]
            starts.append(start)
        n, weights, aims = len(starts), seen.astype(np.float64), points_m[point]
        solve_hands([self._solver] * n, starts, [aims] * n, [weights] * n, free_scale=scale is None, iterations=20)
        return min(starts, key=lambda start: start.rms_m)

    def fit_labelled(self, points_m: FloatArray, point: IntArray, scale: float | None) -> HandPose:
        """The pose of a hand whose points (n, 3) float64 [m] carry their names: marker k is points_m[point[k]]."""
        seen = point != NO_POINT
        weights, targets = seen.astype(np.float64), points_m[point]
        best = HandPose.at_rest(len(point))
        best.rms_m = np.inf
        for angles, markers_m in zip(self._angles, self._templates, strict=True):
            middle, centre = markers_m[seen].mean(0), targets[seen].mean(0)
            turn, _ = Rotation.align_vectors(targets[seen] - centre, markers_m[seen] - middle)
            start = HandPose.at_rest(len(point))
            start.scale = scale or 1.0
            start.theta_rad[:3] = centre - turn.apply(middle)
            start.theta_rad[3:6] = turn.as_rotvec()
            start.theta_rad[6:] = angles
            self._solver.solve(start, targets, weights, free_scale=scale is None, iterations=20)
            if start.rms_m < best.rms_m:
                best = start
        return best

    def _align(self, points_m: FloatArray, scale: float | None, postures: IntArray, n_refined: int) -> list[HandPose]:
        count = len(postures) * N_DIRECTIONS
        costs, r, t, s = np.empty(count), np.empty((count, 3, 3)), np.empty((count, 3)), np.empty(count)
        low, high = SCALE_RANGE if scale is None else (scale, scale)
        kernels.align_templates(
            np.ascontiguousarray(points_m), self._templates[postures], self._directions, low, high, ICP_GATE_M,
            ICP_ITERATIONS, costs, r, t, s,
        )  # fmt: skip
        starts: list[HandPose] = []
        kept: list[int] = []
        for i in np.argsort(costs, kind="stable"):
            # Many starts slide into one place: keep each place once.
            if any(i // N_DIRECTIONS == k // N_DIRECTIONS and np.trace(r[i].T @ r[k]) > 2.8 for k in kept):
                continue
            kept.append(int(i))
            start = HandPose.at_rest(self._templates.shape[1])
            start.theta_rad[:3] = t[i]
            start.theta_rad[3:6] = Rotation.from_matrix(r[i]).as_rotvec()
            start.theta_rad[6:] = self._angles[postures[i // N_DIRECTIONS]]
            start.scale = float(s[i])
            starts.append(start)
            if len(starts) == n_refined:
                break
        return starts

    def _best_of(self, starts: list[HandPose], points_m: FloatArray, free_scale: bool) -> Hypothesis | None:
        found = [self._refine(start, points_m, free_scale, GATES_M) for start in starts]
        best = min((h for h in found if h is not None), key=lambda h: h.cost_m2, default=None)
        return best if best is None else self._bend_digits(best, points_m, free_scale)

    def _bend_digits(self, best: Hypothesis, points_m: FloatArray, free_scale: bool) -> Hypothesis:
        """A digit too far from every start is left without labels: bend each such digit towards the spare points."""
        for digit in range(len(DIGITS)):
            spare = np.delete(points_m, best.point[best.point != NO_POINT], axis=0)
            missing = np.flatnonzero((self._digits == digit) & (best.point == NO_POINT))
            if len(spare) == 0 or len(missing) == 0:
                continue
            shapes = self._shapes[digit]
            there = self._solver.markers_by_digit(best.pose, digit, shapes)[:, missing]
            gaps = np.linalg.norm(there[:, :, None] - spare[None, None], axis=3).min(axis=2)  # (shape, marker)
            costs = np.minimum(gaps, BEND_GATE_M).sum(axis=1)
            for shape in np.argsort(costs, kind="stable")[:N_BENT]:
                bent = best.pose.copy()
                bent.theta_rad[6 + 4 * digit : 10 + 4 * digit] = shapes[shape]
                found = self._refine(bent, points_m, free_scale, (BEND_GATE_M, *GATES_M[-2:]))
                if found is not None and found.cost_m2 < best.cost_m2:
                    best = found
        return best

    def _refine(
        self, start: HandPose, points_m: FloatArray, free_scale: bool, gates_m: tuple[float, ...]
    ) -> Hypothesis | None:
        """Assign and solve in turn, with a closing gate. Works in `start`."""
        self._solver.place(start)
        point = np.full(len(start.markers_world_m), NO_POINT, dtype=np.int64)
        for gate in gates_m:
            new = assign(start.markers_world_m, points_m, gate)
            seen = new != NO_POINT
            if seen.sum() < LEAST_POINTS:
                return None
            if gate == gates_m[-1] and np.array_equal(new, point):
                break
            point = new
            self._solver.solve(start, points_m[point], seen.astype(np.float64), free_scale=free_scale, iterations=8)
        return Hypothesis(start, point, explanation_cost_m2(start, points_m, point, GATES_M[-1]))


def explanation_cost_m2(pose: HandPose, points_m: FloatArray, point: IntArray, cap_m: float) -> float:
    """How badly a hand explains a set of points: the sum over its markers of the squared distance to their points
    [m^2], at most cap_m squared, which a marker without a point and a point without a marker cost too."""
    seen, cap = point != NO_POINT, cap_m**2
    squared = ((pose.markers_world_m[seen] - points_m[point[seen]]) ** 2).sum(1)
    alone = len(point) + len(points_m) - 2 * seen.sum()
    return float(np.minimum(squared, cap).sum() + cap * alone)
