"""A hand as a file rigs it, and how it becomes one of ours.

The file's joints give the hand frame and the bones; its flat rest pose is found by the angles at which our skeleton
has the same bones. So an angle means on an imported hand what it means on the template, whatever pose the file holds.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from core.errors import FormatError
from core.frames import SIDES, FloatArray, IntArray, Side
from core.hand.imports.surface import closed, welded, wound_outwards
from core.hand.mirror import mirror_points
from core.hand.model import HandModel, template
from core.hand.skeleton import DIGITS, JOINT_NAMES, N_DOFS, N_JOINTS, N_ROOT_DOFS, Skeleton
from core.kinematics.forward import joints_world

LENGTH_RANGE_M = (0.09, 0.30)
"""From the wrist to the tip of the middle finger: a child's or an adult's hand, with room."""

MOST_VERTICES, MOST_FACES = 100_000, 400_000
"""Of a mesh that is read; the hand of Phalanx has 6,894 and 13,784."""

LEAST_BONE_M = 0.003
N_INFLUENCES = 4
LEAST_WEIGHT = 0.005

_STARTS = (0.0, 0.5, 0.85)
"""How far a digit is bent where the search for its angles begins, in parts of its limits."""

_FLEXIONS = np.array([(1.0, 0.0, 1.0, 1.0)] + [(0.0, 1.0, 1.0, 1.0)] * (len(DIGITS) - 1))

_PALM = [0, 4, 7, 10, 13]
"""Joints that hardly move in the palm: the wrist and the knuckles of the fingers."""


@dataclass(frozen=True)
class Rig:
    """A hand in its file's own axes and pose.

    joints_m: (16, 3) float64 [m], our joints in our order. towards_m: (5, 3) float64 [m], a point of each digit beyond
    its last joint. vertices_m: (v, 3) float64 [m], faces: (f, 3) int64, weights: (v, 16) float64, share of each joint
    in each vertex, of which at least one is positive. name: of the file, for what is said of it.
    """

    name: str
    joints_m: FloatArray
    towards_m: FloatArray
    vertices_m: FloatArray
    faces: IntArray
    weights: FloatArray


@dataclass(frozen=True)
class ImportedHand:
    """hand: a right hand at our flat rest, mirrored if the file's is a left one. side: of the file's hand."""

    hand: HandModel
    side: Side


def hand_of(rig: Rig, side: Side | None = None) -> ImportedHand:
    """The rig as one of our hands.

    side: of the file's hand; None = the side on which its digits bend and its thumb stands as a hand's do.
    Raises FormatError.
    """
    _check(rig)
    fits = [Fit(rig, each) for each in ((side,) if side else SIDES)]
    fit = min(fits, key=lambda each: each.error)
    return ImportedHand(fit.at_rest(), fit.side)


class Fit:
    """The template's bones turned to where those of a right hand are in the file.

    frame: (3, 3) float64, rows are the axes of the hand frame in the file's (mirrored, for a left hand).
    turns: (16, 3, 3) float64, of each bone from our rest to the file's pose. error: of the fit, to compare sides.
    """

    def __init__(self, rig: Rig, side: Side) -> None:
        self.side: Side = side
        self._rig = rig
        self._skeleton = template().skeleton
        mirrored = mirror_points if side == "left" else np.asarray
        joints_m, towards_m = mirrored(rig.joints_m), mirrored(rig.towards_m)
        frame, origin = _hand_frame(joints_m, self._skeleton)
        self.frame = frame
        self._joints_m = (joints_m - origin) @ frame.T
        self._vertices_m = (mirrored(rig.vertices_m) - origin) @ frame.T
        ends_m = _ends(self._joints_m, (towards_m - origin) @ frame.T)
        self._bones = _unit(ends_m - self._joints_m[1:])  # (15, 3)
        self._lengths_m = np.linalg.norm(ends_m - self._joints_m[1:], axis=1)
        self._rest_bones = _unit(_ends(self._skeleton.joint_positions_m, self._skeleton.tip_positions_m)
                                 - self._skeleton.joint_positions_m[1:])  # fmt: skip
        self.turns = np.empty((N_JOINTS, 3, 3))
        self.turns[0] = np.eye(3)
        squared = 0.0
        for digit in range(len(DIGITS)):
            squared += self._turn(digit)
        # A hand laid on its back fits its fingers, but never the root of its thumb.
        thumb = self._joints_m[1] - self._skeleton.joint_positions_m[1]
        self.error = squared + float(thumb @ thumb) / float(self._joints_m[7] @ self._joints_m[7])

    def _turn(self, digit: int) -> float:
        """Finds the angles of one digit; what they leave is a turn without roll. Returns the squared error left."""
        skeleton, bones = self._skeleton, slice(3 * digit, 3 * digit + 3)
        dofs = slice(4 * digit, 4 * digit + 4)
        theta = np.zeros(N_DOFS)

        def turned(angles: FloatArray) -> tuple[FloatArray, FloatArray]:
            theta[N_ROOT_DOFS:][dofs] = angles
            rotations = joints_world(skeleton, theta)[1:][bones, :3, :3]
            return rotations, np.einsum("kab,kb->ka", rotations, self._rest_bones[bones])

        def error(angles: FloatArray) -> FloatArray:
            left: FloatArray = (turned(angles)[1] - self._bones[bones]).ravel()
            return left

        low, high = skeleton.limits_rad[dofs].T
        starts = (bent * high * _FLEXIONS[digit] for bent in _STARTS)
        tries = [least_squares(error, start, bounds=(low, high), xtol=1e-12, ftol=1e-12) for start in starts]
        found = min(tries, key=lambda each: float(each.cost))
        rotations, directions = turned(found.x)
        for k, (direction, bone) in enumerate(zip(directions, self._bones[bones], strict=True)):
            self.turns[1 + 3 * digit + k] = _smallest_turn(direction, bone) @ rotations[k]
        return 2.0 * float(found.cost)

    def at_rest(self) -> HandModel:
        """The rig with every bone where it lies at rest."""
        skeleton, joints_m = self._skeleton, self._joints_m.copy()
        for j in range(1, N_JOINTS):
            if (j - 1) % 3:
                joints_m[j] = joints_m[j - 1] + self._lengths_m[j - 2] * self._rest_bones[j - 2]
        vertices, faces, weights = welded(self._vertices_m, self._rig.faces, self._rig.weights)
        vertices, faces, weights = closed(vertices, faces, weights)
        skin_joints, skin_weights = four_per_vertex(weights)
        back = np.transpose(self.turns, (0, 2, 1))
        moved = np.einsum("vkab,vkb->vka", back[skin_joints], vertices[:, None] - self._joints_m[skin_joints])
        rest_m: FloatArray = np.einsum("vk,vka->va", skin_weights, moved + joints_m[skin_joints])
        tips = np.empty((len(DIGITS), 3))
        for digit in range(len(DIGITS)):
            last, bone = 3 + 3 * digit, self._rest_bones[2 + 3 * digit]
            own = skin_joints[:, 0] == last
            if not own.any():
                raise FormatError(f"{self._rig.name}: no vertex belongs to {JOINT_NAMES[last]}.", _RIGGED)
            tips[digit] = joints_m[last] + bone * ((rest_m[own] - joints_m[last]) @ bone).max()
        made = Skeleton(joints_m, tips, skeleton.axes, skeleton.limits_rad)
        return HandModel(made, rest_m, wound_outwards(rest_m, faces), skin_joints, skin_weights)


_RIGGED = "Give a hand whose mesh is skinned to its joints, in metres."


def four_per_vertex(weights: FloatArray) -> tuple[IntArray, FloatArray]:
    """(v, 4) joints and (v, 4) weights of (v, 16), the heaviest first; they sum to one, what is tiny is left out."""
    joints = np.argsort(-weights, axis=1, kind="stable")[:, :N_INFLUENCES]
    kept = np.take_along_axis(weights, joints, axis=1)
    kept = kept / kept.sum(axis=1, keepdims=True)
    kept[kept < LEAST_WEIGHT] = 0.0
    return joints, kept / kept.sum(axis=1, keepdims=True)


def fleshy_ends(joints_m: FloatArray, vertices_m: FloatArray, weights: FloatArray) -> FloatArray:
    """(5, 3) float64 [m]: the middle of the surface that each digit's last joint carries, for `Rig.towards_m`."""
    ends = np.empty((len(DIGITS), 3))
    for digit in range(len(DIGITS)):
        last = 3 + 3 * digit
        share = weights[:, last] * (weights[:, last] > 0.5)
        ends[digit] = (share @ vertices_m) / share.sum() if share.any() else joints_m[last]
    return ends


