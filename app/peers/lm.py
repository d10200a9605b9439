"""Levenberg-Marquardt around somebody else's kinematics: the same energy, damping, held limits and shortened steps as
core.kinematics.kernels, with a dense Jacobian. The algebra of a step is compiled, as ours is."""

from __future__ import annotations

from math import sqrt
from typing import Protocol

import numpy as np
from numba import njit

from core.frames import FloatArray
from core.kinematics.prior import PosturePrior

N_ANGLES = 20
N_UNKNOWNS = 26


class Hand(Protocol):
    """A hand in a library. Unknowns: 20 angles, then 6 of the root as the library steps them."""

    def put(self, theta: FloatArray) -> None:
        """Take up a pose, (26,) float64 as in core.hand.skeleton.DOF_NAMES."""

    def moved(self, step: FloatArray) -> FloatArray:
        """Take up the pose that lies `step` (26,) from the one last kept; returns its markers (m, 3) [m]."""

    def keep(self) -> None:
        """Keep the pose last taken up."""

    def jacobian(self) -> FloatArray:
        """(3 m, 26) float64, of the markers at the pose last taken up."""

    def theta(self) -> FloatArray:
        """(26,) float64, the pose last kept."""


class LevenbergMarquardt:
    """Fits a `Hand` to targets."""

    def __init__(self, hand: Hand, limits_rad: FloatArray, prior: PosturePrior) -> None:
        self._hand = hand
        self._low, self._high = np.ascontiguousarray(limits_rad.T)
        self._prior = prior
        self._normal = np.empty((N_UNKNOWNS, N_UNKNOWNS + 1))
        self._factor = np.empty((N_UNKNOWNS, N_UNKNOWNS))
        self._step = np.zeros(N_UNKNOWNS)

    def solve(self, theta: FloatArray, targets_m: FloatArray, weights: FloatArray, iterations: int) -> FloatArray:
        """(26,) float64, `iterations` steps from `theta`."""
        hand, step = self._hand, self._step
        hand.put(theta)
        angles = theta[6:].copy()
        x = hand.moved(np.zeros(N_UNKNOWNS))
        energy, damping, fresh = self._energy(x, targets_m, weights, angles), 1e-3, True
        for _ in range(iterations):
            if fresh:
                jacobian = hand.jacobian()
                _normal(
                    jacobian,
                    targets_m - x,
                    weights,
                    angles,
                    self._prior.mean_rad,
                    self._prior.precision_m2,
                    self._normal,
                )
            slope = _solve(self._normal, angles, self._low, self._high, damping, self._factor, step)
            new_angles, x_new, gain = self._try(1.0, angles, targets_m, weights, energy)
            if not gain >= 0.0:
                length = float(np.clip(0.5 * slope / (gain + slope), 0.1, 0.5))
                new_angles, x_new, gain = self._try(length, angles, targets_m, weights, energy)
            fresh = gain >= 0.0
            if fresh:
                hand.keep()
                angles, x, energy = new_angles, x_new, energy - gain
                damping = max(0.1 * damping, 1e-9)
            else:
                damping = max(10.0 * damping, 1e-6)
        return hand.theta()

    def _try(
        self, length: float, angles: FloatArray, targets_m: FloatArray, weights: FloatArray, energy: float
    ) -> tuple[FloatArray, FloatArray, float]:
        step = length * self._step
        new = np.minimum(np.maximum(angles + step[:N_ANGLES], self._low), self._high)
        step[:N_ANGLES] = new - angles
        x = self._hand.moved(step)
        return new, x, energy - self._energy(x, targets_m, weights, new)

    def _energy(self, x: FloatArray, targets_m: FloatArray, weights: FloatArray, angles: FloatArray) -> float:
        return float(_energy(x, targets_m, weights, angles, self._prior.mean_rad, self._prior.precision_m2))


# Not cached on disk: a benchmark compiles what it measures.
jit = njit(nogil=True, error_model="numpy")


@jit
def _energy(x, targets, weights, angles, mean, precision):  # type: ignore[no-untyped-def]
    energy = 0.0
    for i in range(len(x)):
        for a in range(3):
            energy += weights[i] * (x[i, a] - targets[i, a]) ** 2
    for d in range(N_ANGLES):
        for e in range(N_ANGLES):
            energy += (angles[d] - mean[d]) * precision[d, e] * (angles[e] - mean[e])
    return energy


@jit
def _normal(jacobian, residual, weights, angles, mean, precision, out):  # type: ignore[no-untyped-def]
    """J^T W J (lower triangle) and J^T W r with the prior."""
    out[:] = 0.0
    for i in range(len(residual)):
        for a in range(3):
            row = jacobian[3 * i + a]
            for p in range(N_UNKNOWNS):
                if row[p] != 0.0:
                    scaled = weights[i] * row[p]
                    for q in range(p + 1):
                        out[p, q] += scaled * row[q]
                    out[p, N_UNKNOWNS] += scaled * residual[i, a]
    for d in range(N_ANGLES):
        for e in range(N_ANGLES):
            out[d, e] += precision[d, e]
            out[d, N_UNKNOWNS] += precision[d, e] * (mean[e] - angles[e])


@jit
def _solve(normal, angles, low, high, damping, factor, step):  # type: ignore[no-untyped-def]
    """The damped step by Cholesky, angles pressed against a limit held; returns the energy's slope along it."""
    n = N_UNKNOWNS
    for i in range(n):
        step[i] = normal[i, n]
        for j in range(i + 1):
            factor[i, j] = normal[i, j]
        factor[i, i] += damping * (factor[i, i] + 1e-9)
    for d in range(N_ANGLES):
        if (angles[d] <= low[d] and step[d] < 0.0) or (angles[d] >= high[d] and step[d] > 0.0):
            step[d] = 0.0
            for j in range(n):
                factor[max(d, j), min(d, j)] = 0.0
            factor[d, d] = 1.0
    slope = 0.0
    for i in range(n):
        for j in range(i + 1):
            total = factor[i, j]
            for k in range(j):
                total -= factor[i, k] * factor[j, k]
            factor[i, j] = sqrt(total) if i == j else total / factor[j, j]
        for k in range(i):
            step[i] -= factor[i, k] * step[k]
        step[i] /= factor[i, i]
        slope -= 2.0 * step[i] * step[i]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            step[i] -= factor[k, i] * step[k]
        step[i] /= factor[i, i]
    return slope
