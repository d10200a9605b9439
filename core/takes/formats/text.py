"""Reading text files line by line, with errors that say where."""

from __future__ import annotations

import codecs
import csv
from array import array
from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from io import TextIOWrapper
from pathlib import Path

import numpy as np

from core.errors import FormatError
from core.frames import FloatArray
from core.takes.formats import code_pages
from core.takes.formats.cut_off import Cut, last_number
from core.untrusted.files import open_file

_BOMS = ((codecs.BOM_UTF8, "utf-8-sig"), (codecs.BOM_UTF16_LE, "utf-16"), (codecs.BOM_UTF16_BE, "utf-16"))
NO_VALUE = frozenset({"", "nan", "null", "na", "n/a", "-nan", "nan(ind)", "-nan(ind)", "1.#qnan", "-1.#ind"})
"""What stands in a cell without a value, in lower case."""

MAX_LINE = 1 << 20
"""Longest line read [characters]: some 30,000 columns. No text file of motion has longer ones."""

_RECENT_ROWS = 16  # that tell how a file writes its numbers
_TOO_MANY = 1.3  # times as many cells as columns: decimal commas in a third of the numbers and more

METRES = {
    "mm": 0.001, "millimeter": 0.001, "millimeters": 0.001, "millimetre": 0.001, "millimetres": 0.001,
    "cm": 0.01, "centimeter": 0.01, "centimeters": 0.01, "centimetre": 0.01, "centimetres": 0.01,
    "dm": 0.1, "m": 1.0, "meter": 1.0, "meters": 1.0, "metre": 1.0, "metres": 1.0,
    "in": 0.0254, "inch": 0.0254, "inches": 0.0254, "ft": 0.3048, "feet": 0.3048,
}  # fmt: skip
"""Metres in a unit of length, by its name in lower case."""


def encoding_of(head: bytes) -> str:
    """The encoding a byte order mark names; UTF-8 without one."""
    return next((encoding for bom, encoding in _BOMS if head.startswith(bom)), "utf-8")


def decode_head(head: bytes) -> str:
    """The start of a file as text, whatever it holds."""
    return head.decode(encoding_of(head), errors="replace").lstrip("\ufeff")


class TextLines:
    """The lines of a text file, one after the other, and where we are in it.

    number: of the line read last, from 1. complete: it ended with a line break, so it was not cut off.
    decimal_commas: whether a number may be written 1,5 (only where commas do not separate columns).
    warnings: what was found amiss and read all the same, in sentences.
    """

    def __init__(self, path: Path, decimal_commas: bool = False) -> None:
        self.name = path.name
        self.number = 0
        self.complete = True
        self.decimal_commas = decimal_commas
        self.warnings: list[str] = []
        self._path = path
        self._page = ""

    def __iter__(self) -> Iterator[str]:
        """Each line without its line break; a name that is not UTF-8 is read in a code page, and that is warned of.

        Raises FormatError where the file cannot be read, or is none of lines.
        """
        try:
            with open_file(self._path) as probe:
                head = probe.read(MAX_LINE)
            encoding = encoding_of(head)
            is_utf8 = encoding != "utf-16"
            self._page = code_pages.of(head) if is_utf8 else ""
            errors = "surrogateescape" if is_utf8 else "replace"
            with TextIOWrapper(open_file(self._path), encoding, errors, newline=None) as stream:
                while line := stream.readline(MAX_LINE):
                    self.number += 1
                    self.complete = line.endswith("\n")
                    if len(line) == MAX_LINE and not self.complete:
                        raise self.error(f"is longer than {MAX_LINE} characters.", "This is not a motion file.")
                    yield (line if line.isascii() or not is_utf8 else self._decoded(line)).rstrip("\n")
        except OSError as error:
            raise FormatError(
                f"{self.name} cannot be read ({error.strerror or error}).", "Copy it to this machine and try again."
            ) from error

    def _decoded(self, line: str) -> str:
        raw = line.encode(errors="surrogateescape")
        if code_pages.is_utf8(raw):
            return line
        self._page = self._page or code_pages.guess(raw)
        self.warn(f"Names in it are not UTF-8; they were read in the code page {code_pages.WORDS[self._page]}.")
        return code_pages.decode(raw, self._page)

    def warn(self, sentence: str) -> None:
        """Once, however often it is found."""
        if sentence not in self.warnings:
            self.warnings.append(sentence)

    def warn_of_doubt(self, last: str) -> None:
        """That a last number without a line break may not be whole, and was kept."""
        self.warn(f"Its last line ends without a line break and may be cut off in its last number, {last.strip()}.")

    def has_decimal_commas(self, cells: Sequence[str], width: int) -> bool:
        """Whether a row of a file with commas between columns has so many cells that they must be in its numbers."""
        return not self.decimal_commas and len(filled(cells)) > _TOO_MANY * width

    def decimal_commas_between_commas(self, n_cells: int, width: int) -> FormatError:
        """An error for such a row."""
        return self.error(
            f"has {n_cells} columns instead of {width}: its numbers seem to have decimal commas, and commas separate "
            "its columns, too.",
            "Save it with points in numbers, or with semicolons between columns.",
        )

    def compare_count(self, promised: float, there: int, what: str = "frames") -> None:
        """Warns where a header promises another count (NaN: none) than is there."""
        if np.isfinite(promised) and promised != there:
            self.warn(f"Its header promises {promised:,.0f} {what}, {there:,} {'is' if there == 1 else 'are'} there.")

    def error(self, what: str, action: str = "Export it again.") -> FormatError:
        """An error at the line read last: `what` goes on after the file's name and line."""
        return FormatError(f"{self.name}, line {self.number} {what}", action)

    def ended(self, wanted: str) -> FormatError:
        """An error for a file that ends before `wanted`."""
        return FormatError(f"{self.name} ends at line {self.number}, before {wanted}.", "Export it again.")

    def numbers(self, cells: Sequence[str], columns: Sequence[int] | None = None) -> list[float]:
        """Numbers of one line, of all columns or of those given; NaN for an empty cell.

        Raises FormatError naming line, column and value.
        """
        picked = cells if columns is None else [cells[i] for i in columns]
        try:
            return list(map(float, picked))
        except ValueError:
            pass
        try:
            return [float(cell or "nan") for cell in picked]  # gaps are common, and far faster so
        except ValueError:
            places = range(len(picked)) if columns is None else columns
            return [self.number_at(text, place + 1) for text, place in zip(picked, places, strict=True)]

    def number_at(self, text: str, column: int) -> float:
        """The number in one cell; NaN if it is empty."""
        text = text.strip()
        if text.lower() in NO_VALUE:
            return float("nan")
        try:
            return float(text.replace(",", ".") if self.decimal_commas else text)
        except ValueError:
            raise self.error(
                f"column {column}: {text[:40]!r} is not a number.", "Export it again, or mend that cell."
            ) from None

    def metres(self, unit: str) -> float:
        """Metres in the unit of length named in the file."""
        try:
            return METRES[unit.strip().lower()]
        except KeyError:
            raise self.error(
                f"gives lengths in {unit.strip()[:40]!r}.", "Export in mm, cm, m, inches or feet."
            ) from None

    def split(self, line: str, delimiter: str) -> list[str]:
        """The cells of a line, which may be in quotes. Raises FormatError where a quote is left open."""
        if '"' not in line:
            return line.split(delimiter)
        try:
            return next(csv.reader([line], delimiter=delimiter, strict=True))
        except csv.Error as error:
            if not self.complete:
                return line.split(delimiter)  # the file was cut off within the quotes
            raise self.error(f"has broken quotes ({error}).") from error


