"""The table of what was tried and what became of it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from tests.faults.fault import Fault, Outcome

BEGIN, END = "<!-- written by make faults -->", "<!-- end of what make faults writes -->"


@dataclass(frozen=True)
class Row:
    """One fault and its outcome. not_tried: why it was not tried here, "" if it was."""

    fault: Fault
    outcome: Outcome
    not_tried: str = ""

    @property
    def survived(self) -> bool:
        """Whether nothing was wrong with any try."""
        return bool(self.not_tried) or (not self.outcome.broken and self.outcome.survived == self.outcome.tried)


def markdown(rows: Iterable[Row]) -> str:
    """One line for each fault."""
    lines = ["| what happens | tried | survived | lost | what you are told |", "| --- | --- | --- | --- | --- |"]
    for row in rows:
        if row.not_tried:
            lines.append(f"| {row.fault.what} | 0 | | | not tried here: {_cell(row.not_tried)} |")
            continue
        outcome = row.outcome
        said = outcome.said or "nothing"
        if outcome.broken:
            said += f" Not as it should be: {outcome.broken[0]}"
        lines.append(
            f"| {row.fault.what} | {outcome.tried:,} | {outcome.survived:,} | {_cell(outcome.lost)} | {_cell(said)} |"
        )
    return "\n".join(lines) + "\n"


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "/")


def write_into(document: Path, table: str) -> None:
    """Replaces what stands between the two marks. Raises ValueError where there are none."""
    text = document.read_text(encoding="utf-8")
    head, begin, rest = text.partition(BEGIN)
    _, end, tail = rest.partition(END)
    if not (begin and end):
        raise ValueError(f"{document} has no place for the table ({BEGIN} ... {END}).")
    document.write_text(f"{head}{BEGIN}\n{table}{END}{tail}", encoding="utf-8", newline="\n")
