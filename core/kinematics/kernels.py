"""The compiled kernels of the hand's kinematics, all in one module.

One module, because numba's cache does not see an edit in a callee of another file. Every kernel releases the
interpreter and writes into arrays it is handed; the readable entrances are core.kinematics.forward and .solver.

A hand is five independent chains of four angles on a root of six (seven with scale). The normal equations
(Schröder 2017, eq. 2) are therefore an arrow: five 4 x 4 blocks, each coupled to the root block alone, and are
solved by eliminating the digits one by one.
"""

# mypy: allow-untyped-defs
from __future__ import annotations

from math import atan2, cos, exp, log, sin, sqrt

import numpy as np
from numba import njit

from core.hand.skeleton import DOF_JOINTS, JOINT_PARENTS

_PARENTS = np.asarray(JOINT_PARENTS, dtype=np.int64)
_DOF_JOINTS = np.asarray(DOF_JOINTS, dtype=np.int64)
_FIRST_DOF = np.asarray([0, 0, 2, 3] + [d for g in range(1, 5) for d in (4 * g, 4 * g + 2, 4 * g + 3)], dtype=np.int64)
_N_OWN_DOFS = np.asarray([0] + [2, 1, 1] * 5, dtype=np.int64)

N_JOINTS = 16
N_ANGLES = 20
N_DIGITS = 5

SMALLEST, LARGEST = 0.6, 1.5
"""Sizes of a hand, 1 = the template: beyond any adult or child."""

jit = njit(cache=True, nogil=True, fastmath=False)


@jit
def rotation_from_vector(vector, out):
    """Exponential map: (3,) rotation vector [rad] to (3, 3)."""
    angle = sqrt(vector[0] ** 2 + vector[1] ** 2 + vector[2] ** 2)
    if angle < 1e-12:
        out[:, :] = 0.0
        out[0, 0] = out[1, 1] = out[2, 2] = 1.0
        return
    rotation_about(vector[0] / angle, vector[1] / angle, vector[2] / angle, angle, out)


@jit
def rotation_about(x, y, z, angle, out):
    """Rodrigues: unit axis and angle [rad] to (3, 3)."""
    c, s = cos(angle), sin(angle)
    k = 1.0 - c
    out[0, 0] = c + x * x * k
    out[0, 1] = x * y * k - z * s
    out[0, 2] = x * z * k + y * s
    out[1, 0] = y * x * k + z * s
    out[1, 1] = c + y * y * k
    out[1, 2] = y * z * k - x * s
    out[2, 0] = z * x * k - y * s
    out[2, 1] = z * y * k + x * s
    out[2, 2] = c + z * z * k


@jit
def vector_from_rotation(r, out):
    """Logarithm: (3, 3) to the rotation vector (3,) [rad] of length at most pi."""
    # By the quaternion, from its largest component: well conditioned at every angle.
    trace = r[0, 0] + r[1, 1] + r[2, 2]
    q = np.empty(4)
    if trace > 0.0:
        s = sqrt(trace + 1.0) * 2.0
        q[0], q[1], q[2], q[3] = 0.25 * s, (r[2, 1] - r[1, 2]) / s, (r[0, 2] - r[2, 0]) / s, (r[1, 0] - r[0, 1]) / s
    elif r[0, 0] > r[1, 1] and r[0, 0] > r[2, 2]:
        s = sqrt(1.0 + r[0, 0] - r[1, 1] - r[2, 2]) * 2.0
        q[0], q[1], q[2], q[3] = (r[2, 1] - r[1, 2]) / s, 0.25 * s, (r[0, 1] + r[1, 0]) / s, (r[0, 2] + r[2, 0]) / s
    elif r[1, 1] > r[2, 2]:
        s = sqrt(1.0 + r[1, 1] - r[0, 0] - r[2, 2]) * 2.0
        q[0], q[1], q[2], q[3] = (r[0, 2] - r[2, 0]) / s, (r[0, 1] + r[1, 0]) / s, 0.25 * s, (r[1, 2] + r[2, 1]) / s
    else:
        s = sqrt(1.0 + r[2, 2] - r[0, 0] - r[1, 1]) * 2.0
        q[0], q[1], q[2], q[3] = (r[1, 0] - r[0, 1]) / s, (r[0, 2] + r[2, 0]) / s, (r[1, 2] + r[2, 1]) / s, 0.25 * s
    if q[0] < 0.0:
        q = -q
    length = sqrt(q[1] ** 2 + q[2] ** 2 + q[3] ** 2)
    factor = 2.0 * atan2(length, q[0]) / length if length > 1e-12 else 2.0
    for a in range(3):
        out[a] = factor * q[a + 1]


