"""The parameter section of a C3D file, and the number formats of the three processors it knows."""

from __future__ import annotations

import re
import struct
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from core.errors import FormatError

BLOCK = 512
INTEL, DEC, MIPS = 84, 85, 86
_CHARACTERS, _BYTES, _INTEGERS, _REALS = -1, 1, 2, 4

_MOST_PARAMETERS = 65_536
_MOST_TEXTS = 65_536
_MOST_FRAMES = 1 << 40
_MOST_TOLD = 3


@dataclass(frozen=True)
class Numbers:
    """How a processor writes numbers."""

    processor: int

    @property
    def _order(self) -> str:
        return ">" if self.processor == MIPS else "<"

    def words(self, data: bytes | memoryview) -> NDArray[np.uint16]:
        """Unsigned 16-bit integers."""
        return np.frombuffer(data, self._order + "u2", len(data) // 2).astype(np.uint16)

    def integers(self, data: bytes | memoryview) -> NDArray[np.int16]:
        """Signed 16-bit integers."""
        return np.frombuffer(data, self._order + "i2", len(data) // 2).astype(np.int16)

    def floats(self, data: bytes | memoryview) -> NDArray[np.float32]:
        """32-bit reals. DEC's have their halves swapped, and an exponent two higher."""
        if self.processor != DEC:
            return np.frombuffer(data, self._order + "f4", len(data) // 4).astype(np.float32)
        halves = np.frombuffer(data, "<u2", len(data) // 4 * 2).reshape(-1, 2)
        return (np.ascontiguousarray(halves[:, ::-1]).view("<f4").ravel() / 4.0).astype(np.float32)


@dataclass(frozen=True)
class Parameter:
    """One parameter as it stands in the file."""

    kind: int
    dimensions: tuple[int, ...]
    data: memoryview


@dataclass(frozen=True)
class Parameters:
    """All parameters by group and name, both in upper case.

    start: byte of the file at which they begin. warnings: which of them are damaged and left out, in sentences.
    """

    values: dict[tuple[str, str], Parameter]
    numbers: Numbers
    start: int = 0
    warnings: tuple[str, ...] = ()

    def array(self, group: str, name: str) -> NDArray[np.float64]:
        """The numbers of a parameter; empty if there are none."""
        found = self.values.get((group, name))
        if found is None or found.kind == _CHARACTERS:
            return np.empty(0)
        if found.kind == _REALS:
            with np.errstate(invalid="ignore"):  # a damaged file may hold any bits
                return self.numbers.floats(found.data).astype(np.float64)
        if found.kind == _INTEGERS:
            return self.numbers.integers(found.data).astype(np.float64)
        return np.frombuffer(found.data, np.uint8).astype(np.float64)

    def number(self, group: str, name: str, default: float) -> float:
        """The first number of a parameter."""
        values = self.array(group, name)
        return float(values[0]) if len(values) else default

    def count(self, group: str, name: str) -> int | None:
        """A count however it is written: as one word (unsigned), as two, the lower first, or as reals. None if there
        is none.
        """
        found = self.values.get((group, name))
        if found is None:
            return None
        values = self.array(group, name)
        if found.kind == _INTEGERS:
            values = self.numbers.words(found.data[:4]).astype(np.float64)
        if len(values) == 0 or not np.all(np.isfinite(values[:2])):
            return None
        total = float(values[0]) + (65_536.0 * float(values[1]) if len(values) > 1 else 0.0)
        return round(total) if 0.0 <= total < _MOST_FRAMES else None

    def texts(self, group: str, name: str) -> list[str]:
        """The strings of a parameter, without the spaces that fill them up."""
        found = self.values.get((group, name))
        if found is None or found.kind != _CHARACTERS or not found.dimensions or found.dimensions[0] == 0:
            return []
        width = found.dimensions[0]
        end = min(len(found.data), width * _MOST_TEXTS)
        cells = (found.data[i : i + width] for i in range(0, end, width))
        return [_decode(bytes(cell)).strip() for cell in cells]

    def continued_texts(self, group: str, name: str) -> list[str]:
        """The strings of a parameter and of those that carry it on: LABELS, LABELS2, LABELS3, ..."""
        parts = [
            (int(found[1] or 1), label)
            for owner, label in self.values
            if owner == group and (found := re.fullmatch(re.escape(name) + r"([0-9]{0,5})", label))
        ]
        texts: list[str] = []
        for _, label in sorted(parts):
            texts += self.texts(group, label)
            if len(texts) >= _MOST_TEXTS:  # more points than a file can hold: damage
                break
        return texts

    def text(self, group: str, name: str) -> str:
        """The first string of a parameter; empty if absent."""
        texts = self.texts(group, name)
        return texts[0] if texts else ""


def read_parameters(name: str, data: bytes) -> tuple[Parameters, Numbers]:
    """The parameters of a C3D file. name: the file's, for errors.

    A parameter that is damaged is left out and said, as are all that come after the point where they are cut off:
    what the points need stands in the header, too. Raises FormatError where one of the group POINT is damaged.
    """
    start = (data[0] - 1) * BLOCK
    if start + 4 > len(data):
        raise _damaged(name, f"its parameters should start at byte {start}, but it has {len(data)} bytes")
    numbers = Numbers(data[start + 3])
    if numbers.processor not in (INTEL, DEC, MIPS):
        raise _damaged(name, f"its processor type is {numbers.processor}, not 84, 85 or 86")
    groups: dict[int, str] = {}
    pending: list[tuple[int, str, Parameter | str]] = []
    warnings: list[str] = []
    at = start + 4
    while len(pending) < _MOST_PARAMETERS:
        if at + 2 > len(data):
            warnings.append(f"Its parameters run past its end at byte {at}; those after that are missing.")
            break
        length, owner = struct.unpack_from("<bb", data, at)
        length = abs(length)  # negative: locked
        if length == 0 or owner == 0:
            break
        offset_at = at + 2 + length
        label = _decode(data[at + 2 : offset_at]).upper().strip()
        if offset_at + 2 > len(data):
            warnings.append(f"Its parameter {label!r} is cut off at byte {len(data)}; those after it are missing.")
            break
        offset = int(numbers.words(data[offset_at : offset_at + 2])[0])
        if owner < 0:
            groups[-owner] = label
        else:
            pending.append((owner, label, _parameter(data, offset_at + 2)))
        if offset < 2:  # the last one; a step back or in place would never end
            break
        at = offset_at + offset
    values: dict[tuple[str, str], Parameter] = {}
    damaged: list[str] = []
    for owner, label, parameter in pending:
        group = groups.get(owner, "")
        if isinstance(parameter, Parameter):
            values[group, label] = parameter
        elif group == "POINT":
            raise _damaged(name, f"its parameter {label!r} {parameter}")
        else:
            damaged.append(f"Its parameter {f'{group}:{label}'!r} {parameter}, and is left out.")
    warnings += damaged[:_MOST_TOLD]
    if len(damaged) > _MOST_TOLD:
        warnings.append(f"So are {len(damaged) - _MOST_TOLD:,} more of its parameters.")
    return Parameters(values, numbers, start, tuple(warnings)), numbers


def _parameter(data: bytes, at: int) -> Parameter | str:
    """The parameter whose type stands at a byte, or what is wrong with it."""
    try:
        kind, n_dimensions = struct.unpack_from("<bB", data, at)
        dimensions = struct.unpack_from(f"<{n_dimensions}B", data, at + 2)
    except struct.error:
        return f"is cut off at byte {len(data)}"
    if kind not in (_CHARACTERS, _BYTES, _INTEGERS, _REALS) or n_dimensions > 7:
        return f"has type {kind} and {n_dimensions} dimensions"
    size = abs(kind)
    for dimension in dimensions:
        size *= dimension
    at += 2 + n_dimensions
    if size > len(data) - at:
        return f"promises {size} bytes, {len(data) - at} are left"
    return Parameter(kind, dimensions, memoryview(data)[at : at + size])


def _decode(data: bytes) -> str:
    """C3D text is ASCII; what newer programs write beyond it is UTF-8, what older ones write Latin-1."""
    try:
        return data.decode("utf-8").strip("\0")
    except UnicodeDecodeError:
        return data.decode("latin-1").strip("\0")


def _damaged(name: str, what: str) -> FormatError:
    return FormatError(f"{name} is not a sound C3D file: {what}.", "Export it again.")
