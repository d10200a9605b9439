"""Joints and angles as they are spoken of, and how sure they are."""

from __future__ import annotations

import numpy as np

from core.cast import Cast
from core.frames import FloatArray
from core.hand.certainty import joint_std_rad
from core.hand.skeleton import JOINT_NAMES
from core.takes.export.counted import neutral_words


def angle_title(name: str) -> str:
    """'index_pip_flexion' as 'Index PIP flexion'."""
    digit, joint, motion = name.split("_")
    return f"{digit.capitalize()} {joint.upper()} {motion}"


def angle_tip(cast: Cast) -> str:
    """What a plot of a joint angle shows, and what it counts from."""
    trials = neutral_words(cast)
    zero = f"\nCounted from zero as in angles.csv: {'; '.join(trials)}." if trials else ""
    return (
        "The joint angle drawn for every hand, dotted with one standard deviation of each frame by itself above and "
        f"below.\nNot in it: by how much bones and markers are off in all frames (std_fixed of angles.csv).{zero}"
    )


def joint_words(joint: int) -> str:
    """'ring DIP' of an index into JOINT_NAMES."""
    digit, _, name = JOINT_NAMES[joint].partition("_")
    return f"{digit} {name.upper()}".strip()


def least_sure(theta_std: FloatArray) -> str:
    """'ring DIP ±14°', the joint with the largest standard deviation, 'wrist ±12 mm' if it is its position; '' if none
    is known.

    theta_std: (26,) float64 [m for 0:3, else rad], as a HandFrame holds it.
    """
    if not np.isfinite(theta_std).any():
        return ""
    theta_std = np.nan_to_num(theta_std)
    std_rad = joint_std_rad(theta_std)
    joint = int(std_rad.argmax())
    if joint == 0:
        position_m, turn_rad = np.linalg.norm(theta_std[:3]), np.linalg.norm(theta_std[3:6])
        if std_rad[0] > np.sqrt(2.0) * turn_rad:
            return f"wrist{plus_minus_mm(float(position_m))}"
        return f"wrist ±{np.degrees(turn_rad):.0f}°"
    return f"{joint_words(joint)} ±{np.degrees(std_rad[joint]):.0f}°"


def plus_minus_mm(std_m: float) -> str:
    """' ±12 mm' of an expected error [m], tenths only below a millimetre; '' if it is not known."""
    return f" ±{1000.0 * std_m:.{int(std_m < 0.00095)}f} mm" if np.isfinite(std_m) else ""
