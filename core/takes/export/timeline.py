"""When each frame was: the times of formats that carry them, and the even grid of those that do not."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from core.errors import ExportError
from core.frames import FloatArray, IntArray, MarkerFrame, TrackedFrame
from core.takes.holes import LONGEST_HOLE_S, is_hole

SHORTEST_STEP_S = 1e-4
"""Frames nearer to each other than this are times of arrival in a burst, not of exposure."""


@dataclass(frozen=True)
class Timeline:
    """The frames of a recording in time.

    rate_hz: of the grid. sequences: (n,) int64, the device's frame numbers. times_s: (n,) float64 [s], increasing,
    from start_s; of the even grid where the clock cannot be used. start_s: the mapped host clock at the first frame
    [s], NaN if it cannot be used. slots: (n,) int64, increasing from 0: the place of each frame on the even grid of
    C3D, TRC and BVH, where a lost frame leaves a free place.
    """

    rate_hz: float
    sequences: IntArray
    times_s: FloatArray
    start_s: float
    slots: IntArray

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
        return Timeline(self.rate_hz, self.sequences, self.times_s + offset, start_s, self.slots)


def timeline_of(frames: Iterable[MarkerFrame] | Iterable[TrackedFrame], rate_hz: float) -> Timeline:
    """The timeline of frames in their order. rate_hz: NaN if unknown. Raises ExportError if it cannot be found."""
    stamps = [(frame.sequence, frame.times.host_s) for frame in frames]
    sequences = np.array([sequence for sequence, _ in stamps], dtype=np.int64)
    host_s = np.array([time for _, time in stamps], dtype=np.float64)
    steps_s = np.diff(host_s)
    usable = len(host_s) > 0 and bool(np.all(np.isfinite(host_s))) and bool(np.all(steps_s >= SHORTEST_STEP_S))
    if not (np.isfinite(rate_hz) and rate_hz > 0):
        forward = np.sort(steps_s[steps_s > 0])
        if not len(forward):
            raise ExportError(f"The frame rate is unknown ({rate_hz:g} Hz) and the frames have no times.", "Set it.")
        rate_hz = 1.0 / float(forward[(len(forward) - 1) // 2])
    slots = _slots(sequences, host_s, rate_hz)
    if usable:
        return Timeline(rate_hz, sequences, host_s - host_s[0], float(host_s[0]), slots)
    return Timeline(rate_hz, sequences, slots / rate_hz, float("nan"), slots)


def _slots(sequences: IntArray, host_s: FloatArray, rate_hz: float) -> IntArray:
    """The device's frame numbers tell how many frames are missing, as long as the clock does not contradict: numbers
    that run backwards or far ahead are a device that began anew, and where it stood still only the clock tells how
    long. A pause longer than LONGEST_HOLE_S is a broken clock, and is closed up.
    """
    if len(sequences) == 0:
        return np.empty(0, dtype=np.int64)
    counted, steps_s = np.diff(sequences), np.diff(host_s)
    unit = max(int(np.median(counted)), 1) if len(counted) else 1  # a device may send every second of its frames
    counted = np.rint(counted / unit).astype(np.int64)
    paused = np.where((steps_s > 0) & (steps_s <= LONGEST_HOLE_S), steps_s, 0.0)
    timed = np.maximum(np.rint(paused * rate_hz).astype(np.int64), 1)
    stood_still = is_hole(host_s, rate_hz) & (counted < 0.5 * timed)
    steps = np.where((counted >= 1) & (counted <= 2 * timed) & ~stood_still, counted, timed)
    return np.concatenate([[0], np.cumsum(steps)]).astype(np.int64)
