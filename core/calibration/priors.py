"""What is known of a performer's hand and markers before any point is seen."""

from __future__ import annotations

import numpy as np
from scipy.linalg import block_diag

from core.calibration.bundle import Priors
from core.calibration.surface import surface_normals
from core.frames import FloatArray
from core.hand.anthropometry import shape_prior
from core.hand.model import template
from core.hand.shape import N_SHAPE
from core.kinematics.prior import posture_prior
from core.markers.layout import ALONG_M, NORMAL_M
from core.motion.subspace import Subspace
from core.profile import Profile

POSTURE_WEAKNESS = 5.0
"""Keyframes are the extremes of one performer's motion: the posture prior is so many times wider than the postures of a
subspace. A narrower one bends all keyframes alike, and bones with them."""

KNOWN_SIZE_STD = 0.03
"""Of the size of a hand that was measured or calibrated before: a tape's error, a glove."""


def priors_for(profile: Profile) -> Priors:
    """What a profile tells before any point is seen: its hand or, of a generic one, the population's; where its layout
    has the markers; how hands of its subspace are held."""
    layout, subspace = profile.layout, profile.subspace
    shape, mean_log = shape_prior(), shape_prior().mean_log
    if not np.allclose(profile.shape.ratios, 1.0):  # somebody's: measured, imported or calibrated before
        shape, mean_log = shape_prior(KNOWN_SIZE_STD), np.log(profile.shape.ratios * (profile.scale or 1.0))
    normals = surface_normals(template(), layout.positions_m)
    across = normals[:, :, None] * normals[:, None, :]
    proportions = np.asarray(np.linalg.inv(shape.covariance_log), dtype=np.float64)
    displacement = np.asarray(across / NORMAL_M**2 + (np.eye(3) - across) / ALONG_M**2, dtype=np.float64)
    return Priors(
        mean_log,
        proportions,
        displacement,
        subspace.mean_rad,
        _posture_precision(subspace),
    )


def _posture_precision(subspace: Subspace) -> FloatArray:
    """(20, 20) float64 [1/rad^2]."""
    precision: FloatArray = posture_prior(subspace, noise_m=1.0).precision_m2 / POSTURE_WEAKNESS**2
    return precision


def fixed_covariance(profile: Profile) -> FloatArray:
    """(n, n) float64, how well a profile's shape and marker places are known: what its calibration left open, or else
    what the priors do. Order and units as of a FixedCovariance."""
    if profile.calibrated is not None:
        return profile.calibrated.covariance.matrix
    priors = priors_for(profile)
    covariance = block_diag(np.linalg.inv(priors.shape_precision), *np.linalg.inv(priors.marker_precision_m))
    # A generic hand is the template, which is not quite the population's mean: it is off by that, too.
    off = priors.shape_mean - np.log(profile.shape.ratios * (profile.scale or 1.0))
    covariance[:N_SHAPE, :N_SHAPE] += np.outer(off, off)
    known: FloatArray = covariance
    return known
