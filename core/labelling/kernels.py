# mypy: allow-untyped-defs
"""Compiled kernels of labelling: clusters, and rigid alignment of many templates to a few points."""

from __future__ import annotations

from math import sqrt

import numpy as np

from core.compiled import compiler

jit = compiler(nogil=True)


@jit
def agglomerate(points, max_centre_distance, max_points, labels):
    """Join the two nearest clusters again and again (Han 2018, 4.2).

    points (n, 3) [m]. Clusters join while their centres are within max_centre_distance [m] and hold at most
    max_points together; nearest first, by the smallest gap between their points. Writes labels (n,), 0.. by first
    point. Returns the number of clusters.
    """
    n = points.shape[0]
    parent = np.arange(n)
    centre = points.copy()
    size = np.ones(n, dtype=np.int64)
    gap = np.empty((n, n))
    for i in range(n):
        for j in range(n):
            dx, dy, dz = points[i, 0] - points[j, 0], points[i, 1] - points[j, 1], points[i, 2] - points[j, 2]
            gap[i, j] = sqrt(dx * dx + dy * dy + dz * dz)
    alive = np.ones(n, dtype=np.bool_)
    while True:
        best, bi, bj = max_centre_distance, -1, -1
        for i in range(n):
            if not alive[i]:
                continue
            for j in range(i):
                if not alive[j] or gap[i, j] >= best or size[i] + size[j] > max_points:
                    continue
                dx, dy, dz = centre[i, 0] - centre[j, 0], centre[i, 1] - centre[j, 1], centre[i, 2] - centre[j, 2]
                if dx * dx + dy * dy + dz * dz <= max_centre_distance * max_centre_distance:
                    best, bi, bj = gap[i, j], i, j
        if bi < 0:
            break
        total = size[bi] + size[bj]
        for a in range(3):
            centre[bj, a] = (centre[bj, a] * size[bj] + centre[bi, a] * size[bi]) / total
        size[bj] = total
        alive[bi] = False
        for k in range(n):
            if parent[k] == bi:
                parent[k] = bj
            gap[bj, k] = gap[k, bj] = min(gap[bj, k], gap[bi, k])
    count = 0
    for i in range(n):
        if parent[i] == i:
            for k in range(n):
                if parent[k] == i:
                    labels[k] = count
            count += 1
    return count


@jit
def _solve3(a, b, out):
    """Cramer's rule for a symmetric 3 x 3."""
    c00 = a[1, 1] * a[2, 2] - a[1, 2] * a[2, 1]
    c01 = a[1, 2] * a[2, 0] - a[1, 0] * a[2, 2]
    c02 = a[1, 0] * a[2, 1] - a[1, 1] * a[2, 0]
    determinant = a[0, 0] * c00 + a[0, 1] * c01 + a[0, 2] * c02
    if abs(determinant) < 1e-30:
        out[:] = 0.0
        return
    c11 = a[0, 0] * a[2, 2] - a[0, 2] * a[2, 0]
    c12 = a[0, 1] * a[2, 0] - a[0, 0] * a[2, 1]
    c22 = a[0, 0] * a[1, 1] - a[0, 1] * a[1, 0]
    out[0] = (c00 * b[0] + c01 * b[1] + c02 * b[2]) / determinant
    out[1] = (c01 * b[0] + c11 * b[1] + c12 * b[2]) / determinant
    out[2] = (c02 * b[0] + c12 * b[1] + c22 * b[2]) / determinant


