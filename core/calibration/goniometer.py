"""Joint angles that were read off a hand, as a CSV file: `angle,degrees`, or a column for each hand.

Names are those of angles.csv. What is not named was held at 0. An empty cell, where hands have columns of their own,
gives nothing of that hand: it counts as 0, which is to be said.
"""

from __future__ import annotations

import csv
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from io import StringIO
from pathlib import Path

import numpy as np

from core.errors import FormatError
from core.frames import SIDES, FloatArray, Side
from core.hand.skeleton import DIGIT_DOF_NAMES, ROOT_DOF_NAMES
from core.untrusted.files import read_text

LARGEST_DEG = 150.0
"""No joint of a hand goes further."""

_RADIANS = 3.2
"""Readings that are none larger, and are no whole numbers, may be radians."""

_SEPARATORS = {";": "semicolons", "\t": "tabs"}
_BOTH = "degrees"
_OF_SIDE: dict[str, Side] = {f"{side}_degrees": side for side in SIDES}
_LARGEST_BYTES = 1 << 16
_FORM = "Begin it with the line angle,degrees or angle,left_degrees,right_degrees; each line below names one angle."


@dataclass(frozen=True)
class ReadAngles:
    """At what the angles of each hand were held.

    angles_rad: (20,) float64 [rad] of each hand, 0 where nothing is given. given: how many angles of each. empty: of
    each hand, the angles whose row has no value for it. source: the file, None where there is none: all were held at
    0. warnings: what to look into, in sentences.
    """

    angles_rad: Mapping[Side, FloatArray]
    given: Mapping[Side, int]
    empty: Mapping[Side, tuple[str, ...]]
    source: Path | None = None
    warnings: tuple[str, ...] = ()

    def check(self, sides: Iterable[Side]) -> None:
        """Raises FormatError where a file gives no angle of one of these hands."""
        for side in sides if self.source is not None else ():
            if self.given[side]:
                continue
            others = [other for other in SIDES if self.given[other]]
            whose = f", only of the {others[0]} one" if others else ""
            alone = f", or set the zeros of the {others[0]} one alone with --side {others[0]}" if others else ""
            raise FormatError(
                f"{self.source} gives no angle of the {side} hand, which was tracked{whose}. No zero was set.",
                f"Give its angles in a column {side}_degrees{alone}.",
            )


def read_angles(path: Path | None) -> ReadAngles:
    """What a file gives; all 0 without one. Raises FormatError naming file, line and value."""
    angles_rad: dict[Side, FloatArray] = {side: np.zeros(len(DIGIT_DOF_NAMES)) for side in SIDES}
    given: dict[Side, int] = dict.fromkeys(SIDES, 0)
    empty: dict[Side, list[str]] = {side: [] for side in SIDES}
    if path is None:
        return ReadAngles(angles_rad, given, dict.fromkeys(SIDES, ()))
    rows = csv.reader(StringIO(_text(path), newline=""))
    header = [cell.strip().lower() for cell in next(rows, [])]
    columns = header[1:]
    if header[:1] != ["angle"] or sorted(columns) not in ([_BOTH], *([c] for c in _OF_SIDE), sorted(_OF_SIDE)):
        _check_separator(header, f"{path}, line 1")
        first = ", ".join(header)[:60]
        raise FormatError(f"{path}: its first line is {first or 'empty'}.", f"{_FORM} Units are degrees.")
    named: set[str] = set()
    values: list[float] = []
    for number, row in enumerate(rows, start=2):
        cells = [cell.strip() for cell in row]
        if not any(cells):
            continue
        where = f"{path}, line {number}"
        if len(cells) != len(header):
            _check_separator(cells, where)
            raise FormatError(f"{where}: {len(cells)} cells where the first line has {len(header)}.", _FORM)
        k = _index(cells[0], where)
        if cells[0] in named:
            raise FormatError(f"{where}: {cells[0]} comes twice.", "Name each angle once.")
        named.add(cells[0])
        for column, cell in zip(columns, cells[1:], strict=True):
            if not cell and column != _BOTH:
                empty[_OF_SIDE[column]].append(cells[0])
                continue
            degrees = _degrees(cell, f"{where}, {column}")
            values.append(degrees)
            for side in SIDES if column == _BOTH else (_OF_SIDE[column],):
                angles_rad[side][k] = np.radians(degrees)
                given[side] += 1
    if not values:
        raise FormatError(f"{path} names no angle." if not named else f"{path} gives no value.", _FORM)
    return ReadAngles(angles_rad, given, {side: tuple(names) for side, names in empty.items()}, path, _doubts(values))


def _doubts(values: Iterable[float]) -> tuple[str, ...]:
    size = np.abs(np.array(list(values)))
    if size.max() > _RADIANS or not (size % 1.0).any():
        return ()
    return (f"No angle is larger than {size.max():g}: are these radians? They were read as degrees.",)


def _check_separator(cells: Iterable[str], where: str) -> None:
    text = ",".join(cells)
    for separator, name in _SEPARATORS.items():
        if separator in text:
            raise FormatError(
                f"{where}: its cells are separated by {name} ({text[:60]!r}).",
                "Separate them by commas, and write decimals with a point.",
            )


def _text(path: Path) -> str:
    try:
        return read_text(path, _LARGEST_BYTES)
    except OSError as error:
        raise FormatError(f"{path} cannot be read ({error.strerror or error}).", _FORM) from error


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
