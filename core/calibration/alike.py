"""How many keyframes tell as much as one whose errors are its own.

Points do not miss their markers at random: skin and glove slide with the posture, and a model's joints are not quite a
person's, so in like postures a marker misses alike. Of N such frames a mean is known no better than of N / k, with the
design effect k = 1 + sum of the correlations of one frame's errors with all others' (Kish, Survey Sampling, 1965,
section 8.2). The correlations are those of the residuals, in the frame of the bone that carries the marker, of pairs of
keyframes from the likest on; the sum ends where they cease to be positive (as Geyer's initial positive sequence,
Statist. Sci. 7, 1992, section 3.3): further on, residuals are against each other because a fit made them so.
"""

from __future__ import annotations

import numpy as np

from core.calibration.bundle import Bundle
from core.calibration.geometry import Estimate
from core.frames import FloatArray
from core.hand.skeleton import DIGITS

PARTS = 20
"""Classes of pairs by how unlike they are, of equally many pairs."""

LEAST_WEIGHT = 0.3
"""Of a point that tells: others are not of their marker."""


def alike_shots(bundle: Bundle, at: Estimate, noise_m: float) -> float:
    """k, 1 or more, where a bundle adjustment ended. noise_m: of one coordinate [m]."""
    placed = bundle.place(at)
    residuals_m = bundle.residuals_m(placed)
    tells = bundle.weights(residuals_m, noise_m) > LEAST_WEIGHT
    own = np.einsum("fmba,fmb->fma", placed.rotations[:, bundle.joints], residuals_m) * tells[..., None]
    first, second = np.triu_indices(bundle.n_shots, 1)
    unlike = [_unlike(at.angles_rad)] + [_unlike(at.angles_rad[:, 4 * d : 4 * d + 4]) for d in range(len(DIGITS))]
    shared, alone = np.zeros(PARTS), np.zeros(PARTS)
    for k, joint in enumerate(bundle.joints):
        both = tells[first, k] & tells[second, k]
        a, b = first[both], second[both]
        order = np.argsort(unlike[0 if joint == 0 else 1 + (joint - 1) // 3][a, b], kind="stable")
        products = (own[a, k] * own[b, k]).sum(axis=1)[order]
        scatter = np.square(own[tells[:, k], k]).sum(axis=1).mean() if both.any() else 0.0
        for part, rows in enumerate(np.array_split(products, PARTS)):
            shared[part] += rows.sum()
            alone[part] += len(rows) * scatter
    correlations = shared / np.maximum(alone, 1e-30)
    positive = np.argmin(np.append(correlations, -1.0) > 0.0)
    return 1.0 + (bundle.n_shots - 1) * float(correlations[:positive].sum()) / PARTS


def _unlike(angles_rad: FloatArray) -> FloatArray:
    """(f, f) float64 [rad], how far postures (f, k) are apart."""
    unlike: FloatArray = np.sqrt(np.square(angles_rad[:, None] - angles_rad[None]).mean(axis=-1))
    return unlike
