"""How far the poses of one hand are off for what is the same in all frames: the one place that works it out.

With a neutral trial an angle is reported less its zero, which was tracked with the same bones and markers, and is off
by the same error where the stance of the trial carries it. What is left in the reported angle is the difference:

    d reported = (G(theta) - G(theta_0)) df,    theta_0: the pose tracked in the trial

(G as in core.calibration.carried), which is nothing in the stance itself and grows with the way from it.
"""

from __future__ import annotations

import numpy as np

from core.calibration.carried import Carrier, fixed_std
from core.calibration.neutral import NeutralHand
from core.frames import BoolArray, FloatArray, Side
from core.hand.mirror import mirror_theta
from core.hand.skeleton import N_DOFS, N_ROOT_DOFS
from core.kinematics.prior import posture_prior
from core.profile import Profile

SAMPLE = 200
"""Frames, spread over the recording, from which it is seen which markers a hand shows and what its size rests on."""


class FixedError:
    """Of one hand of a recording."""

    def __init__(
        self, profile: Profile, side: Side, thetas_rad: FloatArray, scales: FloatArray, shown: BoolArray,
        neutral: NeutralHand | None = None,
    ) -> None:  # fmt: skip
        """thetas_rad: (f, 26), scales: (f,), of a sample of its tracked frames, as tracked; none where it has none.
        shown: (m,) bool, markers that the recording shows. neutral: what its reported angles count from."""
        self._carrier, self._side, self._shown = Carrier(profile), side, shown
        self._covariance = self._carrier.covariance
        if profile.scale is None and len(thetas_rad):
            self._covariance = self._carrier.sized(self._carried(thetas_rad, scales, shown[None], free_scale=True))
        self._zeros = np.zeros((N_DOFS, len(self._covariance)))
        if neutral is not None:
            scale = profile.scale or (float(np.median(scales)) if len(scales) else 1.0)
            stance = np.concatenate([np.zeros(N_ROOT_DOFS), trial_stance(neutral, profile)])
            carried = self._carrier.carried(stance[None], np.array([scale]), np.ones((1, len(shown))))[0]
            told = np.concatenate([np.zeros(N_ROOT_DOFS, dtype=np.bool_), neutral.told])
            self._zeros[told] = carried[told]

    def std(self, thetas_rad: FloatArray, scales: FloatArray, observed: BoolArray | None = None) -> FloatArray:
        """(f, 26) float64 [m for 0:3, else rad], one standard deviation of each parameter, as it is reported.

        thetas_rad: (f, 26), as tracked. scales: (f,). observed: (f, m) bool, markers with a point. A marker that is
        hidden for a while counts: what is known of its digit then is from when it was seen, or will be, and as wrong
        as it is there.
        """
        shown = self._shown[None] if observed is None else self._shown | observed
        return fixed_std(self._carried(thetas_rad, scales, shown) - self._zeros, self._covariance)

    def _carried(
        self, thetas_rad: FloatArray, scales: FloatArray, shown: BoolArray, *, free_scale: bool = False
    ) -> FloatArray:
        """G (f, 26 or 27, n). shown: (f, m) or (1, m)."""
        thetas = mirror_theta(thetas_rad) if self._side == "left" else thetas_rad
        weights = np.broadcast_to(shown.astype(np.float64), (len(thetas), len(self._shown)))
        return self._carrier.carried(thetas, scales, weights, free_scale=free_scale)


def trial_stance(neutral: NeutralHand, profile: Profile) -> FloatArray:
    """(20,) float64 [rad], the digit angles that were tracked in a neutral trial.

    Those of which the trial told nothing are where the posture prior has them, given the others.
    """
    angles: FloatArray = neutral.zero_rad + neutral.given_rad
    told, prior = neutral.told, posture_prior(profile.subspace)
    if not told.all():
        p, off = prior.precision_m2, angles[told] - prior.mean_rad[told]
        angles[~told] = prior.mean_rad[~told] - np.linalg.solve(p[np.ix_(~told, ~told)], p[np.ix_(~told, told)] @ off)
        angles[~told] = np.clip(angles[~told], *profile.hand.skeleton.limits_rad[~told].T)
    return angles
