"""How wrong a hand that is followed may be: what its standard deviations rest on, learnt frame by frame.

Three things are not known before a hand is followed, and the fits themselves tell them:

- how far points are off their markers, by skin, glove and a profile that is a little wrong. The points' distances from
  the fit, over the coordinates that the fit has not used up (MacKay, Bayesian Interpolation, Neural Comput. 4, 1992,
  section 4.4: E_D and N - gamma), so that few markers, which any pose nearly explains, do not look like good ones;
- how unusual this hand's postures are, or those into which a wrong profile forces it: what the posture prior costs,
  over the angles that are known (there alpha, E_W and gamma). Never less than one: a calm minute is no promise;
- where markers sit that have not been seen yet: on a profile that nobody calibrated, as well as they are put on by eye.

Beside what each frame's markers and priors leave open there are two more: an angle that is held where it was last seen
is no better known than it was then; and a pose is not quite where points of this noise would have it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from core.frames import BoolArray, FloatArray
from core.guesses import POINT_NOISE_M
from core.hand.skeleton import N_DOFS, N_ROOT_DOFS
from core.kinematics.prior import MotionPrior
from core.kinematics.solver import Appraisal, HandPose, HandSolver
from core.markers.layout import ALONG_M, NORMAL_M, is_shipped
from core.profile import Profile

N_ANGLES = N_DOFS - N_ROOT_DOFS

NOISE_BLEND = 0.02
"""Share of the newest frame in how far points are usually off."""

UNUSUAL_BLEND = 0.005
"""Share of the newest frame in how unusual postures are: one posture lasts for seconds."""

SUPPOSED = 20.0
"""POINT_NOISE_M counts at first, and the usual noise in every frame, as so many coordinates left over would: a frame
that fits much worse than others, as with a wrong name, is to be believed less at once."""

LEAST_NOISE_M = 0.0001
"""No cameras and no skin are better."""

SPEED_LASTS_S = 0.2
"""A digit that is not seen goes on as it went, slower and slower: by 1/e in this time."""

STILL_SHARE, SPEED_SHARE = 0.6, 0.6
"""An angle that is not seen goes on as it went: how far it strays if it did not move, per what angles stray in all, and
per what it would have moved on at its speed. Digits that are still mostly stay so, those that move stop and turn."""

UNLIKE = 1.35
"""How many times further apart than its prior has them the angles are of which nothing but postures tells: a hand that
does something new keeps to no covariance. Chosen with the deviations of gaps (core.kinematics.gaps)."""


def placement_m(profile: Profile) -> float:
    """Standard deviation per axis of a marker's place on the hand before it is first seen [m].

    0 for markers that were calibrated: they are as far off as points usually are, and that is learnt.
    """
    by_eye = is_shipped(profile.layout) or np.allclose(profile.shape.ratios, 1.0)
    return float(np.sqrt((2.0 * ALONG_M**2 + NORMAL_M**2) / 3.0)) if by_eye else 0.0


class Doubt:
    """Of one hand that is followed."""

    def __init__(self, solver: HandSolver, placed_m: float) -> None:
        self._solver, self._by_eye_m = solver, placed_m
        self._left_over_m2, self._left_over = SUPPOSED * POINT_NOISE_M**2, SUPPOSED
        self._unusual_m2, self._postural = N_ANGLES * POINT_NOISE_M**2, float(N_ANGLES)
        self._motion = MotionPrior(np.zeros(N_ANGLES), np.zeros(N_ANGLES))
        self.begin()

    def begin(self) -> None:
        """The hand was found anew: where its markers sit and how it moved is not known; its points are as ever."""
        self._placed_m = np.full(len(self._solver.layout.marker_names), self._by_eye_m)
        self._known_rad, self._known_radps = np.full(N_ANGLES, np.inf), np.zeros(N_ANGLES)
        self._last: _Told | None = None

    @property
    def noise_m(self) -> float:
        """How far a coordinate of a point is usually off its marker [m]."""
        return max(float(np.sqrt(self._left_over_m2 / self._left_over)), LEAST_NOISE_M)

    @property
    def unusual(self) -> float:
        """How many times further apart than usual postures these are, 1 or more."""
        return max(1.0, float(np.sqrt(self._unusual_m2 / self._postural)) / POINT_NOISE_M)

    def of(
        self,
        pose: HandPose,
        targets_m: FloatArray,
        seen: BoolArray,
        guessed: BoolArray,
        expected: MotionPrior,
        unseen_s: FloatArray,
        speed_radps: FloatArray,
    ) -> tuple[FloatArray, FloatArray]:
        """theta_std (26,) float64 [m, rad] of a pose, as in a HandFrame, and marker_cov_m2 (m, 3, 3) float64 [m^2], the
        covariance of each marker's place.

        targets_m: (m, 3) [m], points of the markers `seen` (m,). guessed: (20,) bool, angles held where `expected` has
        them, last seen unseen_s (20,) [s] ago. speed_radps: (20,) [rad/s].
        """
        misfit_m2 = float(np.square(targets_m - pose.markers_world_m)[seen].sum())
        coordinates = 3.0 * np.count_nonzero(seen)
        spare = max(coordinates - N_DOFS, 0.0)
        variance_m2 = max((SUPPOSED * self.noise_m**2 + misfit_m2) / (SUPPOSED + spare), LEAST_NOISE_M**2)
        # The posture prior is written in units of POINT_NOISE_M: to widen it, the unit grows, and all else in it.
        unit_m = POINT_NOISE_M * self.unusual
        self._expect(guessed, expected, unseen_s, unit_m)
        weights = np.where(seen, unit_m**2 / variance_m2, 0.0)
        found = self._solver.appraise(pose, targets_m, weights, unit_m, self._motion)
        theta_std = np.hypot(found.theta_std, found.missed)
        if guessed.any():
            theta_std[N_ROOT_DOFS:][guessed] = np.hypot(
                self._of_guesses(found.theta_std[N_ROOT_DOFS:], unit_m)[guessed], found.missed[N_ROOT_DOFS:][guessed]
            )
        own_m2 = variance_m2 + np.square(self._placed_m) - unit_m**2
        found.marker_cov_m2[~seen] += own_m2[~seen, None, None] * np.eye(3)
        self._last = _Told(
            misfit_m2, coordinates - found.told, found, ~guessed, theta_std[N_ROOT_DOFS:], speed_radps.copy()
        )
        return theta_std, found.marker_cov_m2

    def _of_guesses(self, std_rad: FloatArray, unit_m: float) -> FloatArray:
        """(20,) [rad]: where an angle was last seen is believed as it is, all else UNLIKE times less."""
        held = self._motion.stiffness_m2 / unit_m**2
        other = np.maximum(1.0 / np.square(std_rad) - held, 0.0)
        std: FloatArray = 1.0 / np.sqrt(held + other / UNLIKE**2)
        return std

    def learn(self) -> None:
        """The pose last asked for was the frame's."""
        last, self._last = self._last, None
        if last is None:
            return
        self._known_rad[last.known] = last.std_rad[last.known]
        self._known_radps[last.known] = last.speed_radps[last.known]
        self._left_over_m2 += NOISE_BLEND * (last.misfit_m2 - self._left_over_m2)
        self._left_over += NOISE_BLEND * (last.left_over - self._left_over)
        self._unusual_m2 += UNUSUAL_BLEND * (last.found.unusual_m2 - self._unusual_m2)
        self._postural += UNUSUAL_BLEND * (last.found.postural - self._postural)

    def placed(self, seen: BoolArray, share: float) -> None:
        """Of the markers seen (m,) it is better known where they sit: so much of this frame is in their offsets."""
        self._placed_m[seen] *= 1.0 - share

    def _expect(self, guessed: BoolArray, expected: MotionPrior, unseen_s: FloatArray, unit_m: float) -> None:
        """The motion prior with all that is uncertain about it."""
        self._motion.expected_rad[:] = expected.expected_rad
        self._motion.stiffness_m2[:] = 0.0
        if guessed.any():
            stray2 = POINT_NOISE_M**2 / np.maximum(expected.stiffness_m2[guessed], 1e-30)
            moved_rad = self._known_radps[guessed] * np.minimum(unseen_s[guessed], SPEED_LASTS_S)
            held2 = np.square(self._known_rad[guessed]) + np.square(SPEED_SHARE * moved_rad)
            self._motion.stiffness_m2[guessed] = unit_m**2 / (STILL_SHARE**2 * stray2 + held2)


@dataclass(frozen=True)
class _Told:
    """Of one answer: what the next ones learn from it."""

    misfit_m2: float
    left_over: float
    found: Appraisal
    known: BoolArray
    std_rad: FloatArray
    speed_radps: FloatArray
