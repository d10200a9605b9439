"""The shipped poses: complete, within limits, true to their contacts, no part of the hand in another."""

from __future__ import annotations

import numpy as np
import pytest

from core.hand.model import template
from core.motion.library import ACTIVITIES, LIBRARY, LibraryPose, poses_of
from resources.motion import surface
from resources.motion.free_hand import free_hand_goals
from resources.motion.grasps import grasp_goals
from tests.some import some

CONTACT_M = 3e-3
OVERLAP_M = 3e-3
SOFT_WEB_M = 4.5e-3
"""The webs between the digits give way to what is held."""

FEIX = (
    "Large Diameter", "Small Diameter", "Medium Wrap", "Adducted Thumb", "Light Tool", "Prismatic 4 Finger",
    "Prismatic 3 Finger", "Prismatic 2 Finger", "Palmar Pinch", "Power Disk", "Power Sphere", "Precision Disk",
    "Precision Sphere", "Tripod", "Fixed Hook", "Lateral", "Index Finger Extension", "Extension Type", "Distal Type",
    "Writing Tripod", "Tripod Variation", "Parallel Extension", "Adduction Grip", "Tip Pinch", "Lateral Tripod",
    "Sphere 4-Finger", "Quadpod", "Sphere 3-Finger", "Stick", "Palmar", "Ring", "Ventral", "Inferior Pincer",
)  # fmt: skip
LEAST = {"rest": 7, "extreme": 30, "grasp": 35, "pinch": 14, "counting": 15, "sign": 40, "gesture": 20, "piano": 10}

every_pose = pytest.mark.parametrize("pose", LIBRARY.values(), ids=LIBRARY)


def test_every_pose_is_within_the_limits() -> None:
    low, high = template().skeleton.limits_rad.T
    for pose in LIBRARY.values():
        assert (pose.angles_rad >= low).all(), pose.name
        assert (pose.angles_rad <= high).all(), pose.name


def test_every_activity_is_covered() -> None:
    assert set(LEAST) == set(ACTIVITIES)
    for activity, least in LEAST.items():
        assert len(poses_of(activity)) >= least, activity
    assert sum(len(poses_of(activity)) for activity in ACTIVITIES) == len(LIBRARY)
    with pytest.raises(KeyError, match="juggling"):
        poses_of("juggling")


def test_extremes_take_every_joint_near_its_limits() -> None:
    table = np.degrees([pose.angles_rad for pose in poses_of("extreme")])
    low, high = np.degrees(template().skeleton.limits_rad).T
    reached = np.stack([table.min(axis=0) - low, high - table.max(axis=0)])
    flexions = [i for i in range(20) if i % 4 != 0 or i == 0]
    # A finger's own last two joints do not bend backwards as far as some hands can be pressed.
    assert reached[1, flexions].max() < 22.0
    assert reached[0, [0, 1, 2, 3, 5, 9, 13, 17]].max() < 8.0
    assert reached[1, [4, 8, 12, 16]].max() < 8.0


def test_all_grasps_of_feix_are_there_with_what_they_hold() -> None:
    by_source = {pose.source.split(";")[0]: pose for pose in poses_of("grasp")}
    for number, title in enumerate(FEIX, start=1):
        pose = by_source[f"Feix 2016, {number}: {title}"]
        assert pose.prop is not None
        assert any("prop" in pair for pair in pose.contacts), pose.name


def test_all_static_letters_and_digits_are_there() -> None:
    for letter in "abcdefghiklmnopqrstuvwxy0123456789":
        assert f"asl_{letter}" in LIBRARY


def test_no_two_poses_are_the_same() -> None:
    table = np.stack([pose.angles_rad for pose in LIBRARY.values()])
    apart = np.abs(table[:, None] - table[None]).max(axis=2) + np.eye(len(table))
    assert apart.min() > np.radians(3.0)


def test_the_file_holds_what_the_goals_name() -> None:
    goals = [*free_hand_goals(), *grasp_goals()]
    assert [goal.name for goal in goals] == list(LIBRARY)
    for goal in goals:
        pose = LIBRARY[goal.name]
        assert (pose.activity, pose.source, pose.contacts) == (goal.activity, goal.source, goal.contacts)
        assert (pose.prop is None) == (goal.held is None)


TOUCHING = [pose for pose in LIBRARY.values() if pose.contacts]


def test_some_poses_touch_and_some_do_not() -> None:
    assert len(LIBRARY) / 4 < len(TOUCHING) < len(LIBRARY)


@pytest.mark.parametrize("pose", TOUCHING, ids=lambda pose: pose.name)
def test_what_should_touch_touches(pose: LibraryPose) -> None:
    for pair in some(pose.contacts):
        assert abs(surface.contact_gap(pose.angles_rad, pose.prop, pair)) < CONTACT_M, pair


@every_pose
def test_no_part_of_the_hand_lies_in_another(pose: LibraryPose) -> None:
    depth, where = surface.deepest_overlap(pose.angles_rad)
    assert depth < OVERLAP_M, where


def test_no_part_of_the_hand_lies_in_what_is_held() -> None:
    for pose in LIBRARY.values():
        if pose.prop is not None:
            inside = -surface.prop_distance(pose.prop, surface.surface(pose.angles_rad)[0])
            webs = surface.bodies() < 0
            assert inside[~webs].max() < OVERLAP_M, pose.name
            assert inside[webs].max() < SOFT_WEB_M, pose.name


def test_fingers_bend_as_fingers_do() -> None:
    """The last joint bends with the one before it (2/3, Rijpkema & Girard 1991), unless something presses it."""
    free = [pose for pose in LIBRARY.values() if pose.activity in ("rest", "gesture", "sign", "counting")]
    fingers = np.degrees([pose.angles_rad.reshape(5, 4)[1:] for pose in free]).reshape(-1, 4)
    off = fingers[:, 3] - 2.0 / 3.0 * fingers[:, 2]
    assert np.median(np.abs(off)) < 8.0
    assert np.percentile(np.abs(off), 95) < 25.0
    abducted = np.abs(fingers[:, 0])
    assert abducted[fingers[:, 1] > 75.0].max() < 14.0  # a bent knuckle hardly spreads
