"""TRC: tab-separated labelled markers of Motion Analysis, OpenSim and Motive.

Five header lines: "PathFileType", field names, field values, marker names (one per three columns), axes. The
format does not say which axis is up; it is read as it stands, since its programs write Y up. The header's counts
are not trusted: markers are those named, frames those present. An empty cell is a gap.
"""

from __future__ import annotations

from array import array
from pathlib import Path

import numpy as np

from core.recording import Recording
from core.takes.formats.assemble import assemble, check_size
from core.takes.formats.text import TextLines

START = "PathFileType"


def read(path: Path) -> Recording:
    """Raises FormatError."""
    lines = TextLines(path, decimal_commas=True)
    rows = iter(lines)
    header: list[list[str]] = []
    for wanted in ("its header", "the field names", "the field values", "the marker names", "the axes"):
        line = next(rows, None)
        if line is None:
            raise lines.ended(wanted)
        header.append([cell.strip() for cell in line.split("\t")])
        if wanted == "the field values":
            rate_hz, metres = _fields(lines, header[1], header[2])
        elif wanted == "the marker names":
            labels = _labels(lines, header[3])
    n_values = 3 * len(labels)
    values = array("d")
    for line in rows:
        if not line.strip():
            continue  # OpenSim leaves one line empty after the header
        cells = line.split("\t")
        while len(cells) > 2 + n_values and not cells[-1].strip():
            cells.pop()
        missing = 2 + n_values - len(cells)
        if missing < 0 or (missing and (missing % 3 or not lines.complete)):
            raise lines.error(
                f"has {len(cells)} columns where {len(labels)} markers need {2 + n_values}.",
                "The file is damaged or cut off; export it again.",
            )
        # A complete line may leave out the empty cells of the last markers.
        values.extend(lines.numbers(cells) + [np.nan] * missing)
    table = np.frombuffer(values, dtype=np.float64).reshape(-1, 2 + n_values)
    check_size(lines.name, len(table), len(labels))
    points = table[:, 2:].reshape(len(table), len(labels), 3) * metres
    return assemble(lines.name, rate_hz, points, labels, table[:, 0], table[:, 1], display_name=path.stem)


def _fields(lines: TextLines, names: list[str], values: list[str]) -> tuple[float, float]:
    """Frames per second (NaN if not given) and metres in the file's unit."""
    fields = dict(zip(names, values, strict=False))
    if not fields.get("Units"):
        raise lines.error("gives no value for Units.", "Export it again, in mm or m.")
    rate_hz = lines.number_at(fields["DataRate"], names.index("DataRate") + 1) if "DataRate" in fields else np.nan
    return rate_hz, lines.metres(fields["Units"])


def _labels(lines: TextLines, cells: list[str]) -> list[str]:
    if cells[0].lower() not in ("frame#", "frame"):
        raise lines.error(f"starts with {cells[0][:40]!r} where the marker names start with 'Frame#'.")
    names = cells[2:]
    while names and not names[-1]:
        names.pop()
    labels = names[::3]
    if not labels or any(cell for i, cell in enumerate(names) if i % 3):
        raise lines.error(
            f"names {sum(map(bool, names))} markers, but not one per three columns.",
            "Separate the columns with tabs, and leave two empty cells after each name.",
        )
    return labels
