"""How much of a pose is measured and how much is a guess: one figure per joint, for the eye.

The figures are one standard deviation each, as a HandFrame holds them; what is unknown (NaN) counts as sure, for
nothing speaks against it.
"""

from __future__ import annotations

import numpy as np

from core.frames import BoolArray, FloatArray
from core.hand.skeleton import DIGITS, DOF_JOINTS, N_JOINTS, N_ROOT_DOFS

SURE_RAD = float(np.radians(3.0))
"""Up to here an angle is measured, as well as markers on skin can."""

GUESS_RAD = float(np.radians(7.0))
"""From here on it is a guess: the joints beside it say as much of an angle that no marker speaks for."""

_PALM_M = 0.1
"""Seen over this length, an error of the wrist's position compares with one of its rotation."""

_TURNS = np.zeros((N_JOINTS, len(DOF_JOINTS)))
_TURNS[DOF_JOINTS, np.arange(len(DOF_JOINTS))] = 1.0


def joint_std_rad(theta_std: FloatArray) -> FloatArray:
    """Each joint by itself: the root of the summed variances of its angles.

    theta_std: (..., 26) float64 [m for 0:3, else rad]. Returns (..., 16) float64 [rad]; that of the wrist is of its
    rotation and of its position, as seen over the length of a palm.
    """
    variance = np.square(np.nan_to_num(theta_std, nan=0.0, posinf=np.pi))  # half a turn off is as wrong as can be
    variance[..., :3] /= _PALM_M**2
    joints: FloatArray = variance[..., N_ROOT_DOFS:] @ _TURNS.T
    joints[..., 0] = variance[..., :N_ROOT_DOFS].sum(axis=-1)
    return np.sqrt(joints, out=joints)


def guessed(theta_std: FloatArray) -> FloatArray:
    """How much each joint's place is a guess, 0 (measured) to 1.

    theta_std: (..., 26) float64 [m for 0:3, else rad]. Returns (..., 16) float64, rising smoothly from SURE_RAD to
    GUESS_RAD. A joint is at least as much a guess as every joint that leads to it. The largest of the chain counts
    and not their sum: with a marker at the tip the angles of a finger are unsure together, but opposite.
    """
    std = joint_std_rad(theta_std)
    digits = std[..., 1:].reshape(*std.shape[:-1], len(DIGITS), -1)
    np.maximum.accumulate(digits, axis=-1, out=digits)
    std[..., 1:] = np.maximum(digits.reshape(*std.shape[:-1], -1), std[..., :1])
    t = np.clip((std - SURE_RAD) / (GUESS_RAD - SURE_RAD), 0.0, 1.0)
    guess: FloatArray = t * t * (3.0 - 2.0 * t)
    return guess


def guesses(theta_std: FloatArray) -> BoolArray:
    """(..., 16) bool, which joints are to be called a guess: more guessed than measured. theta_std as above."""
    called: BoolArray = guessed(theta_std) >= 0.5
    return called
