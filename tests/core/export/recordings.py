"""Solved recordings to export: the performer's true motion, with what goes wrong on a capture day."""

from functools import cache

import numpy as np

from core.frames import NO_POINT, HandFrame, HandState, MarkerFrame, Times, TrackedFrame
from core.hand.model import template
from core.motion.performer import Performer
from core.profile import load_profile
from core.takes.formats import c3d, trc
from core.takes.solution import Solution

RATE = 120.0
START_S = 5000.25
"""Of the host clock."""


@cache
def solution(n_frames=240, layout="han19", lost=(100, 101), scale=0.95, untracked=(30, 60), name="take 1"):
    """Both hands (or the layout's), moving. Frames `lost` never arrived. The left hand is not tracked in frames
    before 10, and lost in `untracked`. Every seventh marker is predicted. The scale is found within 20 frames.
    """
    profile = load_profile(layout)
    performer = Performer(profile, seed=3)
    raw, solved = [], []
    for i in range(n_frames):
        if i in lost:
            continue
        truth = performer.at(2.0 + i / RATE)
        times = Times(i / RATE, START_S + i / RATE, START_S + i / RATE + 0.004)
        points, hands = [], []
        for side in profile.sides:
            markers = truth.markers_world_m[side]
            size = scale * (1.0 + 0.002 * max(0, 20 - i))
            joints = truth.joints_world[side].copy()
            joints[:, :3, 3] = joints[0, :3, 3] + size * (joints[:, :3, 3] - joints[0, :3, 3])
            point = np.arange(len(markers)) + len(points)
            point[(np.arange(len(markers)) + i) % 7 == 0] = NO_POINT
            points += list(markers)
            state = HandState.TRACKED
            if side == "left" and i < 10:
                state = HandState.SEARCHING
            elif side == "left" and untracked[0] <= i < untracked[1]:
                state = HandState.LOST
            confidence = np.where(point == NO_POINT, 0.5, 0.98765)
            theta_std = 0.01 * np.arange(1, 27) + 1e-4 * i
            marker_std_m = np.where(point == NO_POINT, 0.012, np.nan if i % 9 == 0 else 0.0007)
            hands.append(
                HandFrame(
                    side,
                    state,
                    truth.theta_rad[side],
                    joints,
                    markers,
                    point,
                    confidence,
                    theta_std,
                    marker_std_m,
                    0.0012,
                    size,
                )
            )
        ids = np.arange(len(points), dtype=np.int64) + 1000
        raw.append(MarkerFrame(7000 + i, times, np.array(points), ids, np.full(len(points), np.nan)))
        solved.append(TrackedFrame(7000 + i, times, tuple(hands)))
    return Solution(name, profile, RATE, tuple(raw), tuple(solved))


def every_point(path):
    """Of a C3D or TRC file, with what was predicted and computed: `read_recording` takes what was measured."""
    return trc.read_all(path) if path.suffix == ".trc" else c3d.read_with_residuals(path)[0]


def hands_of(recording, side):
    """The hand of one side in every solved frame."""
    return [next(hand for hand in frame.hands if hand.side == side) for frame in recording.solved]


def scaled_hand(hand):
    """The template at the size of a solved hand."""
    return template().scaled(hand.scale)
