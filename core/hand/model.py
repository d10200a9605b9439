"""The skinned hand: a skeleton and the surface that it moves."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from importlib.resources import files

import numpy as np

from core.frames import FloatArray, IntArray
from core.hand.skeleton import Skeleton

TEMPLATE = "template.npz"


@dataclass(frozen=True)
class HandModel:
    """A right hand at scale 1.

    vertices_m: (v, 3) float64 [m], surface at rest in the hand frame. faces: (f, 3) int64, counter-clockwise
    from outside. skin_joints: (v, 4) int64 and skin_weights: (v, 4) float64, up to four joints per vertex,
    weights sum to one.
    """

    skeleton: Skeleton
    vertices_m: FloatArray
    faces: IntArray
    skin_joints: IntArray
    skin_weights: FloatArray

    def scaled(self, scale: float) -> HandModel:
        """The same hand, uniformly larger by `scale`."""
        return HandModel(
            self.skeleton.scaled(scale), self.vertices_m * scale, self.faces, self.skin_joints, self.skin_weights
        )


@cache
def template() -> HandModel:
    """The hand shipped with Phalanx (resources/hand/CARD.md says where it comes from)."""
    with (files("resources") / "hand" / TEMPLATE).open("rb") as stream, np.load(stream, allow_pickle=False) as data:
        skeleton = Skeleton(data["joint_positions_m"], data["tip_positions_m"], data["axes"], data["limits_rad"])
        return HandModel(
            skeleton,
            data["vertices_m"].astype(np.float64),
            data["faces"].astype(np.int64),
            data["skin_joints"].astype(np.int64),
            data["skin_weights"].astype(np.float64),
        )


def skin(hand: HandModel, joints_world: FloatArray) -> FloatArray:
    """Linear blend skinning (Han 2018, 4.1) of a right hand.

    joints_world: (16, 4, 4) float64. Returns (v, 3) float64 [m].
    """
    skinning = skinning_matrices(hand.skeleton, joints_world)  # (16, 4, 4)
    blended = np.einsum("vk,vkij->vij", hand.skin_weights, skinning[hand.skin_joints][..., :3, :])
    surface: FloatArray = np.einsum("vij,vj->vi", blended[..., :3], hand.vertices_m) + blended[..., 3]
    return surface


def skinning_matrices(skeleton: Skeleton, joints_world: FloatArray) -> FloatArray:
    """(16, 4, 4) float64: rest hand frame to world for each joint, T_i(theta) (T_i rest)^-1."""
    matrices = joints_world.copy()
    matrices[:, :3, 3] -= np.einsum("jab,jb->ja", joints_world[:, :3, :3], skeleton.joint_positions_m)
    return matrices
