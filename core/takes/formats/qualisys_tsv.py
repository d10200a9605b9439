"""Qualisys Track Manager, "Export to TSV": labelled 3D markers, of export version 2 and before.

A header of keys and values in any order, perhaps one line of column titles, then a row per frame, with or without the
frame number and the time. Millimetres; Qualisys worlds are Z up by convention and turned to Y up here (the file does
not say; x stays, z becomes y). FREQUENCY is EXT with an edge-triggered external timebase: then the times tell the rate.
Source: the QTM manual, "Motion data (.tsv)".
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import chain
from math import isnan, nan
from pathlib import Path

from core.recording import Recording
from core.takes.formats.assemble import assemble, check_size
from core.takes.formats.axes import Z_UP
from core.takes.formats.clock import compared
from core.takes.formats.moment import moment
from core.takes.formats.text import NO_VALUE, TextLines, filled, number, read_table

KEYS = frozenset(
    {
        "FILE_VERSION", "NO_OF_FRAMES", "NO_OF_CAMERAS", "NO_OF_MARKERS", "NO_OF_BODIES", "FREQUENCY", "NO_OF_ANALOG",
        "ANALOG_FREQUENCY", "DESCRIPTION", "TIME_STAMP", "DATA_INCLUDED", "EVENT", "MARKER_NAMES", "BODY_NAMES",
        "TRAJECTORY_TYPES",
    }
)  # fmt: skip
EXTERNAL = "EXT"
MILLIMETRES = 0.001
_MAX_HEADER = 1000  # a header has ten lines, and one per event
_MAX_LEADING = 4
_SPREADSHEET = (";", ",")  # what a spreadsheet may have put in place of tabs
_MAX_BEFORE = 10


def recognises(text: str) -> bool:
    """Whether a file starts with one of the keys, or has several where it starts; with tabs between columns, or with
    what a spreadsheet put there.
    """
    lines = [line for line in text.splitlines() if line.strip()][:_MAX_BEFORE]
    keys = [_key(line, "\t") for line in lines]
    if (keys and keys[0]) or sum(map(bool, keys)) > 1:
        return True
    for delimiter in _SPREADSHEET:
        keys = [key for line in lines if (key := _key(line, delimiter))]
        if len(keys) > 1 and any("_" in key for key in keys):  # other files have a line DESCRIPTION or FREQUENCY, too
            return True
    return False


def read(path: Path) -> Recording:
    """Raises FormatError."""
    lines = TextLines(path, decimal_commas=True)
    rate_hz = promised = promised_markers = nan
    named: list[str] = []
    titles: list[str] = []
    row: list[str] = []
    recorded = None
    rows = _rows(lines)
    for cells in rows:
        key = cells[0].strip().upper()
        value = cells[1].strip() if len(cells) > 1 else ""
        if key == "FREQUENCY":
            rate_hz = nan if value.upper() == EXTERNAL else lines.number_at(value, 2)
        elif key == "TIME_STAMP":
            recorded = moment(value)
        elif key == "NO_OF_FRAMES":
            promised = number(value)
        elif key == "NO_OF_MARKERS":
            promised_markers = number(value)
        elif key == "MARKER_NAMES":
            named = _trimmed(cells[1:])
        elif key == "BODY_NAMES":
            raise lines.error("names rigid bodies: this is a 6D export.", "Export 3D data instead.")
        elif key in KEYS:
            continue
        elif _is_row(cells):
            row = cells
            break
        elif key == "FRAME":
            titles = _trimmed(cells)
        elif lines.number > _MAX_HEADER:
            raise lines.error("is still no row of numbers.", "Export it again as TSV with 3D data.")
    if not named:
        if row:
            raise lines.error("holds numbers, but no MARKER_NAMES came before it.", "Export it again with its header.")
        raise lines.ended("the line MARKER_NAMES with its markers")
    if titles and row and lines.has_decimal_commas(row, len(titles)):
        raise lines.decimal_commas_between_commas(len(row), len(titles))
    labels, n_leading = _fitting(lines, named, titles or row)
    width = n_leading + 3 * len(labels)
    n_counted = min(n_leading, 2)  # frame and time; a time code after them is not read
    columns = [*range(n_counted), *range(n_leading, width)]
    values = read_table(
        lines, chain([row] if row else [], rows), width, columns, promised, counted=n_counted > 0
    ).values
    lines.compare_count(promised_markers, len(labels), "markers")
    check_size(lines.name, len(values), len(labels))
    points = values[:, n_counted:].reshape(len(values), len(labels), 3) * MILLIMETRES
    numbers = values[:, 0] if n_counted else None
    times_s = values[:, 1] if n_counted == 2 else None
    rate_hz, times_s = compared(lines, rate_hz, numbers, times_s)
    recording = assemble(
        lines.name,
        rate_hz,
        points,
        labels,
        numbers,
        times_s,
        display_name=path.stem,
        to_y_up=Z_UP,
        warnings=lines.warnings,
    )
    return replace(recording, recorded=recorded)


def _key(line: str, delimiter: str) -> str:
    """The key that a line starts with, "" if none."""
    cells = line.split(delimiter)
    key = cells[0].strip(' "').upper()
    return key if len(cells) > 1 and key in KEYS else ""


def _rows(lines: TextLines) -> Iterator[list[str]]:
    """The cells of each line; what separates them is told by the first key."""
    delimiter = ""
    for line in lines:
        if not line.strip(" "):
            continue
        if not delimiter:
            delimiter = next((each for each in ("\t", *_SPREADSHEET) if _key(line, each)), "")
            lines.decimal_commas = delimiter != ","
        yield lines.split(line, delimiter) if delimiter in _SPREADSHEET else line.split("\t")


def _fitting(lines: TextLines, named: list[str], row: list[str]) -> tuple[list[str], int]:
    """Those names that fit a row of 3 columns each, and how many columns come before them."""
    for labels in (named, filled(named)):
        n_leading = len(row) - 3 * len(labels) if row else 0
        if 0 <= n_leading <= _MAX_LEADING:
            return labels, n_leading
    width = 3 * len(filled(named)) + 2
    if lines.has_decimal_commas(row, width):
        raise lines.decimal_commas_between_commas(len(row), width)
    raise lines.error(
        f"has {len(row)} columns, which do not fit the {len(named)} MARKER_NAMES.",
        "Export it again with frame and time, or neither.",
    )


def _is_row(cells: list[str]) -> bool:
    """Whether a line of the file's start is the first row of numbers."""
    first = cells[0].strip()
    return not isnan(number(first)) or (len(cells) > 3 and first.lower() in NO_VALUE)


def _trimmed(cells: list[str]) -> list[str]:
    """Without empty cells at the end."""
    while cells and not cells[-1].strip():
        cells = cells[:-1]
    return cells
