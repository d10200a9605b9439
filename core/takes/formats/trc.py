"""TRC: labelled markers of Motion Analysis, OpenSim, Motive and others, separated by tabs.

"PathFileType", field names, field values, marker names, axes, then a row per frame. Programs lay them out in many ways
(a name per one, two or three columns, or a cell late; values padded with empty cells; rows in spaces; no line of axes):
fields are found by name, and whatever names there are must fit the rows, 3 columns each after frame and time. The
format does not say which axis is up; it is read as it stands. The header's counts are not trusted: markers are those
named, frames those present. Joint centres that Phalanx wrote beside its markers are none (computed.py).
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain
from math import isnan
from pathlib import Path

from core.recording import Recording
from core.takes.formats.assemble import assemble, check_size
from core.takes.formats.clock import compared
from core.takes.formats.computed import computed_labels
from core.takes.formats.text import METRES, TextLines, filled, number, read_table

START = "PathFileType"
FIELDS = frozenset(
    {
        "datarate", "camerarate", "numframes", "nummarkers", "units", "origdatarate", "origdatastartframe",
        "orignumframes",
    }
)  # fmt: skip
_FRAME = ("frame#", "frame")
_KNOWN_FIELDS = 2  # so many make a line of field names, where the line before it is missing
_ROW_CELLS = 4  # at least frame, time and a point
_MAX_BEFORE = 10  # lines that some other program wrote above


def recognises(text: str) -> bool:
    """Whether a file starts as TRC does: with any of its header's lines."""
    for line in [line for line in text.splitlines() if line.strip()][:_MAX_BEFORE]:
        if line.lstrip().lower().startswith(START.lower()):
            return True
        if len(FIELDS.intersection(cell.lower() for cell in _cells(line))) >= _KNOWN_FIELDS:
            return True
    return False


def read(path: Path) -> Recording:
    """Its markers. Raises FormatError."""
    return _read(path, markers_only=True)


def read_all(path: Path) -> Recording:
    """Every point of it, with the joint centres and fingertips of our own exports. Raises FormatError."""
    return _read(path, markers_only=False)


def _read(path: Path, markers_only: bool) -> Recording:
    lines = TextLines(path, decimal_commas=True)
    rows = (line for line in lines if line.strip())
    fields, labels = _header(lines, rows)
    width = 2 + 3 * len(labels)
    first = next(rows, "")
    if all(isnan(number(cell)) for cell in _cells(first)):
        first = next(rows, "")  # that was the line of axes
    table = read_table(
        lines,
        (_row(lines, line, width) for line in chain([first], rows)),
        width,
        promised=number(fields.get("numframes", "")),
    )
    n_promised = number(fields.get("nummarkers", ""))
    if len(table.values) and table.widest < width and n_promised != len(labels):
        raise lines.error(
            f"and those before it have {table.widest} columns where {len(labels)} names in the header need {width}.",
            "Separate columns and names with tabs.",
        )
    lines.compare_count(n_promised, len(labels), "markers")
    values = table.values
    check_size(lines.name, len(values), len(labels))
    points = values[:, 2:].reshape(len(values), len(labels), 3) * lines.metres(fields["units"])
    computed = computed_labels(labels) if markers_only else frozenset()
    if computed:
        kept = [i for i, label in enumerate(labels) if label not in computed]
        points, labels = points[:, kept], [labels[i] for i in kept]
    rate_hz, times_s = compared(lines, number(fields.get("datarate", "")), values[:, 0], values[:, 1])
    return assemble(
        lines.name,
        rate_hz,
        points,
        labels,
        values[:, 0],
        times_s,
        display_name=path.stem,
        warnings=lines.warnings,
    )


def _header(lines: TextLines, rows: Iterator[str]) -> tuple[dict[str, str], list[str]]:
    """The fields by their names in lower case, with a usable unit, and the markers' names."""
    fields: dict[str, str] = {}
    for line in rows:
        cells = _cells(line)
        first = cells[0].replace(" ", "").lower()
        _check_tabs(lines, line)
        if first.startswith(START.lower()):
            continue
        if FIELDS.intersection(cell.lower() for cell in cells):
            values = next(rows, None)
            if values is None:
                raise lines.ended("the field values")
            fields = _fields(lines, cells, _cells(values))
        elif first not in _FRAME and not fields and lines.number <= _MAX_BEFORE:
            continue
        elif first not in _FRAME:
            raise lines.error(f"starts with {cells[0][:40]!r} where the marker names start with 'Frame#'.")
        elif not fields:
            raise lines.error("names markers, but no line of fields with Units came before it.")
        else:
            return fields, _labels(lines, cells)
    raise lines.ended("the marker names" if fields else "the field names")


def _check_tabs(lines: TextLines, line: str, is_row: bool = False) -> None:
    """Raises FormatError where a line of the header or a row is separated by something else."""
    for delimiter, word in ((",", "commas"), (";", "semicolons")):
        cells = [cell.strip().replace(" ", "").lower() for cell in line.split(delimiter)]
        is_header = len(FIELDS.intersection(cells)) >= _KNOWN_FIELDS or (cells[0] in _FRAME and len(cells) > 1)
        if is_header or (is_row and len(cells) > _ROW_CELLS):
            raise lines.error(
                f"separates its columns with {word}; TRC has tabs.", "Export it again, or save it with tabs."
            )


def _fields(lines: TextLines, names: list[str], values: list[str]) -> dict[str, str]:
    """The values of fields, by place; by their order where each field has one, or only then the unit is one, since
    empty cells may stand between.
    """
    by_place = {name.lower(): value for name, value in zip(names, values, strict=False)}
    by_order = {name.lower(): value for name, value in zip(filled(names), filled(values), strict=False)}
    all_given = len(filled(names)) == len(filled(values))
    is_padded = by_place.get("units", "").lower() not in METRES and by_order.get("units", "").lower() in METRES
    fields = by_order if all_given or is_padded else by_place
    if not fields.get("units"):
        raise lines.error("gives no value for Units.", "Export it again, in mm or m.")
    lines.metres(fields["units"])
    if "datarate" in fields:
        lines.number_at(fields["datarate"], [name.lower() for name in names].index("datarate") + 1)
    return fields


def _labels(lines: TextLines, cells: list[str]) -> list[str]:
    """The names by place where one stands over each three columns, since one may be empty; else by their order."""
    cells = cells[2:]
    while cells and not cells[-1]:
        cells.pop()
    if not cells:
        raise lines.error("names no markers.", "Export it again with its labelled markers.")
    by_place = cells[0] and not any(cell for i, cell in enumerate(cells) if i % 3)
    return cells[::3] if by_place else filled(cells)


def _cells(line: str) -> list[str]:
    """Of a line of the header."""
    return [cell.strip() for cell in line.split("\t")] if "\t" in line.strip() else (line.split() or [""])


def _row(lines: TextLines, line: str, width: int) -> list[str]:
    cells = line.split("\t")
    if len(cells) < width and len(spaced := line.split()) == width:
        return spaced
    if len(cells) == 1:
        _check_tabs(lines, line, is_row=True)
    return cells
