"""Arrays out of an .npz: numbers and texts alone, nothing unpacked before what is claimed is held against what is
there."""

from __future__ import annotations

import math
import struct
import zipfile
import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from core.errors import FormatError
from core.untrusted.files import open_file

MOST_BYTES = 1 << 27
"""Of all arrays that are read of one file, unpacked: an hour of a hand's 19 markers at 80 Hz."""

MOST_MEMBERS = 256
_MOST_DIRECTORY = 1 << 20  # bytes at a file's end in which its members are listed
_PACKED = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)  # as numpy writes
_VERSIONS = ((1, 0), (2, 0), (3, 0))
_KINDS = "fiubUS"  # floats, whole numbers, yes and no, texts; never objects, which are pickles
_END, _LOCATOR = 22, 20  # bytes of the record that ends a zip file, and of the one before it in zip64

_NOT_SOUND = (
    ValueError, LookupError, EOFError, RuntimeError, MemoryError, OverflowError, TypeError, OSError,
    struct.error, zipfile.BadZipFile, zipfile.LargeZipFile, zlib.error,
)  # fmt: skip
"""What zipfile, zlib and numpy raise of spoilt bytes."""


def read_npz(
    path: Path, wanted: Sequence[str], source: str, mend: str, optional: Sequence[str] = (), most: int = MOST_BYTES
) -> dict[str, NDArray[Any]]:
    """The wanted arrays of an .npz by name, and of the optional ones those that it has; others are passed over.

    most: bytes of all of them. Raises FormatError naming `source` and the array, with what to do: `mend`.
    """
    try:
        stream = open_file(path)
    except OSError as error:
        raise FormatError(f"{source} cannot be read ({error.strerror or error}).", mend) from error
    with stream:
        try:
            with zipfile.ZipFile(_checked_directory(stream)) as archive:
                return _arrays(archive, wanted, optional, most)
        except _UnfitError as error:
            raise FormatError(f"{source}: {error}.", mend) from error
        except _NOT_SOUND as error:
            raise FormatError(f"{source} is not a .npz of plain arrays ({_words(error)}).", mend) from error


class _UnfitError(Exception):
    """What a file claims does not fit; said in words."""


def _arrays(
    archive: zipfile.ZipFile, wanted: Sequence[str], optional: Sequence[str], most: int
) -> dict[str, NDArray[Any]]:
    count = len(archive.infolist())
    members = {info.filename.removesuffix(".npy"): info for info in archive.infolist()}
    if count > MOST_MEMBERS or count > len(members):
        raise _UnfitError(f"it lists {count:,} arrays of {len(members):,} names, {MOST_MEMBERS} at most are read")
    missing = [name for name in wanted if name not in members]
    if missing:
        raise _UnfitError(f"it has no array {', '.join(missing)}")
    named = [name for name in (*wanted, *optional) if name in members]
    if any(members[name].compress_type not in _PACKED for name in named):
        raise _UnfitError("its arrays are packed in another way than numpy does")
    total = sum(members[name].file_size for name in named)
    if total > most:
        raise _UnfitError(f"{', '.join(named)} have {total:,} bytes unpacked, {most:,} at most are read")
    arrays = {}
    for name in named:
        with archive.open(members[name]) as member:
            arrays[name] = _array(member, name, members[name].file_size)
    return arrays


def _array(member: IO[bytes], name: str, size: int) -> NDArray[Any]:
    """One array. size: bytes that the member claims to have."""
    version = np.lib.format.read_magic(member)
    if version not in _VERSIONS:
        raise _UnfitError(f"{name} is of version {version} of its format")
    read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    try:
        shape, in_columns, dtype = read(member)
    except Exception as error:  # numpy reads it as Python's own words, and raises whatever that raises
        raise _UnfitError(f"what {name} holds cannot be told ({_words(error)})") from error
    if dtype.kind not in _KINDS or dtype.itemsize == 0:
        raise _UnfitError(f"{name} holds {dtype}, not numbers or texts")
    claimed = math.prod(shape) * dtype.itemsize
    if min(shape, default=0) < 0 or claimed > size:
        raise _UnfitError(f"{name} claims {claimed:,} bytes, of which at most {size:,} are there")
    data = member.read(claimed)
    if len(data) != claimed or member.read(1):
        there = f"{len(data):,}" if len(data) < claimed else "more"
        raise _UnfitError(f"{name} claims {claimed:,} bytes, {there} are there")
    return np.frombuffer(data, dtype).reshape(shape, order="F" if in_columns else "C")


def _checked_directory(stream: Any) -> Any:
    """The stream, if its list of members is short: zipfile reads and keeps all of it."""
    stream.seek(0, 2)
    size = stream.tell()
    stream.seek(max(size - (1 << 16) - _END - _LOCATOR, 0))
    tail = stream.read()
    at = tail.rfind(b"PK\x05\x06", 0, max(len(tail) - _END + 4, 0))
    if at >= 0:
        if tail[max(at - _LOCATOR, 0) : at].startswith(b"PK\x06\x07"):
            raise _UnfitError("it is packed as archives of more than 4 GB are")
        if int.from_bytes(tail[at + 12 : at + 16], "little") > _MOST_DIRECTORY:
            raise _UnfitError("its list of arrays is longer than any")
    stream.seek(0)
    return stream


def _words(error: BaseException) -> str:
    return str(error)[:100] or type(error).__name__
