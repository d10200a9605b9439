"""The score of a performance: minimum-jerk submovements of one hand (Flash and Hogan 1985), one after another.

All parameters are those of a right hand; a left hand's are its mirror image's.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from core.frames import FloatArray
from core.hand.skeleton import DIGITS, N_DOFS, N_ROOT_DOFS
from core.motion.person import Person

MAX_WRIST_SPEED_MPS = 1.3
MAX_TURN_SPEED_RADPS = 5.0
MAX_DIGIT_SPEED_RADPS = 7.0
_PEAK = 1.875  # peak speed of a minimum-jerk movement, in mean speeds
_CORRECTION = (0.02, 0.09)  # share of a reach that is left to a second, corrective submovement
_CORRECTED_FROM = 0.7  # and when it begins, in durations of the first


class HandScore:
    """The movements of one hand, and where they lead.

    now: (26,) float64, what the parameters will be when all movements so far have ended.
    """

    def __init__(self, person: Person, random: np.random.Generator, start: FloatArray) -> None:
        self._person, self._random = person, random
        self.start = start.copy()
        self.now = start.copy()
        self._moves: list[tuple[FloatArray, FloatArray, FloatArray]] = []  # begin_s, duration_s, change (26,)
        self._calm: list[tuple[float, float]] = []

    def wrist(self, time_s: float, target: FloatArray, duration_s: float | None = None, exact: bool = False) -> float:
        """Reach for a position [m] and rotation vector [rad] (6,). Returns when it arrives [s].

        duration_s: None for this person's own; a longer one where that were too fast. exact: in one submovement.
        """
        random = self._random
        change = target - self.now[:N_ROOT_DOFS]
        way_m, turn_rad = float(np.linalg.norm(change[:3])), float(np.linalg.norm(change[3:]))
        if way_m < 1e-9 and turn_rad < 1e-9:
            return time_s
        if duration_s is None:
            duration_s = self._person.tempo * (0.42 + 1.1 * way_m + 0.16 * turn_rad) * random.uniform(0.85, 1.25)
        duration_s = max(duration_s, self.shortest_s(target))
        left_over = 0.0 if exact or way_m < 0.05 else random.uniform(*_CORRECTION)
        begin = np.full(N_ROOT_DOFS, time_s)
        begin[3:] += 0.0 if exact else random.uniform(0.0, 0.1) * duration_s  # it turns a little after it sets off
        self._add_wrist(begin, duration_s, change * (1.0 - left_over))
        end_s = time_s + duration_s
        if left_over:
            later_s = time_s + _CORRECTED_FROM * duration_s
            self._add_wrist(np.full(N_ROOT_DOFS, later_s), 0.5 * duration_s, change * left_over)
            end_s = later_s + 0.5 * duration_s
        self.now[:N_ROOT_DOFS] = target
        return float(max(end_s, begin.max() + duration_s))

    def begin_with(self, angles_rad: FloatArray) -> None:
        """Another posture (20,) [rad] to start from and come back to; before any movement."""
        self.start[N_ROOT_DOFS:] = self.now[N_ROOT_DOFS:] = angles_rad

    def mark(self) -> tuple[int, int, FloatArray]:
        """Where the score has come to, for back_to."""
        return len(self._moves), len(self._calm), self.now.copy()

    def back_to(self, mark: tuple[int, int, FloatArray]) -> None:
        """Forget everything since a mark."""
        moves, calm, self.now = mark[0], mark[1], mark[2].copy()
        del self._moves[moves:], self._calm[calm:]

    def shortest_s(self, target: FloatArray) -> float:
        """How long the wrist needs at least to a target (6,) [s]."""
        change = target - self.now[:N_ROOT_DOFS]
        way_m, turn_rad = float(np.linalg.norm(change[:3])), float(np.linalg.norm(change[3:]))
        return _PEAK * max(way_m / MAX_WRIST_SPEED_MPS, turn_rad / MAX_TURN_SPEED_RADPS)

    def digits(
        self, time_s: float, target: FloatArray, duration_s: float | None = None, lag_s: FloatArray | None = None
    ) -> float:
        """Take a posture (20,) [rad]. lag_s: (5,) [s] of each digit; None for this person's. Returns the end [s]."""
        change = target - self.now[N_ROOT_DOFS:]
        largest = float(np.abs(change).max())
        if largest < 1e-9:
            return time_s
        if duration_s is None:
            duration_s = self.usual_s(change)
        if lag_s is None:
            lag_s = self.usual_lags(change)
        duration_s = max(duration_s, _PEAK * largest / MAX_DIGIT_SPEED_RADPS)
        begin = time_s + np.repeat(lag_s, 4)
        self._add_digits(begin, duration_s, change)
        self.now[N_ROOT_DOFS:] = target
        return float(begin.max() + duration_s)

    def calm(self, begin_s: float, end_s: float) -> None:
        """The wrist neither sways nor trembles in between: it touches something."""
        self._calm.append((begin_s, end_s))

    def calmness(self, times_s: FloatArray) -> FloatArray:
        """(n,) float64, 0 where the wrist sways freely, 1 where it must not; eases over half a second."""
        calmness = np.zeros(len(times_s))
        for begin_s, end_s in self._calm:
            edge = np.minimum(times_s - begin_s, end_s - times_s) / 0.5 + 1.0
            np.maximum(calmness, min_jerk(np.clip(edge, 0.0, 1.0)), out=calmness)
        return calmness

    def sampled(self, times_s: FloatArray) -> FloatArray:
        """(n, 26) float64, the parameters at evenly spaced times (n,) [s]."""
        step_s = float(times_s[1] - times_s[0])
        moved = np.zeros((len(times_s) + 1, N_DOFS))
        partial = np.zeros((len(times_s), N_DOFS))
        for begin, duration, change in self._moves:
            first = int(np.searchsorted(times_s, begin.min()))
            last = int(np.searchsorted(times_s, (begin + duration).max() + step_s))
            done = np.clip((times_s[first:last, None] - begin) / duration, 0.0, 1.0)
            partial[first:last] += change * min_jerk(done)
            moved[last] += change
        samples: FloatArray = self.start + partial + np.cumsum(moved, axis=0)[:-1]
        return samples

    def _add_wrist(self, begin_s: FloatArray, duration_s: float, change: FloatArray) -> None:
        whole = np.full(N_DOFS, begin_s[0]), np.full(N_DOFS, duration_s), np.zeros(N_DOFS)
        whole[0][:N_ROOT_DOFS], whole[2][:N_ROOT_DOFS] = begin_s, change
        self._moves.append(whole)

    def _add_digits(self, begin_s: FloatArray, duration_s: float, change: FloatArray) -> None:
        whole = np.full(N_DOFS, begin_s[0]), np.full(N_DOFS, duration_s), np.zeros(N_DOFS)
        whole[0][N_ROOT_DOFS:], whole[2][N_ROOT_DOFS:] = begin_s, change
        self._moves.append(whole)

    def usual_s(self, change: FloatArray) -> float:
        """How long this person takes, this time, to change the digits' angles by (20,) [rad]."""
        largest = float(np.abs(change).max())
        duration_s = self._person.tempo * (0.24 + 0.2 * largest) * self._random.uniform(0.85, 1.3)
        return max(duration_s, _PEAK * largest / MAX_DIGIT_SPEED_RADPS)

    def usual_lags(self, change: FloatArray) -> FloatArray:
        """(5,) float64 [s], when each digit sets off: the thumb closes last and opens first, and now and then the
        fingers follow one another as in a wave."""
        random = self._random
        closing = float(change[[5, 9, 13, 17]].sum()) > 0.0
        wave_s = random.choice([0.0, 0.015, 0.07]) * np.arange(len(DIGITS))
        lags: FloatArray = self._person.lag_s + random.uniform(0.0, 0.02, len(DIGITS))
        lags += wave_s if random.random() < 0.5 else wave_s[::-1]
        lags[0] = lags[1:].max() + 0.08 if closing else 0.0
        if not closing:
            lags[1:] += 0.05
        lags *= min(1.0, float(np.abs(change).max()))
        return lags


def min_jerk(x: FloatArray) -> FloatArray:
    """Minimum jerk from 0 to 1."""
    done: FloatArray = x**3 * (10.0 + x * (6.0 * x - 15.0))
    return done


def finger_lags(order: Sequence[int], step_s: float) -> FloatArray:
    """(5,) float64 [s]: the digits of `order` set off one after another, the others at once."""
    lags = np.zeros(len(DIGITS))
    lags[list(order)] = step_s * np.arange(len(order))
    return lags
