"""Motive's CSV export (format versions 1.2x): labelled and unlabelled markers.

The first line holds keys and values. Then rows tell for each column its type, name and ID (newer versions: and
parent), the quantity, and the axis; then comes a row per frame. Units from the header; Motive's world is Y up.
Motive writes each rigid body's and bone's markers twice: as solved ("Rigid Body Marker", "Bone Marker") and as
measured ("Marker"). Measured ones are read, solved ones only where the same marker has no measured column.
"""

from __future__ import annotations

import csv
from array import array
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from core.recording import Recording
from core.takes.formats.assemble import assemble, check_size
from core.takes.formats.text import TextLines

START = "Format Version,"
MEASURED = "marker"
SOLVED = ("rigid body marker", "bone marker")
_MAX_HEADER = 20


def read(path: Path) -> Recording:
    """Raises FormatError."""
    lines = TextLines(path)
    rows = _cells(lines)
    first = next(rows, [])
    header = dict(zip(first[::2], first[1::2], strict=False))
    if "Length Units" not in header:
        raise lines.error("gives no Length Units.", "Export it again with its header.")
    metres = lines.metres(header["Length Units"])
    rate_hz = lines.number_at(header.get("Export Frame Rate") or header.get("Capture Frame Rate") or "", 2)
    types, names, axes = _column_rows(lines, rows)
    columns, labels = _markers(types, names, axes)
    if not labels:
        raise lines.error("ends a header without markers.", "Export it again with Markers switched on.")
    values = array("d")
    for cells in rows:
        if not cells:
            continue
        if len(cells) < len(axes) and (not lines.complete or len(cells) < 2):
            raise lines.error(
                f"has {len(cells)} columns instead of {len(axes)}.", "The file is cut off; export it again."
            )
        cells += [""] * (len(axes) - len(cells))
        values.extend(lines.numbers(cells, columns))
    table = np.frombuffer(values, dtype=np.float64).reshape(-1, 2 + 3 * len(labels))
    check_size(lines.name, len(table), len(labels))
    points = table[:, 2:].reshape(len(table), len(labels), 3) * metres
    return assemble(lines.name, rate_hz, points, labels, table[:, 0], table[:, 1], display_name=path.stem)


def _cells(lines: TextLines) -> Iterator[list[str]]:
    for line in lines:
        if '"' in line:
            try:
                yield next(csv.reader([line], strict=True))
            except csv.Error as error:
                raise lines.error(f"has broken quotes ({error}).") from error
        else:
            yield line.split(",") if line.strip() else []


def _column_rows(lines: TextLines, rows: Iterator[list[str]]) -> tuple[list[str], list[str], list[str]]:
    """Type and name of each column and its axis, read up to the line of axes."""
    types: list[str] = []
    names: list[str] = []
    for cells in rows:
        titled = cells[1].strip().lower() if len(cells) > 1 else ""
        if cells and cells[0].strip().lower() == "frame":
            if not types or not names:
                raise lines.error("comes before the rows of types and names.", "Export it again with its header.")
            return types, names, cells
        if titled == "type":
            types = [cell.strip().lower() for cell in cells]
        elif titled == "name":
            names = cells
        if lines.number > _MAX_HEADER:
            raise lines.error("is still header, without a line that starts with Frame.")
    raise lines.ended("the line of axes that starts with Frame")


def _markers(types: list[str], names: list[str], axes: list[str]) -> tuple[list[int], list[str]]:
    """Columns of frame, time and each marker's x, y, z, and the markers' names."""
    found: dict[str, list[tuple[int, str]]] = {MEASURED: [], SOLVED[0]: [], SOLVED[1]: []}
    end = min(len(types), len(names), len(axes)) - 2
    column = 2
    while column < end:
        is_marker = types[column] in found and [cell.strip().upper() for cell in axes[column : column + 3]] == list(
            "XYZ"
        )
        if is_marker and names[column] == names[column + 2]:
            found[types[column]].append((column, names[column].strip()))
        column += 3 if is_marker else 1
    measured = {name for _, name in found[MEASURED]}
    kept = found[MEASURED] + [each for kind in SOLVED for each in found[kind] if each[1] not in measured]
    kept.sort()
    return [0, 1, *(column + i for column, _ in kept for i in range(3))], [name for _, name in kept]
