"""Poses, hand shape and marker positions of one performer, found together from labelled frames.

A bundle adjustment. Each shot (one right hand in one frame) has a pose of 26 parameters; all share the logarithms of
the 23 shape ratios and the place of every marker on the template. What is minimised, in units of the points' noise:

    sum over observed markers of rho(|x - p|^2) / (k sigma^2)     rho of Geman and McClure: r^2 / (1 + r^2 / c^2)
    + (log s - mean)^T C^-1 (log s - mean)                        shape prior
    + sum over markers of d^T (n n^T / a^2 + (1 - n n^T) / b^2) d displacement prior (Han 2018, 4.5), stiff along n
    + sum over shots of (q - mean)^T P (q - mean)                 posture prior, within the joint limits

by Levenberg-Marquardt with analytic derivatives; the poses are eliminated shot by shot (Schur complement), so the time
grows with the number of shots only linearly.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from core.frames import BoolArray, FloatArray, IntArray
from core.hand.shape import LARGEST, N_SHAPE, SMALLEST, HandShape, bone_maps
from core.hand.skeleton import DOF_JOINTS, JOINT_PARENTS, N_DOFS, N_JOINTS, N_ROOT_DOFS, Skeleton

N_ANGLES = N_DOFS - N_ROOT_DOFS
OUTLIER_SIGMAS = 6.0
"""c of Geman and McClure, in standard deviations of one axis: at this distance a point has a quarter of its weight."""

ALIKE_SHOTS = 4.0
"""k: so many shots tell as much as one whose errors are its own. Skin and glove slide alike in like postures."""

LOG_BOUNDS = float(np.log(SMALLEST)), float(np.log(LARGEST))
FIRST_DAMPING, LEAST_DAMPING, MOST_DAMPING = 1e-3, 1e-9, 1e7


@dataclass(frozen=True)
class Priors:
    """What is known before any point is seen.

    shape_mean (23,), shape_precision (23, 23): of the log ratios. marker_precision_m (m, 3, 3) [1/m^2]: of each
    marker's displacement on the template. posture_mean (20,) [rad], posture_precision (20, 20) [1/rad^2].
    """

    shape_mean: FloatArray
    shape_precision: FloatArray
    marker_precision_m: FloatArray
    posture_mean: FloatArray
    posture_precision: FloatArray


@dataclass(frozen=True)
class Estimate:
    """Where the parameters stand.

    roots_m (f, 3), turns (f, 3, 3), angles_rad (f, 20): the pose of each shot. log_shape (23,). moved_m (m, 3): each
    marker's displacement on the template.
    """

    roots_m: FloatArray
    turns: FloatArray
    angles_rad: FloatArray
    log_shape: FloatArray
    moved_m: FloatArray

    @classmethod
    def of_poses(cls, thetas_rad: FloatArray, log_shape: FloatArray, n_markers: int) -> Estimate:
        """Markers where the layout has them. thetas_rad: (f, 26)."""
        turns = Rotation.from_rotvec(thetas_rad[:, 3:6]).as_matrix()
        return cls(thetas_rad[:, :3].copy(), turns, thetas_rad[:, 6:].copy(), log_shape, np.zeros((n_markers, 3)))

    @property
    def thetas_rad(self) -> FloatArray:
        """(f, 26) float64."""
        vectors = Rotation.from_matrix(self.turns).as_rotvec()
        return np.concatenate([self.roots_m, vectors, self.angles_rad], axis=1)

    @property
    def shape(self) -> HandShape:
        """The hand's."""
        return HandShape(np.exp(self.log_shape))


@dataclass(frozen=True)
class Placed:
    """The model at an estimate. markers_m (f, m, 3), rotations (f, 16, 3, 3), joints_m (f, 16, 3), axes (f, 20, 3)."""

    markers_m: FloatArray
    rotations: FloatArray
    joints_m: FloatArray
    axes: FloatArray


