"""The hand's shape: its measures as ratios to the template's, and what follows from them.

Every bone has a linear map A_j at rest: it stretches along the bone by its length and across it by its digit's
girth; the palm (the wrist's bone) stretches by its width, thickness and length along x, y and z. A child's joint,
the surface and the markers of a bone follow its map, the surface blended by its skin weights: so skeleton, skin and
markers stay together, and joint positions are linear in the ratios.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from core.errors import FormatError
from core.frames import FloatArray, IntArray
from core.hand.model import HandModel
from core.hand.skeleton import DIGITS, JOINT_PARENTS, N_JOINTS, Skeleton
from core.untrusted.values import is_number, shown

BONE_NAMES = ("metacarpal", "proximal", "distal"), ("proximal", "middle", "distal")
"""The three bones of the thumb and of a finger that turn with its joints."""

PALM_NAMES = ("palm_width", "palm_length", "palm_thickness")
SHAPE_NAMES = (
    PALM_NAMES
    + tuple(f"{digit}_{bone}" for digit in DIGITS for bone in BONE_NAMES[digit != "thumb"])
    + tuple(f"{digit}_girth" for digit in DIGITS)
)
N_SHAPE = 23
SMALLEST, LARGEST = 0.5, 1.7
"""Ratios of a human hand, child or adult, with room."""

FIRST_BONE, FIRST_GIRTH = 3, 18
"""Where the bones and the girths begin in SHAPE_NAMES; the bone of joint j (1..15) is FIRST_BONE + j - 1."""


@dataclass(frozen=True)
class HandShape:
    """ratios: (23,) float64, each measure of SHAPE_NAMES over the template's; all ones is the template."""

    ratios: FloatArray

    @classmethod
    def generic(cls) -> HandShape:
        """The template's own."""
        return cls(np.ones(N_SHAPE))

    @classmethod
    def uniform(cls, scale: float) -> HandShape:
        """The template, larger by `scale` in everything."""
        return cls(np.full(N_SHAPE, float(scale)))

    def to_dict(self) -> dict[str, float]:
        """The JSON form: ratio by name."""
        return {name: round(float(ratio), 6) for name, ratio in zip(SHAPE_NAMES, self.ratios, strict=True)}

    @classmethod
    def from_dict(cls, data: Any, source: str = "hand shape") -> HandShape:
        """Raises FormatError naming `source` and the offending value."""
        if not isinstance(data, dict) or set(data) != set(SHAPE_NAMES):
            raise FormatError(f"{source} must name every measure once: " + ", ".join(SHAPE_NAMES) + ".")
        for name, ratio in data.items():
            if not is_number(ratio) or not SMALLEST <= ratio <= LARGEST:
                raise FormatError(f"{source}: {name} {shown(ratio)}.", f"It must lie between {SMALLEST} and {LARGEST}.")
        return cls(np.asarray([float(data[name]) for name in SHAPE_NAMES]))

    def __getitem__(self, name: str) -> float:
        """Ratio of one measure by its name in SHAPE_NAMES."""
        return float(self.ratios[SHAPE_NAMES.index(name)])


def bone_maps(skeleton: Skeleton, shape: HandShape) -> FloatArray:
    """(16, 3, 3) float64, A_j of every joint's bone. skeleton: the template's."""
    ends = _bone_ends_m(skeleton)
    maps = np.empty((N_JOINTS, 3, 3))
    width, length, thickness = shape.ratios[:FIRST_BONE]
    maps[0] = np.diag([width, thickness, length])
    for j in range(1, N_JOINTS):
        along = ends[j] - skeleton.joint_positions_m[j]
        along /= np.linalg.norm(along)
        girth = shape.ratios[FIRST_GIRTH + (j - 1) // 3]
        maps[j] = girth * np.eye(3) + (shape.ratios[FIRST_BONE + j - 1] - girth) * np.outer(along, along)
    return maps


def shaped_skeleton(skeleton: Skeleton, shape: HandShape) -> Skeleton:
    """The template's skeleton in this shape: axes and limits as they are."""
    maps, joints = bone_maps(skeleton, shape), np.zeros((N_JOINTS, 3))
    for j in range(1, N_JOINTS):
        parent = JOINT_PARENTS[j]
        joints[j] = joints[parent] + maps[parent] @ (skeleton.joint_positions_m[j] - skeleton.joint_positions_m[parent])
    last = np.arange(3, N_JOINTS, 3)
    beyond = skeleton.tip_positions_m - skeleton.joint_positions_m[last]
    tips = joints[last] + np.einsum("dab,db->da", maps[last], beyond)
    return Skeleton(joints, tips, skeleton.axes, skeleton.limits_rad)


def shaped_points(skeleton: Skeleton, shape: HandShape, joints: IntArray, points_m: FloatArray) -> FloatArray:
    """Points fixed to bones, such as markers, on the hand in this shape.

    joints: (m,) int64, whose bones carry them. points_m: (m, 3) float64 [m], on the template at rest. Returns (m, 3).
    """
    maps, centres = bone_maps(skeleton, shape), shaped_skeleton(skeleton, shape).joint_positions_m
    local = points_m - skeleton.joint_positions_m[joints]
    placed: FloatArray = centres[joints] + np.einsum("mab,mb->ma", maps[joints], local)
    return placed


def unshaped_points(skeleton: Skeleton, shape: HandShape, joints: IntArray, points_m: FloatArray) -> FloatArray:
    """Inverse of `shaped_points`: from the hand in this shape back to the template."""
    maps, centres = bone_maps(skeleton, shape), shaped_skeleton(skeleton, shape).joint_positions_m
    local = np.linalg.solve(maps[joints], (points_m - centres[joints])[..., None])[..., 0]
    back: FloatArray = skeleton.joint_positions_m[joints] + local
    return back


def shaped_hand(hand: HandModel, shape: HandShape) -> HandModel:
    """The whole hand in this shape. hand: the template."""
    maps, skeleton = bone_maps(hand.skeleton, shape), shaped_skeleton(hand.skeleton, shape)
    centres = skeleton.joint_positions_m - np.einsum("jab,jb->ja", maps, hand.skeleton.joint_positions_m)
    affine = np.concatenate([maps, centres[..., None]], axis=2)  # (16, 3, 4)
    blended = np.einsum("vk,vkij->vij", hand.skin_weights, affine[hand.skin_joints])
    vertices: FloatArray = np.einsum("vij,vj->vi", blended[..., :3], hand.vertices_m) + blended[..., 3]
    return HandModel(skeleton, vertices, hand.faces, hand.skin_joints, hand.skin_weights)


def _bone_ends_m(skeleton: Skeleton) -> FloatArray:
    """(16, 3) float64 [m], far end of every bone at rest; the palm's is the third knuckle."""
    ends = np.empty((N_JOINTS, 3))
    for j in range(N_JOINTS):
        ends[j] = skeleton.tip_positions_m[j // 3 - 1] if j and j % 3 == 0 else skeleton.joint_positions_m[j + 1]
    ends[0] = skeleton.joint_positions_m[7]
    return ends
