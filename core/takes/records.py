"""Reading MCAP records at any place of a file, with every length bounded by the bytes there are."""

from __future__ import annotations

import os
import stat
import struct
from dataclasses import dataclass
from io import BytesIO, FileIO
from mmap import ACCESS_READ, mmap
from pathlib import Path

import lz4.frame
import zstandard
from mcap.data_stream import ReadDataStream

from core.errors import TakeError
from core.takes.rescue import rescued_in

HAS_PREAD = hasattr(os, "pread")
RECORD_HEAD = struct.Struct("<BQ")
MESSAGE_HEAD = struct.Struct("<HIQQ")
CHUNK_HEAD = struct.Struct("<QQQII")
MAX_MESSAGE = 1 << 22
MAX_CHUNK = 1 << 25
"""No message or chunk of a take, packed or unpacked, comes near these sizes; a record that claims more is damaged."""

MAX_RECORD = 1 << 26
"""Nor does any other record."""

_UNPACKED_FREE, _UNPACKED_PER_BYTE = 1 << 26, 256
_BYTES_PER_MESSAGE = 8


class TakeFile:
    """The bytes of a file, by offset. May be read from several threads."""

    def __init__(self, path: Path) -> None:
        """Raises TakeError."""
        self.path = path
        try:
            kind = path.stat().st_mode
            if not stat.S_ISREG(kind) and not stat.S_ISDIR(kind):  # opening a pipe would wait for somebody to write
                raise TakeError(f"{path} is not a file.", "Choose a take.")
            self._raw = FileIO(path, "rb")
            status = os.fstat(self._raw.fileno())
            self.size, self.modified_s = status.st_size, status.st_mtime
            # Windows has no pread; there, unlike elsewhere, a mapped file cannot be cut short under its reader.
            self._map = None if HAS_PREAD or not self.size else mmap(self._raw.fileno(), 0, access=ACCESS_READ)
        except FileNotFoundError as error:
            found = rescued_in(path.parent, path)  # it was taken away, or cut, while it was recorded
            rescued = f" But it was rescued as {found[0]}." if found else ""
            action = "Name that one." if found else "Check the name."
            raise TakeError(f"There is no take {path}.{rescued}", action) from error
        except IsADirectoryError as error:
            raise TakeError(f"{path} is a folder, not a take.", "Choose one of the takes in it.") from error
        except ValueError as error:
            raise TakeError(f"{str(path)!r} cannot be the name of a file ({error}).", "Check the name.") from error
        except OSError as error:
            raise TakeError(
                f"Take {path} cannot be opened ({error.strerror or error}).", "Check its permissions."
            ) from error

    def fileno(self) -> int:
        """The descriptor, for a lock."""
        return self._raw.fileno()

    def read(self, offset: int, n: int) -> bytes:
        """Up to n bytes from an offset, whatever n a damaged file claims; fewer only at the end of the file. Raises
        TakeError."""
        n = min(n, self.size - offset)
        if n <= 0:
            return b""
        try:
            data = self._read_once(offset, n)
            while data and len(data) < n and (more := self._read_once(offset + len(data), n - len(data))):
                data += more
        except (OSError, ValueError) as error:
            raise TakeError(
                f"Take {self.path} cannot be read at byte {offset} ({error}).", "Copy it to a good disk and try again."
            ) from error
        return data

    def _read_once(self, offset: int, n: int) -> bytes:
        return os.pread(self._raw.fileno(), n, offset) if self._map is None else self._map[offset : offset + n]

    def close(self) -> None:
        """Ends reading."""
        if self._map is not None:
            self._map.close()
        self._raw.close()


class Window:
    """Bytes of a file read in blocks, for going through it from front to back."""

    BLOCK = 1 << 22

    def __init__(self, file: TakeFile, block: int = BLOCK) -> None:
        """block: how much is read at once [byte]."""
        self._file = file
        self._block = block
        self._start = 0
        self._data = b""

    def at(self, offset: int, n: int) -> memoryview | None:
        """n bytes from an offset, None if the file ends before."""
        i = offset - self._start
        if not 0 <= i <= len(self._data) - n:
            if offset + n > self._file.size:
                return None
            self._start, i = offset, 0
            self._data = self._file.read(offset, max(n, self._block))
            if len(self._data) < n:
                return None
        return memoryview(self._data)[i : i + n]


@dataclass(frozen=True, slots=True)
class ChunkPlace:
    """Where the compressed records of a chunk lie in the file."""

    offset: int
    size: int
    uncompressed_size: int
    uncompressed_crc: int
    compression: str


def parse_chunk(head: bytes | memoryview, body_offset: int, length: int) -> ChunkPlace | None:
    """The chunk whose record body begins with `head` (at least 64 bytes of it, or all), None if it is not one."""
    if length < CHUNK_HEAD.size + 8 or len(head) < min(length, 64):
        return None
    _, _, uncompressed, crc, name_length = CHUNK_HEAD.unpack_from(head)
    begin = CHUNK_HEAD.size + name_length + 8
    if name_length > 8 or begin > len(head) or begin > length:
        return None
    compression = bytes(head[CHUNK_HEAD.size : CHUNK_HEAD.size + name_length])
    (size,) = struct.unpack_from("<Q", head, begin - 8)
    if size != length - begin or compression not in (b"", b"lz4", b"zstd"):
        return None
    return ChunkPlace(body_offset + begin, size, uncompressed, crc, compression.decode())


class Room:
    """What the bytes of a file can hold, so that a small one does not fill the memory.

    lz4, as takes are sealed with, makes less than 256 bytes of one. A message is its own number, times and checksum at
    least, of which the best packer that there is leaves 16 bytes.
    """

    def __init__(self, size: int) -> None:
        """size: of the file [byte]."""
        self._unpacked = _UNPACKED_FREE + _UNPACKED_PER_BYTE * size
        self.messages = size // _BYTES_PER_MESSAGE

    def chunk(self, place: ChunkPlace) -> bool:
        """Takes the room of one more chunk; False if there is none."""
        if max(place.size, place.uncompressed_size) > MAX_CHUNK or place.uncompressed_size > self._unpacked:
            return False
        self._unpacked -= place.uncompressed_size
        return True


def decompress(place: ChunkPlace, data: bytes) -> bytes | None:
    """The records of a chunk, None if they are damaged beyond decompression."""
    try:
        if place.compression == "lz4":
            unpacker = lz4.frame.LZ4FrameDecompressor()
            records: bytes = unpacker.decompress(data, max_length=place.uncompressed_size)
        elif place.compression == "zstd":
            if zstandard.frame_content_size(data) > place.uncompressed_size:
                return None
            records = zstandard.decompress(data, max_output_size=place.uncompressed_size)
        else:
            records = data
    except (RuntimeError, ValueError, EOFError, MemoryError, zstandard.ZstdError):
        return None
    return records if len(records) == place.uncompressed_size else None


def stream(body: bytes | memoryview) -> ReadDataStream:
    """A record's body as the readers of mcap.records want it."""
    return ReadDataStream(BytesIO(body))
