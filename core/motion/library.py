"""The poses shipped with Phalanx: grasps, pinches, counting, signs, gestures, piano, rest and extremes.

They are kept in resources/motion/poses.json; resources/motion/CARD.md says how they were made.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from importlib.resources import files
from types import MappingProxyType

from core.motion.pose_file import ACTIVITIES, LibraryPose, Prop, poses_from_dict

__all__ = ["ACTIVITIES", "LIBRARY", "LibraryPose", "Prop", "poses_of"]

_FILE = files("resources") / "motion" / "poses.json"

LIBRARY: Mapping[str, LibraryPose] = MappingProxyType(
    poses_from_dict(json.loads(_FILE.read_text(encoding="utf-8")), "resources/motion/poses.json")
)
"""All of them by name, activity by activity."""


def poses_of(activity: str) -> tuple[LibraryPose, ...]:
    """The shipped poses of one of ACTIVITIES. Raises KeyError for another."""
    if activity not in ACTIVITIES:
        raise KeyError(activity)
    return tuple(pose for pose in LIBRARY.values() if pose.activity == activity)
