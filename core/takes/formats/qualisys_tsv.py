"""Qualisys Track Manager, "Export to TSV": labelled 3D markers.

A header of keys and values, perhaps one line of column titles, then a row per frame, with or without the frame
number and the time. Millimetres; Qualisys worlds are Z up by convention and turned to Y up here (the file does
not say; x stays, z becomes y). A gap is "nan", "NULL", an empty cell or 0 0 0, whichever was chosen at export.
"""

from __future__ import annotations

from array import array
from pathlib import Path

import numpy as np

from core.recording import Recording
from core.takes.formats.assemble import assemble, check_size
from core.takes.formats.axes import Z_UP
from core.takes.formats.text import TextLines

START = "NO_OF_FRAMES"
MILLIMETRES = 0.001
_MAX_HEADER = 1000  # a header has ten lines, and one per event
_MAX_LEADING = 4


def read(path: Path) -> Recording:
    """Raises FormatError."""
    lines = TextLines(path, decimal_commas=True)
    rate_hz = float("nan")
    labels: list[str] = []
    titles: list[str] = []
    row: list[str] = []
    rows = iter(lines)
    for line in rows:
        cells = line.split("\t")
        key = cells[0].strip().upper()
        if key == "FREQUENCY":
            rate_hz = lines.number_at(cells[1] if len(cells) > 1 else "", 2)
        elif key == "MARKER_NAMES":
            labels = _trimmed(cells[1:])
        elif key == "BODY_NAMES":
            raise lines.error("names rigid bodies: this is a 6D export.", "Export 3D data instead.")
        elif _is_row(cells):
            row = cells
            break
        elif key == "FRAME":
            titles = _trimmed(cells)
        elif lines.number > _MAX_HEADER:
            raise lines.error("is still no row of numbers.", "Export it again as TSV with 3D data.")
    if not labels:
        if row:
            raise lines.error("holds numbers, but no MARKER_NAMES came before it.", "Export it again with its header.")
        raise lines.ended("the line MARKER_NAMES with its markers")
    n_leading = len(titles or row) - 3 * len(labels) if titles or row else 0
    if not 0 <= n_leading <= _MAX_LEADING:
        raise lines.error(
            f"has {len(row)} columns, which do not fit the {len(labels)} MARKER_NAMES.",
            "Export it again with frame and time, or neither.",
        )
    width = n_leading + 3 * len(labels)
    n_counted = min(n_leading, 2)  # frame and time; a time code after them is not read
    columns = [*range(n_counted), *range(n_leading, width)]
    values = array("d")
    while row:
        if len(row) == width + 1 and not row[-1].strip():
            row.pop()
        if len(row) != width:
            raise lines.error(
                f"has {len(row)} columns instead of {width}.", "The file is damaged or cut off; export it again."
            )
        values.extend(lines.numbers(row, columns))
        row = next((line.split("\t") for line in rows if line.strip()), [])
    table = np.frombuffer(values, dtype=np.float64).reshape(-1, n_counted + 3 * len(labels))
    check_size(lines.name, len(table), len(labels))
    points = table[:, n_counted:].reshape(len(table), len(labels), 3) * MILLIMETRES
    return assemble(
        lines.name,
        rate_hz,
        points,
        labels,
        table[:, 0] if n_counted else None,
        table[:, 1] if n_counted == 2 else None,
        display_name=path.stem,
        to_y_up=Z_UP,
    )


def _is_row(cells: list[str]) -> bool:
    """Whether a line of the file's start is the first row of numbers."""
    try:
        float(cells[0].replace(",", "."))
    except ValueError:
        return not cells[0].strip() and len(cells) > 3
    return True


def _trimmed(cells: list[str]) -> list[str]:
    """Without empty cells at the end."""
    while cells and not cells[-1].strip():
        cells = cells[:-1]
    return cells
