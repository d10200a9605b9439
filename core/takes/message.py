"""What every message of a take has in common: its checksum, and how numbers go into its fields and out of them.

Every message ends in field 15, the CRC-32 of the bytes before it, so that a damaged record is never taken for a
good one, in whatever way it reached the reader.
"""

from __future__ import annotations

import struct
import zlib
from typing import Any

import numpy as np
from google.protobuf.message import DecodeError

from core.errors import FormatError
from core.frames import BoolArray, CodeArray, FloatArray, IntArray, Times
from core.takes.schemas import CRC_FIELD

MEND = "Recover the take."
_MOST_THINGS = 4096
"""Hands, props, rigid bodies, stages or sources of one frame; what claims more is no frame."""

_NO_CODES: CodeArray = np.zeros(0, dtype=np.int8)
_FIXED32_WIRE = 5
_CRC = struct.Struct("<BI")
_CRC_TAG = CRC_FIELD << 3 | _FIXED32_WIRE


def intact(data: bytes | memoryview) -> bool:
    """Whether a message carries the CRC of its own bytes."""
    if len(data) < _CRC.size:
        return False
    tag, crc = _CRC.unpack_from(data, len(data) - _CRC.size)
    return bool(tag == _CRC_TAG and crc == zlib.crc32(data[: -_CRC.size]))


def sign(message: Any) -> bytes:
    """The bytes of a message, its checksum behind them."""
    body: bytes = message.SerializeToString()
    return body + _CRC.pack(_CRC_TAG, zlib.crc32(body))


def parse(kind: Any, data: bytes) -> Any:
    """A message of this protobuf class. Raises FormatError."""
    if not intact(data):
        raise FormatError(f"A record of {len(data)} bytes is damaged: its checksum does not match.", MEND)
    try:
        return kind.FromString(data)
    except DecodeError as error:
        raise FormatError(f"A record of {len(data)} bytes is not a {kind.DESCRIPTOR.name}.", MEND) from error


def put_stamp(message: Any, sequence: int, times: Times) -> None:
    """Number and times of a frame."""
    message.sequence = int(sequence)
    message.device_s = float(times.device_s)
    message.host_s = float(times.host_s)
    message.arrival_s = float(times.arrival_s)


def stamp(message: Any) -> Times:
    """The reverse of put_stamp."""
    return Times(message.device_s, message.host_s, message.arrival_s)


def put_floats(field: Any, values: FloatArray) -> None:
    """Of any shape, row by row."""
    field.extend(np.asarray(values, dtype=np.float64).ravel().tolist())


def put_known(field: Any, values: FloatArray) -> None:
    """Nothing at all where nothing is known."""
    if not np.isnan(values).all():
        put_floats(field, values)


def put_single(field: Any, values: FloatArray) -> None:
    """In single precision; nothing at all where nothing is known, as in takes made before these fields."""
    if not np.isnan(values).all():
        with np.errstate(over="ignore"):  # beyond single precision is infinite
            field.extend(np.asarray(values, dtype=np.float32).tolist())


def put_codes(field: Any, codes: CodeArray) -> None:
    """Nothing at all where all are 0."""
    if len(codes) and codes.any():
        field.extend(np.asarray(codes).astype(np.uint8).tolist())


def floats(field: Any, *shape: int) -> FloatArray:
    """As float64 of this shape; none given: flat."""
    values = np.array(field, dtype=np.float64)
    return values.reshape(shape) if shape else values


def known(field: Any, *shape: int) -> FloatArray:
    """The reverse of put_known and of put_single."""
    return floats(field, *(shape if len(shape) > 1 else ())) if len(field) else np.full(shape, np.nan)


def ints(field: Any) -> IntArray:
    """As int64."""
    return np.array(field, dtype=np.int64)


def flags(field: Any, n: int) -> BoolArray:
    """(n,) bool from the indices of those that are set; (0,) where none is."""
    if not len(field):
        return np.zeros(0, dtype=np.bool_)
    found = np.zeros(n, dtype=np.bool_)
    found[list(field)] = True
    return found


def codes(field: Any, words: tuple[str, ...], n: int = 0) -> CodeArray:
    """The reverse of put_codes; (n,) zeros where nothing was put. What `words` lacks, of a later version, is 0."""
    if not len(field):
        return np.zeros(n, dtype=np.int8) if n else _NO_CODES
    found = np.array(field, dtype=np.int64)
    return np.where(found < len(words), found, 0).astype(np.int8)


def expect(field: Any, n: int, name: str) -> None:
    """Raises FormatError unless a field holds n numbers."""
    if len(field) != n:
        raise FormatError(f"A record holds {len(field)} numbers as {name}, not {n}.", MEND)


def at_most(field: Any, name: str, most: int = _MOST_THINGS) -> None:
    """Raises FormatError if a field holds more than a frame has."""
    if len(field) > most:
        raise FormatError(f"A record holds {len(field)} {name}; a frame has {most} at most.", MEND)
