"""Rigid alignment of named points (Kabsch 1976), and the mean shape of points that were seen moving together."""

from __future__ import annotations

import numpy as np

from core.frames import FloatArray

_ROUNDS = 20
_SETTLED_M = 1e-9


def aligned(from_m: FloatArray, to_m: FloatArray) -> FloatArray:
    """(..., 4, 4) float64 [m]: the rigid motions that take points (..., m, 3) best onto (..., m, 3)."""
    middle, centre = from_m.mean(axis=-2, keepdims=True), to_m.mean(axis=-2, keepdims=True)
    u, _, vt = np.linalg.svd(np.swapaxes(to_m - centre, -1, -2) @ (from_m - middle))
    vt[..., 2, :] *= np.linalg.det(u @ vt)[..., None]
    rotations = u @ vt
    motions = np.zeros((*rotations.shape[:-2], 4, 4))
    motions[..., :3, :3], motions[..., 3, 3] = rotations, 1.0
    motions[..., :3, 3] = (centre - middle @ np.swapaxes(rotations, -1, -2))[..., 0, :]
    return motions


def moved(points_m: FloatArray, motions: FloatArray) -> FloatArray:
    """(..., m, 3) float64 [m]: points (..., m, 3) moved by (..., 4, 4)."""
    result: FloatArray = points_m @ np.swapaxes(motions[..., :3, :3], -1, -2) + motions[..., None, :3, 3]
    return result


def mean_shape(samples_m: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The rigid shape that fits all samples best (generalised Procrustes without scale, Gower 1975).

    samples_m: (t, m, 3) float64 [m], finite. Returns the shape (m, 3) [m], where it lay in the first sample, and the
    distance of each point from it (t, m) [m].
    """
    shape: FloatArray = samples_m[0]
    for _ in range(_ROUNDS):
        laid = moved(samples_m, aligned(samples_m, shape))
        better = laid.mean(axis=0)
        better = moved(better, aligned(better, samples_m[0]))
        change_m = np.abs(better - shape).max()
        shape = better
        if change_m < _SETTLED_M:
            break
    laid = moved(samples_m, aligned(samples_m, shape))
    return shape, np.linalg.norm(laid - shape, axis=2)
