"""Groups of points that may be one hand each (Han 2018, 4.2; Schröder 2017, "Fully automatic tracking")."""

from __future__ import annotations

import numpy as np

from core.frames import FloatArray, IntArray
from core.labelling import kernels

MAX_CENTRE_DISTANCE_M = 0.200
"""Han 2018, 4.2: centres of clusters that join are no further apart."""

SPARE_POINTS = 3
"""A cluster may hold so many points more than a hand has markers (Han: 22 for 19)."""


def clusters(points_m: FloatArray, n_markers: int) -> list[IntArray]:
    """Indices of the points of each cluster that could be a hand of `n_markers`, largest first.

    points_m (n, 3) float64 [m]. A cluster too small to be recognised (fewer than half the markers, or than 4) is
    left out.
    """
    if len(points_m) == 0:
        return []
    labels = np.empty(len(points_m), dtype=np.int64)
    count = kernels.agglomerate(np.ascontiguousarray(points_m), MAX_CENTRE_DISTANCE_M, n_markers + SPARE_POINTS, labels)
    least = max(4, (n_markers + 1) // 2)
    groups = [np.flatnonzero(labels == k) for k in range(count)]
    return sorted((g for g in groups if len(g) >= least), key=len, reverse=True)
