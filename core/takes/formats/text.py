"""Reading text files line by line, with errors that say where."""

from __future__ import annotations

import codecs
from collections.abc import Iterator, Sequence
from pathlib import Path

from core.errors import FormatError

_BOMS = ((codecs.BOM_UTF8, "utf-8-sig"), (codecs.BOM_UTF16_LE, "utf-16"), (codecs.BOM_UTF16_BE, "utf-16"))
_NO_VALUE = frozenset({"", "nan", "null", "na", "n/a", "-nan", "nan(ind)", "-nan(ind)", "1.#qnan", "-1.#ind"})

MAX_LINE = 1 << 20
"""Longest line read [characters]: some 30,000 columns. No text file of motion has longer ones."""

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
    """

    def __init__(self, path: Path, decimal_commas: bool = False) -> None:
        self.name = path.name
        self.number = 0
        self.complete = True
        self.decimal_commas = decimal_commas
        self._path = path

    def __iter__(self) -> Iterator[str]:
        """Each line without its line break. Raises FormatError where the file is not text."""
        try:
            with self._path.open("rb") as probe:
                encoding = encoding_of(probe.read(4))
            with self._path.open(encoding=encoding, newline=None) as stream:
                while line := stream.readline(MAX_LINE):
                    self.number += 1
                    self.complete = line.endswith("\n")
                    if len(line) == MAX_LINE and not self.complete:
                        raise self.error(f"is longer than {MAX_LINE} characters.", "This is not a motion file.")
                    yield line.rstrip("\n")
        except UnicodeError as error:
            self.number += 1
            raise self.error(f"or one soon after is not {encoding} text ({error}).", "Save it as UTF-8.") from error
        except OSError as error:
            raise FormatError(
                f"{self.name} cannot be read ({error.strerror or error}).", "Copy it to this machine and try again."
            ) from error

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
        if text.lower() in _NO_VALUE:
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
