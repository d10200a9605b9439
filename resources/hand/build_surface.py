"""Mesh operations for build_template: cut, cap, subdivide, and weights that flow between seeds."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix, diags
from scipy.sparse.linalg import splu

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Polygon = Sequence[int]


def cut(vertices_m: Array, faces: Ints, z_max_m: float) -> tuple[Array, Ints, Ints]:
    """The mesh without the faces that reach beyond z_max_m: vertices, faces, and which vertices remain."""
    kept = faces[(vertices_m[faces, 2] <= z_max_m).all(axis=1)]
    used = np.unique(kept)
    renumber = np.full(len(vertices_m), -1)
    renumber[used] = np.arange(len(used))
    return vertices_m[used], renumber[kept], used


def rim_of(faces: Sequence[Polygon]) -> list[int]:
    """Vertices of the only open rim, in the order in which a face that closes it runs."""
    directed = {(int(a), int(b)) for face in faces for a, b in zip(face, np.roll(face, -1), strict=True)}
    after = {b: a for a, b in directed if (b, a) not in directed}
    rim = [min(after)]
    while after[rim[-1]] != rim[0]:
        rim.append(after[rim[-1]])
    if len(rim) != len(after):
        raise ValueError(f"the mesh has more than one rim: {len(after)} open edges, {len(rim)} in the first")
    return rim


def cap(vertices_m: Array, faces: Ints, rings: Sequence[tuple[float, float]]) -> tuple[Array, list[Polygon]]:
    """Closes the open rim by rings and one polygon; each ring lies further in by a share of the rim's radius and
    out along z by a length [m]."""
    rim = rim_of(faces.tolist())
    n, edge = len(rim), vertices_m[rim]
    centre = edge.mean(axis=0)
    polygons: list[Polygon] = [list(map(int, face)) for face in faces]
    points, outer = [vertices_m], rim
    for number, (inset, out_m) in enumerate(rings):
        inner = [len(vertices_m) + number * n + k for k in range(n)]
        polygons += [[outer[k], outer[(k + 1) % n], inner[(k + 1) % n], inner[k]] for k in range(n)]
        points.append(edge + (centre - edge) * inset + np.array([0.0, 0.0, out_m]))
        outer = inner
    polygons.append(outer)
    return np.vstack(points), polygons


def subdivide(polygons: Sequence[Polygon], values: Array, smooth: bool = True) -> tuple[Array, Ints]:
    """One Catmull-Clark step of a closed mesh: (v', k) values and (f', 4) quads.

    values: (v, k), positions or anything else that lives at vertices. With smooth=False the old vertices keep
    their values and new ones are means of their edge or face (for weights).
    """
    n, k = len(values), values.shape[1]
    edge_number: dict[tuple[int, int], int] = {}
    edge_faces: list[list[int]] = []
    for f, polygon in enumerate(polygons):
        for a, b in zip(polygon, np.roll(polygon, -1), strict=True):
            key = (min(int(a), int(b)), max(int(a), int(b)))
            if key not in edge_number:
                edge_number[key] = len(edge_faces)
                edge_faces.append([])
            edge_faces[edge_number[key]].append(f)
    face_points = np.stack([values[list(polygon)].mean(axis=0) for polygon in polygons])
    ends = np.array(list(edge_number))
    middles = values[ends].mean(axis=1)
    edge_points = (middles + face_points[np.array(edge_faces)].mean(axis=1)) / 2 if smooth else middles
    old = values.copy()
    if smooth:
        valence = np.zeros(n)
        edge_sum, face_sum = np.zeros((n, k)), np.zeros((n, k))
        for column in (0, 1):
            np.add.at(edge_sum, ends[:, column], middles)
            np.add.at(valence, ends[:, column], 1.0)
        for f, polygon in enumerate(polygons):
            face_sum[list(polygon)] += face_points[f]
        m = valence[:, None]
        old = (face_sum / m + 2.0 * edge_sum / m + (m - 3.0) * values) / m
    quads = []
    for f, polygon in enumerate(polygons):
        corners = [int(corner) for corner in polygon]
        for before, corner, behind in zip(corners[-1:] + corners[:-1], corners, corners[1:] + corners[:1], strict=True):
            first = edge_number[min(corner, behind), max(corner, behind)]
            last = edge_number[min(before, corner), max(before, corner)]
            quads.append([corner, n + first, n + len(ends) + f, n + last])
    return np.vstack([old, edge_points, face_points]), np.array(quads)


def triangles(vertices_m: Array, quads: Ints) -> Ints:
    """(2q, 3) two triangles per quad, cut along the shorter diagonal."""
    across = np.linalg.norm(vertices_m[quads[:, 0]] - vertices_m[quads[:, 2]], axis=1)
    other = np.linalg.norm(vertices_m[quads[:, 1]] - vertices_m[quads[:, 3]], axis=1)
    first = (across <= other)[:, None]
    a = np.where(first, quads[:, [0, 1, 2]], quads[:, [0, 1, 3]])
    b = np.where(first, quads[:, [0, 2, 3]], quads[:, [1, 2, 3]])
    return np.stack([a, b], axis=1).reshape(-1, 3)


def flow_weights(vertices_m: Array, quads: Ints, seeds: Ints, n_joints: int) -> Array:
    """(v, n_joints) weights: 1 at the seeds of a joint, harmonic over the surface between them.

    seeds: (v,) the joint that a vertex belongs to, -1 where the weights are to be found. Edges conduct by the
    inverse of their length.
    """
    edges = np.vstack([quads[:, [k, (k + 1) % 4]] for k in range(4)])
    edges = np.unique(np.sort(edges, axis=1), axis=0)
    conductance = 1.0 / np.maximum(np.linalg.norm(vertices_m[edges[:, 0]] - vertices_m[edges[:, 1]], axis=1), 1e-5)
    n = len(vertices_m)
    rows, columns = np.concatenate([edges, edges[:, ::-1]]).T
    adjacency = coo_matrix((np.tile(conductance, 2), (rows, columns)), shape=(n, n)).tocsr()
    degree = np.asarray(adjacency.sum(axis=1)).ravel()
    free, fixed = np.flatnonzero(seeds < 0), np.flatnonzero(seeds >= 0)
    weights = np.zeros((n, n_joints))
    weights[fixed, seeds[fixed]] = 1.0
    laplacian = diags(degree[free]) - adjacency[free][:, free]
    weights[free] = splu(laplacian.tocsc()).solve(adjacency[free][:, fixed] @ weights[fixed])
    eased = weights**2 * (3.0 - 2.0 * weights)
    total: Array = eased / eased.sum(axis=1, keepdims=True)
    return total
