"""Curves across gaps: what a joint angle did while no marker spoke for it (Schröder 2017, "Fully automatic tracking").

Between the last frame before a gap and the first one after it the curve has the values and velocities of both ends
(C1) and the least angular acceleration (eq. 6). Discretised by finite differences, this is a banded T x T system for
the T missing frames; for equal time steps it is the paper's, with rows 1 -4 6 -4 1.

Over a long gap that alone would swing far out, for a hand seldom keeps its speed. A weak pull towards a guide, the
pose as it was carried through the gap, is added: the ends speak for about MEMORY_S, then the guide does. Gaps much
shorter than that are filled as the paper does.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import solveh_banded

from core.frames import BoolArray, FloatArray

VELOCITY_FRAMES = 3
"""Frames on either side of a gap that its end velocities are taken from: more would lag, fewer are noise."""

MEMORY_S = 0.2
"""Time over which the motion at the ends of a gap tells what happened in it."""

ANGULAR_JERK = 150.0
"""Spread of angular acceleration [rad^2 / s^3], power of the white noise that would move a joint as people do: what
the motion at the ends leaves open."""

_MAX_PINNING = 8


def bridge(
    times_s: FloatArray,
    values: FloatArray,
    before: int,
    after: int,
    *,
    memory_s: float = MEMORY_S,
    limits: FloatArray | None = None,
) -> FloatArray:
    """The rows between the first `before` and the last `after` ones, with C1 ends and least acceleration.

    times_s: (n,) float64 [s], strictly increasing. values: (n, k) float64; the outer rows are what was observed, those
    between are the guide. Both `before` and `after` are at least 1; the velocity of an end is the slope of its
    VELOCITY_FRAMES nearest rows, zero of a single one. memory_s: infinite
    for eq. 6 alone. limits: (k, 2), lower and upper bound of each column. Returns (n - before - after, k).
    """
    last, first = before - 1, len(times_s) - after
    t = times_s[last : first + 1]
    steps = np.diff(t)  # (T + 1,)
    guide = values[before:first]
    ends = np.stack([values[last], values[first]])
    near = slice(max(before - VELOCITY_FRAMES, 0), before), slice(first, first + VELOCITY_FRAMES)
    speeds = np.stack([velocity(times_s[rows], values[rows]) for rows in near])
    matrix, known = _least_acceleration(steps, ends, speeds)
    pull = 0.5 * (steps[:-1] + steps[1:]) / memory_s**4
    matrix[0] += pull
    filled: FloatArray = solveh_banded(matrix, known + pull[:, None] * guide, lower=True)
    if limits is not None:
        for column in np.flatnonzero(((filled < limits[:, 0]) | (filled > limits[:, 1])).any(axis=0)):
            right = known[:, column] + pull * guide[:, column]
            filled[:, column] = _within(matrix, right, filled[:, column], limits[column])
    return filled


def velocity(times_s: FloatArray, values: FloatArray) -> FloatArray:
    """(k,) slope of the straight line through values (n, k) at times (n,) [s]; zero if there is only one."""
    if len(times_s) < 2:
        return np.zeros(values.shape[1])
    t = times_s - times_s.mean()
    slope: FloatArray = t @ (values - values.mean(axis=0)) / (t @ t)
    return slope


def bridge_std(times_s: FloatArray, start_s: float, end_s: float) -> FloatArray:
    """(n,) float64 [rad]: how far the truth may be from the curve across a gap at times (n,) between its ends.

    What white noise of angular acceleration, of power ANGULAR_JERK, adds to a motion that is known at both ends in
    value and velocity (the posterior of an integrated Wiener process, whose mean is the curve of eq. 6).
    """
    lever = (times_s - start_s) * (end_s - times_s) / (end_s - start_s)
    std: FloatArray = np.sqrt(ANGULAR_JERK / 3.0 * np.maximum(lever, 0.0) ** 3)
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