@jit
def _matmul(a, b, out):
    for i in range(3):
        for j in range(3):
            out[i, j] = a[i, 0] * b[0, j] + a[i, 1] * b[1, j] + a[i, 2] * b[2, j]


@jit
def forward(root_t, root_r, angles, scale, offsets, axes, joint_r, joint_p, axes_w):
    """Forward kinematics.

    root_t (3,) [m], root_r (3, 3), angles (20,) [rad], scale; offsets (16, 3) [m] of each joint from its parent
    at rest, axes (20, 3) at rest. Writes joint_r (16, 3, 3), joint_p (16, 3) [m] and axes_w (20, 3), the axis of
    each angle in the world.
    """
    turn = np.empty((3, 3))
    before = np.empty((3, 3))
    for j in range(N_JOINTS):
        if j == 0:
            joint_p[0] = root_t
            joint_r[0] = root_r
            continue
        parent = _PARENTS[j]
        for a in range(3):
            joint_p[j, a] = joint_p[parent, a] + scale * (
                joint_r[parent, a, 0] * offsets[j, 0]
                + joint_r[parent, a, 1] * offsets[j, 1]
                + joint_r[parent, a, 2] * offsets[j, 2]
            )
        joint_r[j] = joint_r[parent]
        for d in range(_FIRST_DOF[j], _FIRST_DOF[j] + _N_OWN_DOFS[j]):
            before[:, :] = joint_r[j]
            for a in range(3):
                axes_w[d, a] = before[a, 0] * axes[d, 0] + before[a, 1] * axes[d, 1] + before[a, 2] * axes[d, 2]
            rotation_about(axes[d, 0], axes[d, 1], axes[d, 2], angles[d], turn)
            _matmul(before, turn, joint_r[j])


@jit
def markers(joint_r, joint_p, scale, marker_joints, marker_locals, out):
    """World positions of markers: marker_locals (m, 3) [m] in the frames of marker_joints (m,). Writes (m, 3)."""
    for i in range(marker_joints.shape[0]):
        j = marker_joints[i]
        for a in range(3):
            out[i, a] = joint_p[j, a] + scale * (
                joint_r[j, a, 0] * marker_locals[i, 0]
                + joint_r[j, a, 1] * marker_locals[i, 1]
                + joint_r[j, a, 2] * marker_locals[i, 2]
            )


@jit
def markers_by_digit(theta, scale, offsets, axes, marker_joints, marker_locals, digit, angles, out):
    """Markers of a hand whose one digit takes each of many shapes.

    theta (26,); angles (n, 4) [rad] for the joints of `digit` 0..4. Writes out (n, m, 3) [m].
    """
    root_r = np.empty((3, 3))
    rotation_from_vector(theta[3:6], root_r)
    bent = theta[6:].copy()
    joint_r, joint_p, axes_w = np.empty((N_JOINTS, 3, 3)), np.empty((N_JOINTS, 3)), np.empty((N_ANGLES, 3))
    for i in range(angles.shape[0]):
        bent[4 * digit : 4 * digit + 4] = angles[i]
        forward(theta[:3], root_r, bent, scale, offsets, axes, joint_r, joint_p, axes_w)
        markers(joint_r, joint_p, scale, marker_joints, marker_locals, out[i])


