"""Where bones and axes of motion lie in the joint frames, for either side; docs/joints.md states them in figures.

At rest every joint frame has the orientation of the hand frame (core.hand.skeleton): frames do not follow the bones.
So a rotation of zero is the same flat hand in every format, and whoever wants frames along the bones needs these.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from core.frames import FloatArray, Side
from core.hand.mirror import mirror_points
from core.hand.skeleton import DIGIT_DOF_NAMES, DOF_JOINTS, N_JOINTS, TIP_JOINTS, Skeleton

_MIDDLE_MCP = 7


@dataclass(frozen=True)
class JointAxes:
    """Unit vectors in the frame of each joint, (16, 3) float64; NaN where a joint has no such axis.

    bones: to the next joint or the tip; the wrist's to the middle finger's knuckle. flexion: a positive angle turns
    about it by the right-hand rule and closes the hand. abduction: alike, away from the middle finger, of the thumb
    from the palm. Of a joint with both, the axis of the angle that comes first in DOF_NAMES stays in the parent's
    frame; the other, like that of a joint with one, stays in the joint's own.
    """

    bones: FloatArray
    flexion: FloatArray
    abduction: FloatArray


def joint_axes(skeleton: Skeleton, side: Side) -> JointAxes:
    """The axes of either side's hand. skeleton: the right hand, at any scale."""
    bones = _ends_m(skeleton) - skeleton.joint_positions_m
    bones /= np.linalg.norm(bones, axis=1, keepdims=True)
    flexion, abduction = np.full((N_JOINTS, 3), np.nan), np.full((N_JOINTS, 3), np.nan)
    for name, joint, axis in zip(DIGIT_DOF_NAMES, DOF_JOINTS, skeleton.axes, strict=True):
        (flexion if name.endswith("_flexion") else abduction)[joint] = axis
    if side == "right":
        return JointAxes(bones, flexion, abduction)
    # In a mirror a turn changes its sense: the axis of a positive angle is minus the mirror image.
    return JointAxes(mirror_points(bones), -mirror_points(flexion), -mirror_points(abduction))


def _ends_m(skeleton: Skeleton) -> FloatArray:
    """(16, 3) float64 [m], the far end of every joint's bone at rest."""
    ends = np.roll(skeleton.joint_positions_m, -1, axis=0)
    ends[list(TIP_JOINTS)] = skeleton.tip_positions_m
    ends[0] = skeleton.joint_positions_m[_MIDDLE_MCP]
    return ends
