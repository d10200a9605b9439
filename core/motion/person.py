"""What makes one performer's hands their own: tempo, range, rest, and how their digits move together.

A person's posture is a smooth, low-rank deviation of a named one: neighbouring fingers lead one another along
(enslaving: Zatsiorsky, Li and Latash 2000), a few random synergies couple all angles, every joint has its own range and
rest, and the left hand is almost, not quite, the right. The deviations are drawn once per person.
"""

from __future__ import annotations

import numpy as np

from core.frames import FloatArray
from core.hand.poses import pose
from core.hand.skeleton import DIGITS

N_ANGLES = 20
MARGIN_RAD = np.radians(2.0)
"""A posture keeps this far from the limits: nobody holds a joint at its stop."""

_SYNERGIES = 3
_SYNERGY_SIZE = 0.07  # largest part of a posture that one random synergy adds to it
_FLEXIONS = (1, 2, 3)  # columns of a finger's four angles
_REST = pose("relaxed")


class Person:
    """Traits drawn from `random`.

    tempo: duration of a movement over the usual one. reach: amplitude of the arms over the usual one.
    lag_s: (5,) float64 [s], by how much each digit sets off late. hesitancy: share of movements that halt midway.
    tremor: amplitude over the usual one. sloppiness_rad: how far a posture taken again differs, one standard deviation.
    """

    def __init__(self, random: np.random.Generator, limits_rad: FloatArray) -> None:
        self._low, self._high = limits_rad[:, 0] + MARGIN_RAD, limits_rad[:, 1] - MARGIN_RAD
        self.tempo = float(np.exp(random.normal(0.0, 0.16)))
        self.reach = float(np.exp(random.normal(0.0, 0.12)))
        self.lag_s = random.uniform(0.0, 0.045, len(DIGITS))
        self.hesitancy = float(random.uniform(0.03, 0.12))
        self.tremor = float(random.uniform(0.4, 1.4))
        self.sloppiness_rad = float(np.radians(random.uniform(1.2, 2.6)))
        both, own = _deviation(random), [_deviation(random), _deviation(random)]
        self._maps = [both[0] + 0.35 * side[0] for side in own]
        self._shifts = [both[1] + 0.35 * side[1] for side in own]

    def posture(self, angles_rad: FloatArray, hand: int) -> FloatArray:
        """How this person's hand (0 left, 1 right) takes the posture (20,) float64 [rad]. Returns (20,)."""
        away = angles_rad - _REST
        return self.within(angles_rad + self._maps[hand] @ away + self._shifts[hand])

    def within(self, angles_rad: FloatArray) -> FloatArray:
        """(..., 20) float64 [rad], inside the limits with a margin."""
        kept: FloatArray = np.clip(angles_rad, self._low, self._high)
        return kept


def _deviation(random: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """(20, 20) what to add per unit of posture away from rest, and (20,) [rad] what to add always."""
    added = np.zeros((N_ANGLES, N_ANGLES))
    for _ in range(_SYNERGIES):
        added += _SYNERGY_SIZE * random.uniform(0.3, 1.0) * np.outer(_smooth(random), _smooth(random))
    enslaving = random.uniform(0.02, 0.09)
    for finger in range(1, 5):
        neighbours = [other for other in (finger - 1, finger + 1) if 1 <= other < 5]
        for column in _FLEXIONS:
            own = 4 * finger + column
            added[own, own] -= enslaving
            for other in neighbours:
                added[own, 4 * other + column] += enslaving / len(neighbours)
    ranges = random.normal(0.0, 0.04, 4)  # by kind of joint, alike in all fingers
    added[np.diag_indices(N_ANGLES)] += np.concatenate([random.normal(0.0, 0.04, 4), np.tile(ranges, 4)])
    return added, np.radians(4.0) * np.sqrt(N_ANGLES) * 0.5 * _smooth(random)


def _smooth(random: np.random.Generator) -> FloatArray:
    """(20,) float64, unit length: a pattern over the joints that changes little from finger to finger."""
    level, slope, bend = random.normal(0.0, 1.0, 3) * (1.0, 0.6, 0.35)
    along = np.linspace(-1.0, 1.0, 4)
    fingers = (level + slope * along + bend * (along**2 - 0.5))[:, None] * random.normal(0.0, 1.0, 4)
    pattern = np.concatenate([random.normal(0.0, 0.6, 4), fingers.ravel()])
    pattern[4::4] *= 0.4  # abduction has a quarter of flexion's range
    pattern /= np.linalg.norm(pattern)
    return pattern
