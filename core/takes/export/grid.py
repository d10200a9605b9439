"""The even grid of formats that know only a rate: which frames each of its places lies at, or between."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from core.frames import BoolArray, FloatArray, IntArray
from core.takes.export.timeline import Timeline
from core.takes.holes import is_hole

_SAME = 1e-6  # of a frame: nearer than this a place is at the frame


@dataclass(frozen=True)
class Grid:
    """Places in even steps of time, from the first solved frame on.

    before, after: (k,) int64, the frames around each place, or the one that it is at twice; where nothing is, the last
    frame before it twice. share: (k,) float64, 0 to below 1, how far from `before` to `after` the place lies. present:
    (k,) bool, False where no frame came: neither of the two may be shown there as if it had been measured.
    places_s, frames_s: (n,) float64 [s], where on the grid each frame lies, and when it was.
    """

    rate_hz: float
    before: IntArray
    after: IntArray
    share: FloatArray
    present: BoolArray
    places_s: FloatArray
    frames_s: FloatArray

    def __len__(self) -> int:
        return len(self.before)

    @property
    def times_s(self) -> FloatArray:
        """(k,) float64 [s], of the places, from 0."""
        return np.arange(len(self)) / self.rate_hz

    def place_s(self, time_s: float) -> float:
        """Where a moment lies on the grid [s]; time_s counts as the frames' own times do."""
        if not len(self.frames_s):
            return time_s
        first, last = float(self.frames_s[0]), float(self.frames_s[-1])
        if first <= time_s <= last:
            return float(np.interp(time_s, self.frames_s, self.places_s))
        return float(self.places_s[0]) + time_s - first if time_s < first else float(self.places_s[-1]) + time_s - last


def grid_of(timeline: Timeline, rate_hz: float | None = None) -> Grid:
    """The grid of the recording's own rate, where each frame has a place of its own and a lost one leaves it free; or
    of another rate, with places between the frames. Nothing is ever put between two frames that a lost one parts."""
    n, slots, times_s = timeline.n_frames, timeline.slots, timeline.times_s
    if rate_hz is None or not n:
        at = timeline.frame_at_slot()
        present = np.zeros(timeline.n_slots, dtype=np.bool_)
        present[slots] = True
        return Grid(timeline.rate_hz, at, at, np.zeros(len(at)), present, slots / timeline.rate_hz, times_s)
    own_s = times_s - times_s[0]
    near_s = _SAME / timeline.rate_hz
    wanted_s = np.arange(int((own_s[-1] + near_s) * rate_hz) + 1) / rate_hz
    before = np.clip(np.searchsorted(own_s, wanted_s + near_s, side="right") - 1, 0, n - 1)
    after = np.minimum(before + 1, n - 1)
    at_frame = (wanted_s - own_s[before] <= near_s) | (after == before)
    neighbours = np.append(_next_to_each_other(timeline), True)[before]
    after = np.where(at_frame | ~neighbours, before, after).astype(np.int64)
    step_s = own_s[after] - own_s[before]
    share = np.where(step_s > 0.0, (wanted_s - own_s[before]) / np.where(step_s > 0.0, step_s, 1.0), 0.0)
    return Grid(rate_hz, before.astype(np.int64), after, share, at_frame | neighbours, own_s, times_s)


def _next_to_each_other(timeline: Timeline) -> BoolArray:
    """(n - 1,) bool: between these two frames none is missing. Where the rate falls in mid-take there are free places
    on the grid between frames that follow each other; then the device's numbers tell."""
    counted = np.diff(timeline.sequences)
    unit = max(int(np.median(counted)), 1) if len(counted) else 1
    followed = (counted == unit) & ~is_hole(timeline.times_s, timeline.rate_hz)
    near: BoolArray = (np.diff(timeline.slots) <= 1) | followed
    return near
