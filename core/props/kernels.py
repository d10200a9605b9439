# mypy: allow-untyped-defs
"""Compiled kernels of props: which points of a cloud are the markers of one rigid thing, and where it is."""

from __future__ import annotations

from math import acos, pi, sqrt

import numpy as np

from core.compiled import compiler

jit = compiler(nogil=True)


@jit
def place(markers, pose, placed):
    """Writes markers (m, 3) moved by pose (4, 4) to placed (m, 3) [m]."""
    for k in range(markers.shape[0]):
        for a in range(3):
            placed[k, a] = (
                pose[a, 3] + pose[a, 0] * markers[k, 0] + pose[a, 1] * markers[k, 1] + pose[a, 2] * markers[k, 2]
            )


@jit
def fit(markers, points, point, anchors, pull, pose):
    """The rigid motion of markers (m, 3) onto their points (Kabsch 1976); writes pose (4, 4).

    point (m,): row of each marker's point in points (n, 3), below 0 if not seen; those are drawn to anchors (m, 3) [m]
    with weight `pull` each, so that what the seen ones leave open stays as it was. Returns the root mean square
    distance of the seen ones [m].
    """
    m = markers.shape[0]
    middle, centre, total = np.zeros(3), np.zeros(3), 0.0
    for k in range(m):
        w = 1.0 if point[k] >= 0 else pull
        total += w
        for a in range(3):
            middle[a] += w * markers[k, a]
            centre[a] += w * (points[point[k], a] if point[k] >= 0 else anchors[k, a])
    middle /= total
    centre /= total
    moment = np.zeros((3, 3))
    for k in range(m):
        w = 1.0 if point[k] >= 0 else pull
        for a in range(3):
            to = (points[point[k], a] if point[k] >= 0 else anchors[k, a]) - centre[a]
            for b in range(3):
                moment[a, b] += w * to * (markers[k, b] - middle[b])
    u, _, vt = np.linalg.svd(moment)
    if np.linalg.det(u) * np.linalg.det(vt) < 0.0:
        vt[2] *= -1.0
    pose[3, :] = 0.0
    pose[3, 3] = 1.0
    for a in range(3):
        pose[a, 3] = centre[a]
        for b in range(3):
            pose[a, b] = u[a, 0] * vt[0, b] + u[a, 1] * vt[1, b] + u[a, 2] * vt[2, b]
    for a in range(3):
        for b in range(3):
            pose[a, 3] -= pose[a, b] * middle[b]
    squared, seen = 0.0, 0
    for k in range(m):
        if point[k] >= 0:
            seen += 1
            for a in range(3):
                d = pose[a, 3] - points[point[k], a]
                for b in range(3):
                    d += pose[a, b] * markers[k, b]
                squared += d * d
    return sqrt(squared / max(seen, 1))


@jit
def label_near(placed, points, free, gate, point):
    """Give markers without a point (point below 0) the nearest free ones within `gate` [m], nearest pair first.

    placed (m, 3), points (n, 3) [m], free (n,) bool. Returns how many markers have a point.
    """
    m, n = placed.shape[0], points.shape[0]
    count = 0
    for k in range(m):
        count += point[k] >= 0
    while count < m:
        best, best_k, best_i = gate * gate, -1, -1
        for i in range(n):
            if not free[i]:
                continue
            taken = False
            for k in range(m):
                taken |= point[k] == i
            if taken:
                continue
            for k in range(m):
                if point[k] >= 0:
                    continue
                dx, dy, dz = points[i, 0] - placed[k, 0], points[i, 1] - placed[k, 1], points[i, 2] - placed[k, 2]
                d = dx * dx + dy * dy + dz * dz
                if d < best:
                    best, best_k, best_i = d, k, i
        if best_k < 0:
            break
        point[best_k] = best_i
        count += 1
    return count


@jit
def follow(markers, points, ids, free, known, expected, id_gate, gate, fine_gate, limit, few_limit, pull, pose, point):
    """A prop near a pose where it is expected (4, 4). known (m,): id that each marker's point had, -1 for none.

    Points with known ids come first, then the nearest within `gate`; what does not fit one rigid motion is dropped, and
    all is labelled again within fine_gate of it. Writes pose (4, 4) and point (m,). Returns the root mean square
    distance [m], infinite if fewer than three markers fit within `limit`, or just three of more not within few_limit.
    """
    m = markers.shape[0]
    anchors, placed = np.empty((m, 3)), np.empty((m, 3))
    place(markers, expected, anchors)
    for with_ids in range(2):
        point[:] = -1
        if with_ids == 0:
            count = 0
            for k in range(m):
                if known[k] < 0:
                    continue
                for i in range(points.shape[0]):
                    if ids[i] == known[k] and free[i]:
                        d = 0.0
                        for a in range(3):
                            d += (points[i, a] - anchors[k, a]) ** 2
                        if d < id_gate * id_gate:
                            point[k] = i
                            count += 1
            if count < 3:
                continue
        else:
            count = label_near(anchors, points, free, gate, point)
        rms = np.inf
        while count >= 3:
            rms = fit(markers, points, point, anchors, pull, pose)
            if rms <= limit:
                break
            place(markers, pose, placed)
            worst, worst_k = -1.0, 0
            for k in range(m):
                if point[k] >= 0:
                    d = 0.0
                    for a in range(3):
                        d += (points[point[k], a] - placed[k, a]) ** 2
                    if d > worst:
                        worst, worst_k = d, k
            point[worst_k] = -1
            count -= 1
        if count < 3:
            continue
        for _ in range(2):
            place(markers, pose, placed)
            point[:] = -1
            count = label_near(placed, points, free, fine_gate, point)
            if count < 3:
                break
            rms = fit(markers, points, point, anchors, pull, pose)
        if count >= 3 and rms <= (limit if count > 3 or m == 3 else few_limit):
            return rms
    point[:] = -1
    return np.inf


