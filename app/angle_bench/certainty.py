"""What is stated about tracked angles: the one place that knows where it is said."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from core.calibration.fixed_error import SAMPLE, FixedError
from core.calibration.neutral import NeutralHand
from core.frames import FloatArray, HandFrame
from core.hand.skeleton import N_ROOT_DOFS
from core.kinematics.prior import N_ANGLES
from core.profile import Profile


def stated(hands: Sequence[HandFrame]) -> FloatArray:
    """(n, 20) float64 [rad], one standard deviation of the digit angles in each frame, `<angle>_std`."""
    if not hands:
        return np.empty((0, N_ANGLES))
    return np.array([hand.theta_std for hand in hands])[:, N_ROOT_DOFS:]


def stated_fixed(profile: Profile, hands: Sequence[HandFrame], neutral: NeutralHand | None = None) -> FloatArray:
    """(n, 20) float64 [rad], one standard deviation from what is the same in all frames, `<angle>_std_fixed`.

    profile: that the hands, right ones, were tracked with. neutral: what their angles are counted from. Which markers
    count is as in angles.csv.
    """
    if not hands:
        return np.empty((0, N_ANGLES))
    observed = np.array([hand.observed for hand in hands])
    thetas, scales = np.array([hand.theta_rad for hand in hands]), np.array([hand.scale for hand in hands])
    rows = np.unique(np.linspace(0, len(hands) - 1, min(SAMPLE, len(hands))).astype(int))
    error = FixedError(profile, "right", thetas[rows], scales[rows], observed[rows].any(axis=0), neutral)
    return error.std(thetas, scales, observed)[:, N_ROOT_DOFS:]
