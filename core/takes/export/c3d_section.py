"""The parameter section of a C3D file, written."""

from __future__ import annotations

import struct
from collections.abc import Mapping

import numpy as np

from core.frames import FloatArray, IntArray

BLOCK = 512
MOST_TEXTS = 255
_INTEL = 84
_CHARACTERS, _INTEGER, _REAL = -1, 2, 4

Value = int | float | tuple[str, ...] | IntArray | FloatArray
"""A 16-bit integer, a 32-bit real, strings, or an array of either number, whose first axis varies fastest in the file,
as in Fortran."""


def parameter_section(groups: Mapping[str, Mapping[str, Value]]) -> bytes:
    """Groups of parameters by name, in whole blocks. At most 255 strings of at most 255 bytes per parameter."""
    body = b""
    for number, (group, parameters) in enumerate(groups.items(), 1):
        name = group.encode("ascii")
        body += struct.pack("<bb", len(name), -number) + name + struct.pack("<hB", 3, 0)
        for label, value in parameters.items():
            body += _parameter(number, label.encode("ascii"), value)
    body += b"\0\0"
    n_blocks = -(-(4 + len(body)) // BLOCK)
    return (bytes((1, 0x50, n_blocks, _INTEL)) + body).ljust(n_blocks * BLOCK, b"\0")


def _parameter(group: int, name: bytes, value: Value) -> bytes:
    kind, dimensions, data = _encoded(value)
    content = struct.pack("<bB", kind, len(dimensions)) + bytes(dimensions) + data + b"\0"
    return struct.pack("<bb", len(name), group) + name + struct.pack("<h", 2 + len(content)) + content


def _encoded(value: Value) -> tuple[int, tuple[int, ...], bytes]:
    if isinstance(value, int):
        return _INTEGER, (), struct.pack("<H", value)
    if isinstance(value, float):
        return _REAL, (), struct.pack("<f", value)
    if isinstance(value, np.ndarray):
        kind, stored = (_REAL, "<f4") if value.dtype.kind == "f" else (_INTEGER, "<u2")
        return kind, value.shape, value.astype(stored).tobytes(order="F")
    texts = [text.encode("utf-8") for text in value]
    width = max(1, *map(len, texts))
    return _CHARACTERS, (width, len(texts)), b"".join(text.ljust(width) for text in texts)
