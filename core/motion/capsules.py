"""Capsules in place of flesh: where the digits, the palms and a prop touch, for many poses at once.

Every bone of a digit and every metacarpal of a right hand is a capsule, a segment with a radius. The radii are those of
flesh that gives: the lower quartile of the template surface's distance from the bone, less 5 %. Arrays hold n poses.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from core.frames import BoolArray, FloatArray, IntArray
from core.hand.skeleton import DOF_JOINTS, JOINT_PARENTS, N_JOINTS, N_ROOT_DOFS, Skeleton
from core.motion.library import Prop

N_BONES = 19
"""15 bones of the digits, joint j of the skeleton carries bone j - 1, then four metacarpals: index to pinky."""

_RADII_M = 0.95e-3 * np.array(
    [11.4, 8.8, 5.9, 8.9, 7.7, 5.4, 8.8, 7.6, 6.2, 8.3, 7.3, 5.7, 6.9, 6.2, 4.7, 9.5, 9.5, 9.0, 8.5]
)
_KNUCKLES = (4, 7, 10, 13)
_JOINT_OF = np.array([*range(1, 16), 0, 0, 0, 0])
_DIGIT_OF = np.array([*np.repeat(range(5), 3), 5, 5, 5, 5])


def _pairs() -> tuple[IntArray, IntArray]:
    """Pairs of bones of one hand that must not pass through each other: of different digits, and thumb or fingertip
    against palm. Neighbours at the root of a digit are of one flesh."""
    pairs = [(a, b) for a in range(15) for b in range(a + 1, 15) if _DIGIT_OF[a] != _DIGIT_OF[b]]
    pairs = [(a, b) for a, b in pairs if a != 0 or b % 3 != 0]  # the thumb's metacarpal and the webs
    pairs += [(2, 15 + k) for k in range(4)] + [(1, 15 + k) for k in range(1, 4)]
    pairs += [(2 + 3 * finger, 14 + finger) for finger in range(1, 5)]
    first, second = np.array(pairs).T
    return first, second


PAIRS = _pairs()


@dataclass(frozen=True)
class Posed:
    """n poses of a right hand: joints (n, 16, 3) [m], axes (n, 20, 3) unit, of every digit angle, and the capsules'
    ends, starts_m and ends_m (n, 19, 3) [m], in the frame that the parameters are in."""

    joints_m: FloatArray
    rotations: FloatArray
    axes: FloatArray
    starts_m: FloatArray
    ends_m: FloatArray

    def __getitem__(self, rows: IntArray | BoolArray) -> Posed:
        """Some of the poses."""
        return Posed(self.joints_m[rows], self.rotations[rows], self.axes[rows], self.starts_m[rows], self.ends_m[rows])

    def moved(self, shift_m: FloatArray) -> Posed:
        """All of them moved by (n, 3) or (3,) [m]."""
        shift = np.broadcast_to(shift_m, (len(self.joints_m), 3))[:, None]
        return Posed(self.joints_m + shift, self.rotations, self.axes, self.starts_m + shift, self.ends_m + shift)

    def mirrored(self) -> Posed:
        """The hand of the other side; its axes turn so that the angles keep their sense."""
        flip = np.array([-1.0, 1.0, 1.0])
        rotations = self.rotations * flip[:, None] * flip
        return Posed(self.joints_m * flip, rotations, -self.axes * flip, self.starts_m * flip, self.ends_m * flip)


class Flesh:
    """The capsules of one right hand. skeleton: in its true size. radii_m: (19,) float64 [m]."""

    def __init__(self, skeleton: Skeleton, size: float) -> None:
        """size: the hand's over the template's."""
        self.skeleton = skeleton
        self.radii_m = _RADII_M * size
        joints, tips = skeleton.joint_positions_m, skeleton.tip_positions_m
        self._offsets = joints - joints[np.maximum(JOINT_PARENTS, 0)]
        self._crosses = np.array([np.cross(np.eye(3), axis) for axis in skeleton.axes])
        self._squares = self._crosses @ self._crosses
        beyond = np.zeros((N_JOINTS, 3))  # end of each digit's bone from its joint
        for j in range(1, N_JOINTS):
            if j % 3:
                beyond[j] = joints[j + 1] - joints[j]
            else:
                bone = tips[j // 3 - 1] - joints[j]
                beyond[j] = bone * (1.0 - self.radii_m[j - 1] / np.linalg.norm(bone))
        self._beyond = beyond[1:]
        self._carpals = np.array([joints[k] * (0.25, 0.0, 0.3) for k in _KNUCKLES])

    def posed(self, theta: FloatArray) -> Posed:
        """theta: (n, 26) float64, of right hands."""
        n = len(theta)
        rotations, positions = np.empty((n, N_JOINTS, 3, 3)), np.empty((n, N_JOINTS, 3))
        axes = np.empty((n, 20, 3))
        rotations[:, 0] = Rotation.from_rotvec(theta[:, 3:6].copy()).as_matrix()
        positions[:, 0] = theta[:, :3]
        sines, versines = np.sin(theta[:, N_ROOT_DOFS:]), 1.0 - np.cos(theta[:, N_ROOT_DOFS:])
        dof = 0
        for j in range(1, N_JOINTS):
            parent = JOINT_PARENTS[j]
            turn = rotations[:, parent]
            positions[:, j] = positions[:, parent] + turn @ self._offsets[j]
            while dof < 20 and DOF_JOINTS[dof] == j:
                axes[:, dof] = turn @ self.skeleton.axes[dof]
                own = (
                    np.eye(3)
                    + sines[:, dof, None, None] * self._crosses[dof]
                    + versines[:, dof, None, None] * self._squares[dof]
                )
                turn = turn @ own
                dof += 1
            rotations[:, j] = turn
        starts, ends = np.empty((n, N_BONES, 3)), np.empty((n, N_BONES, 3))
        starts[:, :15] = positions[:, 1:]
        ends[:, :15] = positions[:, 1:] + np.einsum("njab,jb->nja", rotations[:, 1:], self._beyond)
        starts[:, 15:] = positions[:, :1] + np.einsum("nab,kb->nka", rotations[:, 0], self._carpals)
        ends[:, 15:] = positions[:, _KNUCKLES]
        return Posed(positions, rotations, axes, starts, ends)


@dataclass(frozen=True)
class Touch:
    """k pairs of bones near to each other: gap (k,) [m] between their surfaces, negative inside; points (k, 3) [m] on
    their axes; normal (k, 3), unit, from second to first."""

    gap_m: FloatArray
    first_m: FloatArray
    second_m: FloatArray
    normal: FloatArray


def between(
    starts_a: FloatArray, ends_a: FloatArray, radii_a: FloatArray, starts_b: FloatArray, ends_b: FloatArray,
    radii_b: FloatArray,
) -> Touch:  # fmt: skip
    """Closest approach of capsules, (..., 3) each (Ericson 2005, Real-Time Collision Detection, 5.1.9)."""
    u, v, w = ends_a - starts_a, ends_b - starts_b, starts_a - starts_b
    a, b, c = _dot(u, u), _dot(u, v), _dot(v, v)
    d, e = _dot(u, w), _dot(v, w)
    s = np.clip((b * e - c * d) / np.maximum(a * c - b * b, 1e-12), 0.0, 1.0)
    t = (b * s + e) / c
    s = np.where(t < 0.0, np.clip(-d / a, 0.0, 1.0), np.where(t > 1.0, np.clip((b - d) / a, 0.0, 1.0), s))
    t = np.clip(t, 0.0, 1.0)
    first, second = starts_a + s[..., None] * u, starts_b + t[..., None] * v
    apart = first - second
    distance = np.sqrt(_dot(apart, apart))
    return Touch(distance - radii_a - radii_b, first, second, apart / np.maximum(distance, 1e-9)[..., None])


def own_touches(posed: Posed, radii_m: FloatArray, pairs: tuple[IntArray, IntArray] = PAIRS) -> Touch:
    """(n, pairs): the bones of a hand against each other."""
    a, b = pairs
    return between(
        posed.starts_m[:, a], posed.ends_m[:, a], radii_m[a], posed.starts_m[:, b], posed.ends_m[:, b], radii_m[b]
    )


def cross_touches(right: Posed, left: Posed, radii_m: FloatArray) -> Touch:
    """(n, 19 x 19): the bones of one hand against those of the other, both in the world; left varies fastest."""
    a, b = (grid.ravel() for grid in np.meshgrid(np.arange(N_BONES), np.arange(N_BONES), indexing="ij"))
    return between(
        right.starts_m[:, a], right.ends_m[:, a], radii_m[a], left.starts_m[:, b], left.ends_m[:, b], radii_m[b]
    )


def prop_distance(prop: Prop, points_m: FloatArray) -> FloatArray:
    """(...) [m] signed distance of points (..., 3) [m], in the prop's frame, from its surface; negative inside."""
    size = prop.size_m
    if prop.shape == "sphere":
        distance: FloatArray = np.linalg.norm(points_m, axis=-1) - size[0] / 2.0
        return distance
    if prop.shape == "box":
        over = np.abs(points_m) - np.asarray(size) / 2.0
    else:
        radial = np.hypot(points_m[..., 0], points_m[..., 1]) - size[0] / 2.0
        over = np.stack([radial, np.abs(points_m[..., 2]) - size[1] / 2.0], axis=-1)
    outside = np.linalg.norm(np.maximum(over, 0.0), axis=-1)
    depth: FloatArray = outside + np.minimum(over.max(axis=-1), 0.0)
    return depth


