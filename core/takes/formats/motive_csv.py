"""Motive's CSV export (format versions 1.2x): labelled and unlabelled markers.

The first line holds keys and values. Then rows tell for each column its type, name and ID (newer versions: and
parent), the quantity, and the axis; then comes a row per frame. Units from the header; Motive's world is Y up.
Motive writes each rigid body's and bone's markers twice: as solved ("Rigid Body Marker", "Bone Marker") and as
measured ("Marker"). Measured ones are read, solved ones only where the same marker has no measured column.
Motive writes the name and notes of a take as they are: commas, quotes and line breaks in them may be anywhere.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import chain, pairwise
from pathlib import Path

from core.errors import FormatError
from core.recording import Recording
from core.takes.formats.assemble import assemble, check_size
from core.takes.formats.clock import compared
from core.takes.formats.moment import moment
from core.takes.formats.text import TextLines, number, read_table

START = "Format Version,"
KEYS = frozenset(
    {
        "Format Version", "Take Name", "Take Notes", "Capture Frame Rate", "Export Frame Rate", "Capture Start Time",
        "Capture Start Frame", "Total Frames in Take", "Total Exported Frames", "Rotation Type", "Length Units",
        "Coordinate Space",
    }
)  # fmt: skip
MEASURED = "marker"
SOLVED = ("rigid body marker", "bone marker")
_MAX_HEADER = 1000  # notes may have many lines
_MAX_CELLS = 100_000


def recognises(text: str) -> bool:
    """Whether a file starts with any of the keys, or with the row of types."""
    first = next((line for line in text.splitlines() if line.strip()), "")
    cells = [cell.strip(' "') for cell in first.split(",")]
    return not KEYS.isdisjoint(cells) or cells[:2] == ["", "Type"]


def read(path: Path) -> Recording:
    """Raises FormatError."""
    lines = TextLines(path)
    text = iter(lines)
    header, first = _header(text)
    if "Length Units" not in header:
        raise FormatError(f"{lines.name} gives no Length Units in its first line.", "Export it again with its header.")
    metres = lines.metres(header["Length Units"])
    rate_hz = lines.number_at(header.get("Export Frame Rate") or header.get("Capture Frame Rate") or "", 2)
    rows = (lines.split(line, ",") for line in chain([first], text) if line.strip())
    types, names, axes = _column_rows(lines, rows)
    columns, labels = _markers(types, names, axes)
    if not labels:
        raise lines.error("ends a header without markers.", "Export it again with Markers switched on.")
    promised = number(header.get("Total Exported Frames", ""))
    table = read_table(lines, rows, len(axes), columns, promised, lacking=1).values
    check_size(lines.name, len(table), len(labels))
    points = table[:, 2:].reshape(len(table), len(labels), 3) * metres
    rate_hz, times_s = compared(lines, rate_hz, table[:, 0], table[:, 1])
    recording = assemble(
        lines.name,
        rate_hz,
        points,
        labels,
        table[:, 0],
        times_s,
        display_name=path.stem,
        warnings=lines.warnings,
    )
    return replace(recording, recorded=moment(header.get("Capture Start Time", "")))


def _header(text: Iterator[str]) -> tuple[dict[str, str], str]:
    """The keys with the value after each, and the first line after them."""
    cells: list[str] = []
    last = ""
    for i, line in enumerate(text):
        if line.lower().startswith((",type,", "frame,", ",name,")) or i > _MAX_HEADER or len(cells) > _MAX_CELLS:
            last = line
            break
        cells += [cell.strip(' "') for cell in line.split(",")]
    return {key: value for key, value in pairwise(cells) if key in KEYS}, last


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
