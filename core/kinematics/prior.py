"""What is believed of a hand's posture before a marker is seen: penalties that the solver adds to the markers'."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from core.frames import FloatArray
from core.hand.skeleton import N_DOFS, N_ROOT_DOFS
from core.motion.subspace import Subspace

N_ANGLES = N_DOFS - N_ROOT_DOFS

DIP_PER_PIP = 2.0 / 3.0
"""Flexion of a finger's last joint per flexion of its middle one (Rijpkema & Girard 1991, section 3)."""

COUPLING_M2_PER_RAD2 = 0.004**2
"""An end joint one radian off its coupling weighs as much as a point 4 mm off."""

REST_M2_PER_RAD2 = 0.0006**2
"""What no marker sees drifts to the rest pose; too weak to bend what one sees."""

NOISE_M = 0.001
"""Noise of one marker coordinate that a posture prior is weighed against, unless said otherwise."""

LEAST_RESIDUAL_RAD = 0.10
"""No angle is believed nearer to a subspace than this: new motions leave it, and markers must be free to say so.

Chosen among 0.02 to 0.2 on activities that the prior had not seen, with 19, 8 and 6 markers of 1 mm noise."""


ARM_M = 0.06
"""A marker's usual distance from the joints that move it: how far an angle off a subspace leads it astray."""


@dataclass(frozen=True)
class PosturePrior:
    """A Gaussian of the digit angles, in units of the markers' squares: (a - mean)^T precision (a - mean).

    mean_rad: (20,) float64 [rad]. precision_m2: (20, 20) float64 [m^2/rad^2], symmetric, positive semidefinite: the
    inverse covariance times the variance of a marker coordinate.
    """

    mean_rad: FloatArray
    precision_m2: FloatArray


@dataclass(frozen=True)
class MotionPrior:
    """Where each digit angle is expected in this frame, and how firmly: sum_d stiffness_d (a_d - expected_d)^2.

    expected_rad: (20,) float64 [rad]. stiffness_m2: (20,) float64 [m^2/rad^2], 0 where nothing is expected.
    """

    expected_rad: FloatArray
    stiffness_m2: FloatArray


def rest_prior() -> PosturePrior:
    """A weak pull to the rest pose, and the end joints of the fingers bent with their middle ones."""
    precision = REST_M2_PER_RAD2 * np.eye(N_ANGLES)
    for finger in range(1, 5):
        coupled = np.zeros(N_ANGLES)
        coupled[4 * finger + 2], coupled[4 * finger + 3] = -DIP_PER_PIP, 1.0
        precision += COUPLING_M2_PER_RAD2 * np.outer(coupled, coupled)
    return PosturePrior(np.zeros(N_ANGLES), precision)


REST_PRIOR = rest_prior()

NO_PRIOR = PosturePrior(np.zeros(N_ANGLES), np.zeros((N_ANGLES, N_ANGLES)))
"""Nothing is believed: what the points alone tell."""


def posture_prior(subspace: Subspace, *, noise_m: float = NOISE_M) -> PosturePrior:
    """The Gaussian of the postures that a subspace was made from, for the most probable pose given the markers.

    Full covariance: what lies outside the subspace is held by the residuals, none below LEAST_RESIDUAL_RAD, so that
    markers that speak of every angle are not bent by what others did. noise_m: standard deviation of a marker
    coordinate [m].
    """
    residual = np.maximum(subspace.residual_std_rad, LEAST_RESIDUAL_RAD)
    scaled = subspace.basis * subspace.std_rad
    covariance = scaled @ scaled.T + np.diag(residual**2)
    precision = noise_m**2 * np.linalg.inv(covariance)
    return PosturePrior(subspace.mean_rad, 0.5 * (precision + precision.T))


def subspace_stiffness_m2(subspace: Subspace) -> FloatArray:
    """(l,) float64 [m^2/rad^2], how firmly each coordinate of a subspace is held to its mean against markers.

    Within the subspace a marker can only be reached up to what lies outside it, which counts as its noise: few markers
    that are followed more closely than that throw the digits that have none anywhere.
    """
    outside_m = ARM_M * float(np.sqrt(np.mean(subspace.residual_std_rad**2)))
    stiffness: FloatArray = (NOISE_M**2 + outside_m**2) / np.maximum(subspace.std_rad, 1e-3) ** 2
    return stiffness
