"""Groups of points that may be one hand each (Han 2018, 4.2; Schröder 2017, "Fully automatic tracking")."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from core.frames import FloatArray, IntArray
from core.labelling import kernels

MAX_CENTRE_DISTANCE_M = 0.200
"""Han 2018, 4.2: centres of clusters that join are no further apart."""

SPARE_POINTS = 3
"""A cluster may hold so many points more than a hand has markers (Han: 22 for 19)."""


MAX_POINTS = 2000
"""Points in a frame that are not a hand's; beyond this the optical system is not calibrated."""

MAX_CROWD = 256
"""Points within reach of each other, of which no hand can be told apart; more are passed over."""

MAX_GAP_M = 0.120
"""Neighbouring markers of one hand are nearer than this,"""

FEW_MARKERS, MAX_GAP_OF_FEW_M = 8, 0.190
"""if it wears more than so many. Those of a few are on the fingertips and near the wrist: on the template 125 mm apart,
142 mm with two of them hidden, on a hand 1.25 times as large 180 mm. (Of 9 to 19 markers 60 to 96 mm, 76 to 99 mm.)"""


def clusters(points_m: FloatArray, n_markers: int) -> list[IntArray]:
    """Indices of the points of each cluster that could be a hand of `n_markers`, the likeliest by number first.

    points_m (n, 3) float64 [m]. A cluster too small to be recognised (fewer than half the markers, or than 4) is
    left out.
    """
    return _clusters_and_crowds(points_m, n_markers)[0]


def groups(points_m: FloatArray, n_markers: int) -> list[IntArray]:
    """As `clusters`, and after them, where clusters touch, the points of all of these together: hands that touch may
    have been cut apart in the wrong place."""
    parts, crowds = _clusters_and_crowds(points_m, n_markers)
    return parts + crowds


def _clusters_and_crowds(points_m: FloatArray, n_markers: int) -> tuple[list[IntArray], list[IntArray]]:
    least = max(4, (n_markers + 1) // 2)
    parts: list[IntArray] = []
    whole: list[IntArray] = []
    for crowd in _crowds(points_m, MAX_GAP_M if n_markers > FEW_MARKERS else MAX_GAP_OF_FEW_M):
        if not least <= len(crowd) <= MAX_CROWD:
            continue
        labels = np.empty(len(crowd), dtype=np.int64)
        count = kernels.agglomerate(points_m[crowd], MAX_CENTRE_DISTANCE_M, n_markers + SPARE_POINTS, labels)
        parts += [crowd[labels == k] for k in range(count)]
        if len(crowd) > n_markers + SPARE_POINTS:
            whole.append(crowd)
    return sorted((part for part in parts if len(part) >= least), key=lambda part: abs(len(part) - n_markers)), whole


def _crowds(points_m: FloatArray, gap_m: float) -> list[IntArray]:
    """Indices of points that hang together by gaps of at most gap_m."""
    n = len(points_m)
    if not 0 < n <= MAX_POINTS:
        return []
    pairs = cKDTree(points_m).query_pairs(gap_m, output_type="ndarray")
    graph = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(n, n))
    count, labels = connected_components(graph, directed=False)
    return [np.flatnonzero(labels == k) for k in range(count)]
