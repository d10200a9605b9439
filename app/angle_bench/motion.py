"""Motions with known angles: independent waves of every angle, the built-in performer's, and a hand held flat."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from core.frames import FloatArray
from core.hand.poses import pose
from core.hand.skeleton import N_ROOT_DOFS
from core.motion.performer import Performer
from core.profile import Profile

RANGES_DEG = np.array(
    [(-10, 30), (-10, 30), (0, 45), (0, 60), *(4 * [(-12, 12), (-5, 75), (0, 95), (0, 60)])], dtype=np.float64
)
"""Of independent waves, by angle (20, 2): what a hand does without help, the thumb clear of its ends of travel."""

SLOWEST_HZ, FASTEST_HZ = 0.08, 0.45
SETTLING_S, HELD_S, LEAVING_S = 1.5, 2.0, 0.7
"""A hand that is held flat: until its size is found, then as long as a neutral trial lasts, then on its way."""

FLAT_SPREAD_RAD = np.radians(2.0)
"""One standard deviation of each angle of a held flat hand about the pose: nobody holds it exactly."""

_FLAT, _SWAY_RAD = pose("flat"), np.radians(0.4)


@dataclass(frozen=True)
class Motion:
    """n frames of a right hand. digits_rad: (n, 20) float64 [rad], about the axes of whoever moves. roots: (n, 6)
    float64 [m, rad], the wrist in the world as in core.frames.HandFrame.theta_rad."""

    digits_rad: FloatArray
    roots: FloatArray

    @property
    def thetas_rad(self) -> FloatArray:
        """(n, 26) float64, both together."""
        thetas: FloatArray = np.concatenate([self.roots, self.digits_rad], axis=1)
        return thetas


def independent(random: np.random.Generator, seconds: float, rate_hz: float) -> Motion:
    """Every angle its own wave through RANGES_DEG: none follows from the others, as no posture prior has seen it."""
    low, high = np.radians(RANGES_DEG).T
    share = 0.5 + 0.5 * _waves(random, seconds, rate_hz, len(RANGES_DEG))
    return Motion(low + share * (high - low), _wandering(random, seconds, rate_hz))


def performed(profile: Profile, seed: int, activity: str, seconds: float, rate_hz: float) -> Motion:
    """The right hand of the built-in performer, from when it has begun to move."""
    performer = Performer(profile, seed, activity)
    thetas = np.array([performer.theta("right", 1.5 + i / rate_hz) for i in range(round(seconds * rate_hz))])
    return Motion(thetas[:, N_ROOT_DOFS:], thetas[:, :N_ROOT_DOFS])


def held_first(motion: Motion, random: np.random.Generator, rate_hz: float, flat_rad: FloatArray = _FLAT) -> Motion:
    """The motion, its beginning replaced by a hand that is held flat for SETTLING_S and HELD_S and sways a little, then
    goes over into the motion within LEAVING_S. flat_rad: (20,) float64 [rad], about the axes of whoever moves."""
    n = len(motion.digits_rad)
    still = flat_rad + random.normal(0.0, FLAT_SPREAD_RAD, len(flat_rad))
    still = still + _SWAY_RAD * _waves(random, n / rate_hz, rate_hz, len(flat_rad))[:n]
    t = np.clip((np.arange(n) / rate_hz - SETTLING_S - HELD_S) / LEAVING_S, 0.0, 1.0)[:, None]
    share = t**3 * (10.0 + t * (6.0 * t - 15.0))
    return Motion((1.0 - share) * still + share * motion.digits_rad, motion.roots)


def held_rows(rate_hz: float) -> slice:
    """The frames of the neutral trial in `held_first`."""
    return slice(round(SETTLING_S * rate_hz), round((SETTLING_S + HELD_S) * rate_hz))


def moving_rows(rate_hz: float) -> slice:
    """The frames after it."""
    return slice(round((SETTLING_S + HELD_S + LEAVING_S) * rate_hz), None)


def _waves(random: np.random.Generator, seconds: float, rate_hz: float, count: int) -> FloatArray:
    """(n, count) float64 in -1..1, smooth: sines whose phase itself sways, so that none repeats within a recording."""
    times_s = np.arange(round(seconds * rate_hz))[:, None] / rate_hz
    fast, slow = (2.0 * np.pi * random.uniform(SLOWEST_HZ, FASTEST_HZ, count) for _ in range(2))
    one, two = random.uniform(0.0, 2.0 * np.pi, (2, count))
    waves: FloatArray = np.sin(fast * times_s + one + 1.2 * np.sin(0.7 * slow * times_s + two))
    return waves


def _wandering(random: np.random.Generator, seconds: float, rate_hz: float) -> FloatArray:
    """(n, 6): a wrist that moves by 0.1 m and turns by half a radian about where it began."""
    waves = _waves(random, seconds, rate_hz, N_ROOT_DOFS)
    roots: FloatArray = np.array([0.2, 1.1, -0.3, 0.0, 0.0, 0.0]) + waves * (0.1, 0.1, 0.1, 0.5, 0.5, 0.5)
    return roots