@jit
def frame_of(a, b, c, axes):
    """Writes the orthonormal axes (columns) of a triangle: along a-b, across it towards c, and their normal."""
    u, v = b - a, c - a
    u = u / sqrt((u * u).sum())
    v = v - (u * v).sum() * u
    v = v / max(sqrt((v * v).sum()), 1e-12)
    axes[:, 0], axes[:, 1] = u, v
    axes[0, 2] = u[1] * v[2] - u[2] * v[1]
    axes[1, 2] = u[2] * v[0] - u[0] * v[2]
    axes[2, 2] = u[0] * v[1] - u[1] * v[0]


@jit
def find(markers, triangles, points, rows, tolerance, limit, least, last, turn_cost, pose, point):
    """The pose that explains most markers, from every triangle of points that is congruent to one of the markers'.

    triangles (t, 3): indices of markers; rows: of the points to look among; tolerance: of a side [m]; limit: of the
    root mean square distance [m]; least: fewest markers. Of poses that explain as much the one turned least from `last`
    (4, 4) is kept, where turn_cost > 0. Writes pose and point. Returns the root mean square distance [m], or infinity.
    """
    n, m = rows.shape[0], markers.shape[0]
    cloud = np.empty((n, 3))
    for i in range(n):
        cloud[i] = points[rows[i]]
    apart = np.empty((n, n))
    for i in range(n):
        for j in range(n):
            dx, dy, dz = cloud[i, 0] - cloud[j, 0], cloud[i, 1] - cloud[j, 1], cloud[i, 2] - cloud[j, 2]
            apart[i, j] = sqrt(dx * dx + dy * dy + dz * dz)
    side = np.empty((m, m))
    for i in range(m):
        for j in range(m):
            side[i, j] = sqrt(np.square(markers[i] - markers[j]).sum())
    free = np.ones(n, dtype=np.bool_)
    trial, labels, best_labels = np.empty((4, 4)), np.empty(m, dtype=np.int64), np.full(m, -1, dtype=np.int64)
    placed, anchors = np.empty((m, 3)), np.zeros((m, 3))
    own, there = np.empty((3, 3)), np.empty((3, 3))
    best, best_rms = np.inf, np.inf
    for triangle in range(triangles.shape[0]):
        a, b, c = triangles[triangle, 0], triangles[triangle, 1], triangles[triangle, 2]
        frame_of(markers[a], markers[b], markers[c], own)
        middle = (markers[a] + markers[b] + markers[c]) / 3.0
        for i in range(n):
            for j in range(n):
                if i == j or abs(apart[i, j] - side[a, b]) > tolerance:
                    continue
                for k in range(n):
                    if k in (i, j):
                        continue
                    if abs(apart[i, k] - side[a, c]) > tolerance or abs(apart[j, k] - side[b, c]) > tolerance:
                        continue
                    if best_labels[a] == i and best_labels[b] == j and best_labels[c] == k:
                        continue
                    # Nearly all triangles are chance: laid on by their sides alone, few have more markers about them.
                    frame_of(cloud[i], cloud[j], cloud[k], there)
                    for r in range(3):
                        for q in range(3):
                            trial[r, q] = there[r, 0] * own[q, 0] + there[r, 1] * own[q, 1] + there[r, 2] * own[q, 2]
                    for r in range(3):
                        trial[r, 3] = (cloud[i, r] + cloud[j, r] + cloud[k, r]) / 3.0
                        for q in range(3):
                            trial[r, 3] -= trial[r, q] * middle[q]
                    place(markers, trial, placed)
                    labels[:] = -1
                    if label_near(placed, cloud, free, 2.0 * tolerance, labels) < least:
                        continue
                    fit(markers, cloud, labels, anchors, 0.0, trial)
                    place(markers, trial, placed)
                    labels[:] = -1
                    count = label_near(placed, cloud, free, tolerance, labels)
                    if count < least:
                        continue
                    rms = fit(markers, cloud, labels, anchors, 0.0, trial)
                    if rms > limit:
                        continue
                    trace = (trial[:3, :3] * last[:3, :3]).sum()
                    turn = acos(min(1.0, max(-1.0, 0.5 * (trace - 1.0)))) / pi
                    cost = rms / limit - count + turn_cost * turn
                    if cost < best:
                        best, best_rms = cost, rms
                        pose[:] = trial
                        best_labels[:] = labels
    for k in range(m):
        point[k] = rows[best_labels[k]] if best_labels[k] >= 0 else -1
    return best_rms
