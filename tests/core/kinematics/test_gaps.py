"""Curves across gaps against a dense solve, the cubic they tend to, and the promises of their ends."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.interpolate import CubicHermiteSpline
from scipy.optimize import minimize_scalar

from core.kinematics.gaps import ANGULAR_JERK, bridge, bridge_std, velocity

RATE_HZ = 120.0


def series(t: np.ndarray, seed: int = 0, k: int = 3) -> np.ndarray:
    """k smooth angles [rad] at times (n,)."""
    random = np.random.default_rng(seed)
    frequency, phase = random.uniform(0.5, 6.0, k), random.uniform(0.0, 6.0, k)
    return 0.4 * np.sin(frequency * t[:, None] + phase)


def dense(t: np.ndarray, values: np.ndarray, before: int, after: int, memory_s: float) -> np.ndarray:
    """The same minimum from the energy written out: second differences, one row each, by least squares."""
    first, last = before, len(t) - after
    ghost = [2 * t[before - 1] - t[before], 2 * t[last] - t[last - 1]]
    known = {
        -1: values[before - 1] + (ghost[0] - t[before - 1]) * velocity(t[:before], values[:before]),
        0: values[before - 1],
        last - first + 1: values[last],
        last - first + 2: values[last] + (ghost[1] - t[last]) * velocity(t[last:], values[last:]),
    }
    times = np.concatenate([ghost[:1], t[before - 1 : last + 1], ghost[1:]])  # of frames -1 .. T + 2
    rows, right = [], []
    n = last - first
    for i in range(n + 2):
        h0, h1 = times[i + 1] - times[i], times[i + 2] - times[i + 1]
        w = 0.5 * (h0 + h1)
        row, value = np.zeros(n), np.zeros(values.shape[1])
        for frame, share in ((i - 1, 1 / h0 / w), (i, -(1 / h0 + 1 / h1) / w), (i + 1, 1 / h1 / w)):
            if frame in known:
                value -= share * known[frame]
            else:
                row[frame - 1] += share
        rows.append(np.sqrt(w) * row)
        right.append(np.sqrt(w) * value)
    for i in range(n):
        w = 0.5 * (times[i + 3] - times[i + 1])
        rows.append(np.sqrt(w) / memory_s**2 * np.eye(n)[i])
        right.append(np.sqrt(w) / memory_s**2 * values[first + i])
    return np.linalg.lstsq(np.asarray(rows), np.asarray(right), rcond=None)[0]


@pytest.mark.parametrize("missing", [1, 2, 3, 17, 240])
@pytest.mark.parametrize("memory_s", [0.25, np.inf])
@pytest.mark.parametrize("uneven", [False, True])
def test_the_banded_system_is_the_minimum_of_the_energy(missing: int, memory_s: float, uneven: bool) -> None:
    t = np.arange(missing + 6) / RATE_HZ
    if uneven:
        t += np.random.default_rng(missing).uniform(-0.3, 0.3, len(t)) / RATE_HZ
    values = series(t, missing)
    values[3:-3] += np.random.default_rng(1).normal(0.0, 0.1, (missing, 3))
    filled = bridge(t, values, 3, 3, memory_s=memory_s)
    np.testing.assert_allclose(filled, dense(t, values, 3, 3, memory_s), atol=1e-7)


def test_equal_steps_give_the_rows_of_the_paper() -> None:
    """Applied to what was filled, 1 -4 6 -4 1 gives zero: the fourth difference of a curve of least acceleration."""
    t = np.arange(40) / RATE_HZ
    values = series(t)
    whole = values.copy()
    whole[2:-2] = bridge(t, values, 2, 2, memory_s=np.inf)
    np.testing.assert_allclose(np.diff(whole, 4, axis=0), 0.0, atol=1e-12)


@pytest.mark.parametrize("uneven", [False, True])
def test_fine_steps_tend_to_the_cubic_between_the_ends(uneven: bool) -> None:
    errors = []
    for n in (50, 100, 200, 400):
        t = np.linspace(0.0, 0.5, n)
        if uneven:
            t[1:-1] += np.random.default_rng(0).uniform(-0.3, 0.3, n - 2) * 0.5 / (n - 1)
        ends, speeds = np.array([[0.1], [0.6]]), np.array([[3.0], [-2.0]])
        h = 1e-6
        times = np.concatenate([[-h], t, [0.5 + h]])
        values = np.concatenate([ends[:1] - h * speeds[:1], np.zeros((n, 1)), ends[1:] + h * speeds[1:]])
        values[1], values[-2] = ends
        filled = bridge(times, values, 2, 2, memory_s=np.inf)
        cubic = CubicHermiteSpline([0.0, 0.5], ends[:, 0], speeds[:, 0])
        errors.append(np.abs(filled[:, 0] - cubic(t[1:-1])).max())
    assert errors[-1] < 3e-3
    assert errors[-1] < 0.25 * errors[0]  # first order in the time step


def test_values_and_velocities_are_continuous_at_both_ends() -> None:
    """Steps across the ends of the gap tend to zero with the time step, and so do those of the velocity."""
    jumps = []
    for rate_hz in (120.0, 480.0, 1920.0):
        t = np.arange(round(0.4 * rate_hz)) / rate_hz
        values = series(t, 3)
        gap = slice(round(0.1 * rate_hz), round(0.3 * rate_hz))
        whole = values.copy()
        whole[gap] = bridge(t, np.where(np.isin(np.arange(len(t)), np.arange(len(t))[gap])[:, None], 0.0, values),
                            gap.start, len(t) - gap.stop, memory_s=np.inf)  # fmt: skip
        speed = np.diff(whole, axis=0) * rate_hz
        at_ends = [gap.start - 1, gap.stop - 1]
        jumps.append([np.abs(np.diff(whole, axis=0)[at_ends]).max(), np.abs(np.diff(speed, axis=0)[at_ends]).max()])
    jumps = np.asarray(jumps)
    assert (jumps[1:] < 0.5 * jumps[:-1]).all()
    assert jumps[-1, 1] < 0.1


def test_a_rotation_at_constant_speed_and_a_still_angle_stay_what_they_are() -> None:
    t = np.cumsum(np.random.default_rng(0).uniform(0.004, 0.02, 60))
    values = np.stack([1.5 * t - 0.3, np.full(len(t), 0.7)], axis=1)
    np.testing.assert_allclose(bridge(t, values, 3, 3, memory_s=np.inf), values[3:-3], atol=1e-10)


def test_limits_are_kept_and_met_without_a_kink() -> None:
    t = np.arange(126) / RATE_HZ
    values = np.zeros((126, 1))
    values[:3, 0] = 0.9 + 4.0 * t[:3]
    values[-3:, 0] = 0.9 - 4.0 * (t[-3:] - t[-1])
    limits = np.array([[-0.2, 1.0]])
    free = bridge(t, values, 3, 3, memory_s=np.inf)
    assert free.max() > 1.3
    kept = bridge(t, values, 3, 3, memory_s=np.inf, limits=limits)
    assert kept.max() <= 1.0
    whole = np.concatenate([values[:3], kept, values[-3:]])[:, 0]
    bends = np.abs(np.diff(whole, 2)) * RATE_HZ  # change of velocity from frame to frame [rad/s]
    clipped = np.concatenate([values[:3], np.clip(free, *limits[0])[:], values[-3:]])[:, 0]
    assert bends.max() < 2.1
    assert np.abs(np.diff(clipped, 2)).max() * RATE_HZ > 2.5


def test_a_long_gap_follows_its_guide_and_a_short_one_its_ends() -> None:
    t = np.arange(600) / RATE_HZ
    values = np.full((600, 1), 0.2)
    values[:3, 0] += 6.0 * t[:3]
    filled = bridge(t, values, 3, 3)[:, 0]
    np.testing.assert_allclose(filled[300:], 0.2, atol=2e-3)
    short = values[[0, 1, 2, *range(300, 306), -3, -2, -1]]
    times = np.arange(len(short)) / RATE_HZ
    plain = bridge(times, short, 3, 3, memory_s=np.inf)
    np.testing.assert_allclose(bridge(times, short, 3, 3), plain, atol=1e-4)


def test_velocity_of_rows() -> None:
    t = np.array([0.0, 0.01, 0.03])
    np.testing.assert_allclose(velocity(t, np.outer(t, [2.0, -1.0]) + 5.0), [2.0, -1.0])
    np.testing.assert_array_equal(velocity(t[:1], np.ones((1, 4))), np.zeros(4))


def test_the_std_of_a_bridge_is_that_of_noise_pinned_at_both_ends() -> None:
    """Against the posterior of an integrated Wiener process, conditioned by brute force on values and velocities."""
    length = 0.4

    def covariance(s: float, t: float) -> float:
        return ANGULAR_JERK * quad(lambda u: (s - u) * (t - u), 0.0, min(s, t))[0]

    def cross(s: float) -> np.ndarray:
        """Of the value at s with value and velocity at the far end."""
        return np.array([covariance(s, length), ANGULAR_JERK * quad(lambda u: s - u, 0.0, s)[0]])

    far = ANGULAR_JERK * np.array([[length**3 / 3, length**2 / 2], [length**2 / 2, length]])
    for s in (0.05, 0.2, 0.33):
        expected = covariance(s, s) - cross(s) @ np.linalg.solve(far, cross(s))
        (found,) = bridge_std(np.array([1.0 + s]), 1.0, 1.0 + length)
        np.testing.assert_allclose(found, np.sqrt(expected), rtol=1e-6)
    widest = minimize_scalar(lambda s: -bridge_std(np.array([s]), 0.0, length)[0], bounds=(0, length), method="bounded")
    np.testing.assert_allclose(widest.x, length / 2, atol=1e-4)
