"""The table of what was opened where: collected by the tests as they run."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

BEGIN, END = "<!-- written by make acceptance -->", "<!-- end of what make acceptance writes -->"
_ORDER = ("C3D", "TRC", "CSV", "BVH", "glTF")


@dataclass(frozen=True)
class Row:
    """One file of one take in one program. values: how many were compared. difference: the largest, in `unit`."""

    format: str
    program: str
    kind: str
    what: str
    values: int
    difference: float | None
    unit: str = ""


def markdown(rows: Iterable[Row], absent: Iterable[str]) -> str:
    """One line for each format, program and thing compared."""
    groups: dict[tuple[str, str, str], list[Row]] = defaultdict(list)
    for row in rows:
        groups[row.format, row.program, row.what].append(row)
    lines = [
        "| format | opened in | kinds of takes | compared | values | largest difference |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    for (name, program, what), found in sorted(groups.items(), key=lambda item: (_ORDER.index(item[0][0]), item[0])):
        values = sum(row.values for row in found)
        lines.append(
            f"| {name} | {program} | {len({row.kind for row in found})} | {what} | {values:,} | {_largest(found)} |"
        )
    lines += [f"\nNot opened, for it was not there: {name}." for name in sorted(set(absent))]
    return "\n".join(lines) + "\n"


def _largest(rows: list[Row]) -> str:
    differences = [row.difference for row in rows if row.difference is not None]
    if not differences:
        return "none"
    largest = max(differences)
    return f"{_figure(largest)} {rows[0].unit}" if largest else "none"


def _figure(value: float) -> str:
    """Two digits, rounded up: a table must not promise more than was measured."""
    step = 10.0 ** (math.floor(math.log10(value)) - 1)
    return f"{math.ceil(value / step) * step:.2g}"


def write_into(document: Path, table: str) -> None:
    """Replaces what stands between the two marks. Raises ValueError where there are none."""
    text = document.read_text(encoding="utf-8")
    head, begin, rest = text.partition(BEGIN)
    _, end, tail = rest.partition(END)
    if not (begin and end):
        raise ValueError(f"{document} has no place for the table ({BEGIN} ... {END}).")
    document.write_text(f"{head}{BEGIN}\n{table}{END}{tail}", encoding="utf-8", newline="\n")
