"""Where BVH and glTF hold a pose, beside them: `NAME_held.csv`, a line for each stretch of time.

BVH has no place for a comment, and few programs show what glTF says of it in its `extras`.
"""

from __future__ import annotations

import csv
import io
from pathlib import Path

from core.takes.export.compare import mismatch
from core.takes.export.content import Content
from core.takes.export.naming import file_stem
from core.takes.export.progress import Progress

HEADER = ("held", "from_s", "to_s", "reason", "from_frame", "to_frame")
"""held: "left hand", "Anna left hand", or a prop by its name. Times as `time_s` elsewhere; frames as in BVH, from 1,
both included."""


def needed(content: Content) -> bool:
    """Is a pose held anywhere?"""
    return bool(content.all_held)


def names(content: Content) -> list[str]:
    """One file."""
    return [f"{file_stem(content.solution.name)}_held.csv"]


def write(content: Content, paths: list[Path], progress: Progress) -> None:
    """Writes and reads back. Raises ExportError, OSError."""
    (path,) = paths
    rows = [
        [name, f"{span.from_s:.6f}", f"{span.to_s:.6f}", span.reason, str(span.first), str(span.last)]
        for name, span in content.all_held
    ]
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows([HEADER, *rows])
    path.write_text(text.getvalue(), encoding="utf-8", newline="\n")
    with path.open(encoding="utf-8", newline="") as stream:
        if list(csv.reader(stream)) != [list(HEADER), *rows]:
            raise mismatch(path, "it differs")
    progress(1.0, f"{path.name} is complete")
