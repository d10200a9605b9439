"""The motion of a BVH file as the frames of an inertial glove or suit."""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np

from core.frames import SIDES, InertialFrame, Side, Times
from core.streams import StreamInfo
from core.takes.formats.assemble import unique_labels
from core.takes.formats.bvh import BvhMotion

UNIT_M = 0.01
"""Perception Neuron and Phalanx write centimetres, and the format has no place to say so [m]."""

_BLOCK = 256
"""Frames that are turned into quaternions at once."""

_WORD = re.compile(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])")
_SIDES: dict[str, Side] = {"left": "left", "l": "left", "right": "right", "r": "right"}


def side_of(bone: str) -> Side | None:
    """The side that a bone's name says, in the words of any program: RightHandThumb1, L_wrist, mixamorig:LeftHand,
    thumb_01_l. None where it says none, or both."""
    said = {_SIDES[word.lower()] for word in _WORD.findall(bone) if word.lower() in _SIDES}
    return said.pop() if len(said) == 1 else None


def stream_of(motion: BvhMotion) -> StreamInfo:
    """What is true of all its frames. It names no device: that is who plays them."""
    bones = _bones(motion)
    sides = {side_of(name) for name in bones}
    return StreamInfo(
        "inertial",
        "",
        "BVH",
        "inertial",
        1.0 / motion.frame_time_s,
        rotations="parent",
        bone_names=tuple(bones),
        sides=tuple(side for side in SIDES if side in sides),
        axes="right-handed, Y up",
    )


def frames_of(motion: BvhMotion) -> Iterator[InertialFrame]:
    """Rotations and places of every bone in its parent's frame, a root's in the world. Made a block at a time."""
    bones = _bones(motion)
    names = tuple(bones)
    sides = {side_of(name) for name in bones}
    side = sides.pop() if len(sides) == 1 else None
    for begin in range(0, len(motion.values), _BLOCK):
        n = len(motion.values[begin : begin + _BLOCK])
        rotations, places = np.empty((n, len(bones), 4)), np.empty((n, len(bones), 3))
        for i, joint in enumerate(bones.values()):
            turned, moved = motion.local(joint, slice(begin, begin + n))
            rotations[:, i] = turned.as_quat(canonical=True, scalar_first=True)
            places[:, i] = UNIT_M * moved
        for k in range(n):
            time_s = (begin + k) * motion.frame_time_s
            times = Times(time_s, time_s, time_s)
            yield InertialFrame(begin + k, times, names, rotations[k], side, positions_m=places[k])


def _bones(motion: BvhMotion) -> dict[str, int]:
    """Joints that turn or move, by names that differ. An end site only says how long the last bone is."""
    joints = [joint for joint, channels in enumerate(motion.channels) if channels]
    return dict(zip(unique_labels([motion.names[joint] for joint in joints]), joints, strict=True))
