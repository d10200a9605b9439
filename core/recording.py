"""A recording: what is read from a motion file, a whole take of labelled or unlabelled points in memory."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from core.frames import FloatArray, IntArray, MarkerFrame, Times


@dataclass(frozen=True)
class Recording:
    """Points over time, one column per trajectory.

    name: file or take name. rate_hz: frames per second.
    times_s: (t,) float64 [s], from the start. frame_numbers: (t,) int64, as the file counts them.
    points_m: (t, m, 3) float64 [m], world, Y up; NaN where a trajectory has no sample.
    labels: (m,) names of the trajectories as the file gives them; () for unlabelled points
        (the long form points.csv), whose columns are device ids without meaning.
    ids: (m,) int64, device id of each column.
    """

    name: str
    rate_hz: float
    times_s: FloatArray
    frame_numbers: IntArray
    points_m: FloatArray
    labels: tuple[str, ...]
    ids: IntArray

    @property
    def n_frames(self) -> int:
        """Frames in the recording."""
        return len(self.times_s)

    @property
    def duration_s(self) -> float:
        """From the first to the end of the last frame [s]."""
        return self.n_frames / self.rate_hz

    def frames(self) -> Iterator[MarkerFrame]:
        """The recording as a device would have sent it: only the points present in each frame."""
        present = ~np.isnan(self.points_m[:, :, 0])
        for i in range(self.n_frames):
            seen = present[i]
            t = float(self.times_s[i])
            yield MarkerFrame(
                sequence=int(self.frame_numbers[i]),
                times=Times(t, t, t),
                points_m=np.ascontiguousarray(self.points_m[i, seen]),
                ids=self.ids[seen],
                residuals_m=np.full(int(seen.sum()), np.nan),
            )