class Bundle:
    """The problem: the shots of one performer and how the model makes markers of parameters.

    joints (m,) int64 and places_m (m, 3) [m]: the layout on the template `skeleton`. points_m: (f, m, 3) float64 [m],
    right hands, NaN where unseen.
    """

    def __init__(
        self, skeleton: Skeleton, joints: IntArray, places_m: FloatArray, points_m: FloatArray, priors: Priors
    ) -> None:
        self.skeleton, self.joints, self.places_m, self.priors = skeleton, joints, places_m, priors
        self.seen: BoolArray = ~np.isnan(points_m[..., 0])
        self._points_m = np.nan_to_num(points_m)
        none = np.zeros(N_SHAPE)
        # The maps are linear in the ratios: what one ratio does is the map of that ratio alone.
        self._map_rates = np.stack([bone_maps(skeleton, HandShape(none + unit)) for unit in np.eye(N_SHAPE)])
        self._touches = [(i, int(j)) for i in range(N_SHAPE) for j in np.flatnonzero(self._map_rates[i].any((1, 2)))]
        self._offsets_m = skeleton.joint_positions_m.copy()
        self._offsets_m[1:] -= skeleton.joint_positions_m[list(JOINT_PARENTS[1:])]
        dof_joints = np.asarray(DOF_JOINTS)
        digits, joint_digits = (dof_joints - 1) // 3, (joints - 1) // 3
        self._turned = (joints > 0)[:, None] & (joint_digits[:, None] == digits) & (joints[:, None] >= dof_joints)

    @property
    def n_shots(self) -> int:
        """f."""
        return len(self._points_m)

    @property
    def n_shared(self) -> int:
        """Shape and marker parameters."""
        return N_SHAPE + 3 * len(self.joints)

    def place(self, at: Estimate) -> Placed:
        """Forward kinematics of every shot."""
        maps, n = bone_maps(self.skeleton, at.shape), len(at.roots_m)
        rotations, joints_m = np.empty((n, N_JOINTS, 3, 3)), np.empty((n, N_JOINTS, 3))
        axes = np.empty((n, N_ANGLES, 3))
        rotations[:, 0], joints_m[:, 0] = at.turns, at.roots_m
        dof = 0
        for j in range(1, N_JOINTS):
            parent = JOINT_PARENTS[j]
            joints_m[:, j] = joints_m[:, parent] + rotations[:, parent] @ (maps[parent] @ self._offsets_m[j])
            turn = rotations[:, parent]
            while dof < N_ANGLES and DOF_JOINTS[dof] == j:
                axis = self.skeleton.axes[dof]
                axes[:, dof] = turn @ axis
                turn = turn @ Rotation.from_rotvec(at.angles_rad[:, dof, None] * axis).as_matrix()
                dof += 1
            rotations[:, j] = turn
        local = np.einsum("mab,mb->ma", maps[self.joints], self._arms_m(at))
        markers_m = joints_m[:, self.joints] + np.einsum("fmab,mb->fma", rotations[:, self.joints], local)
        return Placed(markers_m, rotations, joints_m, axes)

    def _arms_m(self, at: Estimate) -> FloatArray:
        """(m, 3) float64 [m], each marker from its joint on the template."""
        arms: FloatArray = self.places_m + at.moved_m - self.skeleton.joint_positions_m[self.joints]
        return arms

    def jacobians(self, at: Estimate, placed: Placed) -> tuple[FloatArray, FloatArray]:
        """Of the markers by the pose (f, m, 3, 26) and by what all shots share (f, m, 3, 23 + 3 m).

        The root turns by a small world rotation before the present one; the shape by the log ratios.
        """
        f, m = placed.markers_m.shape[:2]
        by_pose, by_shared = np.zeros((f, m, 3, N_DOFS)), np.zeros((f, m, 3, self.n_shared))
        by_pose[..., :3] = np.eye(3)
        away = placed.markers_m - at.roots_m[:, None]
        for a, (b, c) in enumerate(((1, 2), (2, 0), (0, 1))):  # unit vector a cross (x - root)
            by_pose[..., b, 3 + a], by_pose[..., c, 3 + a] = -away[..., c], away[..., b]
        markers, dofs = np.nonzero(self._turned)
        arms = placed.markers_m[:, markers] - placed.joints_m[:, np.asarray(DOF_JOINTS)[dofs]]
        by_pose[:, markers, :, N_ROOT_DOFS + dofs] = np.cross(placed.axes[:, dofs], arms).swapaxes(0, 1)

        ratios, chain_m = np.exp(at.log_shape), self._chain_m(at)
        for i, j in self._touches:
            reach = ratios[i] * chain_m[:, j] @ self._map_rates[i, j].T  # (m, 3), in the frame of bone j
            by_shared[..., i] += np.einsum("fab,mb->fma", placed.rotations[:, j], reach)
        own = placed.rotations[:, self.joints] @ bone_maps(self.skeleton, at.shape)[self.joints]
        for k in range(m):
            by_shared[:, k, :, N_SHAPE + 3 * k : N_SHAPE + 3 * k + 3] = own[:, k]
        return by_pose, by_shared

    def _chain_m(self, at: Estimate) -> FloatArray:
        """(m, 16, 3) float64 [m]: of each bone on the way from the wrist to a marker, its part of the way, template."""
        chain = np.zeros((len(self.joints), N_JOINTS, 3))
        chain[np.arange(len(self.joints)), self.joints] = self._arms_m(at)
        for k, joint in enumerate(self.joints):
            while joint > 0:
                parent = JOINT_PARENTS[joint]
                chain[k, parent] = self._offsets_m[joint]
                joint = parent
        return chain

    def residuals_m(self, placed: Placed) -> FloatArray:
        """(f, m, 3) float64 [m], point less model; 0 where unseen."""
        residuals: FloatArray = np.where(self.seen[..., None], self._points_m - placed.markers_m, 0.0)
        return residuals

    def cost(self, at: Estimate, residuals_m: FloatArray, sigma_m: float) -> float:
        """What is minimised."""
        squared = (residuals_m**2).sum(-1)
        gate = (OUTLIER_SIGMAS * sigma_m) ** 2
        p, shape = self.priors, at.log_shape - self.priors.shape_mean
        posture = at.angles_rad - p.posture_mean
        return float(
            (squared / (1.0 + squared / gate)).sum() / (ALIKE_SHOTS * sigma_m**2)
            + shape @ p.shape_precision @ shape
            + np.einsum("ma,mab,mb", at.moved_m, p.marker_precision_m, at.moved_m)
            + np.einsum("fa,ab,fb", posture, p.posture_precision, posture, optimize=True)
        )

    def weights(self, residuals_m: FloatArray, sigma_m: float) -> FloatArray:
        """(f, m) float64 in 0..1: what each observation counts (derivative of rho); 0 where unseen."""
        squared = (residuals_m**2).sum(-1) / (OUTLIER_SIGMAS * sigma_m) ** 2
        weights: FloatArray = self.seen / (1.0 + squared) ** 2
        return weights

    def noise_m(self, residuals_m: FloatArray, sigma_m: float, n_shared: float) -> float:
        """Standard deviation of one coordinate, from the residuals less what the parameters took up [m]."""
        weights = self.weights(residuals_m, sigma_m)
        taken = (N_DOFS * self.n_shots + n_shared) / max(3.0 * float(self.seen.sum()), 1.0)
        # A layout may have fewer coordinates than a pose has parameters: priors hold those, residuals still tell.
        left = 3.0 * weights.sum() * max(1.0 - taken, 0.15)
        return float(np.sqrt((weights * (residuals_m**2).sum(-1)).sum() / max(left, 1e-12)))

    def normal_equations(self, at: Estimate, placed: Placed, residuals_m: FloatArray, sigma_m: float) -> Normal:
        """Gauss-Newton's, with the present robust weights and all priors."""
        f, p = len(at.roots_m), self.priors
        weights = self.weights(residuals_m, sigma_m) / (ALIKE_SHOTS * sigma_m**2)
        by_pose, by_shared = (j.reshape(f, -1, j.shape[-1]) for j in self.jacobians(at, placed))
        w = np.repeat(weights, 3, axis=1)[..., None]
        r = residuals_m.reshape(f, -1, 1)
        weighted = (w * by_pose).swapaxes(1, 2)
        pose, cross, pose_gradient = weighted @ by_pose, weighted @ by_shared, (weighted @ r)[..., 0]
        flat = by_shared.reshape(-1, self.n_shared)
        weighted_flat = (w * by_shared).reshape(-1, self.n_shared).T
        shared, shared_gradient = weighted_flat @ flat, weighted_flat @ r.ravel()
        pose[:, N_ROOT_DOFS:, N_ROOT_DOFS:] += p.posture_precision
        pose_gradient[:, N_ROOT_DOFS:] += (p.posture_mean - at.angles_rad) @ p.posture_precision
        shared += self.shared_prior()
        shared_gradient[:N_SHAPE] += p.shape_precision @ (p.shape_mean - at.log_shape)
        shared_gradient[N_SHAPE:] -= np.einsum("mab,mb->ma", p.marker_precision_m, at.moved_m).ravel()
        # Angles at a limit that are pressed outwards are held (as the solver of single frames does).
        low, high = self.skeleton.limits_rad.T
        down, up = pose_gradient[:, N_ROOT_DOFS:] < 0.0, pose_gradient[:, N_ROOT_DOFS:] > 0.0
        held = np.zeros((f, N_DOFS), dtype=np.bool_)
        held[:, N_ROOT_DOFS:] = ((at.angles_rad <= low) & down) | ((at.angles_rad >= high) & up)
        shot, dof = np.nonzero(held)
        pose[shot, dof], pose[shot, :, dof] = 0.0, 0.0
        pose[shot, dof, dof] = 1.0
        cross[shot, dof], pose_gradient[shot, dof] = 0.0, 0.0
        return Normal(pose, cross, shared, pose_gradient, shared_gradient)

    def shared_prior(self) -> FloatArray:
        """(23 + 3 m, 23 + 3 m) float64, precision of shape and markers before any point is seen."""
        prior = np.zeros((self.n_shared, self.n_shared))
        prior[:N_SHAPE, :N_SHAPE] = self.priors.shape_precision
        for k, block in enumerate(self.priors.marker_precision_m):
            rows = slice(N_SHAPE + 3 * k, N_SHAPE + 3 * k + 3)
            prior[rows, rows] = block
        return prior

    def step(self, at: Estimate, pose_step: FloatArray, shared_step: FloatArray) -> Estimate:
        """Go (f, 26) and (23 + 3 m,) from an estimate, within the limits."""
        low, high = self.skeleton.limits_rad.T
        turns = Rotation.from_rotvec(pose_step[:, 3:6]).as_matrix() @ at.turns
        return Estimate(
            at.roots_m + pose_step[:, :3],
            turns,
            np.clip(at.angles_rad + pose_step[:, N_ROOT_DOFS:], low, high),
            np.clip(at.log_shape + shared_step[:N_SHAPE], *LOG_BOUNDS),
            at.moved_m + shared_step[N_SHAPE:].reshape(-1, 3),
        )

    def solve(
        self,
        start: Estimate,
        sigma_m: float,
        free: BoolArray,
        *,
        iterations: int = 30,
        tolerance: float = 1e-5,
        each: Callable[[], None] = lambda: None,
    ) -> tuple[Estimate, list[float]]:
        """Levenberg-Marquardt on all poses and the shared parameters `free` (23 + 3 m,) bool.

        Returns the estimate and the cost after every accepted step, which never rises. `each` is called before every
        step and may raise to stop.
        """
        at = replace(start, angles_rad=np.clip(start.angles_rad, *self.skeleton.limits_rad.T))
        placed = self.place(at)
        residuals = self.residuals_m(placed)
        costs = [self.cost(at, residuals, sigma_m)]
        damping, normal = FIRST_DAMPING, None
        for _ in range(iterations):
            each()
            if normal is None:
                normal = self.normal_equations(at, placed, residuals, sigma_m)
            new = self.step(at, *normal.solved(damping, free))
            new_placed = self.place(new)
            new_residuals = self.residuals_m(new_placed)
            new_cost = self.cost(new, new_residuals, sigma_m)
            if new_cost < costs[-1]:
                gain = (costs[-1] - new_cost) / max(costs[-1], 1e-300)
                at, placed, residuals, normal = new, new_placed, new_residuals, None
                costs.append(new_cost)
                damping = max(0.2 * damping, LEAST_DAMPING)
                if gain < tolerance:
                    break
            else:
                damping *= 10.0
                if damping > MOST_DAMPING:
                    break
        return at, costs


