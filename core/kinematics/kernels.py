"""The compiled kernels of the hand's kinematics, all in one module.

One module, because numba's cache does not see an edit in a callee of another file. Every kernel releases the
interpreter, allocates nothing and works in records it is handed: HAND is what a hand is, SPACE where its posture may
be, TASK what is asked and answered, WORK where is calculated. The readable entrances are core.kinematics.forward and
.solver.

The unknowns, in this order: 20 coordinates of the posture (the digit angles themselves, or those of a subspace),
6 of the root, the logarithm of the scale. A marker speaks of the four angles of its own digit and of the root, so the
normal equations (Schröder 2017, eq. 2) are an arrow unless a prior couples the digits; elimination in this order
skips what is zero and needs no other case.
"""

# mypy: allow-untyped-defs
from __future__ import annotations

from math import atan2, cos, exp, inf, log, nan, pi, sin, sqrt

import numpy as np

from core.compiled import compiler
from core.hand.skeleton import DOF_JOINTS, JOINT_PARENTS
from core.markers.layout import MAX_MARKERS

_PARENTS = np.asarray(JOINT_PARENTS, dtype=np.int64)
_DOF_JOINTS = np.asarray(DOF_JOINTS, dtype=np.int64)
_FIRST_DOF = np.asarray([0, 0, 2, 3] + [d for g in range(1, 5) for d in (4 * g, 4 * g + 2, 4 * g + 3)], dtype=np.int64)
_LAST_DOF = _FIRST_DOF + np.asarray([0] + [2, 1, 1] * 5, dtype=np.int64)

N_JOINTS = 16
N_ANGLES = 20
ROOT = 20
"""Column of the first of the root's six unknowns: translation, then a small world rotation before the present one."""
SCALE = 26
RIGHT = 27
"""Column of the right-hand side."""

SMALLEST, LARGEST = 0.6, 1.5
"""Sizes of a hand, 1 = the template: beyond any adult or child."""

SCALE_M2 = 0.01**2
"""A hand larger by a factor e weighs as much as a point 10 mm off: points decide, not this."""

LAYER_M2_PER_RAD2 = 0.005**2
"""Of the second layer: one radian off the subspace's pose weighs as much as a point 5 mm off."""

FAR_M = 1.0
"""Standard deviation of the place of a hand of which nothing is seen; its rotation's is pi."""

HAND = np.dtype(
    [
        ("offsets_m", "f8", (N_JOINTS, 3)),  # of each joint from its parent at rest
        ("axes", "f8", (N_ANGLES, 3)),  # at rest
        ("limits_rad", "f8", (N_ANGLES, 2)),
        ("mean_rad", "f8", N_ANGLES),  # the posture prior
        ("precision_m2", "f8", (N_ANGLES, N_ANGLES)),
        ("n_markers", "i8"),
        ("marker_joints", "i8", MAX_MARKERS),
        ("marker_locals_m", "f8", (MAX_MARKERS, 3)),  # in the frames of their joints
    ],
    align=True,
)
SPACE = np.dtype(
    [
        ("dimensions", "i8"),  # 0: the angles themselves
        ("mean_rad", "f8", N_ANGLES),
        ("basis", "f8", (N_ANGLES, N_ANGLES)),  # the first columns
        ("stiffness_m2", "f8", N_ANGLES),  # towards the mean, per coordinate
    ],
    align=True,
)
TASK = np.dtype(
    [
        ("targets_m", "f8", (MAX_MARKERS, 3)),
        ("weights", "f8", MAX_MARKERS),  # 0 for a marker not seen
        ("expected_rad", "f8", N_ANGLES),  # the motion prior
        ("stiffness_m2", "f8", N_ANGLES),
        ("theta", "f8", 26),  # start and result
        ("scale", "f8"),
        ("rms_m", "f8"),
        ("joints_world", "f8", (N_JOINTS, 4, 4)),
        ("markers_world_m", "f8", (MAX_MARKERS, 3)),
        ("theta_std", "f8", 26),
        ("marker_cov_m2", "f8", (MAX_MARKERS, 3, 3)),
        ("missed", "f8", 26),  # from the pose to the best one, in the order of theta
        ("told", "f8"),  # how many parameters the markers tell
        ("postural", "f8"),  # how many angles are known better than from the posture prior
        ("unusual_m2", "f8"),  # energy of the posture prior
    ],
    align=True,
)
WORK = np.dtype(
    [
        ("root_t", "f8", 3),
        ("root_r", "f8", (3, 3)),
        ("angles", "f8", N_ANGLES),
        ("posture", "f8", N_ANGLES),  # the angles, or the coordinates in a subspace
        ("scale", "f8"),
        ("new_t", "f8", 3),
        ("new_r", "f8", (3, 3)),
        ("new_angles", "f8", N_ANGLES),
        ("new_posture", "f8", N_ANGLES),
        ("new_scale", "f8"),
        ("joint_r", "f8", (N_JOINTS, 3, 3)),
        ("joint_p", "f8", (N_JOINTS, 3)),
        ("axes_w", "f8", (N_ANGLES, 3)),
        ("markers", "f8", (MAX_MARKERS, 3)),
        ("pull", "f8", N_ANGLES),  # of the posture prior at the newest pose
        ("expected", "f8", N_ANGLES),
        ("stiffness", "f8", N_ANGLES),
        ("turn", "f8", (3, 3)),
        ("small", "f8", 3),
        ("columns", "f8", (4, 3)),
        ("row", "f8", (3, RIGHT)),
        ("normal", "f8", (RIGHT, RIGHT + 1)),  # upper triangle, right-hand side last; in angles
        ("system", "f8", (RIGHT, RIGHT + 1)),  # the same in the coordinates that are solved for, damped
        ("product", "f8", (N_ANGLES, RIGHT + 1)),
        ("reached", "f8", N_ANGLES),  # the angles of the posture, were there no limits
        ("new_reached", "f8", N_ANGLES),
        ("free_basis", "f8", (N_ANGLES, N_ANGLES)),  # without the rows of the angles at a limit
        ("held", "i8", RIGHT),
        ("with_prior", "i8"),  # the hand's posture prior counts
        ("width", "i8"),  # RIGHT + 1: a loop whose length the compiler knows is unrolled into scalars, not vectorised
        ("step", "f8", RIGHT + 1),
    ],
    align=True,
)

