"""The shipped poses: complete, within limits, and their file."""

from __future__ import annotations

import numpy as np

from core.hand.model import template
from core.motion.library import ACTIVITIES, LIBRARY, poses_of


def test_every_pose_is_within_the_limits() -> None:
    low, high = template().skeleton.limits_rad.T
    for pose in LIBRARY.values():
        assert (pose.angles_rad >= low).all(), pose.name
        assert (pose.angles_rad <= high).all(), pose.name


def test_every_activity_is_covered() -> None:
    for activity in ACTIVITIES:
        assert len(poses_of(activity)) >= 7, activity
    assert sum(len(poses_of(activity)) for activity in ACTIVITIES) == len(LIBRARY)


def test_no_two_poses_are_the_same() -> None:
    table = np.stack([pose.angles_rad for pose in LIBRARY.values()])
    apart = np.abs(table[:, None] - table[None]).max(axis=2) + np.eye(len(table))
    assert apart.min() > np.radians(1.0)
