"""Opening what somebody named as a file: a pipe would wait for its writer, a device has no end."""

from __future__ import annotations

import errno
import os
import stat
from io import BufferedReader
from pathlib import Path

_FLAGS = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
_AT_ONCE = 1 << 20


def open_file(path: Path) -> BufferedReader:
    """The bytes of a file, or of what a link leads to. Never waits.

    Raises OSError, its strerror fit for an operator, where there is none: also for folders, pipes, sockets, devices and
    names that no file can have.
    """
    try:
        _check(path.stat().st_mode)  # opening a device may already do something
        descriptor = os.open(path, _FLAGS)
    except ValueError as error:  # a null character, or half of a surrogate pair
        raise OSError(errno.EINVAL, "no file can have this name") from error
    try:
        _check(os.fstat(descriptor).st_mode)
        return os.fdopen(descriptor, "rb")
    except OSError:
        os.close(descriptor)
        raise


def read_bytes(path: Path, most: int) -> bytes:
    """All of a file of at most `most` bytes. Raises OSError as `open_file`, and where it is larger."""
    with open_file(path) as stream:
        size = os.fstat(stream.fileno()).st_size
        data = b"" if size > most else stream.read(size)
        while max(size, len(data)) <= most and (more := stream.read(_AT_ONCE)):  # it grows, or did not say its size
            data += more
        if max(size, len(data)) > most:
            raise OSError(errno.EFBIG, f"it has {max(size, len(data)):,} bytes, more than the {most:,} that are read")
        return data


def read_text(path: Path, most: int) -> str:
    """A text file in UTF-8, with or without a byte order mark. Raises OSError as `read_bytes`, and for another one."""
    return decoded(read_bytes(path, most))


def decoded(data: bytes) -> str:
    """Text of UTF-8, with or without a byte order mark. Raises OSError."""
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise OSError(errno.EILSEQ, f"it is no text in UTF-8 from byte {error.start} on") from error


def _check(mode: int) -> None:
    if stat.S_ISREG(mode):
        return
    if stat.S_ISDIR(mode):
        raise IsADirectoryError(errno.EISDIR, "it is a folder, not a file")
    kind = "a named pipe" if stat.S_ISFIFO(mode) else "a socket" if stat.S_ISSOCK(mode) else "a device"
    raise OSError(errno.EINVAL, f"it is {kind}, not a file")
