"""When the frames of a text file were: the rate and the times of its header and its rows, where they disagree.

Times are in seconds unless a title says otherwise, and some programs write others without a word. Frame numbers stand
in for times that are not there.
"""

from __future__ import annotations

import numpy as np

from core.frames import FloatArray
from core.takes.formats.text import TextLines
from core.takes.holes import LONGEST_HOLE_S

FASTEST_HZ = 100_000.0
RATE_TOLERANCE = 0.05
"""How far times with few decimals may lie from the rate of a header: 960 Hz in whole milliseconds is 4 % off."""

SLOWEST_HZ = 1.0
"""No motion is captured slower: such times are in another unit."""

_UNITS = {1e-3: "milliseconds", 1e-6: "microseconds", 1e-9: "nanoseconds"}
_TOO_SHORT = (1e3, 1e6)  # seconds under a title that says milliseconds or microseconds
_ENOUGH_FRAMES = 10  # to contradict a header
_ASTRAY, _FEW = 0.35, 0.1  # a step so far from whole frames is left out, where so few are
_ROUNDED_FRAMES, _ROUNDED = 0.05, 0.01  # a rate may be rounded so far, over the recording and of itself
_FINEST_DECIMALS = 6


def compared(
    lines: TextLines, rate_hz: float, numbers: FloatArray | None, times_s: FloatArray | None, is_seconds: bool = False
) -> tuple[float, FloatArray | None]:
    """The rate [Hz] and the times (t,) float64 [s] of frames, brought together; warns of what is not as it stands.

    rate_hz: the header's, NaN if it says none; NaN comes back where the times plainly tell another, or where it says
    none. numbers, times_s: (t,) as read. is_seconds: the file says that its times are in seconds.
    """
    times_s = _in_seconds(lines, rate_hz, times_s, is_seconds)
    if not 0.0 < rate_hz < np.inf or times_s is None or len(times_s) < _ENOUGH_FRAMES:
        return rate_hz, times_s
    steps, span = np.diff(times_s), times_s[-1] - times_s[0]
    if not (np.isfinite(span) and np.all(steps > 0)):
        return rate_hz, times_s
    rates = [len(steps) / span, 1.0 / np.median(steps)]
    if numbers is not None and np.all(np.diff(numbers) > 0):
        rates.append((numbers[-1] - numbers[0]) / span)  # frames may be missing
    if any(abs(rate - rate_hz) < RATE_TOLERANCE * rate_hz for rate in rates):
        return rate_hz, times_s
    lines.warn(f"Its header says {rate_hz:g} Hz, its times {rate_of(times_s):g} Hz; the times are taken.")
    return float("nan"), times_s


def rate_of(times_s: FloatArray | None) -> float:
    """The rate that times (t,) float64 [s] tell, as plain as their decimals allow; NaN where they tell none."""
    steps = np.diff(times_s) if times_s is not None else np.empty(0)
    steps = steps[steps > 0]
    if times_s is None or not len(steps) or not np.all(np.isfinite(steps)):
        return float("nan")
    # Counted over the whole file: one step alone is as coarse as the decimals of its times.
    each = steps / np.sort(steps)[(len(steps) - 1) // 2]
    counts = np.round(each)
    whole = (np.abs(each - counts) <= _ASTRAY) & (counts > 0)
    if np.count_nonzero(~whole) <= max(1.0, _FEW * len(steps)):
        steps, counts = steps[whole], counts[whole]
    span = float(steps.sum())
    rate = float(counts.sum()) / span
    return _plain(rate, span, 0.0 if np.ptp(steps) < 1e-9 else _resolution_s(times_s))


def times_of(
    n_frames: int, rate_hz: float, numbers: FloatArray | None, times_s: FloatArray | None, told: list[str]
) -> FloatArray:
    """(n_frames,) float64 [s] from 0: the times, else by the frame numbers, else by the count; adds to what is told.

    Numbers that skip frames leave a hole. They may count in steps of any size; the usual step is one frame.
    """
    if times_s is not None and usable(times_s):
        return np.asarray(times_s - times_s[0], dtype=np.float64)
    if times_s is not None and not np.all(np.isnan(times_s)):
        told.append(f"Its times do not increase; frames are spaced by its rate of {rate_hz:g} Hz instead.")
    if numbers is None or n_frames < 2 or not np.all(np.abs(numbers) < 2**53) or not np.all(np.diff(numbers) > 0):
        return np.arange(n_frames, dtype=np.float64) / rate_hz
    steps = np.diff(numbers)
    unit = np.sort(steps)[(len(steps) - 1) // 2]
    wild = steps / unit > LONGEST_HOLE_S * rate_hz
    if wild.any():
        at = int(np.argmax(wild))
        told.append(
            f"Its frame numbers jump from {numbers[at]:.0f} to {numbers[at + 1]:.0f}, more than "
            f"{LONGEST_HOLE_S / 60:g} minutes; no time is left between."
        )
        numbers = np.concatenate([[0.0], np.cumsum(np.where(wild, unit, steps))])
    return np.asarray((numbers - numbers[0]) / unit / rate_hz, dtype=np.float64)


def usable(times_s: FloatArray | None) -> bool:
    """Whether times (t,) float64 [s] say when each frame was: they increase."""
    return times_s is not None and bool(np.all(np.isfinite(times_s)) and np.all(np.diff(times_s) > 0))


def _in_seconds(lines: TextLines, rate_hz: float, times_s: FloatArray | None, is_seconds: bool) -> FloatArray | None:
    """The times, where they are plainly in another unit in seconds."""
    found_hz = rate_of(times_s)
    if times_s is None or np.isnan(found_hz):
        return times_s
    factors, reason = [], ""
    if 0.0 < rate_hz < np.inf:
        reason = f"its header says {rate_hz:g} Hz"
        every = (*_UNITS, *_TOO_SHORT)
        factors = [each for each in every if abs(found_hz / each - rate_hz) < RATE_TOLERANCE * rate_hz]
    if not factors and found_hz > FASTEST_HZ:
        reason = f"in the unit of their title they would mean {found_hz:,.0f} Hz"
        factors = [each for each in _TOO_SHORT if found_hz / each <= FASTEST_HZ]
    if not factors and found_hz < SLOWEST_HZ and not is_seconds:
        reason = f"in seconds they would mean {found_hz:.3g} Hz"
        factors = [each for each in _UNITS if SLOWEST_HZ <= found_hz / each <= 1e3 * SLOWEST_HZ]
    if not factors:
        return times_s
    unit = _UNITS.get(factors[0], "seconds")
    lines.warn(f"Its times are read in {unit}, for {reason}.")
    return times_s * factors[0]


def _plain(rate: float, span_s: float, resolution_s: float) -> float:
    """The rate with as few decimals as times of that resolution can tell, and as put no frame out of its place."""
    near = max(resolution_s * rate, min(_ROUNDED_FRAMES, _ROUNDED * rate * span_s)) / span_s
    for decimals in range(_FINEST_DECIMALS):
        rounded = round(rate, decimals)
        if rounded > 0 and abs(rounded - rate) <= near:
            return rounded
    return rate


def _resolution_s(times_s: FloatArray) -> float:
    """The last decimal of times [s]; 0 if it is none of the first."""
    for decimals in range(_FINEST_DECIMALS + 1):
        scaled = times_s * 10.0**decimals
        if np.all(np.abs(scaled - np.round(scaled)) < 1e-4):
            return float(10.0**-decimals)
    return 0.0
