"""Turning a file's axes to the house's: right-handed, Y up."""

from __future__ import annotations

import numpy as np

from core.frames import FloatArray

_AXES = {"X": 0, "Y": 1, "Z": 2}

Z_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
"""(3, 3) rotation from Z up to Y up: -90 degrees about X."""


def from_screen(x_screen: str, y_screen: str) -> FloatArray:
    """(3, 3) rotation to Y up from what a C3D file names as pointing right (x) and up (y) on a screen, such as
    "+X" and "+Z". The identity where the file names no usable pair.
    """
    right, up = _unit(x_screen), _unit(y_screen)
    if up is None:
        return np.eye(3)
    if right is None or abs(right @ up) > 0.5:  # only the up axis is known: keep X where it can be kept
        right = np.array([1.0, 0.0, 0.0]) if abs(up[0]) < 0.5 else np.array([0.0, 0.0, 1.0])
    return np.stack([right, up, np.cross(right, up)])


def _unit(axis: str) -> FloatArray | None:
    axis = axis.strip().upper()
    sign, letter = (-1.0, axis[1:]) if axis.startswith("-") else (1.0, axis.lstrip("+"))
    if letter not in _AXES:
        return None
    unit = np.zeros(3)
    unit[_AXES[letter]] = sign
    return unit
