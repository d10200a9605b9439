"""Curves across gaps against a dense solve, the cubic they tend to, and the promises of their ends."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.interpolate import CubicHermiteSpline
from scipy.optimize import minimize_scalar

from core.kinematics.gaps import (
    ANGULAR_JERK,
    JERK_PER_SPEED,
    MEMORY_RANGE_S,
    MEMORY_S,
    MEMORY_STD_RAD,
    OWN_SHARE,
    USUAL_RADPS,
    bridge,
    bridge_std,
    memory_s,
    velocity,
)

RATE_HZ = 120.0


def series(t: np.ndarray, seed: int = 0, k: int = 3) -> np.ndarray:
    """k smooth angles [rad] at times (n,)."""
    random = np.random.default_rng(seed)
    frequency, phase = random.uniform(0.5, 6.0, k), random.uniform(0.0, 6.0, k)
    return 0.4 * np.sin(frequency * t[:, None] + phase)


def stds(values: np.ndarray, before: int, after: int, guide_rad: float = np.nan) -> np.ndarray:
    """(n, k): ends that are as good as certain, and a guide so sure; by default there is none."""
    std = np.full(values.shape, 1e-9)
    std[before : len(values) - after] = guide_rad
    return std


def plain(t: np.ndarray, values: np.ndarray, before: int, after: int, **how: object) -> np.ndarray:
    """Eq. 6 alone."""
    return bridge(t, values, stds(values, before, after), before, after, **how).values


def speed_of(t: np.ndarray, values: np.ndarray) -> np.ndarray:
    return velocity(t, values, np.full(values.shape, 1e-9), np.full(values.shape[1], 1e-9), USUAL_RADPS)[0]


def dense(t: np.ndarray, values: np.ndarray, before: int, after: int, memory: np.ndarray) -> np.ndarray:
    """The same minimum from the energy written out: second differences, one row each, by least squares. memory: (T,)"""
    first, last = before, len(t) - after
    ghost = [2 * t[before - 1] - t[before], 2 * t[last] - t[last - 1]]
    known = {
        -1: values[before - 1] + (ghost[0] - t[before - 1]) * speed_of(t[:before], values[:before]),
        0: values[before - 1],
        last - first + 1: values[last],
        last - first + 2: values[last] + (ghost[1] - t[last]) * speed_of(t[last:], values[last:]),
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
        rows.append(np.sqrt(w) / memory[i] ** 2 * np.eye(n)[i])
        right.append(np.sqrt(w) / memory[i] ** 2 * values[first + i])
    return np.linalg.lstsq(np.asarray(rows), np.asarray(right), rcond=None)[0]


@pytest.mark.parametrize("missing", [1, 2, 3, 17, 240])
@pytest.mark.parametrize("guided", [False, True])
@pytest.mark.parametrize("uneven", [False, True])
def test_the_banded_system_is_the_minimum_of_the_energy(missing: int, guided: bool, uneven: bool) -> None:
    t = np.arange(missing + 6) / RATE_HZ
    if uneven:
        t += np.random.default_rng(missing).uniform(-0.3, 0.3, len(t)) / RATE_HZ
    values = series(t, missing)
    values[3:-3] += np.random.default_rng(1).normal(0.0, 0.1, (missing, 3))
    std = stds(values, 3, 3)
    if guided:  # alike in all columns: the dense energy has one memory in each row
        std[3:-3] = np.random.default_rng(2).uniform(0.02, 0.4, (missing, 1))
    filled = bridge(t, values, std, 3, 3).values
    np.testing.assert_allclose(filled, dense(t, values, 3, 3, memory_s(std[3:-3, 0])), atol=1e-7)


def test_the_memory_of_the_ends_is_the_longer_the_less_sure_the_guide() -> None:
    found = memory_s(np.array([0.0, MEMORY_STD_RAD / 4.0, MEMORY_STD_RAD, 10.0, np.nan]))
    np.testing.assert_allclose(found, [MEMORY_RANGE_S[0], MEMORY_S / 2.0, MEMORY_S, MEMORY_RANGE_S[1], np.inf])


def test_equal_steps_give_the_rows_of_the_paper() -> None:
    """Applied to what was filled, 1 -4 6 -4 1 gives zero: the fourth difference of a curve of least acceleration."""
    t = np.arange(40) / RATE_HZ
    values = series(t)
    whole = values.copy()
    whole[2:-2] = plain(t, values, 2, 2)
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
        filled = plain(times, values, 2, 2)
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
        whole[gap] = plain(t, np.where(np.isin(np.arange(len(t)), np.arange(len(t))[gap])[:, None], 0.0, values),
                            gap.start, len(t) - gap.stop)  # fmt: skip
        speed = np.diff(whole, axis=0) * rate_hz
        at_ends = [gap.start - 1, gap.stop - 1]
        jumps.append([np.abs(np.diff(whole, axis=0)[at_ends]).max(), np.abs(np.diff(speed, axis=0)[at_ends]).max()])
    jumps = np.asarray(jumps)
    assert (jumps[1:] < 0.5 * jumps[:-1]).all()
    assert jumps[-1, 1] < 0.1


def test_a_rotation_at_constant_speed_and_a_still_angle_stay_what_they_are() -> None:
    t = np.cumsum(np.random.default_rng(0).uniform(0.004, 0.02, 60))
    values = np.stack([1.5 * t - 0.3, np.full(len(t), 0.7)], axis=1)
    np.testing.assert_allclose(plain(t, values, 3, 3), values[3:-3], atol=1e-10)


def test_limits_are_kept_and_met_without_a_kink() -> None:
    t = np.arange(126) / RATE_HZ
    values = np.zeros((126, 1))
    values[:3, 0] = 0.9 + 4.0 * t[:3]
    values[-3:, 0] = 0.9 - 4.0 * (t[-3:] - t[-1])
    limits = np.array([[-0.2, 1.0]])
    free = plain(t, values, 3, 3)
    assert free.max() > 1.3
    kept = plain(t, values, 3, 3, limits=limits)
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
    filled = bridge(t, values, stds(values, 3, 3, MEMORY_STD_RAD), 3, 3).values[:, 0]
    np.testing.assert_allclose(filled[300:], 0.2, atol=2e-3)
    short = values[[0, 1, 2, *range(300, 306), -3, -2, -1]]
    times = np.arange(len(short)) / RATE_HZ
    guided = bridge(times, short, stds(short, 3, 3, MEMORY_STD_RAD), 3, 3).values
    np.testing.assert_allclose(guided, plain(times, short, 3, 3), atol=1e-4)


def test_velocity_is_that_of_the_line() -> None:
    t = np.array([0.0, 0.01, 0.03])
    speeds, std = velocity(t, np.outer(t, [2.0, -1.0]) + 5.0, np.full((3, 2), 1e-9), np.full(2, 1e-9), USUAL_RADPS)
    np.testing.assert_allclose(speeds, [2.0, -1.0], rtol=1e-9)
    assert (std < 1e-3).all()
    speeds, std = velocity(t[:1], np.ones((1, 4)), np.full((1, 4), 0.1), np.full(4, 0.1), USUAL_RADPS)
    np.testing.assert_array_equal(speeds, np.zeros(4))
    np.testing.assert_array_equal(std, np.full(4, USUAL_RADPS))


def test_velocity_is_the_posterior_of_a_line_through_what_each_frame_has_of_its_own() -> None:
    """Against the line, its slope of known spread, fitted by brute force with the full covariance of the frames."""
    t = np.array([0.0, 0.008, 0.017, 0.03])
    sigma = np.array([0.02, 0.05, 0.03, 0.08])
    values = np.random.default_rng(3).normal(0.0, 0.1, 4)
    surest = 0.015
    own2 = (OWN_SHARE * sigma) ** 2 + np.maximum(sigma**2 - surest**2, 0.0)
    design = np.stack([np.ones(4), t], axis=1)
    # The error that all frames share is one more unknown of the line's height: it cannot turn it.
    covariance = np.diag(own2) + surest**2
    information = design.T @ np.linalg.solve(covariance, design) + np.diag([0.0, 1.0 / USUAL_RADPS**2])
    expected = np.linalg.solve(information, design.T @ np.linalg.solve(covariance, values))
    speeds, std = velocity(t, values[:, None], sigma[:, None], np.array([surest]), USUAL_RADPS)
    np.testing.assert_allclose(speeds[0], expected[1], rtol=1e-8)
    np.testing.assert_allclose(std[0], np.sqrt(np.linalg.inv(information)[1, 1]), rtol=1e-8)


def test_a_frame_that_is_not_sure_does_not_throw_the_curve() -> None:
    """The last frame before the gap jumps and says that it is not sure: the curve sets out as the two before went."""
    t = np.arange(42) / RATE_HZ
    values = np.zeros((42, 1))
    values[2] = 0.1
    sure, unsure = stds(values, 3, 3), stds(values, 3, 3)
    sure[:3], unsure[:3] = 0.01, [[0.01], [0.01], [0.1]]
    believed, doubted = bridge(t, values, sure, 3, 3), bridge(t, values, unsure, 3, 3)
    assert believed.values.max() > 0.15
    assert doubted.values.max() < 0.105
    assert doubted.std[0, 0] > 5.0 * believed.std[0, 0]


def test_the_std_of_a_bridge_is_that_of_noise_pinned_at_both_ends() -> None:
    """Against the posterior of an integrated Wiener process, conditioned by brute force on values and velocities."""
    length, speed = 0.4, 2.0
    jerk = ANGULAR_JERK + JERK_PER_SPEED * speed + 3.0 * speed**2

    def std_at(*since: float) -> np.ndarray:
        """Of ends that are known, both at that speed."""
        t = 1.0 + np.array([0.0, *since, length])
        return bridge_std(t, np.zeros((2, 1)), np.full((2, 1), speed), np.zeros((2, 1)), 1.0, 3.0)[:, 0]

    def covariance(s: float, t: float) -> float:
        return jerk * quad(lambda u: (s - u) * (t - u), 0.0, min(s, t))[0]

    def cross(s: float) -> np.ndarray:
        """Of the value at s with value and velocity at the far end."""
        return np.array([covariance(s, length), jerk * quad(lambda u: s - u, 0.0, s)[0]])

    far = jerk * np.array([[length**3 / 3, length**2 / 2], [length**2 / 2, length]])
    for s in (0.05, 0.2, 0.33):
        expected = covariance(s, s) - cross(s) @ np.linalg.solve(far, cross(s))
        (found,) = std_at(s)
        np.testing.assert_allclose(found, np.sqrt(expected), rtol=1e-9)
    widest = minimize_scalar(lambda s: -std_at(s)[0], bounds=(0, length), method="bounded")
    np.testing.assert_allclose(widest.x, length / 2, atol=1e-4)


def test_ends_and_their_velocities_that_are_not_sure_are_in_the_std_of_a_bridge() -> None:
    """Against cubics through ends and velocities drawn by chance."""
    random = np.random.default_rng(5)
    t = np.linspace(0.0, 0.3, 8)
    ends_std, speeds_std = np.array([[0.05], [0.05]]), np.array([[0.9], [0.4]])
    shared, speeds = random.normal(0.0, 0.05, 4000), random.normal(0.0, speeds_std, (2, 4000))
    ways = CubicHermiteSpline(t[[0, -1]], np.stack([shared, shared]), speeds)(t[1:-1])
    nothing = np.zeros((2, 1))
    open_anyway = bridge_std(t, nothing, nothing, nothing)
    found = bridge_std(t, ends_std, nothing, speeds_std)
    np.testing.assert_allclose(np.sqrt(found**2 - open_anyway**2)[:, 0], ways.std(axis=1), rtol=0.05)


def test_a_curve_says_what_its_guide_leaves_open_and_how_far_it_is_from_it() -> None:
    t = np.arange(606) / RATE_HZ
    values = np.full((606, 1), 0.2)
    values[3:-3, 0] = np.where(np.arange(600) < 300, 0.2, 0.8)  # the guide steps, the curve does not
    std = stds(values, 3, 3, MEMORY_STD_RAD)
    found = bridge(t, values, std, 3, 3)
    off = found.values - values[3:-3]
    assert np.abs(off[295:305]).max() > 0.2
    np.testing.assert_allclose(found.std[200:400], np.hypot(MEMORY_STD_RAD, off[200:400]), rtol=1e-12)
    assert found.std[0, 0] < 0.01 * MEMORY_STD_RAD
    assert found.std[-1, 0] < 0.01 * MEMORY_STD_RAD
