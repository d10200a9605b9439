"""The surface of an imported hand: vertices that a file splits are one again, its open end is closed."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from core.frames import FloatArray, IntArray

Skinned = tuple[FloatArray, IntArray, FloatArray]
"""Vertices (v, 3) [m], faces (f, 3), weights (v, j)."""

WELD_M = 1e-6
"""Vertices nearer than this are one that was split for the sake of normals or textures."""


def welded(vertices_m: FloatArray, faces: IntArray, weights: FloatArray) -> Skinned:
    """The same surface with one vertex per place, faces without extent left out; the weights of what was split are
    averaged."""
    pairs = cKDTree(vertices_m).query_pairs(WELD_M, output_type="ndarray")
    first = np.arange(len(vertices_m))
    for a, b in pairs[np.lexsort(pairs.T[::-1])]:
        first[b] = min(first[b], first[a])
    while not np.array_equal(first, first[first]):
        first = first[first]
    faces = first[faces]
    faces = faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]
    used, numbers = np.unique(faces, return_inverse=True)
    sums = np.zeros_like(weights)
    np.add.at(sums, first, weights / weights.sum(axis=1, keepdims=True))
    return vertices_m[used], numbers.reshape(-1, 3), sums[used] / sums[used].sum(axis=1, keepdims=True)


def open_rims(faces: IntArray) -> list[list[int]]:
    """Loops of vertices along which a surface is open, each in the order in which a face that closes it runs."""
    directed = {(int(a), int(b)) for face in faces for a, b in zip(face, np.roll(face, -1), strict=True)}
    after = {b: a for a, b in directed if (b, a) not in directed}
    rims = []
    while after:
        start, following = after.popitem()
        rim = [start]
        while following != start and following in after:
            rim.append(following)
            following = after.pop(following)
        if following == start:
            rims.append(rim)
    return rims


def closed(vertices_m: FloatArray, faces: IntArray, weights: FloatArray) -> Skinned:
    """The surface with a fan over every open rim, such as a wrist's; the fan's middle is carried as its rim is."""
    for rim in open_rims(faces):
        middle = len(vertices_m)
        vertices_m = np.vstack([vertices_m, vertices_m[rim].mean(axis=0)])
        weights = np.vstack([weights, weights[rim].mean(axis=0)])
        fan = [[a, b, middle] for a, b in zip(rim, np.roll(rim, -1), strict=True)]
        faces = np.vstack([faces, fan])
    return vertices_m, faces, weights


def is_closed(faces: IntArray) -> bool:
    """Does every edge belong to two faces that run along it in opposite directions?"""
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    there, back = {tuple(edge) for edge in edges.tolist()}, {tuple(edge) for edge in edges[:, ::-1].tolist()}
    return len(there) == len(edges) and there == back


def wound_outwards(vertices_m: FloatArray, faces: IntArray) -> IntArray:
    """The faces counter-clockwise from outside: turned if the volume that they enclose is negative."""
    a, b, c = np.moveaxis(vertices_m[faces], 1, 0)
    volume = np.einsum("fi,fi->", a, np.cross(b, c))
    return faces if volume >= 0.0 else faces[:, ::-1]