@jit
def marker_jacobian(point, joint, root_t, joint_p, axes_w, row):
    """Derivative of one marker at `point` on `joint`. Writes row (3, 27).

    Columns: 3 translation, 3 rotation of the root (a small world rotation before the present one), 20 angles,
    logarithm of the scale.
    """
    row[:, :] = 0.0
    x, y, z = point[0] - root_t[0], point[1] - root_t[1], point[2] - root_t[2]
    for a in range(3):
        row[a, a] = 1.0
    row[0, 4], row[0, 5] = z, -y
    row[1, 3], row[1, 5] = -z, x
    row[2, 3], row[2, 4] = y, -x
    row[0, 26], row[1, 26], row[2, 26] = x, y, z
    if joint == 0:
        return
    first = 4 * ((joint - 1) // 3)
    for d in range(first, _FIRST_DOF[joint] + _N_OWN_DOFS[joint]):
        j = _DOF_JOINTS[d]
        px, py, pz = point[0] - joint_p[j, 0], point[1] - joint_p[j, 1], point[2] - joint_p[j, 2]
        ax, ay, az = axes_w[d, 0], axes_w[d, 1], axes_w[d, 2]
        row[0, 6 + d] = ay * pz - az * py
        row[1, 6 + d] = az * px - ax * pz
        row[2, 6 + d] = ax * py - ay * px


@jit
def _dot(row, p, vector):
    return row[0, p] * vector[0] + row[1, p] * vector[1] + row[2, p] * vector[2]


@jit
def _column_dot(row, p, q):
    return row[0, p] * row[0, q] + row[1, p] * row[1, q] + row[2, p] * row[2, q]


@jit
def pose_step(before, after, step):
    """What leads from one pose to another: (26,) parameters each, the rotation as a rotation vector in the world."""
    r0, r1, turn = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    rotation_from_vector(before[3:6], r0)
    rotation_from_vector(after[3:6], r1)
    _matmul(r1, r0.T, turn)
    for d in range(after.shape[0]):
        step[d] = after[d] - before[d]
    vector_from_rotation(turn, step[3:6])


@jit
def pose_moved(theta, step):
    """Take such a step from `theta` (26,), in place."""
    r, turn, moved = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    rotation_from_vector(theta[3:6], r)
    rotation_from_vector(step[3:6], turn)
    _matmul(turn, r, moved)
    for d in range(theta.shape[0]):
        if d < 3 or d >= 6:
            theta[d] += step[d]
    vector_from_rotation(moved, theta[3:6])


@jit
def _cholesky_solve(a, b, n, columns):
    """Solve a x = b in place for n x n positive definite a and b (n, columns). False if a is not."""
    for i in range(n):
        for j in range(i + 1):
            total = a[i, j]
            for k in range(j):
                total -= a[i, k] * a[j, k]
            if i == j:
                if total <= 0.0:
                    return False
                a[i, i] = sqrt(total)
            else:
                a[i, j] = total / a[j, j]
    for c in range(columns):
        for i in range(n):
            total = b[i, c]
            for k in range(i):
                total -= a[i, k] * b[k, c]
            b[i, c] = total / a[i, i]
        for i in range(n - 1, -1, -1):
            total = b[i, c]
            for k in range(i + 1, n):
                total -= a[k, i] * b[k, c]
            b[i, c] = total / a[i, i]
    return True


@jit
def _cost(x, targets, weights, angles, prior, stiffness, coupling, coupling_stiffness, scale, scale_prior, scale_k):
    total = 0.0
    for i in range(x.shape[0]):
        if weights[i] > 0.0:
            dx, dy, dz = x[i, 0] - targets[i, 0], x[i, 1] - targets[i, 1], x[i, 2] - targets[i, 2]
            total += weights[i] * (dx * dx + dy * dy + dz * dz)
    for d in range(N_ANGLES):
        difference = angles[d] - prior[d]
        total += stiffness[d] * difference * difference
    for g in range(1, N_DIGITS):
        difference = angles[4 * g + 3] - coupling * angles[4 * g + 2]
        total += coupling_stiffness * difference * difference
    if scale_k > 0.0:
        difference = log(scale / scale_prior)
        total += scale_k * difference * difference
    return total


@jit
def solve(
    theta, scale, free_scale, targets, weights, offsets, axes, limits, marker_joints, marker_locals,
    prior, stiffness, coupling, coupling_stiffness, scale_prior, scale_k, iterations, tolerance,
    joints_out, markers_out,
):  # fmt: skip
    """Levenberg-Marquardt on the pose of one right hand (Schröder 2017, eq. 1-2; Han 2018, 4.3).

    Minimises sum_i w_i |x_i - t_i|^2 + sum_d k_d (theta_d - prior_d)^2 + k_c sum_fingers (DIP - c PIP)^2 within the
    joint limits. Angles at a limit that the gradient presses outwards are held; every accepted step lowers the
    cost.

    theta (26,) is start and result. targets (m, 3) [m], weights (m,), 0 for a marker not seen. prior and
    stiffness (20,) [rad], [m^2/rad^2]. Writes joints_out (16, 4, 4) and markers_out (m, 3).
    Returns scale, weighted RMS distance of the seen markers [m] (NaN if none), accepted steps.
    """
    m = targets.shape[0]
    nr = 7 if free_scale else 6
    root_t, root_r = theta[:3].copy(), np.empty((3, 3))
    rotation_from_vector(theta[3:6], root_r)
    angles = theta[6:].copy()
    for d in range(N_ANGLES):
        angles[d] = min(max(angles[d], limits[d, 0]), limits[d, 1])
    joint_r, joint_p, axes_w = np.empty((N_JOINTS, 3, 3)), np.empty((N_JOINTS, 3)), np.empty((N_ANGLES, 3))
    x = np.empty((m, 3))
    new_t, new_r, new_angles = np.empty(3), np.empty((3, 3)), np.empty(N_ANGLES)
    turn, small = np.empty((3, 3)), np.empty(3)
    a_dd, b_dr, g_d = np.empty((N_DIGITS, 4, 4)), np.empty((N_DIGITS, 4, 7)), np.empty((N_DIGITS, 4))
    c_rr, g_r = np.empty((7, 7)), np.empty(7)
    work_a, work_b = np.empty((4, 4)), np.empty((N_DIGITS, 4, 8))
    root_a, root_b = np.empty((7, 7)), np.empty((7, 1))
    row, residual = np.empty((3, 27)), np.empty(3)
    held = np.zeros(N_ANGLES, dtype=np.bool_)

    forward(root_t, root_r, angles, scale, offsets, axes, joint_r, joint_p, axes_w)
    markers(joint_r, joint_p, scale, marker_joints, marker_locals, x)
    cost = _cost(
        x, targets, weights, angles, prior, stiffness, coupling, coupling_stiffness, scale, scale_prior, scale_k
    )
    damping = 1e-3
    accepted = 0
    fresh = True
    for _ in range(iterations):
        if fresh:
            # Normal equations at the present pose.
            a_dd[:], b_dr[:], g_d[:], c_rr[:], g_r[:] = 0.0, 0.0, 0.0, 0.0, 0.0
            for i in range(m):
                w = weights[i]
                if w <= 0.0:
                    continue
                for a in range(3):
                    residual[a] = targets[i, a] - x[i, a]
                joint = marker_joints[i]
                marker_jacobian(x[i], joint, root_t, joint_p, axes_w, row)
                for p in range(nr):
                    rp = p if p < 6 else 26
                    g_r[p] += w * _dot(row, rp, residual)
                    for q in range(p + 1):
                        c_rr[p, q] += w * _column_dot(row, rp, q if q < 6 else 26)
                if joint == 0:
                    continue
                g = (joint - 1) // 3
                for p in range(_FIRST_DOF[joint] + _N_OWN_DOFS[joint] - 4 * g):
                    dp = 6 + 4 * g + p
                    g_d[g, p] += w * _dot(row, dp, residual)
                    for q in range(p + 1):
                        a_dd[g, p, q] += w * _column_dot(row, dp, 6 + 4 * g + q)
                    for q in range(nr):
                        b_dr[g, p, q] += w * _column_dot(row, dp, q if q < 6 else 26)
            for g in range(N_DIGITS):
                for k in range(4):
                    d = 4 * g + k
                    a_dd[g, k, k] += stiffness[d]
                    g_d[g, k] += stiffness[d] * (prior[d] - angles[d])
                if g > 0:
                    difference = coupling * angles[4 * g + 2] - angles[4 * g + 3]
                    a_dd[g, 3, 3] += coupling_stiffness
                    a_dd[g, 2, 2] += coupling_stiffness * coupling * coupling
                    a_dd[g, 3, 2] -= coupling_stiffness * coupling
                    g_d[g, 3] += coupling_stiffness * difference
                    g_d[g, 2] -= coupling_stiffness * coupling * difference
            if free_scale and scale_k > 0.0:
                c_rr[6, 6] += scale_k
                g_r[6] += scale_k * log(scale_prior / scale)
            for d in range(N_ANGLES):
                push = g_d[d // 4, d % 4]
                held[d] = (angles[d] <= limits[d, 0] and push < 0.0) or (angles[d] >= limits[d, 1] and push > 0.0)

        # Eliminate the digits, solve the root, substitute back.
        for p in range(nr):
            root_b[p, 0] = g_r[p]
            for q in range(p + 1):
                root_a[p, q] = c_rr[p, q]
            root_a[p, p] += damping * c_rr[p, p] + 1e-12
        good = True
        for g in range(N_DIGITS):
            for p in range(4):
                free_p = not held[4 * g + p]
                for q in range(p + 1):
                    free_q = not held[4 * g + q]
                    work_a[p, q] = a_dd[g, p, q] if free_p and free_q else 0.0
                work_a[p, p] = a_dd[g, p, p] * (1.0 + damping) + 1e-12 if free_p else 1.0
                for q in range(nr):
                    work_b[g, p, q] = b_dr[g, p, q] if free_p else 0.0
                work_b[g, p, nr] = g_d[g, p] if free_p else 0.0
            good = good and _cholesky_solve(work_a, work_b[g], 4, nr + 1)
            for p in range(nr):
                for k in range(4):
                    if not held[4 * g + k]:
                        root_b[p, 0] -= b_dr[g, k, p] * work_b[g, k, nr]
                        for q in range(p + 1):
                            root_a[p, q] -= b_dr[g, k, p] * work_b[g, k, q]
        good = good and _cholesky_solve(root_a, root_b, nr, 1)
        if not good:
            damping = max(damping * 10.0, 1e-6)
            fresh = False
            continue

        for a in range(3):
            new_t[a] = root_t[a] + root_b[a, 0]
            small[a] = root_b[3 + a, 0]
        rotation_from_vector(small, turn)
        _matmul(turn, root_r, new_r)
        new_scale = scale
        if free_scale:
            new_scale = min(max(scale * exp(min(max(root_b[6, 0], -0.1), 0.1)), SMALLEST), LARGEST)
        for d in range(N_ANGLES):
            g, k = d // 4, d % 4
            step = work_b[g, k, nr]
            for q in range(nr):
                step -= work_b[g, k, q] * root_b[q, 0]
            new_angles[d] = min(max(angles[d] + step, limits[d, 0]), limits[d, 1])
        forward(new_t, new_r, new_angles, new_scale, offsets, axes, joint_r, joint_p, axes_w)
        markers(joint_r, joint_p, new_scale, marker_joints, marker_locals, x)
        new_cost = _cost(
            x, targets, weights, new_angles, prior, stiffness, coupling, coupling_stiffness,
            new_scale, scale_prior, scale_k,
        )  # fmt: skip
        if new_cost <= cost:
            gain = cost - new_cost
            root_t[:], root_r[:], angles[:] = new_t, new_r, new_angles
            scale = new_scale
            accepted += 1
            fresh = True
            damping = max(damping * 0.1, 1e-9)
            done = gain <= tolerance * cost
            cost = new_cost
            if done:
                break
        else:
            damping = max(damping * 10.0, 1e-6)
            fresh = False
            if damping > 1e6:
                break

    forward(root_t, root_r, angles, scale, offsets, axes, joint_r, joint_p, axes_w)
    markers(joint_r, joint_p, scale, marker_joints, marker_locals, markers_out)
    theta[:3] = root_t
    vector_from_rotation(root_r, theta[3:6])
    theta[6:] = angles
    joints_out[:] = 0.0
    for j in range(N_JOINTS):
        joints_out[j, :3, :3] = joint_r[j]
        joints_out[j, :3, 3] = joint_p[j]
        joints_out[j, 3, 3] = 1.0
    total, weight = 0.0, 0.0
    for i in range(m):
        if weights[i] > 0.0:
            dx = markers_out[i, 0] - targets[i, 0]
            dy = markers_out[i, 1] - targets[i, 1]
            dz = markers_out[i, 2] - targets[i, 2]
            total += weights[i] * (dx * dx + dy * dy + dz * dz)
            weight += weights[i]
    return scale, sqrt(total / weight) if weight > 0.0 else np.nan, accepted