@jit
def align_templates(points, templates, rotations, scale_low, scale_high, gate, iterations, costs, out_r, out_t, out_s):
    """Fit every template from every start rotation to a cloud of points, by iterated closest points.

    points (n, 3) [m]; templates (k, m, 3) [m]; rotations (r, 3, 3). Pairs further apart than `gate` [m] do not pull
    and cost gate^2. Writes costs (k * r,) [m^2], the mean over points and markers of the capped squared distance,
    and rotations, translations [m] and scales of each fit.
    """
    n, m = points.shape[0], templates.shape[1]
    cloud = np.zeros(3)
    for i in range(n):
        for a in range(3):
            cloud[a] += points[i, a] / n
    x, pair = np.empty((m, 3)), np.empty(n, dtype=np.int64)
    r, t, turn, new_r = np.empty((3, 3)), np.empty(3), np.empty((3, 3)), np.empty((3, 3))
    a_mat, b_vec, w_vec = np.empty((3, 3)), np.empty(3), np.empty(3)
    pc, qc = np.empty(3), np.empty(3)
    nearest = np.empty(m)
    for k in range(templates.shape[0]):
        middle = np.zeros(3)
        for i in range(m):
            for a in range(3):
                middle[a] += templates[k, i, a] / m
        for start in range(rotations.shape[0]):
            r[:, :] = rotations[start]
            s = sqrt(scale_low * scale_high)
            for a in range(3):
                t[a] = cloud[a] - s * (r[a, 0] * middle[0] + r[a, 1] * middle[1] + r[a, 2] * middle[2])
            cost = 0.0
            for iteration in range(iterations + 1):
                for i in range(m):
                    for a in range(3):
                        x[i, a] = t[a] + s * (
                            r[a, 0] * templates[k, i, 0] + r[a, 1] * templates[k, i, 1] + r[a, 2] * templates[k, i, 2]
                        )
                # Wide at first, so that a wrong start can slide home.
                reach = gate if iteration >= iterations - 4 else 2.0 * gate
                cost = 0.0
                nearest[:] = gate * gate
                used = 0
                pc[:], qc[:] = 0.0, 0.0
                for i in range(n):
                    best, best_j = reach * reach, -1
                    for j in range(m):
                        dx, dy, dz = points[i, 0] - x[j, 0], points[i, 1] - x[j, 1], points[i, 2] - x[j, 2]
                        d = dx * dx + dy * dy + dz * dz
                        if d < best:
                            best, best_j = d, j
                        if d < nearest[j]:
                            nearest[j] = d
                    pair[i] = best_j
                    cost += min(best, gate * gate) / n
                    if best_j >= 0:
                        used += 1
                        for a in range(3):
                            pc[a] += points[i, a]
                            qc[a] += x[best_j, a]
                for j in range(m):
                    cost += nearest[j] / m
                if iteration == iterations or used < 4:
                    break
                for a in range(3):
                    pc[a] /= used
                    qc[a] /= used
                a_mat[:, :], b_vec[:] = 0.0, 0.0
                dot, square = 0.0, 0.0
                for i in range(n):
                    j = pair[i]
                    if j < 0:
                        continue
                    qx, qy, qz = x[j, 0] - qc[0], x[j, 1] - qc[1], x[j, 2] - qc[2]
                    px, py, pz = points[i, 0] - pc[0], points[i, 1] - pc[1], points[i, 2] - pc[2]
                    a_mat[0, 0] += qy * qy + qz * qz
                    a_mat[1, 1] += qx * qx + qz * qz
                    a_mat[2, 2] += qx * qx + qy * qy
                    a_mat[0, 1] -= qx * qy
                    a_mat[0, 2] -= qx * qz
                    a_mat[1, 2] -= qy * qz
                    b_vec[0] += qy * pz - qz * py
                    b_vec[1] += qz * px - qx * pz
                    b_vec[2] += qx * py - qy * px
                    dot += qx * px + qy * py + qz * pz
                    square += qx * qx + qy * qy + qz * qz
                a_mat[1, 0], a_mat[2, 0], a_mat[2, 1] = a_mat[0, 1], a_mat[0, 2], a_mat[1, 2]
                for a in range(3):
                    a_mat[a, a] += 1e-9
                _solve3(a_mat, b_vec, w_vec)
                angle = sqrt(w_vec[0] ** 2 + w_vec[1] ** 2 + w_vec[2] ** 2)
                if angle > 1e-12:
                    c, sn = np.cos(min(angle, 0.7)), np.sin(min(angle, 0.7))
                    ux, uy, uz = w_vec[0] / angle, w_vec[1] / angle, w_vec[2] / angle
                    o = 1.0 - c
                    turn[0, 0], turn[0, 1], turn[0, 2] = c + ux * ux * o, ux * uy * o - uz * sn, ux * uz * o + uy * sn
                    turn[1, 0], turn[1, 1], turn[1, 2] = uy * ux * o + uz * sn, c + uy * uy * o, uy * uz * o - ux * sn
                    turn[2, 0], turn[2, 1], turn[2, 2] = uz * ux * o - uy * sn, uz * uy * o + ux * sn, c + uz * uz * o
                    for a in range(3):
                        for b in range(3):
                            new_r[a, b] = turn[a, 0] * r[0, b] + turn[a, 1] * r[1, b] + turn[a, 2] * r[2, b]
                    old_s = s
                    if square > 0.0 and dot > 0.0:
                        s = min(max(s * dot / square, scale_low), scale_high)
                    # The centre of the matched template points moves onto that of the matched points.
                    for a in range(3):
                        centre_local = 0.0
                        for b in range(3):
                            centre_local += turn[a, b] * (qc[b] - t[b])
                        t[a] = pc[a] - centre_local * s / old_s
                    r[:, :] = new_r
                else:
                    for a in range(3):
                        t[a] += pc[a] - qc[a]
            index = k * rotations.shape[0] + start
            costs[index] = cost
            out_r[index], out_t[index], out_s[index] = r, t, s
