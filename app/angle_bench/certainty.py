"""What is stated about tracked angles: the one place that knows where it is said."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from core.calibration.carried import Carrier, fixed_std
from core.frames import FloatArray, HandFrame
from core.hand.skeleton import N_ROOT_DOFS
from core.kinematics.prior import N_ANGLES
from core.profile import Profile

SAMPLE = 200
"""Frames from which it is seen what a hand's size rests on, as for angles.csv (core.takes.export.fixed_std)."""


def stated(hands: Sequence[HandFrame]) -> FloatArray:
    """(n, 20) float64 [rad], one standard deviation of the digit angles in each frame, `<angle>_std`."""
    if not hands:
        return np.empty((0, N_ANGLES))
    return np.array([hand.theta_std for hand in hands])[:, N_ROOT_DOFS:]


def stated_fixed(profile: Profile, hands: Sequence[HandFrame]) -> FloatArray:
    """(n, 20) float64 [rad], one standard deviation from what is the same in all frames, `<angle>_std_fixed`.

    profile: that the hands, right ones, were tracked with. A marker that is ever seen counts in every frame, as in
    angles.csv.
    """
    if not hands:
        return np.empty((0, N_ANGLES))
    carrier = Carrier(profile)
    shown = np.any([hand.observed for hand in hands], axis=0).astype(np.float64)
    thetas, scales = np.array([hand.theta_rad for hand in hands]), np.array([hand.scale for hand in hands])
    weights = np.tile(shown, (len(hands), 1))
    covariance = carrier.covariance
    if profile.scale is None:
        rows = np.unique(np.linspace(0, len(hands) - 1, min(SAMPLE, len(hands))).astype(int))
        covariance = carrier.sized(carrier.carried(thetas[rows], scales[rows], weights[rows], free_scale=True))
    return fixed_std(carrier.carried(thetas, scales, weights), covariance)[:, N_ROOT_DOFS:]
