"""When each frame was: the times of formats that carry them, and the even grid of those that do not."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from core.errors import ExportError
from core.frames import BoolArray, FloatArray, IntArray, MarkerFrame, TrackedFrame
from core.takes.holes import is_hole
from core.takes.rate import Rate, counted, hz_text, rate_of

SHORTEST_STEP_S = 1e-4
"""Frames nearer to each other than this are times of arrival in a burst, not of exposure."""

_TELLING = 15  # frames behind a hole that tell how long it was


@dataclass(frozen=True)
class Timeline:
    """The frames of a recording in time.

    rate_hz: of the grid: the stated one, or by the clock where that puts frames elsewhere; the highest that is kept up
    where it changes. sequences: (n,) int64, the device's frame numbers. times_s: (n,) float64 [s], increasing,
    from start_s; of the even grid where the clock cannot be used. start_s: the mapped host clock at the first frame
    [s], NaN if it cannot be used. slots: (n,) int64, increasing from 0: the place of each frame on the even grid of
    C3D, TRC and BVH, where a lost frame leaves a free place; within half a place of its time, jitter aside, wherever
    the clock can be used. warnings: what the grid shows otherwise than the recording, in sentences.
    """

    rate_hz: float
    sequences: IntArray
    times_s: FloatArray
    start_s: float
    slots: IntArray
    warnings: tuple[str, ...] = ()

    @property
    def n_frames(self) -> int:
        """Frames there are."""
        return len(self.sequences)

    @property
    def n_slots(self) -> int:
        """Places on the even grid."""
        return int(self.slots[-1]) + 1 if len(self.slots) else 0

    def frame_at_slot(self) -> IntArray:
        """(n_slots,) int64, index of the frame at each place, or of the last before it."""
        return np.searchsorted(self.slots, np.arange(self.n_slots), side="right") - 1

    def keys(self) -> tuple[FloatArray, IntArray]:
        """(k,) float64 [s] and (k,) int64: when to set a key, and to which frame, for formats that blend from key to
        key. Over a hole the frame before it has a second key at its end, so that the hand does not drift through it.
        """
        ends = np.flatnonzero(is_hole(self.times_s, self.rate_hz))
        frames = np.insert(np.arange(self.n_frames), ends + 1, ends)
        times_s = np.insert(self.times_s, ends + 1, self.times_s[ends + 1] - 1.0 / self.rate_hz)
        return times_s, frames.astype(np.int64)

    def shifted(self, start_s: float) -> Timeline:
        """The same with times counted from another instant of the host clock, where both are known."""
        offset = self.start_s - start_s
        if not np.isfinite(offset):
            return self
        return replace(self, times_s=self.times_s + offset, start_s=start_s)


def timeline_of(frames: Iterable[MarkerFrame] | Iterable[TrackedFrame], rate_hz: float) -> Timeline:
    """The timeline of frames in their order. rate_hz: NaN if unknown. Frames whose time is unknown are put between
    those beside them, by their numbers. Raises ExportError if the rate cannot be found."""
    stamps = [(frame.sequence, frame.times.host_s) for frame in frames]
    sequences = np.array([sequence for sequence, _ in stamps], dtype=np.int64)
    host_s = np.array([time for _, time in stamps], dtype=np.float64)
    steps_s = np.diff(host_s)
    if not (np.isfinite(rate_hz) and rate_hz > 0):
        forward = np.sort(steps_s[steps_s > 0])
        if not len(forward):
            raise ExportError(f"The frame rate is unknown ({rate_hz:g} Hz) and the frames have no times.", "Set it.")
        rate_hz = 1.0 / float(forward[(len(forward) - 1) // 2])
    unknown = ~np.isfinite(host_s)
    if unknown.any() and not unknown.all():
        host_s = _between(sequences, host_s, unknown, rate_hz)
    usable = len(host_s) > 0 and bool(np.all(np.isfinite(host_s))) and bool(np.all(np.diff(host_s) >= SHORTEST_STEP_S))
    if not usable:
        steps, _ = counted(sequences, host_s, rate_hz)
        slots = np.concatenate([[0], np.cumsum(steps)]).astype(np.int64)[: len(sequences)]
        return Timeline(rate_hz, sequences, slots / rate_hz, float("nan"), slots)
    grid_hz, slots, warnings = _grid(sequences, host_s, rate_hz)
    if n := int(unknown.sum()):
        warnings = (*warnings, f"{n:,} frames of unknown time are put between those beside them, by their numbers.")
    return Timeline(grid_hz, sequences, host_s - host_s[0], float(host_s[0]), slots, warnings)


def _between(sequences: IntArray, host_s: FloatArray, unknown: BoolArray, rate_hz: float) -> FloatArray:
    """(n,) float64 [s], the times with those that are unknown by the device's numbers: between the known ones beside
    them, before the first and behind the last at the rate. A device that counts anew went on by one."""
    numbers = np.concatenate([[0], np.cumsum(np.maximum(np.diff(sequences), 1))]).astype(np.float64)
    known = np.flatnonzero(~unknown)
    first, last = known[0], known[-1]
    between = np.interp(numbers, numbers[known], host_s[known])
    between += np.minimum(numbers - numbers[first], 0) / rate_hz + np.maximum(numbers - numbers[last], 0) / rate_hz
    return np.where(unknown, between, host_s)


def _grid(sequences: IntArray, host_s: FloatArray, rate_hz: float) -> tuple[float, IntArray, tuple[str, ...]]:
    """Rate [Hz] of the even grid, (n,) int64 places on it, and warnings."""
    rate = rate_of(sequences, host_s, rate_hz)
    pace = rate.pace
    ahead = rate.times_s * pace.rate_hz - rate.frames  # free places before each frame, by the clock
    # No frame is later than those behind it allow; so places are free only where frames came slower for good.
    slower = np.rint(np.minimum.accumulate(ahead[::-1])[::-1])
    free = _after_holes(ahead, rate.stood_still) if pace.constant else slower
    slots = rate.frames + (free - free[0]).astype(np.int64)
    return pace.rate_hz, slots, _warnings(rate)


def _after_holes(ahead: FloatArray, stood_still: BoolArray) -> FloatArray:
    """(n,) whole numbers: free places where a device of one rate stood still. Elsewhere its numbers tell, for they do
    not jitter. Behind each hole some frames tell together, counted from the first of all."""
    free = np.zeros(len(ahead))
    begins = [0, *(np.flatnonzero(stood_still) + 1).tolist(), len(ahead)]
    if len(begins) == 2:
        return free
    medians = [float(np.median(ahead[a : min(b, a + _TELLING)])) for a, b in pairwise(begins)]
    so_far = 0.0
    for (a, b), median in zip(pairwise(begins), medians, strict=True):
        so_far = max(so_far, float(np.rint(median - medians[0])))
        free[a:b] = so_far
    return free


def _warnings(rate: Rate) -> tuple[str, ...]:
    if not rate.words:
        return ()
    free = "" if rate.pace.constant else ", with free places where frames came slower"
    return (f"{rate.words}: the even grid of C3D, TRC and BVH is of {hz_text(rate.pace.rate_hz)} Hz{free}.",)
