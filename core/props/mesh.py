"""Surfaces of props, for the screen and for exports."""

from __future__ import annotations

import numpy as np

from core.frames import FloatArray, IntArray
from core.props.prop import Prop

AROUND, RINGS = 32, 16
MARKER_RADIUS_M = 0.005

Mesh = tuple[FloatArray, FloatArray, IntArray]
"""Vertices (v, 3) float64 [m], unit normals (v, 3), faces (f, 3) int64, counter-clockwise from outside."""


def prop_mesh(prop: Prop) -> Mesh:
    """The prop's model in its own frame; of one without a model, a ball at each marker."""
    size = prop.model.size_m
    match prop.model.shape:
        case "cylinder":
            return _cylinder(size[0] / 2.0, size[1] / 2.0)
        case "sphere":
            return _sphere(size[0] / 2.0, AROUND, RINGS)
        case "box":
            return _box(0.5 * np.asarray(size))
    ball, normals, faces = _sphere(MARKER_RADIUS_M, AROUND // 2, RINGS // 2)
    n = len(prop.markers_m)
    vertices = (prop.markers_m[:, None] + ball).reshape(-1, 3)
    shifts = np.repeat(np.arange(n) * len(ball), len(faces))[:, None]
    return vertices, np.tile(normals, (n, 1)), np.tile(faces, (n, 1)) + shifts


def _sphere(radius_m: float, around: int, rings: int) -> Mesh:
    polar = np.linspace(0.0, np.pi, rings + 1)
    profile = np.column_stack([np.sin(polar), np.cos(polar)])
    normals, faces = _turned(profile, around)
    solid = np.linalg.norm(np.cross(*_edges(normals, faces)), axis=1) > 1e-12  # at the poles quads are triangles
    return radius_m * normals, normals, faces[solid]


def _cylinder(radius_m: float, half_m: float) -> Mesh:
    """A wall and two lids with edges of their own, so that they stay sharp."""
    parts = []
    for profile, normal in (
        ([[0.0, half_m], [radius_m, half_m]], [0.0, 1.0]),
        ([[radius_m, half_m], [radius_m, -half_m]], [1.0, 0.0]),
        ([[radius_m, -half_m], [0.0, -half_m]], [0.0, -1.0]),
    ):
        vertices, faces = _turned(np.array(profile), AROUND)
        normals, _ = _turned(np.array([normal, normal]), AROUND)
        solid = np.linalg.norm(np.cross(*_edges(vertices, faces)), axis=1) > 1e-15
        parts.append((vertices, normals, faces[solid]))
    return _joined(parts)


def _box(half_m: FloatArray) -> Mesh:
    parts = []
    for axis in range(3):
        for sign in (1.0, -1.0):
            normal, u, v = sign * np.eye(3)[axis], np.eye(3)[(axis + 1) % 3], sign * np.eye(3)[(axis + 2) % 3]
            corners = np.array([normal - u - v, normal + u - v, normal + u + v, normal - u + v]) * half_m
            parts.append((corners, np.tile(normal, (4, 1)), np.array([[0, 1, 2], [0, 2, 3]])))
    return _joined(parts)


def _turned(profile: FloatArray, around: int) -> tuple[FloatArray, IntArray]:
    """A profile (k, 2) of distances from z and heights along it, from the top down, turned about z."""
    angles = np.linspace(0.0, 2.0 * np.pi, around, endpoint=False)
    k = len(profile)
    points = np.empty((k, around, 3))
    points[..., 0] = profile[:, :1] * np.cos(angles)
    points[..., 1] = profile[:, :1] * np.sin(angles)
    points[..., 2] = profile[:, 1:]
    row, column = (grid.ravel() for grid in np.meshgrid(np.arange(k - 1), np.arange(around), indexing="ij"))
    beside = (column + 1) % around
    a, b = row * around + column, row * around + beside
    c, d = a + around, b + around
    faces = np.concatenate([np.column_stack([a, c, d]), np.column_stack([a, d, b])])
    return points.reshape(-1, 3), faces.astype(np.int64)


def _edges(vertices: FloatArray, faces: IntArray) -> tuple[FloatArray, FloatArray]:
    corners = vertices[faces]
    return corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]


def _joined(parts: list[Mesh]) -> Mesh:
    starts = np.cumsum([0, *(len(vertices) for vertices, _, _ in parts)])
    vertices, normals = (np.concatenate([part[i] for part in parts]) for i in (0, 1))
    faces = np.concatenate([faces + start for (_, _, faces), start in zip(parts, starts, strict=False)])
    return vertices, normals, faces
