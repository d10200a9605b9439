"""Many hands of many shapes at once: their joints, the bones that stand in for their flesh, and what rides on them.

All are right hands; arrays hold n of them. Numbers equal those of core.hand.shape and core.kinematics.forward.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from core.frames import FloatArray, IntArray
from core.hand.model import template
from core.hand.shape import FIRST_BONE, FIRST_GIRTH, N_SHAPE
from core.hand.skeleton import DOF_JOINTS, JOINT_PARENTS, N_JOINTS
from core.motion.capsules import Flesh

_SKELETON = template().skeleton
_FLESH = Flesh(_SKELETON, 1.0)
_N_BONES = len(_FLESH.radii_m)
_KNUCKLES = (4, 7, 10, 13)
_PARENTS = np.maximum(np.asarray(JOINT_PARENTS), 0)
_OFFSETS_M = _SKELETON.joint_positions_m - _SKELETON.joint_positions_m[_PARENTS]
_OFFSETS_M[0] = 0.0
_ENDS_M = np.stack(
    [_SKELETON.tip_positions_m[j // 3 - 1] if j % 3 == 0 else _SKELETON.joint_positions_m[j + 1] for j in range(1, 16)]
)
_BONES_M = _ENDS_M - _SKELETON.joint_positions_m[1:]
_ALONG = _BONES_M / np.linalg.norm(_BONES_M, axis=1, keepdims=True)
_GIRTH_OF = FIRST_GIRTH + np.arange(15) // 3
_CROSSES = np.array([np.cross(np.eye(3), axis) for axis in _SKELETON.axes])
_SQUARES = _CROSSES @ _CROSSES


@dataclass(frozen=True)
class Bodies:
    """n right hands.

    maps: (n, 16, 3, 3), how each bone is stretched at rest (core.hand.shape). rotations: (n, 16, 3, 3) and joints_m:
    (n, 16, 3) [m], joint frames. starts_m, ends_m: (n, 19, 3) [m] and radii_m: (n, 19) [m], the capsules of
    core.motion.capsules.
    """

    maps: FloatArray
    rotations: FloatArray
    joints_m: FloatArray
    starts_m: FloatArray
    ends_m: FloatArray
    radii_m: FloatArray

    def carried(self, joints: IntArray, positions_m: FloatArray) -> FloatArray:
        """(n, m, 3) [m]: points that ride on bones. joints (n, m) or (m,): which; positions_m (n, m, 3) or (m, 3): on
        the template at rest, as in a MarkerLayout."""
        rows = np.arange(len(self.maps))[:, None]
        joints = np.broadcast_to(joints, (len(self.maps), joints.shape[-1]))
        local = positions_m - _SKELETON.joint_positions_m[joints]
        turned = self.rotations[rows, joints] @ self.maps[rows, joints]
        placed: FloatArray = (turned @ local[..., None])[..., 0] + self.joints_m[rows, joints]
        return placed


def shaped_maps(ratios: FloatArray) -> FloatArray:
    """(n, 16, 3, 3) float64, bone_maps of many shapes. ratios: (n, 23) float64 in the order of SHAPE_NAMES."""
    maps = np.zeros((len(ratios), N_JOINTS, 3, 3))
    maps[:, 0, 0, 0], maps[:, 0, 1, 1], maps[:, 0, 2, 2] = ratios[:, 0], ratios[:, 2], ratios[:, 1]
    girths = ratios[:, _GIRTH_OF]
    stretch = ratios[:, FIRST_BONE:FIRST_GIRTH] - girths
    outer = _ALONG[:, :, None] * _ALONG[:, None, :]
    maps[:, 1:] = girths[..., None, None] * np.eye(3) + stretch[..., None, None] * outer
    return maps


def at_rest(ratios: FloatArray) -> Bodies:
    """Hands of these shapes (n, 23) in the template's own posture and place."""
    n = len(ratios)
    return posed(np.zeros((n, 20)), np.tile(np.eye(3), (n, 1, 1)), np.zeros((n, 3)), ratios)


def posed(angles_rad: FloatArray, rotations: FloatArray, wrists_m: FloatArray, ratios: FloatArray) -> Bodies:
    """Hands in their poses.

    angles_rad: (n, 20) float64, the digits. rotations: (n, 3, 3), wrists_m: (n, 3) [m], the wrists. ratios: (n, 23).
    """
    n = len(angles_rad)
    assert ratios.shape == (n, N_SHAPE)
    maps = shaped_maps(ratios)
    turns, joints = np.empty((n, N_JOINTS, 3, 3)), np.empty((n, N_JOINTS, 3))
    turns[:, 0], joints[:, 0] = rotations, wrists_m
    offsets = np.einsum("njab,jb->nja", maps[:, _PARENTS], _OFFSETS_M)
    sines, versines = np.sin(angles_rad), 1.0 - np.cos(angles_rad)
    dof = 0
    for j in range(1, N_JOINTS):
        parent = JOINT_PARENTS[j]
        turn = turns[:, parent]
        joints[:, j] = joints[:, parent] + (turn @ offsets[:, j, :, None])[..., 0]
        while dof < len(DOF_JOINTS) and DOF_JOINTS[dof] == j:
            own = np.eye(3) + sines[:, dof, None, None] * _CROSSES[dof] + versines[:, dof, None, None] * _SQUARES[dof]
            turn = turn @ own
            dof += 1
        turns[:, j] = turn
    radii = np.concatenate(
        [ratios[:, _GIRTH_OF], np.repeat(ratios[:, 2:3], _N_BONES - 15, axis=1)], axis=1
    ) * _FLESH.radii_m  # fmt: skip
    starts, ends = np.empty((n, _N_BONES, 3)), np.empty((n, _N_BONES, 3))
    bones = np.einsum("njab,jb->nja", maps[:, 1:], _BONES_M)
    last = np.arange(2, 15, 3)  # a tip's capsule ends where its round end touches the tip
    bones[:, last] *= (1.0 - radii[:, last] / np.linalg.norm(bones[:, last], axis=2))[..., None]
    starts[:, :15] = joints[:, 1:]
    ends[:, :15] = joints[:, 1:] + (turns[:, 1:] @ bones[..., None])[..., 0]
    carpals = np.stack([_SKELETON.joint_positions_m[k] * (0.25, 0.0, 0.3) for k in _KNUCKLES])
    carpals = np.einsum("nab,kb->nka", maps[:, 0], carpals)
    starts[:, 15:] = joints[:, :1] + np.einsum("nab,nkb->nka", rotations, carpals)
    ends[:, 15:] = joints[:, _KNUCKLES]
    return Bodies(maps, turns, joints, starts, ends, radii)
