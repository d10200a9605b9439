"""The surface below a marker."""

from __future__ import annotations

import numpy as np

from core.frames import FloatArray
from core.hand.model import HandModel

NEAREST_FACES = 200
"""Faces by their centre that are searched for the nearest point."""


def surface_normals(hand: HandModel, points_m: FloatArray) -> FloatArray:
    """(m, 3) float64, unit, outward: normals of the rest surface at the points nearest to `points_m` (m, 3) [m]."""
    corners = hand.vertices_m[hand.faces]  # (t, 3, 3)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    found = np.empty_like(points_m)
    for k, point in enumerate(points_m):
        near = np.argsort(((corners.mean(axis=1) - point) ** 2).sum(axis=1))[:NEAREST_FACES]
        closest = _closest_on_triangles(corners[near], point)
        squared = ((closest - point) ** 2).sum(axis=1)
        # All faces that share the nearest point, such as those about an edge, give its normal.
        at = near[squared <= squared.min() + 1e-12]
        total = normals[at].sum(axis=0)
        found[k] = total / np.linalg.norm(total)
    return found


def _closest_on_triangles(corners: FloatArray, point: FloatArray) -> FloatArray:
    """(t, 3): the point of each triangle (t, 3, 3) nearest to `point` (3,)."""
    a, ab, ac = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    ap = point - a
    g11, g12, g22 = (ab * ab).sum(1), (ab * ac).sum(1), (ac * ac).sum(1)
    b1, b2 = (ab * ap).sum(1), (ac * ap).sum(1)
    area = np.maximum(g11 * g22 - g12**2, 1e-300)
    u, v = (g22 * b1 - g12 * b2) / area, (g11 * b2 - g12 * b1) / area
    candidates = [a + u[:, None] * ab + v[:, None] * ac]
    inside = (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0)
    for i, j in ((0, 1), (1, 2), (2, 0)):
        start, edge = corners[:, i], corners[:, j] - corners[:, i]
        along = ((point - start) * edge).sum(1) / np.maximum((edge * edge).sum(1), 1e-300)
        candidates.append(start + np.clip(along, 0.0, 1.0)[:, None] * edge)
    squared = np.stack([((c - point) ** 2).sum(1) for c in candidates])
    squared[0, ~inside] = np.inf
    closest: FloatArray = np.stack(candidates)[np.argmin(squared, axis=0), np.arange(len(corners))]
    return closest