jit = compiler(nogil=True, fastmath=False, error_model="numpy")


@jit
def rotation_from_vector(vector, out):
    """Exponential map: (3,) rotation vector [rad] to (3, 3) (Rodrigues)."""
    angle = sqrt(vector[0] ** 2 + vector[1] ** 2 + vector[2] ** 2)
    if angle < 1e-12:
        for i in range(3):
            for j in range(3):
                out[i, j] = 1.0 if i == j else 0.0
        return
    x, y, z = vector[0] / angle, vector[1] / angle, vector[2] / angle
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
    if trace > 0.0:
        s = sqrt(trace + 1.0) * 2.0
        w, x, y, z = 0.25 * s, (r[2, 1] - r[1, 2]) / s, (r[0, 2] - r[2, 0]) / s, (r[1, 0] - r[0, 1]) / s
    elif r[0, 0] > r[1, 1] and r[0, 0] > r[2, 2]:
        s = sqrt(1.0 + r[0, 0] - r[1, 1] - r[2, 2]) * 2.0
        w, x, y, z = (r[2, 1] - r[1, 2]) / s, 0.25 * s, (r[0, 1] + r[1, 0]) / s, (r[0, 2] + r[2, 0]) / s
    elif r[1, 1] > r[2, 2]:
        s = sqrt(1.0 + r[1, 1] - r[0, 0] - r[2, 2]) * 2.0
        w, x, y, z = (r[0, 2] - r[2, 0]) / s, (r[0, 1] + r[1, 0]) / s, 0.25 * s, (r[1, 2] + r[2, 1]) / s
    else:
        s = sqrt(1.0 + r[2, 2] - r[0, 0] - r[1, 1]) * 2.0
        w, x, y, z = (r[1, 0] - r[0, 1]) / s, (r[0, 2] + r[2, 0]) / s, (r[1, 2] + r[2, 1]) / s, 0.25 * s
    _vector_from_quaternion(w, x, y, z, out)


@jit
def _vector_from_quaternion(w, x, y, z, out):
    sign = -1.0 if w < 0.0 else 1.0
    length = sqrt(x * x + y * y + z * z)
    factor = sign * (2.0 * atan2(length, sign * w) / length if length > 1e-12 else 2.0)
    out[0], out[1], out[2] = factor * x, factor * y, factor * z


@jit
def _quaternion_from_vector(v):
    angle = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
    factor = sin(0.5 * angle) / angle if angle > 1e-12 else 0.5
    return cos(0.5 * angle), factor * v[0], factor * v[1], factor * v[2]


@jit
def _compose(after, before, sign, out):
    """Rotation vectors: first `before` (backwards if sign is -1), then `after`."""
    a, b, c, d = _quaternion_from_vector(after)
    w, x, y, z = _quaternion_from_vector(before)
    x, y, z = sign * x, sign * y, sign * z
    _vector_from_quaternion(
        a * w - b * x - c * y - d * z,
        a * x + b * w + c * z - d * y,
        a * y - b * z + c * w + d * x,
        a * z + b * y - c * x + d * w,
        out,
    )


