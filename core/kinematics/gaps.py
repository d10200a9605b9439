"""Curves across gaps: what a joint angle did while no marker spoke for it (Schröder 2017, "Fully automatic tracking").

Between the last frame before a gap and the first one after it the curve has the values and velocities of both ends
(C1) and the least angular acceleration (eq. 6). Discretised by finite differences, this is a banded T x T system for
the T missing frames; for equal time steps it is the paper's, with rows 1 -4 6 -4 1.

Over a long gap that alone would swing far out, for a hand seldom keeps its speed. A pull towards a guide, the pose as
it was carried through the gap, is added, the firmer the surer the guide is: the ends speak for its memory, then the
guide does. Gaps much shorter than that are filled as the paper does.

How far the truth may be from the curve is said of the curve itself: by its ends where they hold it, by the guide and
the way between them where it follows the guide.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solveh_banded

from core.frames import BoolArray, FloatArray

VELOCITY_FRAMES = 3
"""Frames on either side of a gap that its end velocities are taken from: more would lag, fewer are noise."""

MEMORY_S, MEMORY_RANGE_S = 0.2, (0.08, 0.5)
"""Time over which the motion at the ends of a gap tells what happened in it, beside a guide that is MEMORY_STD_RAD
sure; it grows with the root of the guide's standard deviation (with equal noise of acceleration, the curve that is the
most probable does so)."""

MEMORY_STD_RAD = float(np.radians(8.0))

ANGULAR_JERK, JERK_PER_SPEED = 2.0, 5.0
"""Spread of angular acceleration [rad^2 / s^3], power of the white noise that moves a joint: what the motion at the
ends leaves open. That of one at rest, and more for each rad/s at the ends: digits that move are about to turn or stop.
Chosen, like the two below, so that two of these standard deviations hold 95 % of angles in gaps of 0.15 to 2 s."""

WRIST_JERK_PER_SPEED2 = 100.0
"""Beside these, of a wrist for each (rad/s)^2: arms that wave a hand turn it back within a tenth of a second."""

OWN_SHARE = 0.08
"""Of an angle's standard deviation, what one frame does not share with the next: by the rest no velocity is wrong."""

USUAL_RADPS = 1.5
"""Spread of the velocities of digits: what one is believed to be while nothing sure is known of it."""

_LEAST_STD_RAD, _UNKNOWN_RAD = 1e-9, 10.0
_MAX_PINNING = 8


@dataclass(frozen=True)
class Bridge:
    """values (T, k) float64: the curve over the missing rows. std (T, k) float64: how far the truth may be from it."""

    values: FloatArray
    std: FloatArray


def bridge(
    times_s: FloatArray,
    values: FloatArray,
    std: FloatArray,
    before: int,
    after: int,
    *,
    limits: FloatArray | None = None,
    unit: FloatArray | float = 1.0,
    jerk_per_speed2: FloatArray | float = 0.0,
) -> Bridge:
    """The rows between the first `before` and the last `after` ones, with C1 ends and least acceleration.

    times_s: (n,) float64 [s], strictly increasing. values: (n, k) float64; the outer rows are what was observed, those
    between are the guide. std: (n, k), one standard deviation of each, NaN where there is no guide. Both `before` and
    `after` are at least 1; the velocity of an end is that of its VELOCITY_FRAMES nearest rows (`velocity`), the others
    of its side tell only how sure it is as a rule. limits: (k, 2), lower and upper bound of each column. unit: (k,),
    what a column changes by while a joint turns by a radian. jerk_per_speed2: (k,), as in `bridge_std`.
    """
    last, first = before - 1, len(times_s) - after
    t = times_s[last : first + 1]
    steps = np.diff(t)  # (T + 1,)
    guide = values[before:first]
    ends = np.stack([values[last], values[first]])
    near = slice(max(before - VELOCITY_FRAMES, 0), before), slice(first, first + VELOCITY_FRAMES)
    surest = np.fmin.reduce(std[:before]), np.fmin.reduce(std[first:])
    found = [
        velocity(times_s[rows], values[rows], std[rows], of_all, USUAL_RADPS * unit)
        for rows, of_all in zip(near, surest, strict=True)
    ]
    speeds, speeds_std = (np.stack(two) for two in zip(*found, strict=True))
    matrix, known = _least_acceleration(steps, ends, speeds)
    pull = 0.5 * (steps[:-1] + steps[1:])[:, None] / memory_s(std[before:first] / unit) ** 4
    right = known + pull * np.where(pull > 0.0, guide, 0.0)
    filled = np.empty_like(right)
    for column in range(right.shape[1]):
        system = matrix.copy()
        system[0] += pull[:, column]
        filled[:, column] = solveh_banded(system, right[:, column], lower=True)
        if limits is not None:
            filled[:, column] = _within(system, right[:, column], filled[:, column], limits[column])
    of_ends = bridge_std(t, np.stack([std[last], std[first]]), speeds, speeds_std, unit, jerk_per_speed2)
    of_guide = np.hypot(std[before:first], filled - guide)
    return Bridge(filled, np.fmin(of_ends, of_guide))


def memory_s(std_rad: FloatArray) -> FloatArray:
    """[s], of guides so sure [rad]: infinite where there is none (NaN)."""
    memory = np.clip(MEMORY_S * np.sqrt(std_rad / MEMORY_STD_RAD), *MEMORY_RANGE_S)
    return np.where(np.isnan(std_rad), np.inf, memory)


