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

from core.calibration.geometry import Estimate, Placed, WornHand
from core.frames import BoolArray, FloatArray, IntArray
from core.hand.shape import LARGEST, N_SHAPE, SMALLEST
from core.hand.skeleton import N_DOFS, N_ROOT_DOFS, Skeleton

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


class Bundle(WornHand):
    """The problem: the shots of one performer and how the model makes markers of parameters.

    joints (m,) int64 and places_m (m, 3) [m]: the layout on the template `skeleton`. points_m: (f, m, 3) float64 [m],
    right hands, NaN where unseen.
    """

    def __init__(
        self, skeleton: Skeleton, joints: IntArray, places_m: FloatArray, points_m: FloatArray, priors: Priors
    ) -> None:
        super().__init__(skeleton, joints, places_m)
        self.priors = priors
        self.seen: BoolArray = ~np.isnan(points_m[..., 0])
        self._points_m = np.nan_to_num(points_m)

    @property
    def n_shots(self) -> int:
        """f."""
        return len(self._points_m)

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

    def normal_equations(
        self, at: Estimate, placed: Placed, residuals_m: FloatArray, sigma_m: float, alike: float = ALIKE_SHOTS
    ) -> Normal:
        """Gauss-Newton's, with the present robust weights and all priors. alike: so many shots tell as much as one."""
        f, p = len(at.roots_m), self.priors
        weights = self.weights(residuals_m, sigma_m) / (alike * sigma_m**2)
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
        return Normal(pose, cross, shared, pose_gradient, shared_gradient, held)

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
    """Normal equations in blocks: pose (f, 26, 26), cross (f, 26, s), shared (s, s), and the downhill gradients. held:
    (f, 26) bool, parameters that a joint limit holds."""

    pose: FloatArray
    cross: FloatArray
    shared: FloatArray
    pose_gradient: FloatArray
    shared_gradient: FloatArray
    held: BoolArray

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