@jit
def pose_step(before, after, step):
    """What leads from one pose to another: (26,) parameters each, the rotation as a rotation vector in the world."""
    for d in range(26):
        if d < 3 or d >= 6:
            step[d] = after[d] - before[d]
    _compose(after[3:6], before[3:6], -1.0, step[3:6])


@jit
def pose_moved(theta, step):
    """Take such a step from `theta` (26,), in place."""
    for d in range(26):
        if d < 3 or d >= 6:
            theta[d] += step[d]
    _compose(step[3:6], theta[3:6], 1.0, theta[3:6])


@jit
def forward(root_t, root_r, angles, scale, offsets, axes, joint_r, joint_p, axes_w):
    """Forward kinematics.

    root_t (3,) [m], root_r (3, 3), angles (20,) [rad], scale; offsets (16, 3) [m] of each joint from its parent
    at rest, axes (20, 3) at rest. Writes joint_r (16, 3, 3), joint_p (16, 3) [m] and axes_w (20, 3), the axis of
    each angle in the world.
    """
    for a in range(3):
        joint_p[0, a] = root_t[a]
        for b in range(3):
            joint_r[0, a, b] = root_r[a, b]
    for j in range(1, N_JOINTS):
        parent = _PARENTS[j]
        for a in range(3):
            joint_p[j, a] = joint_p[parent, a] + scale * (
                joint_r[parent, a, 0] * offsets[j, 0]
                + joint_r[parent, a, 1] * offsets[j, 1]
                + joint_r[parent, a, 2] * offsets[j, 2]
            )
            for b in range(3):
                joint_r[j, a, b] = joint_r[parent, a, b]
        for d in range(_FIRST_DOF[j], _LAST_DOF[j]):
            kx, ky, kz = axes[d, 0], axes[d, 1], axes[d, 2]
            c, s = cos(angles[d]), sin(angles[d])
            for a in range(3):
                # One row of the rotation, turned about the axis k of its right side.
                x, y, z = joint_r[j, a, 0], joint_r[j, a, 1], joint_r[j, a, 2]
                along = x * kx + y * ky + z * kz
                axes_w[d, a] = along
                along *= 1.0 - c
                joint_r[j, a, 0] = c * x + s * (y * kz - z * ky) + along * kx
                joint_r[j, a, 1] = c * y + s * (z * kx - x * kz) + along * ky
                joint_r[j, a, 2] = c * z + s * (x * ky - y * kx) + along * kz


@jit
def markers(joint_r, joint_p, scale, count, marker_joints, marker_locals, out):
    """World positions of `count` markers, marker_locals (m, 3) [m] in the frames of marker_joints. Writes (m, 3)."""
    for i in range(count):
        j = marker_joints[i]
        for a in range(3):
            out[i, a] = joint_p[j, a] + scale * (
                joint_r[j, a, 0] * marker_locals[i, 0]
                + joint_r[j, a, 1] * marker_locals[i, 1]
                + joint_r[j, a, 2] * marker_locals[i, 2]
            )


@jit
def markers_by_digit(hands, works, theta, scale, digit, angles, out):
    """Markers of the first hand when one of its digits takes each of many shapes.

    theta (26,); angles (n, 4) [rad] for the joints of `digit` 0..4. Writes out (n, m, 3) [m].
    """
    hand, work = hands[0], works[0]
    rotation_from_vector(theta[3:6], work.root_r)
    for a in range(3):
        work.root_t[a] = theta[a]
    for d in range(N_ANGLES):
        work.angles[d] = theta[6 + d]
    for i in range(angles.shape[0]):
        for k in range(4):
            work.angles[4 * digit + k] = angles[i, k]
        forward(
            work.root_t, work.root_r, work.angles, scale, hand.offsets_m, hand.axes,
            work.joint_r, work.joint_p, work.axes_w,
        )  # fmt: skip
        markers(
            work.joint_r, work.joint_p, scale, hand.n_markers, hand.marker_joints, hand.marker_locals_m, work.markers
        )
        for k in range(out.shape[1]):
            for a in range(3):
                out[i, k, a] = work.markers[k, a]


