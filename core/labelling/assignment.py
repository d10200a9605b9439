"""One-to-one assignment of points to markers, each pair near enough (Schröder 2017, eq. 5; Han 2018, eq. 1)."""

from __future__ import annotations

import numpy as np
from scipy.optimize import linear_sum_assignment

from core.frames import NO_POINT, FloatArray, IntArray


def assign(predicted_m: FloatArray, points_m: FloatArray, gates_m: FloatArray | float) -> IntArray:
    """For each predicted marker the index of its point, NO_POINT where none is near enough.

    predicted_m (m, 3), points_m (n, 3) float64 [m]; gates_m: (m,) or one distance [m] beyond which a marker stays
    without a point. The sum of squared distances is least, a marker left out counting its gate squared.
    """
    point = np.full(len(predicted_m), NO_POINT, dtype=np.int64)
    if len(points_m) == 0 or len(predicted_m) == 0:
        return point
    # |x - p|^2 = |x|^2 + |p|^2 - 2 x p would lose digits far from the origin.
    difference = predicted_m[:, None, :] - points_m[None, :, :]
    squared = np.einsum("mna,mna->mn", difference, difference)
    gates = np.broadcast_to(np.square(gates_m), (len(predicted_m),))
    near = squared < gates[:, None]
    # Costs relative to leaving the marker out: never positive, zero beyond the gate.
    cost = np.where(near, squared - gates[:, None], 0.0)
    markers, chosen = linear_sum_assignment(cost)
    good = near[markers, chosen]
    point[markers[good]] = chosen[good]
    return point