@dataclass(frozen=True)
class Normal:
    """Normal equations in blocks: pose (f, 26, 26), cross (f, 26, s), shared (s, s), and the downhill gradients."""

    pose: FloatArray
    cross: FloatArray
    shared: FloatArray
    pose_gradient: FloatArray
    shared_gradient: FloatArray

    def solved(self, damping: float, free: BoolArray) -> tuple[FloatArray, FloatArray]:
        """The step (f, 26), (s,), damped in proportion to the diagonal (Marquardt); 0 for what is not free."""
        pose = self.pose.copy()
        diagonal = np.arange(N_DOFS)
        pose[:, diagonal, diagonal] *= 1.0 + damping
        cross = self.cross[..., free]
        eliminated = np.linalg.solve(pose, np.concatenate([self.pose_gradient[..., None], cross], axis=2))
        shared = self.shared[np.ix_(free, free)].copy()
        shared[np.diag_indices(len(shared))] *= 1.0 + damping
        rows = cross.shape[0] * cross.shape[1], cross.shape[2]
        tall = cross.reshape(rows).T
        gradient = self.shared_gradient[free] - tall @ eliminated[..., 0].ravel()
        shared -= tall @ eliminated[..., 1:].reshape(rows)
        step = np.zeros(len(self.shared_gradient))
        step[free] = np.linalg.solve(shared, gradient)
        return eliminated[..., 0] - eliminated[..., 1:] @ step[free], step

    def information(self) -> FloatArray:
        """(s, s) float64: inverse covariance of the shared parameters, the poses being free."""
        eliminated = np.linalg.solve(self.pose, self.cross)
        tall = self.cross.reshape(-1, self.cross.shape[-1])
        information: FloatArray = self.shared - tall.T @ eliminated.reshape(tall.shape)
        return 0.5 * (information + information.T)