def _check(rig: Rig) -> None:
    """Raises FormatError for what is no hand, or not in metres."""
    numbers = (rig.joints_m, rig.towards_m, rig.vertices_m, rig.weights)
    if not all(np.isfinite(values).all() for values in numbers):
        raise FormatError(f"{rig.name} holds a number that is none.", "Export the hand again.")
    if len(rig.vertices_m) == 0 or len(rig.faces) == 0:
        raise FormatError(f"{rig.name} has a skeleton but no surface.", _RIGGED)
    if rig.faces.min() < 0 or rig.faces.max() >= len(rig.vertices_m):
        raise FormatError(
            f"{rig.name}: a face names vertex {rig.faces.max()} of {len(rig.vertices_m)}.", "Export the hand again."
        )
    if rig.weights.min() < 0.0 or rig.weights.sum(axis=1).min() <= 0.0:
        loose = int(np.argmin(rig.weights.sum(axis=1)))
        raise FormatError(f"{rig.name}: vertex {loose} is skinned to no joint of the hand.", _RIGGED)
    low, high = LENGTH_RANGE_M
    chain = np.linalg.norm(np.diff(np.vstack([rig.joints_m[[0, 7, 8, 9]], rig.towards_m[2]]), axis=0), axis=1)
    if not low <= chain.sum() <= high:
        raise FormatError(
            f"{rig.name}: from wrist to middle fingertip it is {1e3 * chain.sum():.4g} mm long.",
            "Give a hand in metres.",
        )
    ends = _ends(rig.joints_m, rig.towards_m)
    short = np.linalg.norm(ends - rig.joints_m[1:], axis=1) < LEAST_BONE_M
    if short.any():
        raise FormatError(
            f"{rig.name}: the bone of {JOINT_NAMES[1 + int(np.argmax(short))]} has no length.", "Export the hand again."
        )


