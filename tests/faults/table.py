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


HEAD = ["| what happens | tried | survived | lost | what you are told |", "| --- | --- | --- | --- | --- |"]


def markdown(rows: Iterable[Row]) -> str:
    """One line for each fault."""
    return "\n".join([*HEAD, *map(_line, rows)]) + "\n"


def _line(row: Row) -> str:
    if row.not_tried:
        return f"| {row.fault.what} | 0 | | | not tried here: {_cell(row.not_tried)} |"
    outcome = row.outcome
    said = outcome.said or "nothing"
    if outcome.broken:
        said += f" Not as it should be: {outcome.broken[0]}"
    return f"| {row.fault.what} | {outcome.tried:,} | {outcome.survived:,} | {_cell(outcome.lost)} | {_cell(said)} |"


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "/")


def write_into(document: Path, rows: Iterable[Row], order: Iterable[str]) -> None:
    """Renews these lines of the table between the two marks; the others stay. order: what happens, of every fault
    there is. Raises ValueError where there are no marks."""
    text = document.read_text(encoding="utf-8")
    head, begin, rest = text.partition(BEGIN)
    table, end, tail = rest.partition(END)
    if not (begin and end):
        raise ValueError(f"{document} has no place for the table ({BEGIN} ... {END}).")
    lines = {line.split("|")[1].strip(): line for line in table.strip().splitlines()[len(HEAD) :]}
    lines |= {row.fault.what: _line(row) for row in rows if not row.not_tried}
    table = "\n".join([*HEAD, *(lines[what] for what in order if what in lines)])
    document.write_text(f"{head}{BEGIN}\n{table}\n{END}{tail}", encoding="utf-8", newline="\n")
