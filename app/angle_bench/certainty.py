"""What is stated about tracked angles: the one place that knows where it is said."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from core.frames import FloatArray, HandFrame
from core.hand.skeleton import N_ROOT_DOFS
from core.kinematics.prior import N_ANGLES
from core.profile import Profile


def stated(hands: Sequence[HandFrame]) -> FloatArray:
    """(n, 20) float64 [rad], one standard deviation of the digit angles in each frame, `<angle>_std`."""
    if not hands:
        return np.empty((0, N_ANGLES))
    return np.array([hand.theta_std for hand in hands])[:, N_ROOT_DOFS:]


def stated_fixed(profile: Profile, hands: Sequence[HandFrame]) -> FloatArray:
    """(n, 20) float64 [rad], one standard deviation from what is the same in all frames, `<angle>_std_fixed`; NaN where
    it is not known. profile: that the hands were tracked with."""
    return np.full((len(hands), N_ANGLES), np.nan)
