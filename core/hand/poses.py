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
    "fist": ((38, 36, 38, 42), (-3, 84, 106, 62), (0, 88, 108, 64), (-4, 90, 106, 64), (-9, 92, 100, 62)),
    "pinch_index": ((34, 24, 12, 4), (-10, 56, 41, 18), (0, 26, 24, 12), (1, 22, 22, 12), (2, 18, 20, 12)),
    "pinch_middle": ((40, 38, 8, 2), (4, 24, 20, 10), (-10, 62, 44, 10), (0, 30, 24, 12), (0, 24, 22, 12)),
    "point": ((38, 36, 38, 42), (0, 0, 4, 2), (0, 88, 106, 64), (-4, 90, 104, 64), (-9, 92, 98, 62)),
    "ok": ((34, 24, 12, 4), (-10, 56, 41, 18), (2, 2, 4, 2), (8, -2, 4, 2), (12, -4, 6, 2)),
    "cup": ((16, 38, 12, 16), (-4, 34, 30, 18), (0, 38, 32, 20), (-3, 42, 34, 20), (-7, 46, 34, 20)),
    "hook": ((0, 8, 8, 10), (-3, 6, 92, 54), (0, 6, 96, 56), (-4, 8, 94, 56), (-8, 10, 88, 54)),
    "grasp": ((22, 48, 16, 22), (2, 40, 42, 24), (0, 44, 44, 26), (0, 48, 46, 26), (0, 50, 44, 26)),
    "thumbs_up": ((-24, 8, -10, -12), (-3, 84, 104, 62), (0, 88, 106, 64), (-4, 90, 104, 64), (-9, 92, 98, 62)),
    "peace": ((38, 36, 40, 44), (8, 0, 4, 2), (-8, 0, 4, 2), (-2, 90, 102, 64), (-8, 92, 98, 62)),
}

POSE_NAMES = tuple(_POSES_DEG)
"""Poses by name; tracking usually starts in "relaxed", flat-pose calibration asks for "flat"."""


def pose(name: str) -> FloatArray:
    """(20,) float64 [rad], the digit angles of a named pose. Raises KeyError for an unknown name."""
    return np.radians(np.asarray(_POSES_DEG[name], dtype=np.float64).reshape(20))
