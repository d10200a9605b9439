"""What a bundle adjustment leaves open about the hand's measures and the places of its markers.

The inverse of Gauss-Newton's equations with the poses eliminated (Schur complement), made honest in two ways:

- points err alike in like postures: they count as so many frames fewer as their residuals say (core.calibration.alike);
- the posture prior pulls all poses towards one mean, which is not this performer's: a mean that is off by one standard
  deviation of the prior's postures is one more unknown that all frames share. No number of frames tells it from bones.
"""

from __future__ import annotations

import numpy as np

from core.calibration.bundle import Bundle
from core.calibration.geometry import N_ANGLES, Estimate
from core.calibration.priors import KNOWN_SIZE_STD, POSTURE_WEAKNESS
from core.frames import FloatArray
from core.hand.shape import N_SHAPE
from core.hand.skeleton import N_ROOT_DOFS


def information(bundle: Bundle, at: Estimate, noise_m: float, alike: float) -> FloatArray:
    """(n, n) float64, inverse covariance of what all frames share, where an adjustment ended.

    noise_m: of one coordinate [m]. alike: so many frames tell as much as one (core.calibration.alike.alike_shots).
    """
    placed = bundle.place(at)
    normal = bundle.normal_equations(at, placed, bundle.residuals_m(placed), noise_m, alike)
    pulls = bundle.priors.posture_precision
    by_mean = np.zeros((len(normal.pose), normal.pose.shape[1], N_ANGLES))
    by_mean[:, N_ROOT_DOFS:] = -pulls
    by_mean[normal.held] = 0.0
    cross = np.concatenate([normal.cross, by_mean], axis=2)
    eliminated = np.linalg.solve(normal.pose, cross)
    n, flat = bundle.n_shared, (-1, cross.shape[2])
    whole = -cross.reshape(flat).T @ eliminated.reshape(flat)
    whole[:n, :n] += normal.shared
    whole[n:, n:] += (len(cross) + POSTURE_WEAKNESS**2) * pulls
    left = whole[:n, :n] - whole[:n, n:] @ np.linalg.solve(whole[n:, n:], whole[n:, :n])
    return np.asarray(0.5 * (left + left.T), dtype=np.float64)


def left_open(information: FloatArray, keep_shape: bool) -> FloatArray:
    """(n, n) float64, covariance of shape and marker places.

    keep_shape: the shape was not found but believed: it is right but for KNOWN_SIZE_STD, and the markers were found on
    it, wrong as it may be.
    """
    if not keep_shape:
        return np.asarray(np.linalg.inv(information), dtype=np.float64)
    of_markers, across = information[N_SHAPE:, N_SHAPE:], information[N_SHAPE:, :N_SHAPE]
    by_size = np.ones(len(information))
    by_size[N_SHAPE:] = -np.linalg.solve(of_markers, across.sum(axis=1))
    covariance: FloatArray = KNOWN_SIZE_STD**2 * np.outer(by_size, by_size)
    covariance[N_SHAPE:, N_SHAPE:] += np.linalg.inv(of_markers)
    return covariance
