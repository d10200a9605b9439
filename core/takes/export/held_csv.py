"""Where BVH and glTF hold a pose, beside them: `NAME_held.csv`, a line for each stretch of time.

BVH has no place for a comment, and few programs show what glTF says of it in its `extras`.
"""

from __future__ import annotations

import csv
import io
import math
from pathlib import Path

from core.takes.export.compare import mismatch
from core.takes.export.content import Content
from core.takes.export.held import HeldSpan
from core.takes.export.progress import Progress

HEADER = ("held", "from_s", "to_s", "reason", "from_frame", "to_frame")
"""held: "left hand", "Anna left hand", or a prop by its name. Times as `time_s` elsewhere; frames as in BVH, from 1,
both included; empty where a rate was asked for that has none in this time."""

_NEAR = 1e-6  # of a frame


def names(content: Content) -> list[str]:
    """One file."""
    return [f"{content.stem}_held.csv"]


def write(content: Content, paths: list[Path], progress: Progress) -> None:
    """Writes and reads back. Raises ExportError, OSError."""
    (path,) = paths
    rows = [
        [name, f"{span.from_s:.6f}", f"{span.to_s:.6f}", span.reason, *_frames(content, span)]
        for name, span in content.all_held
    ]
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows([HEADER, *rows])
    path.write_text(text.getvalue(), encoding="utf-8", newline="\n")
    with path.open(encoding="utf-8", newline="") as stream:
        if list(csv.reader(stream)) != [list(HEADER), *rows]:
            raise mismatch(path, "it differs")
    progress(1.0, f"{path.name} is complete")


def _frames(content: Content, span: HeldSpan) -> tuple[str, str]:
    if content.options.rate_hz is None:
        return str(span.first), str(span.last)
    grid, begin_s = content.grid, content.timeline.times_s[0]
    first, stop = (math.ceil((time_s - begin_s) * grid.rate_hz - _NEAR) for time_s in (span.from_s, span.to_s))
    stop = min(stop, len(grid))
    return (str(first + 1), str(stop)) if first < stop else ("", "")
