"""CSV with a column per axis of each marker, as NOKOV, Vicon Nexus, spreadsheets and scripts write it.

    Frame,Time,Tip-X,Tip-Y,Tip-Z,Back-X,...        or Tip.X, Tip:X, Tip_x, Tip X, Tip-X (mm), tip_x_m
    Trajectories / 100 / ,,Anna:Tip,,,Anna:Back,,  or names above, then Frame,Sub Frame,X,Y,Z,X,Y,Z, then mm,mm,mm

With or without frame and time, wherever they stand; commas, semicolons (then with decimal commas) or tabs. What the
file does not say is assumed and warned of: the unit by the size of what moves, the rate, and that Y is up. Vicon's
worlds are Z up by convention and turned to Y up.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import chain, pairwise
from math import isnan, nan
from pathlib import Path

import numpy as np

from core.errors import FormatError
from core.frames import FloatArray
from core.recording import Recording
from core.takes.formats.assemble import assemble, check_size
from core.takes.formats.axes import Z_UP
from core.takes.formats.clock import compared
from core.takes.formats.no_places import no_places
from core.takes.formats.text import METRES, TextLines, filled, number, read_table

ASSUMED_HZ = 100.0
"""Where a file tells neither a rate nor times."""

METRES_WITHIN = 2.5
"""Markers of one frame within so much of each other are in metres: in millimetres no two markers would fit, and no
performer is larger."""

TRAJECTORIES = "trajectories"
_SECTIONS = frozenset({TRAJECTORIES, "devices", "joints", "segments", "model outputs", "events"})  # of Vicon Nexus
_DELIMITERS = (",", ";", "\t")
_UNITS = "|".join(sorted(METRES, key=len, reverse=True))
_AXIS = re.compile(rf"(.*?)[\s_.:/|-]*[(\[]?([xyz])[)\]]?(?:[\s_]*[(\[]?({_UNITS})[)\]]?)?", re.IGNORECASE)
_FRAME = re.compile(r"(frame|field|sample|index|item|no|nr|#)[\s_.]*(#|number|no|nr|index|id)?\.?", re.IGNORECASE)
_TIME = re.compile(r"(time[\s_]?stamp|time|seconds|t)[\s_]*[(\[]?(s|sec|seconds|ms|us)?[)\]]?", re.IGNORECASE)
_BESIDE = re.compile(r"|sub[\s_]?frame|time[\s_]?code|smpte|unnamed.*", re.IGNORECASE)
_IN_SECONDS = frozenset({"s", "sec", "seconds"})
_SECONDS = {"ms": 1e-3, "us": 1e-6}
_RATE = re.compile(r"rate|frequency|fps", re.IGNORECASE)
_MAX_HEADER = 20
_MAX_TITLE = 200
_MOST_NAMED = 3


@dataclass(frozen=True)
class _Header:
    """columns: of each marker's x. frame, time: their columns, -1 for none. unit: "" where not given; rate_hz: NaN.
    width: columns that have titles. others: names of what has three axes and is no position."""

    delimiter: str
    width: int
    columns: list[int]
    labels: list[str]
    others: list[str]
    unit: str
    rate_hz: float
    frame: int
    time: int
    second_s: float
    is_seconds: bool
    is_vicon: bool


def recognises(text: str) -> bool:
    """Whether a file's start has a header with three columns per marker, or is one of Vicon's."""
    first = next((line for line in text.splitlines() if line.strip()), "")
    return _section(first) in _SECTIONS or _find_header(text.splitlines()) is not None


def read(path: Path) -> Recording:
    """Raises FormatError."""
    lines = TextLines(path)
    rows = (line for line in lines if line.strip(" "))
    header = _find_header(rows)
    if header is None:
        raise FormatError(
            f"{path.name} has no header with three columns per marker.",
            "Export trajectories, with columns such as Name-X,Name-Y,Name-Z.",
        )
    lines.decimal_commas = header.delimiter != ","
    if header.others:
        lines.warn(_said_of(header.others))
    cells = _cells(lines, _of_section(rows, header), header)
    row = next(cells, [])
    unit = header.unit
    if row and all(isnan(number(cell)) for cell in row) and filled(row):
        of_markers = [cell for column in header.columns for cell in row[column : column + 3]]
        units = {cell.lower().strip("()[]") for cell in filled(of_markers)} or {"/".join(filled(row))}
        unit = unit or (units.pop() if len(units) == 1 else "/".join(sorted(units)))
        lines.metres(unit)
        row = next(cells, [])
    time = header.time if _is_number(row, header.time) else -1
    frame = header.frame if header.frame < header.columns[0] or _is_number(row, header.frame) else -1
    counted = [column for column in (frame, time) if column >= 0]
    width = max(header.columns[-1] + 3, *(column + 1 for column in counted), 0)
    columns = [*counted, *(column + i for column in header.columns for i in range(3))]
    table = (cells[:width] for cells in chain([row], cells))
    values = read_table(lines, table, width, columns, counted=bool(counted)).values
    check_size(lines.name, len(values), len(header.labels))
    numbers = values[:, 0] if frame >= 0 else None
    times_s = values[:, len(counted) - 1] * header.second_s if time >= 0 else None
    points = values[:, len(counted) :].reshape(len(values), len(header.labels), 3)
    points = points * (lines.metres(unit) if unit else _assumed_metres(lines, points))
    rate_hz, times_s = compared(lines, header.rate_hz, numbers, times_s, header.is_seconds)
    if isnan(rate_hz) and (times_s is None or len(times_s) < 2):
        rate_hz = ASSUMED_HZ
        lines.warn(f"It tells neither its rate nor times; {rate_hz:g} Hz is assumed. A column Time would tell it.")
    if not header.is_vicon:
        lines.warn("It does not say which axis is up; Y is taken, and nothing is turned.")
    return assemble(
        lines.name,
        rate_hz,
        points,
        header.labels,
        numbers,
        times_s,
        display_name=path.stem,
        to_y_up=Z_UP if header.is_vicon else None,
        warnings=lines.warnings,
    )


def _find_header(lines: Iterable[str]) -> _Header | None:
    """Read up to the line of axes; None where there is none."""
    section, above, rate_hz, unit, n_read = "", "", nan, "", 0
    for line in lines:
        if not line.strip():
            continue
        if _section(line) in _SECTIONS:
            section, above, rate_hz = _section(line), "", nan
            continue
        if section and section != TRAJECTORIES:
            continue  # Vicon writes forces and analog channels before the trajectories, a thousand lines a second
        n_read += 1
        if n_read > _MAX_HEADER:
            return None
        for delimiter in _DELIMITERS:
            found = _columns(line.split(delimiter), above.split(delimiter))
            if found:
                columns, labels, given, others, n_before = found
                break
        else:
            rate_hz, unit = _said(line, rate_hz, unit)
            above = line
            continue
        cells = [cell.strip(' "') for cell in line.split(delimiter)]
        taken = {column + i for column in columns for i in range(3)}
        free = [(i, cell) for i, cell in enumerate(cells) if i not in taken]
        frame = next((i for i, cell in free if _FRAME.fullmatch(cell)), -1)
        time = next((i for i, cell in free if _TIME.fullmatch(cell)), -1)
        if not all(_BESIDE.fullmatch(cell) or i in (frame, time) for i, cell in enumerate(cells[:n_before])):
            return None  # a table of something else
        match = _TIME.fullmatch(cells[time]) if time >= 0 else None
        named = ((match[2] or match[1]) if match else "").lower()
        return _Header(
            delimiter,
            len(cells),
            columns,
            labels,
            others,
            given or unit,
            rate_hz,
            frame,
            time,
            _SECONDS.get(named, 1.0),
            named in _IN_SECONDS,
            bool(section),
        )
    return None


def _columns(cells: list[str], above: list[str]) -> tuple[list[int], list[str], str, list[str], int] | None:
    """The column of each marker's x, the markers' names and the unit, where cells are names of axes; then the names of
    what has axes and is no position, and how many columns stand before anything with axes."""
    parts = [_title(cell.strip(' "')) for cell in cells] if len(cells) > 2 else []
    columns, labels, units, joined = [], [], [], []
    column = 0
    while column < len(parts) - 2:
        three = parts[column : column + 3]
        is_marker = [part[1] for part in three] == ["x", "y", "z"] and len({part[0] for part in three}) == 1
        if is_marker:
            columns.append(column)
            labels.append(three[0][0])
            joined.append(cells[column].strip(' "').lower().startswith(three[0][0].lower() + "x"))
            units.append(three[0][2])
        column += 3 if is_marker else 1
    if columns and not any(labels):
        placed = [above[column].strip(' "') if column < len(above) else "" for column in columns]
        names = filled([cell.strip(' "') for cell in above])
        labels = names if len(names) == len(columns) else placed
        joined = [False] * len(labels)
    if not any(labels) or len(columns) != len(labels):
        return None
    is_none = no_places(labels, joined)
    kept = [i for i, none in enumerate(is_none) if not none]
    if not kept:
        return None
    unit = next((units[i] for i in kept if units[i]), "")
    n_before = columns[0]
    if is_none[0] and n_before and parts[n_before - 1] == ("", "", ""):
        title = cells[n_before - 1].strip(' "').lower()
        n_before -= title.startswith(labels[0].lower()) and title.endswith("w")  # of a quaternion w, x, y, z
    others = [label for label, none in zip(labels, is_none, strict=True) if none]
    return [columns[i] for i in kept], [labels[i] for i in kept], unit, others, n_before


def _said_of(others: list[str]) -> str:
    named = ", ".join(others[:_MOST_NAMED])
    more = f" and {len(others) - _MOST_NAMED} more" if len(others) > _MOST_NAMED else ""
    if len(others) == 1:
        return f"1 set of columns holds rotations, velocities or the like, no positions, and is left out: {named}."
    return (
        f"{len(others)} sets of columns hold rotations, velocities or the like, no positions, and are left out: "
        f"{named}{more}."
    )


def _cells(lines: TextLines, rows: Iterator[str], header: _Header) -> Iterator[list[str]]:
    """Of each row. Raises FormatError where decimal commas stand between commas."""
    for line in rows:
        cells = lines.split(line, header.delimiter)
        if len(cells) > header.width and lines.has_decimal_commas(cells, header.width):
            raise lines.decimal_commas_between_commas(len(cells), header.width)
        yield cells


def _title(cell: str) -> tuple[str, str, str]:
    """Name, axis and unit in the title of a column; empty where it is none."""
    match = _AXIS.fullmatch(cell) if len(cell) <= _MAX_TITLE else None
    return (match[1].strip(), match[2].lower(), (match[3] or "").lower()) if match else ("", "", "")


def _said(line: str, rate_hz: float, unit: str) -> tuple[float, str]:
    """The rate and unit that a line above the header gives."""
    cells = next((split for mark in (*_DELIMITERS, ":") if len(split := filled(line.split(mark))) > 1), [line])
    if len(cells) == 1 and not isnan(number(line)):
        return number(line), unit
    for key, value in pairwise(cells):
        if _RATE.search(key) and not isnan(number(value)):
            rate_hz = number(value)
        elif "unit" in key.lower() and value.lower() in METRES:
            unit = value.lower()
    return rate_hz, unit


def _section(line: str) -> str:
    """The only word of a line, in lower case."""
    return line.strip(' ",;\t').lower()


def _of_section(rows: Iterator[str], header: _Header) -> Iterator[str]:
    for line in rows:
        if header.is_vicon and _section(line) in _SECTIONS:
            return
        yield line


def _is_number(row: list[str], column: int) -> bool:
    return 0 <= column < len(row) and not isnan(number(row[column]))


def _assumed_metres(lines: TextLines, points: FloatArray) -> float:
    """Metres in the unit of points (t, m, 3), by how far apart the markers of a frame are."""
    seen = np.asarray(np.isfinite(points).all(axis=2) & points.any(axis=2))
    shown = np.where(seen[:, :, None], points, np.nan)[seen.sum(axis=1) > 1]
    extents = (np.nanmax(shown, axis=1) - np.nanmin(shown, axis=1)).max(axis=1)
    extent = float(np.median(extents)) if len(extents) else nan
    unit = "m" if 0.0 < extent < METRES_WITHIN else "mm"
    reason = "" if isnan(extent) else f", since the markers of a frame lie within {_plainly(extent)} of each other"
    lines.warn(f"It tells no unit of length; {unit} is assumed{reason}.")
    return METRES[unit]


def _plainly(value: float) -> str:
    return f"{value:,.0f}" if 100.0 <= value < 1e9 else f"{value:.3g}"
