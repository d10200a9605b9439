"""A recording: what is read from a motion file, a whole take of labelled or unlabelled points in memory."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from datetime import datetime

import numpy as np

from core.frames import FloatArray, IntArray, MarkerFrame, Times
from core.gaps import NO_GAPS, Gaps
from core.printable import MOST_OF_TEXT, printable


@dataclass(frozen=True)
class Recording:
    """Points over time.

    Of a labelled recording each column is one trajectory. Of an unlabelled one (points.csv, a take) column k is
    just the k-th point of each frame: ids are short-lived, and a column for each would not fit in memory.

    name: file or take name. rate_hz: frames per second.
    times_s: (t,) float64 [s], from the start, increasing. frame_numbers: (t,) int64, as the file counts them.
    points_m: (t, m, 3) float64 [m], world, Y up; NaN where there is no point.
    labels: (m,) names of the trajectories as the file gives them, all different; () if unlabelled.
    ids: (m,) int64, id of each trajectory; (t, m) if unlabelled, NO_ID where there is no point.
    gaps: points that are not there, by reason. warnings: what its reader found amiss and went on without, in sentences.
    format: what kind of file it is, as people call it. recorded: when, with its zone; None if the file does not say.
    source_s: (t,) float64 [s], when each frame was as the file counts, NaN where it does not say; None if it never
    does.
    """

    name: str
    rate_hz: float
    times_s: FloatArray
    frame_numbers: IntArray
    points_m: FloatArray
    labels: tuple[str, ...]
    ids: IntArray
    gaps: Gaps = NO_GAPS
    warnings: tuple[str, ...] = ()
    format: str = ""
    recorded: datetime | None = None
    source_s: FloatArray | None = None

    def __post_init__(self) -> None:
        for field in ("name", "format"):
            object.__setattr__(self, field, printable(getattr(self, field)))
        object.__setattr__(self, "labels", tuple(map(printable, self.labels)))
        object.__setattr__(self, "warnings", tuple(printable(text, MOST_OF_TEXT) for text in self.warnings))

    @property
    def n_frames(self) -> int:
        """Frames in the recording."""
        return len(self.times_s)

    @property
    def duration_s(self) -> float:
        """Of its frames alone, at its rate [s]."""
        return self.n_frames / self.rate_hz

    @property
    def span_s(self) -> float:
        """From the first frame to the end of the last by their times, with any time between without frames [s]."""
        return float(self.times_s[-1] - self.times_s[0]) + 1.0 / self.rate_hz

    @property
    def gap_figures(self) -> dict[str, float]:
        """Its gaps, by reason and as a share of the points that there should be."""
        return self.gaps.figures(int((~np.isnan(self.points_m[:, :, 0])).sum()))

    def at(self, rows: IntArray) -> Recording:
        """Only these frames."""
        return replace(
            self,
            times_s=self.times_s[rows],
            frame_numbers=self.frame_numbers[rows],
            points_m=self.points_m[rows],
            ids=self.ids if self.ids.ndim == 1 else self.ids[rows],
            source_s=None if self.source_s is None else self.source_s[rows],
        )

    def frames(self) -> Iterator[MarkerFrame]:
        """The recording as a device would have sent it: only the points present in each frame. The device's clock is
        the file's own, and counts from the start where it has none."""
        present = ~np.isnan(self.points_m[:, :, 0])
        ids = np.broadcast_to(self.ids, present.shape)
        for i in range(self.n_frames):
            seen = present[i]
            t = float(self.times_s[i])
            source_s = t if self.source_s is None else float(self.source_s[i])
            yield MarkerFrame(
                sequence=int(self.frame_numbers[i]),
                times=Times(source_s, t, t),
                points_m=np.ascontiguousarray(self.points_m[i, seen]),
                ids=ids[i, seen],
                residuals_m=np.full(int(seen.sum()), np.nan),
            )