@jit
def marker_jacobian(point, joint, root_t, joint_p, axes_w, row):
    """Derivative of one marker at `point` on `joint` by the unknowns. Writes row (3, 27)."""
    for a in range(3):
        for d in range(RIGHT):
            row[a, d] = 0.0
        row[a, ROOT + a] = 1.0
        row[a, SCALE] = point[a] - root_t[a]
    x, y, z = row[0, SCALE], row[1, SCALE], row[2, SCALE]
    row[0, ROOT + 4], row[0, ROOT + 5] = z, -y
    row[1, ROOT + 3], row[1, ROOT + 5] = -z, x
    row[2, ROOT + 3], row[2, ROOT + 4] = y, -x
    if joint == 0:
        return
    for d in range(4 * ((joint - 1) // 3), _LAST_DOF[joint]):
        j = _DOF_JOINTS[d]
        px, py, pz = point[0] - joint_p[j, 0], point[1] - joint_p[j, 1], point[2] - joint_p[j, 2]
        ax, ay, az = axes_w[d, 0], axes_w[d, 1], axes_w[d, 2]
        row[0, d] = ay * pz - az * py
        row[1, d] = az * px - ax * pz
        row[2, d] = ax * py - ay * px


@jit
def normal_equations(hand, task, work):
    """J^T W J and J^T W r of the markers at the present pose, into work.normal: upper triangle, r on the right."""
    normal, x, targets, weights, columns = work.normal, work.markers, task.targets_m, task.weights, work.columns
    joint_p, axes_w = work.joint_p, work.axes_w
    for i in range(RIGHT):
        for j in range(work.width):
            normal[i, j] = 0.0
    for i in range(hand.n_markers):
        w = weights[i]
        if not w > 0.0:
            continue
        rx, ry, rz = w * (targets[i, 0] - x[i, 0]), w * (targets[i, 1] - x[i, 1]), w * (targets[i, 2] - x[i, 2])
        px, py, pz = x[i, 0] - work.root_t[0], x[i, 1] - work.root_t[1], x[i, 2] - work.root_t[2]
        # The root: derivatives are the identity (columns 20 to 22), the cross product with p (23 to 25), and p (26).
        wx, wy, wz = w * px, w * py, w * pz
        normal[20, 20] += w
        normal[20, 24] += wz
        normal[20, 25] -= wy
        normal[20, 26] += wx
        normal[20, 27] += rx
        normal[21, 23] -= wz
        normal[21, 25] += wx
        normal[21, 26] += wy
        normal[21, 27] += ry
        normal[22, 23] += wy
        normal[22, 24] -= wx
        normal[22, 26] += wz
        normal[22, 27] += rz
        normal[23, 23] += wy * py + wz * pz
        normal[23, 24] -= wx * py
        normal[23, 25] -= wx * pz
        normal[23, 27] += py * rz - pz * ry
        normal[24, 24] += wx * px + wz * pz
        normal[24, 25] -= wy * pz
        normal[24, 27] += pz * rx - px * rz
        normal[25, 25] += wx * px + wy * py
        normal[25, 27] += px * ry - py * rx
        normal[26, 26] += wx * px + wy * py + wz * pz
        normal[26, 27] += px * rx + py * ry + pz * rz
        joint = hand.marker_joints[i]
        if joint == 0:
            continue
        first = 4 * ((joint - 1) // 3)
        for k in range(_LAST_DOF[joint] - first):
            d = first + k
            j = _DOF_JOINTS[d]
            qx, qy, qz = x[i, 0] - joint_p[j, 0], x[i, 1] - joint_p[j, 1], x[i, 2] - joint_p[j, 2]
            ax, ay, az = axes_w[d, 0], axes_w[d, 1], axes_w[d, 2]
            cx, cy, cz = ay * qz - az * qy, az * qx - ax * qz, ax * qy - ay * qx
            columns[k, 0], columns[k, 1], columns[k, 2] = cx, cy, cz
            normal[d, 27] += cx * rx + cy * ry + cz * rz
            cx, cy, cz = w * cx, w * cy, w * cz
            for q in range(k + 1):
                normal[first + q, d] += columns[q, 0] * cx + columns[q, 1] * cy + columns[q, 2] * cz
            normal[d, 20] += cx
            normal[d, 21] += cy
            normal[d, 22] += cz
            normal[d, 23] += py * cz - pz * cy
            normal[d, 24] += pz * cx - px * cz
            normal[d, 25] += px * cy - py * cx
            normal[d, 26] += px * cx + py * cy + pz * cz
    normal[21, 21] = normal[22, 22] = normal[20, 20]


@jit
def _add_priors(hand, work):
    """Posture prior, motion prior and the scale's, onto the markers' normal equations."""
    normal = work.normal
    for d in range(N_ANGLES):
        if work.with_prior:
            for e in range(d, N_ANGLES):
                normal[d, e] += hand.precision_m2[d, e]
            normal[d, RIGHT] += work.pull[d]
        normal[d, d] += work.stiffness[d]
        normal[d, RIGHT] += work.stiffness[d] * (work.expected[d] - work.angles[d])
    normal[SCALE, SCALE] += SCALE_M2
    normal[SCALE, RIGHT] -= SCALE_M2 * log(work.scale)


@jit
def eliminate(work):
    """Gauss, in place, on the symmetric positive definite work.system: upper triangle and right-hand side; zeros are
    skipped. Leaves D L^T and the right-hand side to match. False if it is not positive definite."""
    system, width = work.system, work.width
    for k in range(RIGHT):
        pivot = system[k, k]
        if not pivot > 0.0:
            return False
        inverse = 1.0 / pivot
        for i in range(k + 1, RIGHT):
            factor = system[k, i] * inverse
            if factor != 0.0:
                # The whole row: what lies left of the diagonal is never read, and whole rows are quickest.
                for j in range(width):
                    system[i, j] -= factor * system[k, j]
    return True


@jit
def _substitute(work):
    system, step = work.system, work.step
    for i in range(RIGHT):
        step[i] = system[i, RIGHT]
    for j in range(RIGHT - 1, -1, -1):
        step[j] /= system[j, j]
        for i in range(j):
            step[i] -= system[i, j] * step[j]


@jit
def _project(space, work):
    """The normal equations in the coordinates of a subspace (J M, Schröder 2017, eq. 4), into work.system."""
    normal, system, basis, product = work.normal, work.system, work.free_basis, work.product
    count, width = space.dimensions, work.width
    for d in range(N_ANGLES):
        for q in range(width):
            product[d, q] = 0.0 if q < ROOT else normal[d, q]
    for d in range(N_ANGLES):
        for e in range(d, N_ANGLES):
            h = normal[d, e]
            if h != 0.0:
                for p in range(count):
                    product[d, p] += h * basis[e, p]
                if e > d:
                    for p in range(count):
                        product[e, p] += h * basis[d, p]
    for p in range(RIGHT):
        for q in range(width):
            system[p, q] = 0.0 if p < N_ANGLES else normal[p, q]
    for d in range(N_ANGLES):
        for p in range(count):
            b = basis[d, p]
            if b != 0.0:
                for q in range(width):
                    system[p, q] += b * product[d, q]
    for p in range(count):
        system[p, p] += space.stiffness_m2[p]
        system[p, RIGHT] -= space.stiffness_m2[p] * work.posture[p]


@jit
def _assemble(space, work, damping):
    """The damped system of the free unknowns (eq. 2), into work.system."""
    system, normal, held, width = work.system, work.normal, work.held, work.width
    if space.dimensions > 0:
        _project(space, work)
    else:
        for i in range(RIGHT):
            for j in range(width):
                system[i, j] = normal[i, j]
    for i in range(RIGHT):
        if held[i]:
            for j in range(i):
                system[j, i] = 0.0
            for j in range(width):
                system[i, j] = 0.0
            system[i, i] = 1.0
        else:
            system[i, i] += damping * (system[i, i] + 1e-9)


@jit
def _bend(hand, space, work):
    """The angles of the new posture, within the limits (eq. 3)."""
    posture, angles, reached, count = work.new_posture, work.new_angles, work.new_reached, space.dimensions
    for d in range(N_ANGLES):
        reached[d] = posture[d] if count == 0 else space.mean_rad[d]
    for p in range(count):
        for d in range(N_ANGLES):
            reached[d] += space.basis[d, p] * posture[p]
    for d in range(N_ANGLES):
        angles[d] = min(max(reached[d], hand.limits_rad[d, 0]), hand.limits_rad[d, 1])
        if count == 0:
            posture[d] = angles[d]


@jit
def _hold(hand, space, work, free_scale, free_root):
    """What must not move: angles at a limit that the gradient presses outwards; unknowns that are given.

    In a subspace it is the angle that stays at its limit, not a coordinate: its row of the basis falls out.
    """
    held = work.held
    for i in range(6):
        held[ROOT + i] = not free_root
    held[SCALE] = not free_scale
    for d in range(N_ANGLES):
        if space.dimensions == 0:
            low, high, push = hand.limits_rad[d, 0], hand.limits_rad[d, 1], work.normal[d, RIGHT]
            held[d] = (work.angles[d] <= low and push < 0.0) or (work.angles[d] >= high and push > 0.0)
            continue
        held[d] = d >= space.dimensions
        inside = hand.limits_rad[d, 0] <= work.reached[d] <= hand.limits_rad[d, 1]
        for p in range(space.dimensions):
            work.free_basis[d, p] = space.basis[d, p] if inside else 0.0


@jit
def _evaluate(hand, space, task, work):
    """Joints, markers and the energy of the new pose."""
    forward(
        work.new_t, work.new_r, work.new_angles, work.new_scale, hand.offsets_m, hand.axes,
        work.joint_r, work.joint_p, work.axes_w,
    )  # fmt: skip
    markers(
        work.joint_r, work.joint_p, work.new_scale, hand.n_markers, hand.marker_joints, hand.marker_locals_m,
        work.markers,
    )  # fmt: skip
    x, targets, angles = work.markers, task.targets_m, work.new_angles
    energy = SCALE_M2 * log(work.new_scale) ** 2
    for i in range(hand.n_markers):
        if task.weights[i] > 0.0:
            dx, dy, dz = x[i, 0] - targets[i, 0], x[i, 1] - targets[i, 1], x[i, 2] - targets[i, 2]
            energy += task.weights[i] * (dx * dx + dy * dy + dz * dz)
    for d in range(N_ANGLES):
        difference = work.expected[d] - angles[d]
        energy += work.stiffness[d] * difference * difference
    return energy + _posture_energy(hand, space, work)


@jit
def _posture_energy(hand, space, work):
    """Energy of the posture prior; its gradient into work.pull."""
    energy = 0.0
    for p in range(space.dimensions):
        energy += space.stiffness_m2[p] * work.new_posture[p] ** 2
    if not work.with_prior:
        return energy
    pull, angles, mean = work.pull, work.new_angles, hand.mean_rad
    for d in range(N_ANGLES):
        pull[d] = 0.0
    for e in range(N_ANGLES):
        difference = mean[e] - angles[e]
        for d in range(N_ANGLES):
            pull[d] += hand.precision_m2[e, d] * difference
    for d in range(N_ANGLES):
        energy += pull[d] * (mean[d] - angles[d])
    return energy


@jit
def _try_step(hand, space, task, work, length):
    """Energy after `length` times the step, within the limits."""
    step = work.step
    for a in range(3):
        work.new_t[a] = work.root_t[a] + length * step[ROOT + a]
        work.small[a] = length * step[ROOT + 3 + a]
    rotation_from_vector(work.small, work.turn)
    turn, r = work.turn, work.root_r
    for i in range(3):
        for j in range(3):
            work.new_r[i, j] = turn[i, 0] * r[0, j] + turn[i, 1] * r[1, j] + turn[i, 2] * r[2, j]
    growth = exp(min(max(length * step[SCALE], -0.1), 0.1))
    work.new_scale = work.scale if step[SCALE] == 0.0 else min(max(work.scale * growth, SMALLEST), LARGEST)
    for p in range(N_ANGLES):
        work.new_posture[p] = work.posture[p] + length * step[p]
    _bend(hand, space, work)
    return _evaluate(hand, space, task, work)


@jit
def _start(task, work):
    """The start of the task as the new pose."""
    for a in range(3):
        work.new_t[a] = task.theta[a]
        work.small[a] = task.theta[3 + a]
    rotation_from_vector(work.small, work.new_r)
    work.new_scale = task.scale
    for d in range(N_ANGLES):
        work.new_angles[d] = task.theta[6 + d]


@jit
def _accept(work):
    _copy_pose(work.new_t, work.new_r, work.new_angles, work.root_t, work.root_r, work.angles)
    for p in range(N_ANGLES):
        work.posture[p], work.reached[p] = work.new_posture[p], work.new_reached[p]
    work.scale = work.new_scale


@jit
def _copy_pose(t, r, angles, to_t, to_r, to_angles):
    for a in range(3):
        to_t[a] = t[a]
        for b in range(3):
            to_r[a, b] = r[a, b]
    for d in range(N_ANGLES):
        to_angles[d] = angles[d]


@jit
def _line_search(work, gain):
    """How much to take of a step whose gain is negative: where a parabola along it is lowest."""
    slope = 0.0  # of the energy along the step: -2 g.step, and g.step is a sum of squares of the eliminated system
    for k in range(RIGHT):
        slope -= 2.0 * work.system[k, RIGHT] ** 2 / work.system[k, k]
    length = 0.5 * slope / (gain + slope)
    return min(max(length, 0.1), 0.5) if length < inf else 0.1


@jit
def _descend(hand, space, task, work, free_scale, free_root, iterations, tolerance):
    """Levenberg-Marquardt from the new pose; leaves the best as the new pose. Every accepted step lowers the energy."""
    for p in range(space.dimensions):
        work.new_posture[p] = 0.0
        for d in range(N_ANGLES):
            work.new_posture[p] += space.basis[d, p] * (work.new_angles[d] - space.mean_rad[d])
    if space.dimensions == 0:
        for d in range(N_ANGLES):
            work.new_posture[d] = work.new_angles[d]
    _bend(hand, space, work)
    energy = _evaluate(hand, space, task, work)
    _accept(work)
    damping = 1e-3
    fresh = True
    for _ in range(iterations):
        if fresh:
            normal_equations(hand, task, work)
            _add_priors(hand, work)
            _hold(hand, space, work, free_scale, free_root)
        _assemble(space, work, damping)
        fresh = False
        gain = -1.0
        if eliminate(work):
            _substitute(work)
            gain = energy - _try_step(hand, space, task, work, 1.0)
            if not gain >= 0.0:
                gain = energy - _try_step(hand, space, task, work, _line_search(work, gain))
        if gain >= 0.0:
            _accept(work)
            energy -= gain
            damping = max(damping * 0.1, 1e-9)
            fresh = True
            if gain <= tolerance * energy:
                break
        else:
            damping = max(damping * 10.0, 1e-6)
            if damping > 1e6:
                break
    _copy_pose(work.root_t, work.root_r, work.angles, work.new_t, work.new_r, work.new_angles)
    work.new_scale = work.scale


@jit
def _answer(hand, task, work):
    """The new pose as the result of the task."""
    forward(
        work.new_t, work.new_r, work.new_angles, work.new_scale, hand.offsets_m, hand.axes,
        work.joint_r, work.joint_p, work.axes_w,
    )  # fmt: skip
    markers(
        work.joint_r, work.joint_p, work.new_scale, hand.n_markers, hand.marker_joints, hand.marker_locals_m,
        task.markers_world_m,
    )  # fmt: skip
    vector_from_rotation(work.new_r, work.small)
    for a in range(3):
        task.theta[a] = work.new_t[a]
        task.theta[3 + a] = work.small[a]
    for d in range(N_ANGLES):
        task.theta[6 + d] = work.new_angles[d]
    task.scale = work.new_scale
    for j in range(N_JOINTS):
        for a in range(3):
            for b in range(3):
                task.joints_world[j, a, b] = work.joint_r[j, a, b]
            task.joints_world[j, a, 3] = work.joint_p[j, a]
    total, weight = 0.0, 0.0
    for i in range(hand.n_markers):
        if task.weights[i] > 0.0:
            for a in range(3):
                total += task.weights[i] * (task.markers_world_m[i, a] - task.targets_m[i, a]) ** 2
            weight += task.weights[i]
    task.rms_m = sqrt(total / weight) if weight > 0.0 else nan


@jit
def solve(hands, whole, spaces, tasks, works, layered, free_scale, free_root, iterations, tolerance):
    """Levenberg-Marquardt on the pose of right hands (Schröder 2017, eq. 1-4; Han 2018, 4.3), one after the other.

    Minimises sum_i w_i |x_i - t_i|^2 + (a - mean)^T P (a - mean) + sum_d k_d (a_d - e_d)^2, a the digit angles, within
    the joint limits. hands, spaces, tasks, works: (n,) of HAND, SPACE, TASK, WORK; whole (1,) SPACE without
    dimensions. In a space with dimensions the space's stiffness stands in for P; layered: first in the space, then
    all parameters, damped towards what the space found (there "Subspace prior", last paragraph).
    """
    for h in range(hands.shape[0]):
        hand, space, task, work = hands[h], spaces[h], tasks[h], works[h]
        _start(task, work)
        work.with_prior = space.dimensions == 0
        for d in range(N_ANGLES):
            work.expected[d] = task.expected_rad[d]
            work.stiffness[d] = task.stiffness_m2[d]
        _descend(hand, space, task, work, free_scale, free_root, iterations, tolerance)
        if layered:
            for d in range(N_ANGLES):
                k = work.stiffness[d]
                work.stiffness[d] = k + LAYER_M2_PER_RAD2
                work.expected[d] = (k * work.expected[d] + LAYER_M2_PER_RAD2 * work.new_angles[d]) / work.stiffness[d]
            _descend(hand, whole[0], task, work, free_scale, free_root, iterations, tolerance)
        _answer(hand, task, work)


@jit
def _inverse_root(work):
    """V with V V^T the inverse of the eliminated system, into work.normal: row p belongs to unknown p."""
    # L^T V = D^-1/2, from the last row up; rows of L^T are those of the system over its diagonal.
    system, out, width = work.system, work.normal, work.width
    for i in range(RIGHT - 1, -1, -1):
        for k in range(width):
            out[i, k] = 0.0
        inverse = 1.0 / system[i, i]
        out[i, i] = sqrt(inverse)
        for j in range(i + 1, RIGHT):
            factor = system[i, j] * inverse
            if factor != 0.0:
                for k in range(width):
                    out[i, k] -= factor * out[j, k]


@jit
def _traced(root, weight, hand, count):
    """Sum of `weight` (20,) times the diagonal of the inverse V V^T, and of the posture prior times it."""
    diagonal, prior = 0.0, 0.0
    for p in range(N_ANGLES):
        for q in range(p, N_ANGLES):
            h = hand.precision_m2[p, q]
            if h == 0.0 and q > p:
                continue
            entry = 0.0
            for k in range(q, count):
                entry += root[p, k] * root[q, k]
            prior += h * entry if q == p else 2.0 * h * entry
            if q == p:
                diagonal += weight[p] * entry
    return diagonal, prior


@jit
def uncertainty(hands, whole, tasks, works, noise_m):
    """One standard deviation of every parameter and how markers scatter, from the inverse of the normal equations with
    priors.

    Of hands as they are in their tasks. Joint limits count as a prior of their width, a hand of which nothing is seen
    is somewhere within FAR_M. Writes theta_std (26,) and marker_cov_m2 (m, 3, 3), the covariance in space: of a marker
    that is seen that of its observation, of another that of its prediction.

    And what speaks for or against this noise: missed (26,), the step that leads, within the limits, to where markers
    and priors of these weights balance; told, of how many parameters the markers tell, and postural, in how many
    directions more is known of the posture than its prior says (the gamma of MacKay, Neural Comput. 4, 1992, eq. 4.6,
    for either); unusual_m2, the energy of the posture prior.
    """
    variance = noise_m * noise_m
    for h in range(hands.shape[0]):
        hand, task, work = hands[h], tasks[h], works[h]
        _start(task, work)
        work.with_prior = True
        for d in range(N_ANGLES):
            work.expected[d] = task.expected_rad[d]
            work.stiffness[d] = task.stiffness_m2[d]
        _evaluate(hand, whole[0], task, work)
        _copy_pose(work.new_t, work.new_r, work.new_angles, work.root_t, work.root_r, work.angles)
        work.scale = work.new_scale
        normal_equations(hand, task, work)
        _add_priors(hand, work)
        for d in range(RIGHT):
            work.held[d] = d == SCALE
        unusual = 0.0
        for d in range(N_ANGLES):
            unusual += work.pull[d] * (hand.mean_rad[d] - work.angles[d])
            width = hand.limits_rad[d, 1] - hand.limits_rad[d, 0]
            work.normal[d, d] += 12.0 * variance / (width * width)
            work.stiffness[d] += 12.0 * variance / (width * width)  # from here on all that is no posture prior
        task.unusual_m2 = unusual
        for a in range(3):
            work.normal[ROOT + a, ROOT + a] += variance / FAR_M**2
            work.normal[ROOT + 3 + a, ROOT + 3 + a] += variance / pi**2
        _assemble(whole[0], work, 0.0)
        eliminate(work)
        _substitute(work)
        for a in range(6):
            task.missed[a] = work.step[ROOT + a]
        for d in range(N_ANGLES):
            best = work.angles[d] + work.step[d]
            best = min(max(best, hand.limits_rad[d, 0]), hand.limits_rad[d, 1])
            task.missed[6 + d] = best - work.angles[d]
        root, row, moved = work.normal, work.row, work.system
        _inverse_root(work)
        other, prior = _traced(root, work.stiffness, hand, SCALE)
        for a in range(6):
            given = variance / (FAR_M**2 if a < 3 else pi**2)
            for k in range(ROOT + a, SCALE):
                other += given * root[ROOT + a, k] ** 2
        task.told = SCALE - other - prior
        task.postural = N_ANGLES - prior
        for p in range(SCALE):
            total = 0.0
            for k in range(p, SCALE):
                total += root[p, k] * root[p, k]
            task.theta_std[p - ROOT if p >= ROOT else p + 6] = noise_m * sqrt(total)
        for i in range(hand.n_markers):
            own = variance / task.weights[i] if task.weights[i] > 0.0 else variance
            for a in range(3):
                for b in range(3):
                    task.marker_cov_m2[i, a, b] = own if a == b else 0.0
            if task.weights[i] > 0.0:
                continue
            joint = hand.marker_joints[i]
            marker_jacobian(work.markers[i], joint, work.root_t, work.joint_p, work.axes_w, row)
            for a in range(3):
                for k in range(work.width):
                    moved[a, k] = 0.0
                for p in range(SCALE):
                    if row[a, p] != 0.0:
                        for k in range(work.width):
                            moved[a, k] += row[a, p] * root[p, k]
            for a in range(3):
                for b in range(a + 1):
                    both = 0.0
                    for k in range(SCALE):
                        both += moved[a, k] * moved[b, k]
                    task.marker_cov_m2[i, a, b] += variance * both
                    if b < a:
                        task.marker_cov_m2[i, b, a] = task.marker_cov_m2[i, a, b]
