"""What never stops moving in a living hand: slow sway, drift along synergies, and tremor at 8 to 12 Hz."""

from __future__ import annotations

import numpy as np

from core.frames import FloatArray
from core.hand.skeleton import N_DOFS, N_ROOT_DOFS
from core.motion.person import Person

_WAVES = 3
_SWAY_HZ = (0.15, 0.8)
_TREMOR_HZ = (8.0, 12.0)  # physiological: Elble and Koller 1990
_SWAY = np.concatenate([np.full(3, 0.004), np.full(3, 0.02), np.full(N_DOFS - N_ROOT_DOFS, 0.015)])
_TREMOR = np.concatenate([np.full(3, 6e-5), np.full(3, 6e-4), np.full(N_DOFS - N_ROOT_DOFS, 8e-4)])


def unrest(
    person: Person, random: np.random.Generator, times_s: FloatArray, period_s: float, calmness: FloatArray
) -> FloatArray:
    """(n, 26): what to add to one hand's parameters at times (n,) [s]; every wave comes a whole number of times per
    period. calmness (n,): where 1, the wrist does not take part."""
    waves = _waves(random, times_s, period_s, _SWAY_HZ) * _SWAY
    waves += _waves(random, times_s, period_s, _TREMOR_HZ) * _TREMOR * person.tremor
    waves[:, :N_ROOT_DOFS] *= (1.0 - calmness)[:, None]
    return np.asarray(waves)


def _waves(
    random: np.random.Generator, times_s: FloatArray, period_s: float, range_hz: tuple[float, float]
) -> FloatArray:
    """(n, 26) of unit RMS at most: a few sine waves each."""
    sum_ = np.zeros((len(times_s), N_DOFS))
    low, high = (round(hz * period_s) for hz in range_hz)
    for _ in range(_WAVES):
        cycles = random.integers(low, high + 1, N_DOFS)
        amplitude = random.uniform(0.5, 1.0, N_DOFS) / np.sqrt(_WAVES)
        phase = random.uniform(0.0, 2.0 * np.pi, N_DOFS)
        sum_ += amplitude * np.sin(2.0 * np.pi * cycles / period_s * times_s[:, None] + phase)
    return sum_
