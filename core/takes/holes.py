"""Time without frames: what a recording should hold by its clock and its rate, and does not.

A device's own numbers tell what was sent and never arrived. They say nothing of a server that stood still, was
restarted or was never there: only the clock does.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from core.frames import BoolArray, FloatArray, IntArray, Standstill

LEAST_HOLE_S, LEAST_HOLE_FRAMES = 0.05, 2.5
"""A shorter step between two frames, in seconds or in frames, is the jitter of a clock or one frame that was lost,
which the device's numbers tell."""

LEAST_END_S = 0.25
"""At the ends of a recording frames are on their way: what is missing there shorter than this is not missing."""

LONGEST_HOLE_S = 600.0
"""A longer step is a clock that jumped, in a recording that does not say itself how long it was."""

_BURST = 0.25  # of a frame: what follows sooner was held up by what held up the frame before it
_ENOUGH_STEPS = 10  # to know the rate by
_MOST_FRAMES = 1e12
_ALIKE = 0.01  # rates this near are one, and the stated one has no jitter in it


@dataclass(frozen=True)
class Holes:
    """Where a recording holds no frames.

    from_s, to_s: (k,) float64 [s], ascending, in the time of the frames: when the first missing frame was due, and
    the next frame that is there (or the end). frames: (k,) int64, about how many are missing; 0 if the rate is unknown.
    own: (k,) bool, where this program stood still and did not read. came: (k,) bool, where frames came that the file
    lacks: they are counted as dropped or unreadable. Elsewhere nothing came.
    """

    from_s: FloatArray
    to_s: FloatArray
    frames: IntArray
    own: BoolArray = field(default_factory=lambda: np.zeros(0, dtype=np.bool_))
    came: BoolArray = field(default_factory=lambda: np.zeros(0, dtype=np.bool_))

    def __post_init__(self) -> None:
        for name in ("own", "came"):
            if len(getattr(self, name)) != len(self.from_s):
                object.__setattr__(self, name, np.zeros(len(self.from_s), dtype=np.bool_))

    def __len__(self) -> int:
        return len(self.from_s)

    @property
    def seconds(self) -> float:
        """Of all of them [s]."""
        return float((self.to_s - self.from_s).sum())

    @property
    def longest_s(self) -> float:
        """The longest [s], 0 if there is none."""
        return float((self.to_s - self.from_s).max(initial=0.0))

    @property
    def missing(self) -> int:
        """About how many frames are missing in all of them."""
        return int(self.frames.sum())

    @property
    def words(self) -> str:
        """'34.4 s without frames, about 3,440', '' for none."""
        if not len(self):
            return ""
        about = f", about {self.missing:,}" if self.missing else ""
        return f"{seconds_text(self.seconds)} without frames{about}"

    def at(self, time_s: float) -> int | None:
        """The hole at a moment [s]."""
        i = int(np.searchsorted(self.from_s, time_s, side="right")) - 1
        return i if i >= 0 and time_s < self.to_s[i] else None

    def shifted(self, by_s: float) -> Holes:
        """The same in a time that counts from another instant [s]."""
        return replace(self, from_s=self.from_s + by_s, to_s=self.to_s + by_s)

    def within(self, from_s: float, to_s: float) -> Holes:
        """Those of a part of the recording, cut at its ends [s]."""
        begin, end = np.maximum(self.from_s, from_s), np.minimum(self.to_s, to_s)
        kept = end > begin
        share = (end - begin)[kept] / (self.to_s - self.from_s)[kept]
        frames = np.rint(self.frames[kept] * share).astype(np.int64)
        return Holes(begin[kept], end[kept], frames, self.own[kept], self.came[kept])

    def owned(self, standstills: Sequence[Standstill]) -> Holes:
        """The same, `own` where standstills, in the time of the holes, make up most of a hole."""
        if not standstills or not len(self):
            return self
        spans = np.array([one.reach_s for one in standstills])
        spans = spans[np.argsort(spans[:, 0], kind="stable")]
        until = np.maximum.accumulate(spans[:, 1])
        begin = np.maximum(spans[:, 0], np.concatenate([[-np.inf], until[:-1]]))
        end = np.maximum(until, begin)
        knots, stood_s = np.column_stack([begin, end]).ravel(), np.cumsum(end - begin)
        before_s = np.column_stack([np.concatenate([[0.0], stood_s[:-1]]), stood_s]).ravel()
        inside_s = np.interp(self.to_s, knots, before_s) - np.interp(self.from_s, knots, before_s)
        return replace(self, own=inside_s > (self.to_s - self.from_s) / 2)

    @property
    def standing(self) -> Holes:
        """Those in which this program stood still."""
        return self._where(self.own)

    @property
    def silences(self) -> Holes:
        """Those in which nothing came."""
        return self._where(~self.own & ~self.came)

    def _where(self, kept: BoolArray) -> Holes:
        return Holes(self.from_s[kept], self.to_s[kept], self.frames[kept], self.own[kept], self.came[kept])


NO_HOLES = Holes(np.empty(0), np.empty(0), np.empty(0, dtype=np.int64))