def number(text: str) -> float:
    """The number in a cell of a header, with a decimal point or comma; NaN where there is none."""
    try:
        return float(text.strip().replace(",", "."))
    except ValueError:
        return float("nan")


def filled(cells: Sequence[str]) -> list[str]:
    """The cells that are not empty, without spaces around them."""
    return [text for cell in cells if (text := cell.strip())]


@dataclass(frozen=True)
class Table:
    """Rows of numbers (t, columns) float64, NaN where a cell was empty; widest: cells of the longest row."""

    values: FloatArray
    widest: int


def read_table(
    lines: TextLines,
    rows: Iterable[list[str]],
    width: int,
    columns: Sequence[int] | None = None,
    promised: float = float("nan"),
    lacking: int = 3,
    counted: bool = True,
) -> Table:
    """The rows of numbers that end a file, cell by cell.

    width: cells of a row. columns: those to be read; None: all. promised: rows by the header, NaN if it says nothing.
    lacking: a complete row may leave out empty cells at its end, in multiples of this.
    counted: rows have a frame number or time, so that an empty one is no frame; else it is one that saw nothing.
    A last row that was cut off is left out with a warning if whole ones came before it. Raises FormatError.
    """
    values = array("d")
    n_rows, widest = 0, 0
    recent: deque[list[str]] = deque(maxlen=_RECENT_ROWS + 1)
    is_last_read = columns is None or width - 1 in columns
    for cells in rows:
        if (counted or len(cells) < width) and not any(cell and not cell.isspace() for cell in cells):
            continue
        while len(cells) > width and not cells[-1].strip():
            cells.pop()
        missing = width - len(cells)
        try:
            if missing < 0 or (missing and (missing % lacking or not lines.complete or len(cells) < 2)):
                if lines.has_decimal_commas(cells, width):
                    raise lines.decimal_commas_between_commas(len(cells), width)
                raise lines.error(
                    f"has {len(cells)} columns instead of {width}.", "The file is damaged or cut off; export it again."
                )
            read = lines.numbers(cells + [""] * missing if missing else cells, columns)
        except FormatError:
            if lines.complete or not n_rows:
                raise
            lines.warn("Its last line is cut off and was left out.")
            break
        values.extend(read)
        n_rows, widest = n_rows + 1, max(widest, len(cells))
        recent.append(cells)
    table = np.frombuffer(values, dtype=np.float64).reshape(n_rows, len(columns) if columns is not None else width)
    # Cut off within its last number, a line still has all of its columns.
    if not lines.complete and n_rows > 1 and is_last_read and len(recent[-1]) == width:
        before = [cells[-1] for cells in list(recent)[:-1] if len(cells) == width]
        cut = last_number(recent[-1], before, n_rows < promised)
        if cut is Cut.YES:
            lines.warn("Its last line is cut off and was left out.")
            table = table[:-1]
        elif cut is Cut.MAYBE:
            lines.warn_of_doubt(recent[-1][-1])
    lines.compare_count(promised, len(table))
    return Table(table, widest)
