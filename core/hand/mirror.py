"""Left hands are right hands seen in a mirror, the plane x = 0. Only here is it done.

The engine mirrors a left hand's points, solves a right hand, and mirrors the result back. Joint angles are
the same on both sides: flexion closes either hand.
"""

from __future__ import annotations

import numpy as np

from core.frames import FloatArray, Side
from core.hand.model import HandModel, skin

_MIRROR = np.diag([-1.0, 1.0, 1.0, 1.0])


def mirror_points(points_m: FloatArray) -> FloatArray:
    """(..., 3) float64 [m] to the same in the mirror."""
    return points_m * (-1.0, 1.0, 1.0)


def mirror_theta(theta_rad: FloatArray) -> FloatArray:
    """(..., 26) parameters of one hand to those of its mirror image (a rotation vector is a pseudovector)."""
    mirrored = theta_rad.copy()
    mirrored[..., [0, 4, 5]] *= -1.0
    return mirrored


def mirror_transforms(transforms: FloatArray) -> FloatArray:
    """(..., 4, 4) rigid transforms of one hand to those of its mirror image: M T M, again a proper rotation."""
    return _MIRROR @ transforms @ _MIRROR


def skin_hand(hand: HandModel, side: Side, joints_world: FloatArray) -> FloatArray:
    """Surface of a tracked hand of either side.

    hand: the right hand at the performer's scale. joints_world: (16, 4, 4), as in a HandFrame of that side.
    Returns (v, 3) float64 [m]; the faces of a left hand are those of the right, wound the other way.
    """
    if side == "right":
        return skin(hand, joints_world)
    return mirror_points(skin(hand, mirror_transforms(joints_world)))