def seconds_text(seconds: float) -> str:
    """'34.4 s', below a second with two decimals."""
    return f"{seconds:.1f} s" if seconds >= 1.0 else f"{seconds:.2f} s"


def hole_words(holes: Holes, i: int) -> str:
    """One of them: 'Nothing came for 34.4 s, about 3,440 frames.', or with the reason why there is none."""
    about = f", about {int(holes.frames[i]):,}" if holes.frames[i] else ""
    long = seconds_text(float(holes.to_s[i] - holes.from_s[i]))
    if holes.own[i]:
        return f"Phalanx stood still here: {long} without frames{about}."
    if holes.came[i]:
        return f"Frames that came here are lost: {long} without frames{about}."
    return f"Nothing came for {long}{about + ' frames' if about else ''}."


def holes_of(times_s: FloatArray, rate_hz: float, begin_s: float = math.nan, end_s: float = math.nan) -> Holes:
    """The holes of a recording.

    times_s: (n,) float64 [s], when each frame was exposed, in the order in which frames came; steps back are none, and
    times that are not finite are passed over. rate_hz: as the device says, NaN if unknown: the frames themselves say
    it better where there are enough. begin_s, end_s: when recording began and ended [s], NaN if unknown.
    """
    times_s = times_s[np.isfinite(times_s)]
    steps_s = np.diff(times_s)
    period_s = _period_s(steps_s, rate_hz)
    if not len(times_s):
        whole = math.isfinite(end_s - begin_s) and end_s - begin_s >= LEAST_END_S
        return _holes(np.array([begin_s]), np.array([end_s]), period_s) if whole else NO_HOLES
    longest_s = end_s - begin_s if math.isfinite(end_s - begin_s) else LONGEST_HOLE_S
    at = np.flatnonzero(is_hole(times_s, rate_hz) & (steps_s <= longest_s))
    starts, ends = times_s[at] + period_s, times_s[at + 1]
    least_s = max(LEAST_END_S, LEAST_HOLE_FRAMES * period_s)
    if times_s[0] - begin_s >= least_s:
        starts, ends = np.concatenate([[begin_s], starts]), np.concatenate([[times_s[0]], ends])
    if end_s - times_s[-1] >= least_s:
        starts, ends = np.concatenate([starts, [times_s[-1] + period_s]]), np.concatenate([ends, [end_s]])
    return _holes(starts, ends, period_s)


def is_hole(times_s: FloatArray, rate_hz: float) -> BoolArray:
    """(n - 1,) bool: which steps from one frame to the next pass over frames that never were. times_s, rate_hz: as in
    `holes_of`; times that are not finite or far off alone make none."""
    if len(times_s) < 2:
        return np.zeros(0, dtype=np.bool_)
    with np.errstate(invalid="ignore"):
        steps_s = np.diff(times_s)
        # A step counts from the latest time before it; one that the next frame takes back is a bad time.
        stands = np.isfinite(times_s) & np.append(steps_s > -LEAST_HOLE_S, True)
        ahead_s = times_s[1:] - np.maximum.accumulate(np.where(stands, times_s, -np.inf))[:-1]
    period_s = _period_s(steps_s[np.isfinite(steps_s)], rate_hz)
    least_s = max(LEAST_HOLE_S, LEAST_HOLE_FRAMES * period_s)
    holes: BoolArray = np.isfinite(ahead_s) & stands[1:] & (ahead_s >= least_s) & (steps_s >= least_s)
    for k in np.flatnonzero(holes):
        holes[k] = _without_burst(steps_s, int(k), period_s) >= least_s
    return holes


def _period_s(steps_s: FloatArray, rate_hz: float) -> float:
    """From a frame to the next [s]; 0 if unknown."""
    stated_s = 1.0 / rate_hz if math.isfinite(rate_hz) and rate_hz > 0 else 0.0
    forward = steps_s[steps_s > 0]
    if not len(forward) or (stated_s and len(forward) < _ENOUGH_STEPS):
        return stated_s
    found_s = float(np.median(forward))
    return stated_s if abs(found_s - stated_s) < _ALIKE * found_s else found_s


def _without_burst(steps_s: FloatArray, k: int, period_s: float) -> float:
    """Step k, less what the frames behind it come too soon: they were not missing, but late."""
    length_s = float(steps_s[k])
    for step_s in steps_s[k + 1 :]:
        if step_s >= _BURST * period_s or length_s <= period_s:
            break
        length_s -= period_s - max(float(step_s), 0.0)
    return length_s


def _holes(from_s: FloatArray, to_s: FloatArray, period_s: float) -> Holes:
    with np.errstate(over="ignore"):  # of a rate that cannot be
        frames = np.rint((to_s - from_s) / period_s) if period_s else np.zeros(len(from_s))
    frames = np.minimum(frames, _MOST_FRAMES)
    order = np.argsort(from_s, kind="stable")  # a clock that stepped back may have put them in another
    return Holes(from_s[order], to_s[order], frames.astype(np.int64)[order])