_SAMPLES = np.linspace(0.0, 1.0, 5)


def prop_touches(posed: Posed, radii_m: FloatArray, prop: Prop, transforms: FloatArray) -> Touch:
    """(n, 19): the bones of a hand against a prop. transforms: (n, 4, 4), prop in the frame of the poses."""
    along = posed.starts_m[..., None, :] + _SAMPLES[:, None] * (posed.ends_m - posed.starts_m)[..., None, :]
    rotation, origin = transforms[:, :3, :3], transforms[:, :3, 3]
    local = np.einsum("nba,njsb->njsa", rotation, along - origin[:, None, None])
    distance = prop_distance(prop, local)
    nearest = distance.argmin(axis=2)[..., None]
    point = np.take_along_axis(local, nearest[..., None], axis=2)[:, :, 0]
    h = 1e-5
    slope = np.stack(
        [prop_distance(prop, point + h * unit) - prop_distance(prop, point - h * unit) for unit in np.eye(3)], axis=-1
    )
    slope /= np.maximum(np.linalg.norm(slope, axis=-1, keepdims=True), 1e-9)
    normal = np.einsum("nab,njb->nja", rotation, slope)
    gap = np.take_along_axis(distance, nearest, axis=2)[..., 0] - radii_m
    world = np.take_along_axis(along, nearest[..., None], axis=2)[:, :, 0]
    return Touch(gap, world, world, normal)


def pushed(posed: Posed, rows: IntArray, bones: IntArray, points_m: FloatArray, pushes: FloatArray) -> FloatArray:
    """(k, 23): how far each push moves with the wrist's translation (3) and the digits' angles (20), per unit.

    rows (k,): poses. bones (k,), points_m (k, 3): where. pushes: (k, 3) unit, direction.
    """
    lever = np.zeros((len(rows), 23))
    lever[:, :3] = pushes
    joint = _JOINT_OF[bones]
    digit = _DIGIT_OF[bones]
    for dof in range(20):
        moves = (digit == dof // 4) & (np.asarray(DOF_JOINTS[dof]) <= joint)
        if moves.any():
            k = np.flatnonzero(moves)
            arm = points_m[k] - posed.joints_m[rows[k], DOF_JOINTS[dof]]
            lever[k, 3 + dof] = _dot(np.cross(posed.axes[rows[k], dof], arm), pushes[k])
    return lever


def _dot(a: FloatArray, b: FloatArray) -> FloatArray:
    product: FloatArray = np.einsum("...i,...i->...", a, b)
    return product
