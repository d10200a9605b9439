"""Forward kinematics of a right hand, by parameters."""

from __future__ import annotations

import numpy as np

from core.frames import FloatArray, IntArray
from core.hand.skeleton import JOINT_PARENTS, N_JOINTS, Skeleton
from core.kinematics import kernels


def rest_offsets(skeleton: Skeleton) -> FloatArray:
    """(16, 3) float64 [m], each joint from its parent at rest; the wrist is the origin."""
    offsets: FloatArray = skeleton.joint_positions_m.copy()
    offsets[1:] -= skeleton.joint_positions_m[list(JOINT_PARENTS[1:])]
    return offsets


def joints_world(skeleton: Skeleton, theta_rad: FloatArray) -> FloatArray:
    """Joint frames of a right hand in the world.

    theta_rad: (26,) float64 (core.hand.skeleton.DOF_NAMES). Returns (16, 4, 4) float64, translation [m].
    """
    root_r, joint_r = np.empty((3, 3)), np.empty((N_JOINTS, 3, 3))
    joint_p, axes_w = np.empty((N_JOINTS, 3)), np.empty((20, 3))
    theta = np.ascontiguousarray(theta_rad, dtype=np.float64)
    kernels.rotation_from_vector(theta[3:6], root_r)
    kernels.forward(theta[:3], root_r, theta[6:], 1.0, rest_offsets(skeleton), skeleton.axes, joint_r, joint_p, axes_w)
    joints = np.zeros((N_JOINTS, 4, 4))
    joints[:, :3, :3] = joint_r
    joints[:, :3, 3] = joint_p
    joints[:, 3, 3] = 1.0
    return joints


def markers_world(
    skeleton: Skeleton, theta_rad: FloatArray, marker_joints: IntArray, marker_positions_m: FloatArray
) -> FloatArray:
    """Markers of a right hand in the world.

    marker_joints: (m,) int64. marker_positions_m: (m, 3) float64 [m], at rest in the hand frame of this skeleton.
    Returns (m, 3) float64 [m].
    """
    joints = joints_world(skeleton, theta_rad)[marker_joints]
    local = marker_positions_m - skeleton.joint_positions_m[marker_joints]
    world: FloatArray = np.einsum("mab,mb->ma", joints[:, :3, :3], local) + joints[:, :3, 3]
    return world
