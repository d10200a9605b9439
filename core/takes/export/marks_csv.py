"""Moments that were marked, beside whatever else is exported: `marks.csv`, a line for each. C3D holds them too."""

from __future__ import annotations

import csv
import io
from math import isnan
from pathlib import Path

import numpy as np

from core.takes.export.compare import mismatch
from core.takes.export.content import Content
from core.takes.export.csv_text import csv_text
from core.takes.export.progress import Progress

HEADER = ("time_s", "frame", "text", "time_source_s")
"""When it was, counted as `time_s` elsewhere; the device's number of the frame at that moment; what was written; when
that frame was by the device's clock or in the file it came from, empty where that tells none."""


def names(content: Content) -> list[str]:
    """One file."""
    return ["marks.csv"]


def write(content: Content, paths: list[Path], progress: Progress) -> None:
    """Writes and reads back. Raises ExportError, OSError."""
    (path,) = paths
    rows = [
        (f"{time_s:.6f}", str(frame), text, "" if isnan(source_s) else f"{source_s:.6f}")
        for time_s, frame, text, source_s in _marks(content)
    ]
    stream = io.StringIO()
    csv.writer(stream, lineterminator="\n").writerows([HEADER, *rows])
    path.write_text(stream.getvalue(), encoding="utf-8", newline="")
    with path.open(encoding="utf-8", newline="") as written:
        if [tuple(row) for row in csv.reader(written)] != [HEADER, *rows]:
            raise mismatch(path, "it differs")
    progress(1.0, f"{path.name} is complete")


def _marks(content: Content) -> list[tuple[float, int, str, float]]:
    """Of each, in order of time: when [s], the frame that was shown, the text on one line, and when that frame was by
    its own clock [s]."""
    timeline = content.timeline
    found = []
    for mark in sorted(content.solution.marks, key=lambda mark: mark.time_s):
        at = int(np.searchsorted(timeline.times_s, mark.time_s + 0.5 / timeline.rate_hz, side="right")) - 1
        source_s = content.source_s(max(at, 0))
        text = csv_text(" ".join(mark.text.split()))
        found.append((mark.time_s, int(timeline.sequences[max(at, 0)]), text, source_s))
    return found