def velocity(
    times_s: FloatArray, values: FloatArray, std: FloatArray, surest: FloatArray, usual: FloatArray | float
) -> tuple[FloatArray, FloatArray]:
    """Velocity (k,) of values (n, k) with standard deviations std (n, k) at times (n,) [s], and its own (k,).

    The slope of the straight line through them, each weighted by what it does not share with the surest (k,) around: an
    error that all have moves the line and does not turn it, but a frame less sure than those before has an error of its
    own, as of a marker that slides off. Then the mean of it and of no motion, as their variances weigh them: `usual`,
    (k,) or one, is the spread of velocities. A single value tells nothing: 0, `usual`.
    """
    usual = np.broadcast_to(np.asarray(usual, dtype=np.float64), values.shape[1:])
    if len(times_s) < 2:
        return np.zeros(values.shape[1]), usual.copy()
    std = np.maximum(np.nan_to_num(std, nan=_UNKNOWN_RAD), _LEAST_STD_RAD)
    more2 = np.square(std) - np.square(np.nan_to_num(surest, nan=_UNKNOWN_RAD))
    own2 = np.square(OWN_SHARE * std) + np.maximum(more2, 0.0)
    weights = 1.0 / own2
    t = times_s[:, None] - (weights * times_s[:, None]).sum(axis=0) / weights.sum(axis=0)
    told = (weights * t**2).sum(axis=0)
    believed = told * usual**2 / (told * usual**2 + 1.0)
    slope = (weights * t * values).sum(axis=0) / told
    return believed * slope, np.sqrt(believed / told)


def bridge_std(
    times_s: FloatArray,
    ends_std: FloatArray,
    speeds: FloatArray,
    speeds_std: FloatArray,
    unit: FloatArray | float = 1.0,
    jerk_per_speed2: FloatArray | float = 0.0,
) -> FloatArray:
    """(T, k): how far the truth may be from the curve between the ends of a gap, the first and last of times (T + 2,).

    Three things, independent: the ends (2, k) themselves; their velocities (2, k) with standard deviations (2, k), as
    far as the cubic of Hermite follows them; and white noise of angular acceleration that a motion known at both ends
    leaves open (the posterior of an integrated Wiener process, whose mean is the curve of eq. 6), of power
    ANGULAR_JERK + JERK_PER_SPEED |v| + jerk_per_speed2 v^2, v the root mean square of both velocities.
    """
    since, left = times_s[1:-1, None] - times_s[0], times_s[-1] - times_s[1:-1, None]
    share = since / (since + left)
    ends = (1.0 - share) * ends_std[0] + share * ends_std[1]
    ways = np.square(since * (1.0 - share) ** 2 * speeds_std[0]) + np.square(left * share**2 * speeds_std[1])
    moving = np.sqrt(np.square(speeds / unit).mean(axis=0))
    noise = (ANGULAR_JERK + moving * (JERK_PER_SPEED + moving * jerk_per_speed2)) * np.square(unit)
    std: FloatArray = np.sqrt(np.square(ends) + ways + noise / 3.0 * (since * (1.0 - share)) ** 3)
    return std


def _least_acceleration(steps_s: FloatArray, ends: FloatArray, speeds: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Normal equations of sum_i w_i a_i^2 over the T missing rows: lower bands (3, T) and right side (T, k).

    a_i is the second difference at frame i divided by its time steps, w_i the time it stands for. Before and after the
    gap the motion goes on with the end's velocity, by one step as long as the one beside it.
    """
    n = len(steps_s) - 1
    h = np.concatenate([steps_s[:1], steps_s, steps_s[-1:]])  # (T + 3,), of the frames -1, 0 .. T + 1, T + 2
    w = 0.5 * (h[:-1] + h[1:])  # (T + 2,)
    root = 1.0 / np.sqrt(w)
    # Row i of the differences, weighted: left_i x_(i-1) + middle_i x_i + right_i x_(i+1), i = 0 .. T + 1.
    left, right = root / h[:-1], root / h[1:]
    middle = -(left + right)
    bands = np.zeros((3, n))
    bands[0] = right[:-2] ** 2 + middle[1:-1] ** 2 + left[2:] ** 2
    bands[1, :-1] = middle[1:-2] * right[1:-2] + left[2:-1] * middle[2:-1]
    bands[2, :-2] = right[2:-2] * left[2:-2]
    # What the known rows contribute to each difference.
    fixed = np.zeros((n + 2, ends.shape[1]))
    fixed[0] = left[0] * (ends[0] - h[0] * speeds[0]) + middle[0] * ends[0]
    fixed[1] += left[1] * ends[0]
    fixed[n] += right[n] * ends[1]
    fixed[n + 1] += middle[n + 1] * ends[1] + right[n + 1] * (ends[1] + h[-1] * speeds[1])
    known = -(right[:-2, None] * fixed[:-2] + middle[1:-1, None] * fixed[1:-1] + left[2:, None] * fixed[2:])
    return bands, known


def _within(matrix: FloatArray, known: FloatArray, filled: FloatArray, limits: FloatArray) -> FloatArray:
    """The curve of one column laid onto the limits where it went beyond them; it meets them without a kink."""
    low, high = limits
    pinned: BoolArray = np.zeros(len(filled), dtype=np.bool_)
    stiff = 1e6 * matrix[0].max()
    for _ in range(_MAX_PINNING):
        beyond = (filled < low) | (filled > high)
        if not (beyond & ~pinned).any():
            break
        pinned |= beyond
        bound = np.where(filled > 0.5 * (low + high), high, low)
        held = matrix.copy()
        held[0, pinned] += stiff
        filled = solveh_banded(held, known + np.where(pinned, stiff * bound, 0.0), lower=True)
    return np.clip(filled, low, high)
