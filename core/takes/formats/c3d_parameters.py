"""The parameter section of a C3D file, and the number formats of the three processors it knows."""

from __future__ import annotations

import struct
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from core.errors import FormatError

BLOCK = 512
INTEL, DEC, MIPS = 84, 85, 86
_CHARACTERS, _BYTES, _INTEGERS, _REALS = -1, 1, 2, 4


@dataclass(frozen=True)
class Numbers:
    """How a processor writes numbers."""

    processor: int

    @property
    def _order(self) -> str:
        return ">" if self.processor == MIPS else "<"

    def words(self, data: bytes) -> NDArray[np.uint16]:
        """Unsigned 16-bit integers."""
        return np.frombuffer(data, self._order + "u2", len(data) // 2).astype(np.uint16)

    def integers(self, data: bytes) -> NDArray[np.int16]:
        """Signed 16-bit integers."""
        return np.frombuffer(data, self._order + "i2", len(data) // 2).astype(np.int16)

    def floats(self, data: bytes) -> NDArray[np.float32]:
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
    data: bytes


@dataclass(frozen=True)
class Parameters:
    """All parameters by group and name, both in upper case."""

    values: dict[tuple[str, str], Parameter]
    numbers: Numbers

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

    def long(self, group: str, name: str) -> int:
        """A 32-bit count, written as two 16-bit words, the lower first; 0 if absent."""
        found = self.values.get((group, name))
        if found is None or found.kind != _INTEGERS or len(found.data) != 4:
            return 0
        low, high = self.numbers.words(found.data)
        return int(low) + (int(high) << 16)

    def texts(self, group: str, name: str) -> list[str]:
        """The strings of a parameter, without the spaces that fill them up."""
        found = self.values.get((group, name))
        if found is None or found.kind != _CHARACTERS or not found.dimensions or found.dimensions[0] == 0:
            return []
        width = found.dimensions[0]
        cells = (found.data[i : i + width] for i in range(0, len(found.data), width))
        return [_decode(cell).strip() for cell in cells]

    def text(self, group: str, name: str) -> str:
        """The first string of a parameter; empty if absent."""
        texts = self.texts(group, name)
        return texts[0] if texts else ""


def read_parameters(name: str, data: bytes) -> tuple[Parameters, Numbers]:
    """The parameters of a C3D file. name: the file's, for errors. Raises FormatError."""
    start = (data[0] - 1) * BLOCK
    if start + 4 > len(data):
        raise _damaged(name, f"its parameters should start at byte {start}, but it has {len(data)} bytes")
    numbers = Numbers(data[start + 3])
    if numbers.processor not in (INTEL, DEC, MIPS):
        raise _damaged(name, f"its processor type is {numbers.processor}, not 84, 85 or 86")
    groups: dict[int, str] = {}
    pending: list[tuple[int, str, Parameter]] = []
    at = start + 4
    while True:
        try:
            length, owner = struct.unpack_from("<bb", data, at)
        except struct.error:
            raise _damaged(name, f"its parameters run past its end at byte {at}") from None
        length = abs(length)  # negative: locked
        if length == 0 or owner == 0:
            break
        offset_at = at + 2 + length
        label = _decode(data[at + 2 : offset_at]).upper().strip()
        offset = int(numbers.words(data[offset_at : offset_at + 2])[0]) if offset_at + 2 <= len(data) else -1
        if offset < 0:
            raise _damaged(name, f"its parameter {label!r} is cut off at byte {len(data)}")
        if owner < 0:
            groups[-owner] = label
        else:
            pending.append((owner, label, _parameter(name, label, data, offset_at + 2)))
        if offset < 2:  # the last one; a step back or in place would never end
            break
        at = offset_at + offset
    values = {(groups.get(owner, ""), label): parameter for owner, label, parameter in pending}
    return Parameters(values, numbers), numbers


def _parameter(name: str, label: str, data: bytes, at: int) -> Parameter:
    try:
        kind, n_dimensions = struct.unpack_from("<bB", data, at)
        dimensions = struct.unpack_from(f"<{n_dimensions}B", data, at + 2)
    except struct.error:
        raise _damaged(name, f"its parameter {label!r} is cut off at byte {len(data)}") from None
    if kind not in (_CHARACTERS, _BYTES, _INTEGERS, _REALS) or n_dimensions > 7:
        raise _damaged(name, f"its parameter {label!r} has type {kind} and {n_dimensions} dimensions")
    size = abs(kind)
    for dimension in dimensions:
        size *= dimension
    at += 2 + n_dimensions
    if size > len(data) - at:
        raise _damaged(name, f"its parameter {label!r} promises {size} bytes, {len(data) - at} are left")
    return Parameter(kind, dimensions, data[at : at + size])


def _decode(data: bytes) -> str:
    """C3D text is ASCII; what newer programs write beyond it is UTF-8, what older ones write Latin-1."""
    try:
        return data.decode("utf-8").strip("\0")
    except UnicodeDecodeError:
        return data.decode("latin-1").strip("\0")


def _damaged(name: str, what: str) -> FormatError:
    return FormatError(f"{name} is not a sound C3D file: {what}.", "Export it again.")
