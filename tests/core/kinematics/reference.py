"""The solver once more, slowly and plainly: dense numpy, explicit Jacobians, no buffers.

The same mathematics as core.kinematics.kernels, written to be read: what the kernels compute must equal this.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from core.hand.skeleton import DOF_JOINTS, JOINT_PARENTS, Skeleton
from core.kinematics.kernels import FAR_M, LARGEST, LAYER_M2_PER_RAD2, SCALE_M2, SMALLEST
from core.kinematics.prior import REST_PRIOR, MotionPrior, PosturePrior, subspace_stiffness_m2
from core.markers.layout import MarkerLayout
from core.motion.subspace import Subspace

NO_MOTION = MotionPrior(np.zeros(20), np.zeros(20))


@dataclass(frozen=True)
class State:
    """A pose: root translation and rotation, coordinates of the posture, scale."""

    t: np.ndarray
    r: np.ndarray
    posture: np.ndarray
    scale: float


@dataclass(frozen=True)
class Space:
    """Where the posture may be: angles = clipped(mean + basis @ posture)."""

    mean: np.ndarray
    basis: np.ndarray
    stiffness: np.ndarray

    @property
    def whole(self) -> bool:
        return bool(self.basis.shape == (20, 20))


WHOLE = Space(np.zeros(20), np.eye(20), np.zeros(20))


def space_of(subspace: Subspace) -> Space:
    return Space(subspace.mean_rad, subspace.basis, subspace_stiffness_m2(subspace))


class Reference:
    def __init__(self, skeleton: Skeleton, layout: MarkerLayout, prior: PosturePrior = REST_PRIOR) -> None:
        self.skeleton, self.layout, self.prior = skeleton, layout, prior
        self.low, self.high = skeleton.limits_rad.T

    def joints(self, t: np.ndarray, r: np.ndarray, angles: np.ndarray, scale: float) -> np.ndarray:
        """(16, 4, 4)."""
        rest = self.skeleton.joint_positions_m
        joints = np.zeros((16, 4, 4))
        joints[:, 3, 3] = 1.0
        joints[0, :3, :3], joints[0, :3, 3] = r, t
        for j in range(1, 16):
            parent = joints[JOINT_PARENTS[j]]
            joints[j, :3, 3] = parent[:3, 3] + scale * parent[:3, :3] @ (rest[j] - rest[JOINT_PARENTS[j]])
            turn = Rotation.identity()
            for d in np.flatnonzero(np.asarray(DOF_JOINTS) == j):
                turn = turn * Rotation.from_rotvec(angles[d] * self.skeleton.axes[d])
            joints[j, :3, :3] = parent[:3, :3] @ turn.as_matrix()
        return joints

    def markers(self, joints: np.ndarray, scale: float) -> np.ndarray:
        """(m, 3)."""
        local = self.layout.positions_m - self.skeleton.joint_positions_m[self.layout.joints]
        own = joints[self.layout.joints]
        return own[:, :3, 3] + scale * np.einsum("mab,mb->ma", own[:, :3, :3], local)

    def jacobian(self, joints: np.ndarray, angles: np.ndarray, scale: float) -> np.ndarray:
        """(m, 3, 27): of each marker by 20 angles, translation, small world rotation, logarithm of the scale."""
        x = self.markers(joints, scale)
        jacobian = np.zeros((len(x), 3, 27))
        for d, j in enumerate(DOF_JOINTS):
            before = joints[JOINT_PARENTS[j], :3, :3]
            for e in range(d):
                if DOF_JOINTS[e] == j:  # the outer of the two axes of one joint turns the inner
                    before = before @ Rotation.from_rotvec(angles[e] * self.skeleton.axes[e]).as_matrix()
            axis = before @ self.skeleton.axes[d]
            for i, joint in enumerate(self.layout.joints):
                while joint > j:
                    joint = JOINT_PARENTS[joint]
                if joint == j:
                    jacobian[i, :, d] = np.cross(axis, x[i] - joints[j, :3, 3])
        jacobian[:, :, 20:23] = np.eye(3)
        p = x - joints[0, :3, 3]
        for a in range(3):
            jacobian[:, :, 23 + a] = np.cross(np.eye(3)[a], p)
        jacobian[:, :, 26] = p
        return jacobian

    def angles(self, space: Space, state: State) -> np.ndarray:
        return np.clip(space.mean + space.basis @ state.posture, self.low, self.high)

    def energy(
        self, space: Space, state: State, targets: np.ndarray, weights: np.ndarray, prior: PosturePrior,
        motion: MotionPrior,
    ) -> float:  # fmt: skip
        angles = self.angles(space, state)
        x = self.markers(self.joints(state.t, state.r, angles, state.scale), state.scale)
        seen = weights > 0
        off = angles - prior.mean_rad
        return float(
            weights[seen] @ ((x - targets)[seen] ** 2).sum(1)
            + off @ prior.precision_m2 @ off
            + motion.stiffness_m2 @ (angles - motion.expected_rad) ** 2
            + space.stiffness @ state.posture**2
            + SCALE_M2 * np.log(state.scale) ** 2
        )

    def normal_equations(
        self, space: Space, state: State, targets: np.ndarray, weights: np.ndarray, prior: PosturePrior,
        motion: MotionPrior,
    ) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
        """A, b of the angles, the root and the scale: eq. 2 without its damping."""
        angles = self.angles(space, state)
        joints = self.joints(state.t, state.r, angles, state.scale)
        seen = weights > 0
        jacobian = self.jacobian(joints, angles, state.scale)[seen].reshape(-1, 27)
        residual = (targets - self.markers(joints, state.scale))[seen].ravel()
        w = np.repeat(weights[seen], 3)
        a, b = jacobian.T @ (w[:, None] * jacobian), jacobian.T @ (w * residual)
        a[:20, :20] += prior.precision_m2 + np.diag(motion.stiffness_m2)
        b[:20] += prior.precision_m2 @ (prior.mean_rad - angles) + motion.stiffness_m2 * (motion.expected_rad - angles)
        a[26, 26] += SCALE_M2
        b[26] -= SCALE_M2 * np.log(state.scale)
        return a, b

    def moved(self, space: Space, state: State, step: np.ndarray) -> State:
        """`step`: posture, root, scale."""
        k = len(state.posture)
        turn = Rotation.from_rotvec(step[k + 3 : k + 6]).as_matrix()
        scale = state.scale
        if step[k + 6] != 0.0:
            scale = float(np.clip(scale * np.exp(np.clip(step[k + 6], -0.1, 0.1)), SMALLEST, LARGEST))
        new = State(state.t + step[k : k + 3], turn @ state.r, state.posture + step[:k], scale)
        return replace(new, posture=self.angles(space, new)) if space.whole else new

    def descend(
        self, space: Space, state: State, targets: np.ndarray, weights: np.ndarray, prior: PosturePrior,
        motion: MotionPrior, free_scale: bool, free_root: bool, iterations: int, tolerance: float,
    ) -> State:  # fmt: skip
        energy = self.energy(space, state, targets, weights, prior, motion)
        damping = 1e-3
        for _ in range(iterations):
            a, b = self.normal_equations(space, state, targets, weights, prior, motion)
            raw = space.mean + space.basis @ state.posture
            inside = np.eye(20)[:, (self.low <= raw) & (raw <= self.high)]
            k = len(state.posture)
            m = np.zeros((27, k + 7))  # eq. 3: angles and root by the unknowns
            m[:20, :k] = space.basis if space.whole else inside @ inside.T @ space.basis
            m[20:, k:] = np.eye(7)
            a, b = m.T @ a @ m, m.T @ b
            a[:k, :k] += np.diag(space.stiffness[:k])
            b[:k] -= space.stiffness[:k] * state.posture
            free = np.ones(k + 7, dtype=bool)
            free[k : k + 6], free[k + 6] = free_root, free_scale
            if space.whole:
                angles = self.angles(space, state)
                free[:20] = ~(((angles <= self.low) & (b[:20] < 0)) | ((angles >= self.high) & (b[:20] > 0)))
            damped = (a + np.diag(damping * (np.diag(a) + 1e-9)))[np.ix_(free, free)]
            step = np.zeros(k + 7)
            step[free] = np.linalg.solve(damped, b[free])
            new = self.moved(space, state, step)
            gain = energy - self.energy(space, new, targets, weights, prior, motion)
            if gain < 0.0:
                slope = -2.0 * b @ step
                new = self.moved(space, state, np.clip(0.5 * slope / (gain + slope), 0.1, 0.5) * step)
                gain = energy - self.energy(space, new, targets, weights, prior, motion)
            if gain >= 0.0:
                state, energy, damping = new, energy - gain, max(0.1 * damping, 1e-9)
                if gain <= tolerance * energy:
                    break
            else:
                damping = max(10.0 * damping, 1e-6)
                if damping > 1e6:
                    break
        return state

    def solve(
        self, theta: np.ndarray, targets: np.ndarray, weights: np.ndarray, *, scale: float = 1.0,
        subspace: Subspace | None = None, layered: bool = False, free_scale: bool = False, free_root: bool = True,
        iterations: int = 10, tolerance: float = 1e-4, motion: MotionPrior = NO_MOTION,
    ) -> tuple[np.ndarray, float]:  # fmt: skip
        """Parameters (26,) and scale."""
        none = PosturePrior(np.zeros(20), np.zeros((20, 20)))
        space = WHOLE if subspace is None else space_of(subspace)
        prior = self.prior if subspace is None else none
        posture = space.basis.T @ (theta[6:] - space.mean)
        if space.whole:
            posture = np.clip(posture, self.low, self.high)
        state = State(theta[:3].copy(), Rotation.from_rotvec(theta[3:6]).as_matrix(), posture, scale)
        options = (free_scale, free_root, iterations, tolerance)
        state = self.descend(space, state, targets, weights, prior, motion, *options)
        angles = self.angles(space, state)
        if layered:
            stiffness = motion.stiffness_m2 + LAYER_M2_PER_RAD2
            expected = (motion.stiffness_m2 * motion.expected_rad + LAYER_M2_PER_RAD2 * angles) / stiffness
            state = replace(state, posture=angles)
            state = self.descend(WHOLE, state, targets, weights, none, MotionPrior(expected, stiffness), *options)
            angles = state.posture
        return np.concatenate([state.t, Rotation.from_matrix(state.r).as_rotvec(), angles]), state.scale

    def uncertainty(
        self, theta: np.ndarray, weights: np.ndarray, noise_m: float, *, scale: float = 1.0,
        motion: MotionPrior = NO_MOTION,
    ) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
        """theta_std (26,), marker_cov_m2 (m, 3, 3)."""
        state = State(theta[:3], Rotation.from_rotvec(theta[3:6]).as_matrix(), theta[6:], scale)
        joints = self.joints(state.t, state.r, theta[6:], scale)
        targets = self.markers(joints, scale)
        a, _ = self.normal_equations(WHOLE, state, targets, weights, self.prior, motion)
        a = a[:26, :26] / noise_m**2
        a[range(20), range(20)] += 12.0 / (self.high - self.low) ** 2
        a[range(20, 23), range(20, 23)] += 1.0 / FAR_M**2
        a[range(23, 26), range(23, 26)] += 1.0 / np.pi**2
        covariance = np.linalg.inv(a)
        jacobian = self.jacobian(joints, theta[6:], scale)[:, :, :26]
        predicted = np.einsum("map,pq,mbq->mab", jacobian, covariance, jacobian) + noise_m**2 * np.eye(3)
        observed = (noise_m**2 / np.where(weights > 0, weights, 1.0))[:, None, None] * np.eye(3)
        std = np.sqrt(np.diag(covariance))
        return np.concatenate([std[20:], std[:20]]), np.where((weights > 0)[:, None, None], observed, predicted)

    def balance(
        self, theta: np.ndarray, targets: np.ndarray, weights: np.ndarray, noise_m: float, *, scale: float = 1.0,
        motion: MotionPrior = NO_MOTION,
    ) -> tuple[np.ndarray, float, float, float]:  # fmt: skip
        """missed (26,), told, postural, unusual_m2 of an Appraisal."""
        state = State(theta[:3], Rotation.from_rotvec(theta[3:6]).as_matrix(), theta[6:], scale)
        a, b = self.normal_equations(WHOLE, state, targets, weights, self.prior, motion)
        none = PosturePrior(np.zeros(20), np.zeros((20, 20)))
        data, _ = self.normal_equations(WHOLE, state, targets, weights, none, NO_MOTION)
        a, b, data = a[:26, :26], b[:26], data[:26, :26]
        a[range(20), range(20)] += 12.0 * noise_m**2 / (self.high - self.low) ** 2
        a[range(20, 23), range(20, 23)] += noise_m**2 / FAR_M**2
        a[range(23, 26), range(23, 26)] += noise_m**2 / np.pi**2
        inverse = np.linalg.inv(a)
        step = inverse @ b
        angles = np.clip(theta[6:] + step[:20], self.low, self.high) - theta[6:]
        off = theta[6:] - self.prior.mean_rad
        return (
            np.concatenate([step[20:], angles]),
            float(np.trace(inverse @ data)),
            float(20.0 - np.trace(inverse[:20, :20] @ self.prior.precision_m2)),
            float(off @ self.prior.precision_m2 @ off),
        )
