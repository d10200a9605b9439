"""The ends of the digits. They are no joints: each follows the last joint of its digit."""

from __future__ import annotations

import numpy as np

from core.frames import FloatArray, Side
from core.hand.mirror import mirror_points
from core.hand.skeleton import TIP_JOINTS, Skeleton


def tip_offsets(skeleton: Skeleton, side: Side) -> FloatArray:
    """(5, 3) float64 [m], each tip from the last joint of its digit, in the frame of that joint, for either side.

    skeleton: the right hand.
    """
    offsets: FloatArray = skeleton.tip_positions_m - skeleton.joint_positions_m[list(TIP_JOINTS)]
    return mirror_points(offsets) if side == "left" else offsets


def tips_world(skeleton: Skeleton, side: Side, joints_world: FloatArray, scale: float) -> FloatArray:
    """(5, 3) float64 [m], the tips of a tracked hand.

    skeleton: the right hand at scale 1. joints_world: (16, 4, 4) float64, as in a HandFrame of this side. scale: of it.
    """
    last = joints_world[list(TIP_JOINTS)]
    tips: FloatArray = last[:, :3, 3] + scale * np.einsum("dab,db->da", last[:, :3, :3], tip_offsets(skeleton, side))
    return tips
