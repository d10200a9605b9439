"""Postures to learn labels from: those of the library, mixed digit by digit, and those of the synthetic performer.

A pool is made once and drawn from. Nothing recorded from a person is in it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from core.frames import FloatArray
from core.hand.model import template
from core.hand.skeleton import N_DOFS, N_ROOT_DOFS
from core.motion.capsules import Flesh, own_touches
from core.motion.library import LIBRARY, Prop
from core.motion.performer import Performer
from core.profile import load_profile

DEEPEST_M = 0.006
"""Postures in which flesh stands deeper in flesh are thrown away."""

ALONE = ("free", "signs", "range", "gestures")
TOGETHER = ("hands", "everyday")
FIRST_PERSON = 5000
"""Seeds of the performer from here on are training's; those that any benchmark uses are below."""

_APART_M = 0.20
_EVERY = 4  # knots of a performance
_FREE_DIGIT = 0.12
"""Share of digits that take any angle within their limits."""


@dataclass(frozen=True)
class Pool:
    """angles_rad: (k, 20) float64, postures of one hand. pairs_rad: (q, 2, 26) float64, left hands as mirrored right
    ones, and right hands, that are near each other. held: grasps of the library with what they hold."""

    angles_rad: FloatArray
    pairs: FloatArray
    held: tuple[tuple[FloatArray, Prop], ...]


def pool(random: np.random.Generator, mixed: int = 40_000, persons: int = 10) -> Pool:
    """mixed: how many postures are mixed from the library's. persons: performers per activity (2 s each)."""
    profile = load_profile("han19")
    alone, pairs = [_mixed(random, mixed)], []
    for person in range(persons):
        for activity in (*ALONE, *TOGETHER):
            seed = FIRST_PERSON + int(random.integers(1_000_000))
            knots = Performer(profile, seed, activity, person=FIRST_PERSON + person).performance.knots[:, ::_EVERY]
            if activity in ALONE:
                alone.append(knots[..., N_ROOT_DOFS:].reshape(-1, N_DOFS - N_ROOT_DOFS))
            else:
                mirrored = knots[0, :, :3] * (-1.0, 1.0, 1.0)
                near = np.linalg.norm(mirrored - knots[1, :, :3], axis=1) < _APART_M
                pairs.append(knots[:, near].swapaxes(0, 1))
    held = tuple((pose.angles_rad, pose.prop) for pose in LIBRARY.values() if pose.prop is not None)
    return Pool(np.concatenate(alone), np.concatenate([np.empty((0, 2, N_DOFS)), *pairs]), held)


def _mixed(random: np.random.Generator, count: int) -> FloatArray:
    """(count, 20): two postures of the library, each digit its own way between them, loosened, some digits anywhere."""
    known = np.stack([pose.angles_rad for pose in LIBRARY.values()])
    low, high = template().skeleton.limits_rad.T
    flesh = Flesh(template().skeleton, 1.0)
    kept: list[FloatArray] = []
    found = 0
    while found < count:
        n = min(4096, 2 * (count - found) + 64)
        first, second = known[random.integers(len(known), size=(2, n))]
        share = np.clip(random.uniform(0.0, 1.0, (n, 1)) + random.normal(0.0, 0.35, (n, 5)), 0.0, 1.0)
        angles = first + np.repeat(share, 4, axis=1) * (second - first)
        loose = random.exponential(np.radians(7.0), (n, 1)) * np.where(np.arange(20) % 4 == 0, 0.5, 1.0)
        angles += random.normal(0.0, 1.0, (n, 20)) * loose
        anywhere = _anywhere(random, n, low, high)
        free = np.repeat(random.random((n, 5)) < _FREE_DIGIT, 4, axis=1)
        angles = np.clip(np.where(free, anywhere, angles), low, high)
        theta = np.concatenate([np.zeros((n, N_ROOT_DOFS)), angles], axis=1)
        clear = own_touches(flesh.posed(theta), flesh.radii_m).gap_m.min(axis=1) > -DEEPEST_M
        kept.append(angles[clear])
        found += int(clear.sum())
    return np.concatenate(kept)[:count]


def _anywhere(random: np.random.Generator, n: int, low: FloatArray, high: FloatArray) -> FloatArray:
    """(n, 20) within the limits; the last joint of a finger bends by about two thirds of the one before it."""
    angles = random.uniform(low, high, (n, 20))
    for last in range(7, 20, 4):
        angles[:, last] = np.clip(angles[:, last - 1] * random.uniform(0.3, 1.0, n), low[last], high[last])
    return angles
