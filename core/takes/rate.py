"""The rate of a recording by its frame numbers and its times together, and what to say where it is not the stated one:
the same words whether a recording is looked at, checked or exported."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from core.frames import BoolArray, FloatArray, IntArray
from core.takes.holes import LONGEST_HOLE_S, is_hole
from core.takes.pace import Pace, pace_of, without_bursts

_NEARLY = 0.01  # rates this near need no word
_ROUNDS = 3


@dataclass(frozen=True)
class Rate:
    """How fast the n frames of a recording came.

    stated_hz: as the recording says. pace: as its frames do. times_s: (n,) float64 [s], from the first frame, where
    frames that were held up together are where they belong. frames: (n,) int64, the place of each by its number alone.
    stood_still: (n - 1,) bool, where frames are missing that no number tells.
    """

    stated_hz: float
    pace: Pace
    times_s: FloatArray
    frames: IntArray
    stood_still: BoolArray

    @property
    def words(self) -> str:
        """'Its rate changes from 120 to 240 Hz at 1.7 s', '' where it is as stated."""
        pace, stated = self.pace, self.stated_hz
        if pace.constant:
            if abs(pace.rate_hz - stated) <= _NEARLY * stated:
                return ""
            return f"Its rate is stated as {hz_text(stated)} Hz and is {hz_text(pace.rate_hz)} Hz by its times"
        low, high = float(pace.rates_hz.min()), float(pace.rates_hz.max())
        n = len(pace.changes_s)
        if not n:
            return f"Its rate wanders between {hz_text(low)} and {hz_text(high)} Hz"
        if n == 1:
            before, after = pace.rates_hz
            return f"Its rate changes from {hz_text(before)} to {hz_text(after)} Hz at {self._first_change_s():.1f} s"
        return (
            f"Its rate changes {n} times between {hz_text(low)} and {hz_text(high)} Hz, "
            f"first at {self._first_change_s():.1f} s"
        )

    def _first_change_s(self) -> float:
        """By the clock [s]: the pace counts its time without holes."""
        kept = np.flatnonzero(~self.stood_still)
        running = np.cumsum(np.diff(self.times_s)[kept])
        k = kept[min(int(np.searchsorted(running, self.pace.changes_s[0])), len(kept) - 1)]
        return float(self.times_s[k + 1] - self.times_s[0])


def rate_of(sequences: IntArray, host_s: FloatArray, rate_hz: float) -> Rate:
    """The rate of frames: (n,) int64 numbers, (n,) float64 [s] increasing times. rate_hz: as stated, positive."""
    steps_s, believed_hz = np.diff(host_s), rate_hz
    for _ in range(_ROUNDS):  # numbers are believed by the rate, and the rate is told by the numbers
        steps, stood_still = counted(sequences, host_s, believed_hz)
        counts = np.where(stood_still, 1, steps)  # there the clock alone tells
        even_s = without_bursts(np.where(steps_s <= LONGEST_HOLE_S, steps_s, counts / rate_hz), counts)
        pace = pace_of(even_s[~stood_still], counts[~stood_still], rate_hz)
        if abs(pace.rate_hz - believed_hz) <= _NEARLY * believed_hz:
            break
        believed_hz = pace.rate_hz
    times_s = np.concatenate([[0.0], np.cumsum(even_s)])
    frames = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
    return Rate(rate_hz, pace, times_s, frames, stood_still)


def rate_warning(sequences: IntArray, host_s: FloatArray, rate_hz: float) -> str:
    """A sentence where frames came at another rate than is stated, or at several; '' where they did not, and of a rate
    that is not known.

    sequences: (n,) int64. host_s: (n,) float64 [s]. Frames whose time is not a number, or not behind the times before
    it, tell nothing and are passed over.
    """
    if not (np.isfinite(rate_hz) and rate_hz > 0):
        return ""
    finite = np.isfinite(host_s)
    sequences, host_s = sequences[finite], host_s[finite]
    before = np.maximum.accumulate(np.append(-np.inf, host_s))[:-1]
    forward = host_s > before
    if forward.sum() < 2:
        return ""
    words = rate_of(sequences[forward], host_s[forward], rate_hz).words
    return f"{words}." if words else ""


def counted(sequences: IntArray, host_s: FloatArray, rate_hz: float) -> tuple[IntArray, BoolArray]:
    """(n - 1,) int64, how many places each frame is behind the one before it, and (n - 1,) bool, where frames are
    missing that no number tells.

    The device's frame numbers tell how many frames are missing, as long as the clock does not contradict: numbers
    that run backwards or far ahead are a device that began anew, and where it stood still only the clock tells how
    long. A pause longer than LONGEST_HOLE_S is a broken clock, and is closed up.
    """
    steps, steps_s = np.diff(sequences), np.diff(host_s)
    unit = max(int(np.median(steps)), 1) if len(steps) else 1  # a device may send every second of its frames
    steps = np.rint(steps / unit).astype(np.int64)
    paused = np.where((steps_s > 0) & (steps_s <= LONGEST_HOLE_S), steps_s, 0.0)
    timed = np.maximum(np.rint(paused * rate_hz).astype(np.int64), 1)
    stood_still = is_hole(host_s, rate_hz) & (steps < 0.5 * timed)
    by_number = (steps >= 1) & (steps <= 2 * timed) & ~stood_still
    return np.where(by_number, steps, timed), ~by_number & (timed > 1)


def hz_text(rate_hz: float) -> str:
    """'120', '119.88': no more than people say."""
    whole = round(rate_hz)
    return f"{whole}" if abs(rate_hz - whole) <= 5e-4 * rate_hz else f"{rate_hz:.2f}".rstrip("0").rstrip(".")
