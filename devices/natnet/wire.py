"""Little-endian bytes to values and back, with every count bounded by the bytes that are left."""

from __future__ import annotations

import struct
from typing import Any

import numpy as np
from numpy.typing import NDArray

from core.errors import FormatError

Version = tuple[int, int]
"""NatNet bitstream version, major and minor."""

I16 = struct.Struct("<h")
I32 = struct.Struct("<i")
F32 = struct.Struct("<f")
F64 = struct.Struct("<d")

POINTS = np.dtype("<f4")


class Reader:
    """A cursor over one payload. Every method raises FormatError where the bytes end too early."""

    __slots__ = ("_at", "_data", "_end", "_what")

    def __init__(self, data: bytes, what: str) -> None:
        self._data = data
        self._what = what
        self._at = 0
        self._end = len(data)

    @property
    def left(self) -> int:
        """Bytes not yet read, of the open section or of the whole."""
        return self._end - self._at

    def error(self, text: str) -> FormatError:
        """The one parse error, saying where."""
        return FormatError(f"{self._what}: {text} (byte {self._at} of {len(self._data)}).")

    def values(self, layout: struct.Struct, of: str) -> tuple[Any, ...]:
        """The values of `layout`."""
        at = self._at
        if self._end - at < layout.size:
            raise self.error(f"{of} needs {layout.size} bytes, {self.left} are left")
        self._at = at + layout.size
        return layout.unpack_from(self._data, at)

    def i32(self, of: str) -> int:
        """One signed 32-bit integer."""
        value: int = self.values(I32, of)[0]
        return value

    def raw(self, size: int, of: str) -> bytes:
        """`size` bytes."""
        if not 0 <= size <= self.left:
            raise self.error(f"{of} needs {size} bytes, {self.left} are left")
        self._at += size
        return self._data[self._at - size : self._at]

    def count(self, least: int, of: str) -> int:
        """A number of elements of at least `least` bytes each."""
        n = self.i32(of)
        if n < 0 or n * least > self.left:
            raise self.error(f"{n} {of} announced, {self.left} bytes left")
        return n

    def array(self, dtype: np.dtype[Any], n: int, of: str) -> NDArray[Any]:
        """(n,) of `dtype`, a read-only view of the packet."""
        size = n * dtype.itemsize
        if size > self.left:
            raise self.error(f"{n} {of} need {size} bytes, {self.left} are left")
        self._at += size
        return np.frombuffer(self._data, dtype, n, self._at - size)

    def points(self, n: int, of: str) -> NDArray[np.float32]:
        """(n, 3) float32."""
        return self.array(POINTS, 3 * n, of).reshape(n, 3)

    def text(self, of: str) -> str:
        """Text up to its NUL."""
        stop = self._data.find(b"\0", self._at, self._end)
        if stop < 0:
            raise self.error(f"{of} has no end")
        text = self._data[self._at : stop].decode("utf-8", "surrogateescape")
        self._at = stop + 1
        return text

    def padded_text(self, size: int, of: str) -> str:
        """Text in a field of `size` bytes. What follows its NUL is uninitialised memory of the server."""
        return self.raw(size, of).split(b"\0", 1)[0].decode("utf-8", "surrogateescape")

    def open_section(self, sized: bool, least: int, of: str) -> int:
        """The count that heads a section and, where the bitstream has it, the size of its body.

        Until `close_section` nothing is read past that size.
        """
        n = self.i32(of)
        if sized:
            self.open_section_of(self.i32(of), of)
        if n < 0 or n * least > self.left:
            raise self.error(f"{n} {of} announced, {self.left} bytes left")
        return n

    def open_section_of(self, size: int, of: str) -> None:
        """Nothing is read past the next `size` bytes until `close_section`."""
        if not 0 <= size <= self.left:
            raise self.error(f"{size} bytes of {of} announced, {self.left} are left")
        self._end = self._at + size

    def close_section(self, sized: bool, elastic: bool, of: str) -> None:
        """Leave a section. `elastic`: a newer server may have written more than is known here."""
        if not sized:
            return
        if self._at != self._end:
            if not elastic:
                raise self.error(f"{self.left} bytes left over in {of}")
            self._at = self._end
        self._end = len(self._data)

    def section_array(self, dtype: np.dtype[Any], sized: bool, elastic: bool, of: str) -> NDArray[Any]:
        """A whole section of records of one size. Newer servers may append fields to each record."""
        n = self.open_section(sized, dtype.itemsize, of)
        stride = self.left // n if sized and elastic and n and self.left % n == 0 else dtype.itemsize
        if stride == dtype.itemsize:
            records = self.array(dtype, n, of)
        else:
            body = np.frombuffer(self.raw(n * stride, of), np.uint8).reshape(n, stride)
            records = np.ascontiguousarray(body[:, : dtype.itemsize]).view(dtype).reshape(n)
        self.close_section(sized, elastic, of)
        return records

    def finish(self) -> None:
        """Raises FormatError if bytes are left over."""
        if self.left:
            raise self.error(f"{self.left} bytes left over")


def pack_text(text: str) -> bytes:
    """Text and its NUL."""
    return text.encode("utf-8", "surrogateescape") + b"\0"


def pack_padded_text(text: str, size: int) -> bytes:
    """Text in a field of `size` bytes, the last of which is NUL."""
    return text.encode("utf-8", "surrogateescape")[: size - 1].ljust(size, b"\0")


def pack_section(n: int, body: bytes, sized: bool) -> bytes:
    """A section: count, size where the bitstream has it, body."""
    return I32.pack(n) + (I32.pack(len(body)) if sized else b"") + body
