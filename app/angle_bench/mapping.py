"""Angles of a hand that is not ours beside ours: where its zeros are, and how far the two definitions differ.

Another hand has axes and zeros of its own. Its wrist's frame is taken for ours (both have -Z to the fingers and +Y out
of the back). Its zeros are mapped: at its bind pose, all its own angles zero, ours are those that point our bones the
way its bones point. From there on its own angles are what is true, each about its own axis; nothing else is fitted.

How much the axes differ is the mapping's own error: in every frame our model, with its bone lengths, each digit hung up
by its first joint, is brought as near as it can be to the true centres beyond, without a prior and without a marker.
What it cannot reach, in mm, and how far these best angles of ours run beside the hand's own is printed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from app.angle_bench.motion import Motion
from core.frames import FloatArray
from core.hand.imports.measure import bone_lengths_m
from core.hand.model import template
from core.hand.shape import FIRST_BONE, LARGEST, N_SHAPE, SMALLEST, HandShape, shaped_skeleton
from core.hand.skeleton import JOINT_NAMES, N_ROOT_DOFS, TIP_JOINTS, TIP_NAMES, Skeleton
from core.hand.tips import tips_world
from core.kinematics.forward import joints_world
from core.kinematics.prior import N_ANGLES, NO_PRIOR
from core.kinematics.solver import HandPose, HandSolver
from core.markers.layout import MarkerLayout

ROOM_RAD = np.radians(20.0)
"""So far beyond our limits a mapped angle may lie: it is not to be cut off, nor a finger bent the wrong way round."""

_BEYOND = np.array([2, 3, 5, 6, 8, 9, 11, 12, 14, 15, 16, 17, 18, 19, 20])
"""Of the 16 joints and 5 tips, those that the angles move."""

_ITERATIONS = 60
N_JOINTS_AND_TIPS = len(JOINT_NAMES) + len(TIP_NAMES)


@dataclass(frozen=True)
class Mapped:
    """angles_rad: (n, 20) float64 [rad] in our terms. off_m: (n, 15) float64 [m], how far each joint and tip beyond the
    first joint of its digit is from where our model has it."""

    angles_rad: FloatArray
    off_m: FloatArray


def zeros_rad(theirs: Skeleton) -> FloatArray:
    """(20,) float64 [rad], our angles at the bind pose of another hand."""
    at_bind = mapped(theirs, Motion(np.zeros((1, N_ANGLES)), np.zeros((1, N_ROOT_DOFS))))
    zeros: FloatArray = at_bind.angles_rad[0]
    return zeros


def mapped(theirs: Skeleton, motion: Motion) -> Mapped:
    """The best angles of ours for a motion about the axes of another hand, whose wrist's frame is the hand frame."""
    ours = _our_skeleton(theirs)
    solver, weights = _follower(ours), np.zeros(N_JOINTS_AND_TIPS)
    weights[_BEYOND] = 1.0
    pose = HandPose.at_rest(N_JOINTS_AND_TIPS)
    angles, off_m = np.empty((len(motion.digits_rad), N_ANGLES)), np.empty((len(motion.digits_rad), len(_BEYOND)))
    for i, digits in enumerate(motion.digits_rad):
        targets = _hung_up(ours, _centres_m(theirs, digits))
        pose.theta_rad[:] = np.concatenate([np.zeros(N_ROOT_DOFS), digits])
        solver.solve(pose, targets, weights, free_root=False, iterations=_ITERATIONS, tolerance=1e-9)
        angles[i] = pose.theta_rad[N_ROOT_DOFS:]
        off_m[i] = np.linalg.norm(pose.markers_world_m - targets, axis=1)[_BEYOND]
    return Mapped(angles, off_m)


def _our_skeleton(theirs: Skeleton) -> Skeleton:
    """Our model with the bone lengths of another hand."""
    ours, ratios = template().skeleton, np.ones(N_SHAPE)
    ratios[FIRST_BONE : FIRST_BONE + 15] = np.clip(bone_lengths_m(theirs) / bone_lengths_m(ours), SMALLEST, LARGEST)
    return shaped_skeleton(ours, HandShape(ratios))


def _follower(ours: Skeleton) -> HandSolver:
    """A solver whose markers are the centres themselves, held back by nothing."""
    limits = ours.limits_rad + np.array([-ROOM_RAD, ROOM_RAD])
    free = Skeleton(ours.joint_positions_m, ours.tip_positions_m, ours.axes, limits)
    joints = np.concatenate([np.arange(len(JOINT_NAMES)), TIP_JOINTS])
    at = np.concatenate([ours.joint_positions_m, ours.tip_positions_m])
    return HandSolver(free, MarkerLayout("centres", "", ("right",), JOINT_NAMES + TIP_NAMES, joints, at), NO_PRIOR)


def _centres_m(skeleton: Skeleton, digits_rad: FloatArray) -> FloatArray:
    """(21, 3) float64 [m], joint centres and fingertips in the frame of the wrist."""
    world = joints_world(skeleton, np.concatenate([np.zeros(N_ROOT_DOFS), digits_rad]))
    return np.concatenate([world[:, :3, 3], tips_world(skeleton, "right", world, 1.0)])


def _hung_up(ours: Skeleton, centres_m: FloatArray) -> FloatArray:
    """(21, 3): the centres with the first joint of every digit moved to where ours is."""
    moved = centres_m.copy()
    for digit, tip in enumerate(range(len(JOINT_NAMES), N_JOINTS_AND_TIPS)):
        own = [*range(3 * digit + 1, 3 * digit + 4), tip]
        moved[own] += ours.joint_positions_m[own[0]] - centres_m[own[0]]
    return moved
