"""How fast frames came: at one rate, or at several, by their numbers and their times together."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from core.frames import BoolArray, FloatArray, IntArray

WINDOW_S, WINDOW_STEPS = 0.5, 24
"""A rate is measured over at least so long, and so many steps."""

SAME = 0.05
"""Windows whose rates differ by less, and by no more than jitter makes, are of one rate."""

OFF_FRAMES = 0.5
"""A rate that is off by more, over the whole recording, is another one."""

_SURE = 6.0  # times what chance would do
_MEDIAN = 1.25 * 1.48  # deviation of a median, from the median deviation, by the root of their number
_PIECE_S = 4.0  # long enough to know a rate to a ten thousandth
_WANDERED_FRAMES, _WANDERED_BLOCKS, _BLOCK_S = 1.0, 3, 1.0  # off a straight line, for so many blocks on end
_LATE_S, _LATE_FRAMES, _BURST = 0.05, 2.5, 0.25  # a longer step, and what follows it sooner, were held up together


@dataclass(frozen=True)
class Pace:
    """rate_hz: the highest that is kept up. changes_s: (k,) float64 [s], when it changes. rates_hz: (k + 1,) float64,
    between the changes; the lowest and the highest where it wanders without a step, and then changes_s is empty.
    constant: whether there is but one rate.
    """

    rate_hz: float
    changes_s: FloatArray
    rates_hz: FloatArray

    @property
    def constant(self) -> bool:
        """Whether there is but one rate."""
        return len(self.rates_hz) == 1


def without_bursts(steps_s: FloatArray, counts: IntArray) -> FloatArray:
    """(n,) float64 [s], the steps with frames that were held up and came together put where they belong."""
    even = steps_s.copy()
    period_s = float(np.median(steps_s / counts)) if len(steps_s) else 0.0
    due_s = period_s * counts
    for k in np.flatnonzero(steps_s >= np.maximum(_LATE_S, _LATE_FRAMES * due_s)):
        for j in range(k + 1, len(even)):
            spare_s = even[k] - due_s[k]
            if even[j] >= _BURST * due_s[j] or spare_s <= 0.0:
                break
            moved_s = min(due_s[j] - even[j], spare_s)
            even[j] += moved_s
            even[k] -= moved_s
    return even


def pace_of(steps_s: FloatArray, counts: IntArray, nominal_hz: float) -> Pace:
    """The pace of steps (n,) float64 [s] from frame to frame that pass over `counts` (n,) int64 frames. nominal_hz: the
    rate that was stated, kept where the steps do not tell another for sure."""
    times_s, frames = np.cumsum(steps_s), np.cumsum(counts).astype(np.float64)
    rates, noise, edges = _windows(steps_s, counts, times_s, frames)
    if len(rates) >= 3:
        kept_up = np.minimum(rates[:-1, 0], rates[1:, 0])
        high, low = float(kept_up.max()), float(np.maximum(rates[:-1, 1], rates[1:, 1]).min())
        if high > (1.0 + SAME + _SURE * float(np.median(noise))) * low:
            return _changing(steps_s / counts, times_s, frames, rates, edges, high, low, nominal_hz)
    measured = _slope(times_s, frames) if len(steps_s) >= WINDOW_STEPS else nominal_hz
    if len(steps_s) >= WINDOW_STEPS and _wanders(times_s, frames, measured):
        pieces = _pieces(times_s, frames)
        return Pace(max(pieces), np.empty(0), np.array([min(pieces), max(pieces)]))
    span_s = float(times_s[-1] - times_s[0]) if len(times_s) else 0.0
    off = span_s * abs(measured - nominal_hz)
    if off > max(OFF_FRAMES, _SURE * _chance(times_s, frames, measured)):
        nominal_hz = plain(measured, span_s)
    return Pace(nominal_hz, np.empty(0), np.array([nominal_hz]))


def plain(rate_hz: float, span_s: float) -> float:
    """The rate with as few decimals as put no frame out of its place over `span_s`."""
    for decimals in range(7):
        rounded = round(rate_hz, decimals)
        if rounded > 0 and abs(rounded - rate_hz) * span_s <= 0.2 * OFF_FRAMES:
            return rounded
    return rate_hz


def _windows(
    steps_s: FloatArray, counts: IntArray, times_s: FloatArray, frames: FloatArray
) -> tuple[FloatArray, FloatArray, IntArray]:
    """(w, 2) float64 [Hz], the rate of overlapping windows at least and at most: by its mean, which a stall lowers and
    a burst raises, and by its median, which clumps raise. (w,) float64, by what share jitter moves the median. (w, 2)
    int64, their first and last step.
    """
    if len(steps_s) < 2 * WINDOW_STEPS:
        return np.empty((0, 2)), np.empty(0), np.empty((0, 2), dtype=np.int64)
    window_s = max(WINDOW_S, WINDOW_STEPS * float(np.median(steps_s / counts)))
    starts = np.searchsorted(times_s, np.arange(times_s[0], times_s[-1] - window_s, 0.5 * window_s))
    ends = np.searchsorted(times_s, times_s[starts] + window_s, side="right") - 1
    each = steps_s / counts
    rows, noise, edges = [], [], []
    for start, end in zip(starts.tolist(), ends.tolist(), strict=True):
        if end - start < WINDOW_STEPS // 2:
            continue
        mean = (frames[end] - frames[start]) / (times_s[end] - times_s[start])
        period_s = float(np.median(each[start + 1 : end + 1]))
        spread_s = float(np.median(np.abs(each[start + 1 : end + 1] - period_s)))
        rows.append((min(mean, 1.0 / period_s), max(mean, 1.0 / period_s)))
        noise.append(_MEDIAN * spread_s / period_s / np.sqrt(end - start))
        edges.append((start, end))
    return np.array(rows).reshape(-1, 2), np.array(noise), np.array(edges, dtype=np.int64).reshape(-1, 2)


def _changing(
    each_s: FloatArray,
    times_s: FloatArray,
    frames: FloatArray,
    rates: FloatArray,
    edges: IntArray,
    high: float,
    low: float,
    nominal_hz: float,
) -> Pace:
    middle = np.sqrt(high * low)
    fast = rates[:, 0] > middle
    fast[1:-1] &= fast[:-2] | fast[2:]  # one window alone keeps nothing up
    flips = np.flatnonzero(fast[1:] != fast[:-1])
    bounds = [0, *(flips + 1).tolist(), len(fast)]
    levels = np.array([float(np.median(rates[a:b].mean(axis=1))) for a, b in pairwise(bounds)])
    changes_s = np.empty(len(flips))
    for i, k in enumerate(flips.tolist()):
        a, b = edges[max(k - 1, 0), 0], edges[min(k + 2, len(edges) - 1), 1]
        before, after = (np.abs(each_s[a : b + 1] - 1.0 / level) for level in levels[i : i + 2])
        cost = np.cumsum(before) - np.cumsum(after)
        changes_s[i] = times_s[a + int(np.argmin(cost))]
    best, best_span_s = high, 0.0
    for i, window in enumerate(bounds[:-1]):
        part = _inside(times_s, changes_s, i)
        if part.sum() < WINDOW_STEPS:
            continue
        span_s = float(np.ptp(times_s[part]))
        levels[i] = plain(_slope(times_s[part], frames[part]), span_s)
        if fast[window]:
            fastest = max(_pieces(times_s[part], frames[part]))
            best = max(best, fastest) if best_span_s else fastest
            best_span_s = max(best_span_s, span_s)
    grid_hz = nominal_hz if abs(nominal_hz - best) * best_span_s <= OFF_FRAMES else plain(best, best_span_s)
    return Pace(grid_hz, changes_s, levels)


def _inside(times_s: FloatArray, changes_s: FloatArray, i: int) -> BoolArray:
    """(n,) bool, the steps between two changes, less those at their edges."""
    begin = changes_s[i - 1] if i > 0 else -np.inf
    end = changes_s[i] if i < len(changes_s) else np.inf
    return (times_s > begin) & (times_s < end)


def _pieces(times_s: FloatArray, frames: FloatArray) -> list[float]:
    """The rates of equal pieces, each long enough to be sure of it [Hz]."""
    n = max(int(np.ptp(times_s) / _PIECE_S), 1)
    cuts = np.searchsorted(times_s, np.linspace(times_s[0], times_s[-1], n + 1))
    cuts[-1] = len(times_s)
    pairs = zip(cuts[:-1].tolist(), cuts[1:].tolist(), strict=True)
    return [_slope(times_s[a:b], frames[a:b]) for a, b in pairs if b - a >= WINDOW_STEPS] or [_slope(times_s, frames)]


def _slope(times_s: FloatArray, frames: FloatArray) -> float:
    """Frames per second by least squares [Hz]: of the times over the frames, for the noise is in the times."""
    x = frames - frames.mean()
    return float((x @ x) / (x @ (times_s - times_s.mean())))


def _chance(times_s: FloatArray, frames: FloatArray, rate_hz: float) -> float:
    """By how many frames the ends of a fitted line are off by the jitter of the times alone."""
    if not len(times_s):
        return 0.0
    noise = float(np.std(times_s * rate_hz - frames))
    return noise * float(np.sqrt(12.0 / len(times_s)))


def _wanders(times_s: FloatArray, frames: FloatArray, rate_hz: float) -> bool:
    """Whether frames leave the straight line of one rate for longer than anything is held up."""
    off = times_s * rate_hz - frames
    off -= off.mean()
    starts = np.searchsorted(times_s, np.arange(times_s[0], times_s[-1], _BLOCK_S))
    blocks = np.array([np.median(part) for part in np.split(off, starts[1:]) if len(part)])
    far = np.abs(blocks) > _WANDERED_FRAMES
    runs = np.convolve(far, np.ones(_WANDERED_BLOCKS), mode="valid") if len(far) >= _WANDERED_BLOCKS else np.zeros(1)
    return bool(np.any(runs >= _WANDERED_BLOCKS))