def _hand_frame(joints_m: FloatArray, skeleton: Skeleton) -> tuple[FloatArray, FloatArray]:
    """Rows of the hand frame (3, 3), and its origin: wrist and knuckles lie as the template's, turned rigidly."""
    ours, theirs = skeleton.joint_positions_m[_PALM], joints_m[_PALM]
    turn, _ = Rotation.align_vectors(ours - ours.mean(axis=0), theirs - theirs.mean(axis=0))
    frame: FloatArray = turn.as_matrix()
    return frame, joints_m[0]


def _ends(joints_m: FloatArray, tips_m: FloatArray) -> FloatArray:
    """(15, 3) far end of the bone of every joint but the wrist."""
    digits = np.concatenate([joints_m[1:].reshape(-1, 3, 3), tips_m[:, None]], axis=1)
    ends: FloatArray = digits[:, 1:].reshape(-1, 3)
    return ends


def _unit(vectors: FloatArray) -> FloatArray:
    unit: FloatArray = vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
    return unit


def _smallest_turn(a: FloatArray, b: FloatArray) -> FloatArray:
    """(3, 3) rotation that takes unit `a` to unit `b` and rolls nothing about them."""
    axis = np.cross(a, b)
    sine = float(np.linalg.norm(axis))
    if sine < 1e-12:
        return np.eye(3)
    matrix: FloatArray = Rotation.from_rotvec(axis / sine * np.arctan2(sine, float(a @ b))).as_matrix()
    return matrix
