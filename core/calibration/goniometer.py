"""Joint angles that were read off a hand, as a CSV file: `angle,degrees`, or a column for each hand.

Names are those of angles.csv. What is not named, and an empty cell where hands have columns of their own, was held
at 0.
"""

from __future__ import annotations

import csv
from difflib import get_close_matches
from io import StringIO
from pathlib import Path

import numpy as np

from core.errors import FormatError
from core.frames import SIDES, FloatArray, Side
from core.hand.skeleton import DIGIT_DOF_NAMES, ROOT_DOF_NAMES

LARGEST_DEG = 150.0
"""No joint of a hand goes further."""

_BOTH = "degrees"
_OF_SIDE: dict[str, Side] = {f"{side}_degrees": side for side in SIDES}
_LARGEST_BYTES = 1 << 16
_FORM = "Begin it with the line angle,degrees or angle,left_degrees,right_degrees; each line below names one angle."


def read_angles(path: Path | None) -> dict[Side, FloatArray]:
    """(20,) float64 [rad] of each hand; all 0 without a file. Raises FormatError naming file, line and value."""
    angles_rad: dict[Side, FloatArray] = {side: np.zeros(len(DIGIT_DOF_NAMES)) for side in SIDES}
    if path is None:
        return angles_rad
    rows = csv.reader(StringIO(_text(path), newline=""))
    header = [cell.strip().lower() for cell in next(rows, [])]
    columns = header[1:]
    if header[:1] != ["angle"] or sorted(columns) not in ([_BOTH], *([c] for c in _OF_SIDE), sorted(_OF_SIDE)):
        first = ", ".join(header)[:60]
        raise FormatError(f"{path}: its first line is {first or 'empty'}.", f"{_FORM} Units are degrees.")
    named: set[str] = set()
    for number, row in enumerate(rows, start=2):
        cells = [cell.strip() for cell in row]
        if not any(cells):
            continue
        where = f"{path}, line {number}"
        if len(cells) != len(header):
            raise FormatError(f"{where}: {len(cells)} cells where the first line has {len(header)}.", _FORM)
        k = _index(cells[0], where)
        if cells[0] in named:
            raise FormatError(f"{where}: {cells[0]} comes twice.", "Name each angle once.")
        named.add(cells[0])
        for column, cell in zip(columns, cells[1:], strict=True):
            if not cell and column != _BOTH:
                continue
            degrees = _degrees(cell, f"{where}, {column}")
            for side in SIDES if column == _BOTH else (_OF_SIDE[column],):
                angles_rad[side][k] = np.radians(degrees)
    if not named:
        raise FormatError(f"{path} names no angle.", _FORM)
    return angles_rad


def _text(path: Path) -> str:
    try:
        if path.stat().st_size > _LARGEST_BYTES:
            raise FormatError(f"{path} is larger than {_LARGEST_BYTES // 1024} kB: no file of angles.", _FORM)
        return path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise FormatError(f"{path} cannot be read ({getattr(error, 'strerror', None) or error}).", _FORM) from error


def _index(name: str, where: str) -> int:
    if name in DIGIT_DOF_NAMES:
        return DIGIT_DOF_NAMES.index(name)
    if name in ROOT_DOF_NAMES:
        raise FormatError(f"{where}: {name} has no zero.", "Name angles of digits only.")
    near = get_close_matches(name.lower().replace(" ", "_"), DIGIT_DOF_NAMES, 1)
    hint = f"Is it {near[0]}?" if near else "Names are those of angles.csv, such as index_pip_flexion."
    raise FormatError(f"{where}: there is no angle {name!r}.", hint)


def _degrees(text: str, where: str) -> float:
    try:
        value = float(text)
    except ValueError:
        raise FormatError(f"{where}: {text!r} is no number.", "Write degrees with a decimal point.") from None
    if not abs(value) <= LARGEST_DEG:
        raise FormatError(
            f"{where}: {text} degrees.", f"No joint goes beyond {LARGEST_DEG:.0f}; flexion counts from the flat hand."
        )
    return value
