"""Every point of a recording, compactly: an hour of two hands has seventeen million.

Arrays run over all points, frame after frame, each frame's in the order in which it has them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from core.frames import IntArray, MarkerFrame, Times
from core.gaps import present

SHORTEST_STEP_S = 1e-4
"""Frames nearer in time, or in the wrong order, say nothing of speed."""


class Column:
    """An array that grows at its end."""

    def __init__(self, dtype: Any) -> None:
        self._values: NDArray[Any] = np.empty(1024, dtype)
        self._length = 0

    def extend(self, values: NDArray[Any]) -> None:
        """Put values behind those that are there."""
        length = self._length + len(values)
        if length > len(self._values):
            grown = np.empty(max(length, 3 * len(self._values) // 2), self._values.dtype)
            grown[: self._length] = self._values[: self._length]
            self._values = grown
        self._values[self._length : length] = values
        self._length = length

    def whole(self) -> NDArray[Any]:
        """All values so far."""
        return self._values[: self._length].copy()


@dataclass
class Cloud:
    """first: (n_frames + 1,) int64, where each frame's points begin. tracklet: (n_points,) int32, numbered from 0.

    step_m: (n_points,) float32 [m], from the point before in the same tracklet, NaN at its first. kink: (n_points,)
    float32, how much a marker's velocity changed at the point before, 1 being the most that a hand does; NaN where
    there are no two before. time_s: (n_frames,) float64 [s].
    """

    first: IntArray
    tracklet: NDArray[np.int32]
    step_m: NDArray[np.float32]
    kink: NDArray[np.float32]
    time_s: NDArray[np.float64]

    @property
    def n_frames(self) -> int:
        """Frames of the recording."""
        return len(self.time_s)

    @property
    def n_tracklets(self) -> int:
        """Tracklets; every number below has a point."""
        return int(self.tracklet.max()) + 1 if len(self.tracklet) else 0

    def rows(self, frame: int) -> slice:
        """Where the points of a frame are."""
        return slice(int(self.first[frame]), int(self.first[frame + 1]))

    def frames(self) -> NDArray[np.int32]:
        """(n_points,) int32, the frame of each point."""
        return np.repeat(np.arange(self.n_frames, dtype=np.int32), np.diff(self.first))

    def spans(self) -> tuple[IntArray, IntArray]:
        """First and last frame of each tracklet, (n_tracklets,) int64."""
        frames = self.frames()
        begin, end = np.full(self.n_tracklets, self.n_frames), np.full(self.n_tracklets, -1)
        np.minimum.at(begin, self.tracklet, frames)
        np.maximum.at(end, self.tracklet, frames)
        return begin.astype(np.int64), end.astype(np.int64)


def clock_s(times: Times) -> float:
    """The time [s] by which motion is judged: the device's own where it has one."""
    return times.device_s if np.isfinite(times.device_s) else times.host_s


def usable(frame: MarkerFrame) -> NDArray[np.bool_]:
    """(n,) bool, points that are anywhere at all."""
    return present(frame.points_m)
