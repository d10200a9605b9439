"""Where a recording has no frames, beside whatever else is exported: `NAME_holes.csv`, a line for each.

C3D and TRC hold gaps there; BVH and glTF can only hold the last pose, so that nobody could tell from them.
"""

from __future__ import annotations

from pathlib import Path

from core.takes.export.compare import mismatch
from core.takes.export.content import Content
from core.takes.export.progress import Progress
from core.takes.holes import Holes, seconds_text

HEADER = "from_s,to_s,frames"
"""When the first missing frame was due and when the next one came, counted as `time_s` elsewhere, and about how many
are missing."""


def words(holes: Holes, length_s: float) -> str:
    """What an export says of them: '12.4 s without frames, about 1,488: ...'. length_s: of its frames, from the first
    to the last [s]."""
    inside = holes.within(0.0, length_s)
    said = []
    if len(inside):
        said.append(
            f"{seconds_text(inside.seconds)} are gaps in C3D and TRC, and BVH and glTF hold the last pose there"
        )
    if inside.seconds < holes.seconds - 1e-6:
        said.append("files begin with the first frame and end with the last")
    return f"{holes.words}: {'; '.join(said)}."


def names(content: Content) -> list[str]:
    """One file."""
    return [f"{content.stem}_holes.csv"]


def write(content: Content, paths: list[Path], progress: Progress) -> None:
    """Writes and reads back. Raises ExportError, OSError."""
    (path,) = paths
    holes = content.solution.holes
    rows = zip(holes.from_s.tolist(), holes.to_s.tolist(), holes.frames.tolist(), strict=True)
    text = "\n".join([HEADER, *(f"{begin:.6f},{end:.6f},{frames}" for begin, end, frames in rows), ""])
    path.write_text(text, encoding="utf-8", newline="\n")
    if path.read_text(encoding="utf-8") != text:
        raise mismatch(path, "it differs")
    progress(1.0, f"{path.name} is complete")
