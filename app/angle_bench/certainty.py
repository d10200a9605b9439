"""What a tracked hand states about its angles: the one place that knows in which fields."""

from __future__ import annotations

import numpy as np

from core.frames import FloatArray, HandFrame
from core.hand.skeleton import N_ROOT_DOFS


def stated(hand: HandFrame) -> tuple[FloatArray, FloatArray]:
    """One standard deviation of the 20 digit angles, and what the calibration adds to it that is the same in every
    frame: (20,) float64 [rad] each, the second NaN where the hand does not say it."""
    fixed = getattr(hand, "theta_std_fixed", None)
    free = hand.theta_std[N_ROOT_DOFS:]
    return free, np.full_like(free, np.nan) if fixed is None else np.asarray(fixed, dtype=np.float64)[N_ROOT_DOFS:]
