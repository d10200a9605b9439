"""Whether a prop looks the same from several sides: from its markers alone nobody can tell then how it is turned."""

from __future__ import annotations

from itertools import permutations

import numpy as np
from scipy.optimize import linear_sum_assignment

from core.frames import FloatArray
from core.props.rigid import aligned, moved

ALIKE_M = 0.001
"""Turned onto itself so well (root mean square), noise decides between the two sides."""

_SIDE_M = 4.0 * ALIKE_M


def alike(markers_m: FloatArray, tolerance_m: float = ALIKE_M) -> tuple[tuple[int, ...], ...]:
    """Every other way to name the markers (m, 3) float64 [m] of a rigid prop that fits within `tolerance_m` (root mean
    square): for each, the marker that lies where marker 0, 1, ... lay before the turn. Empty: it has but one side.
    """
    m = len(markers_m)
    apart_m = np.linalg.norm(markers_m[:, None] - markers_m[None], axis=2)
    base = max(permutations(range(m), 3), key=lambda corners: _area(markers_m[list(corners)]))
    found: dict[tuple[int, ...], None] = {}
    for other in permutations(range(m), 3):
        if any(
            abs(apart_m[other[i], other[j]] - apart_m[base[i], base[j]]) > _SIDE_M for i, j in ((0, 1), (0, 2), (1, 2))
        ):
            continue
        turned = moved(markers_m, aligned(markers_m[list(base)], markers_m[list(other)]))
        cost = np.linalg.norm(turned[:, None] - markers_m[None], axis=2)
        _, names = linear_sum_assignment(np.square(cost))
        settled = moved(markers_m, aligned(markers_m, markers_m[names]))
        rms_m = np.sqrt(np.square(settled - markers_m[names]).sum(axis=1).mean())
        order = tuple(int(name) for name in names)
        if rms_m <= tolerance_m and order != tuple(range(m)):
            found[order] = None
    return tuple(found)


def symmetry_words(markers_m: FloatArray) -> str:
    """What follows for who tracks it, "" for a prop with one side."""
    others = len(alike(markers_m))
    if not others:
        return ""
    sides = "two sides" if others == 1 else f"{others + 1} sides"
    return (
        f"Its markers look the same from {sides}: which one is seen first is chance, unless it begins turned as it was "
        "when it was defined. Move one marker so that no two distances are equal."
    )


def _area(corners_m: FloatArray) -> float:
    a, b, c = corners_m
    return float(np.linalg.norm(np.cross(b - a, c - a)))
