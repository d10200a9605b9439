"""scipy's least_squares on our energy within the limits, Jacobians by finite differences."""

from __future__ import annotations

import numpy as np
from scipy.optimize import least_squares

from core.frames import FloatArray
from core.hand.skeleton import Skeleton
from core.kinematics.forward import markers_world
from core.kinematics.prior import PosturePrior
from core.markers.layout import MarkerLayout


class ScipyHand:
    """Solves by trust region; an iteration is one of its own, with a Jacobian of 26 differences."""

    def __init__(self, skeleton: Skeleton, layout: MarkerLayout, prior: PosturePrior) -> None:
        self._skeleton, self._layout, self._mean = skeleton, layout, prior.mean_rad
        self._root = np.linalg.cholesky(prior.precision_m2).T
        free = np.full((6, 2), [-np.inf, np.inf])
        self._bounds = np.vstack([free, skeleton.limits_rad]).T

    def solve(self, theta: FloatArray, targets_m: FloatArray, weights: FloatArray, iterations: int) -> FloatArray:
        """(26,) float64, `iterations` from `theta`."""
        low, high = self._bounds
        inside = np.clip(theta, low + 1e-9, high - 1e-9)
        w = np.sqrt(weights)[:, None]

        def residuals(now: FloatArray) -> FloatArray:
            x = markers_world(self._skeleton, now, self._layout.joints, self._layout.positions_m)
            return np.concatenate([(w * (x - targets_m)).ravel(), self._root @ (now[6:] - self._mean)])

        found = least_squares(
            residuals, inside, bounds=(low, high), max_nfev=iterations, xtol=1e-15, ftol=1e-15, gtol=1e-15
        )
        solved: FloatArray = found.x
        return solved
