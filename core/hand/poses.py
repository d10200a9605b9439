"""Named poses of the digits, right or left hand alike.

Each is one row of degrees per digit: thumb (CMC flexion, CMC abduction, MCP flexion, IP flexion), then the four
fingers (MCP abduction, MCP, PIP and DIP flexion), in the order of core.hand.skeleton.DIGIT_DOF_NAMES.
"""

from __future__ import annotations

import numpy as np

from core.frames import FloatArray

_Row = tuple[float, float, float, float]
_REST: _Row = (0.0, 0.0, 0.0, 0.0)

_POSES_DEG: dict[str, tuple[_Row, _Row, _Row, _Row, _Row]] = {
    "rest": (_REST, _REST, _REST, _REST, _REST),
    "flat": ((-8, -4, 0, -2), (-5, -2, 0, 0), (0, -2, 0, 0), (-5, -2, 0, 0), (-10, -2, 0, 0)),
    "relaxed": ((8, 14, 10, 14), (1, 14, 20, 10), (0, 18, 24, 12), (-1, 22, 26, 14), (-1, 24, 24, 14)),
    "spread": ((-20, 6, -8, -10), (14, -8, -2, -2), (0, -8, -2, -2), (12, -8, -2, -2), (16, -8, -2, -2)),
    "fist": ((38, 28, 44, 46), (-2, 82, 98, 52), (0, 86, 100, 54), (-2, 88, 98, 52), (-4, 90, 90, 46)),
    "pinch_index": ((34, 20, 13, 2), (-11, 66, 26, 12), (0, 30, 24, 12), (1, 26, 22, 12), (2, 22, 20, 12)),
    "pinch_middle": ((44, 27, 9, 2), (4, 28, 22, 10), (-11, 64, 41, 9), (0, 32, 24, 12), (0, 26, 22, 12)),
    "point": ((38, 28, 44, 46), (0, 0, 4, 2), (0, 86, 98, 52), (-2, 88, 96, 52), (-4, 90, 90, 46)),
    "ok": ((34, 20, 13, 2), (-11, 66, 26, 12), (2, 2, 4, 2), (8, -2, 4, 2), (12, -4, 6, 2)),
    "cup": ((16, 38, 12, 16), (-4, 34, 30, 18), (0, 38, 32, 20), (-3, 42, 34, 20), (-7, 46, 34, 20)),
    "hook": ((0, 8, 8, 10), (-3, 6, 90, 46), (0, 6, 92, 48), (-4, 8, 90, 46), (-8, 10, 84, 42)),
    "grasp": ((22, 48, 16, 22), (2, 40, 42, 24), (0, 44, 44, 26), (0, 48, 46, 26), (0, 50, 44, 26)),
    "thumbs_up": ((-24, 8, -10, -12), (-2, 82, 96, 52), (0, 86, 98, 54), (-2, 88, 96, 52), (-4, 90, 90, 46)),
    "peace": ((40, 30, 46, 48), (8, 0, 4, 2), (-8, 0, 4, 2), (-1, 88, 96, 52), (-4, 90, 90, 46)),
}

POSE_NAMES = tuple(_POSES_DEG)
"""Poses by name; tracking usually starts in "relaxed", flat-pose calibration asks for "flat"."""


def pose(name: str) -> FloatArray:
    """(20,) float64 [rad], the digit angles of a named pose. Raises KeyError for an unknown name."""
    return np.radians(np.asarray(_POSES_DEG[name], dtype=np.float64).reshape(20))
