"""The file that a take is recorded into."""

from __future__ import annotations

import contextlib
import os
from io import FileIO
from pathlib import Path

from core.errors import TakeError
from core.takes.lock import lock
from core.takes.place import Fate, Place, is_at, place_of


class RecordFile:
    """Unbuffered output for `mcap.writer.Writer`, which hands over whole records: all of a record is written or
    nothing, so that a full disk leaves a file that ends with a whole record. For one thread.

    Records go to the end of the file, wherever another program has put that, and never behind a hole. size: of what is
    in it. cut_at: where the end was last found that somebody else had moved, None if nobody has; cuts: how often.
    """

    def __init__(self, path: Path) -> None:
        """Raises FileExistsError or another OSError, or TakeError, and then leaves nothing behind."""
        self.path = path
        self._raw = FileIO(path, "x+b", opener=_appending)
        self.size = self.cuts = 0
        self.cut_at: int | None = None
        try:
            lock(self._raw.fileno(), path)
        except BaseException:
            self.remove()
            raise

    @property
    def closed(self) -> bool:
        """Whether it takes no more."""
        return self._raw.closed

    @property
    def place(self) -> Place:
        """Where it lies now, and whether what was written is still all that is in it."""
        place = place_of(self._raw.fileno(), self.path)
        with contextlib.suppress(OSError):
            self._measure()
        if place.fate is Fate.HERE and self.cut_at is not None:
            return Place(Fate.CUT, place.path)
        return place

    def status(self) -> os.stat_result:
        """Of the open file, whatever its name leads to. Raises OSError."""
        return os.fstat(self._raw.fileno())

    def is_open_as(self, fd: int) -> bool:
        """Whether another descriptor is of this very file: what is opened by its name may be another by then."""
        try:
            return os.path.samestat(self.status(), os.fstat(fd))
        except OSError:
            return False

    def write(self, data: bytes | bytearray | memoryview) -> None:
        """Appends a record. Raises TakeError, and then nothing of it is in the file."""
        if self._raw.closed:
            raise TakeError(f"Take {self.path} is not being recorded any more.", "Start a new take.")
        rest = memoryview(data)
        try:
            self._measure()
            while rest:
                rest = rest[self._raw.write(rest) :]
        except OSError as error:
            with contextlib.suppress(OSError):
                os.ftruncate(self._raw.fileno(), self.size)
            with contextlib.suppress(OSError):
                self.size = self.status().st_size  # a part of a record may stay; nobody else wrote that
            raise TakeError(
                f"Take {self.path} cannot be written ({error.strerror or error}); what it holds is safe.",
                "Free space on its disk or record to another one.",
            ) from error
        self.size += len(data)

    def _measure(self) -> None:
        """Finds out whether somebody else has moved the end of the file. Raises OSError."""
        end = self.status().st_size
        if end != self.size:
            self.size, self.cut_at, self.cuts = end, end, self.cuts + 1

    def read(self, offset: int, n: int) -> bytes:
        """n bytes of what was written, fewer where somebody cut the file short. Raises OSError."""
        self._raw.seek(offset)
        data = b""
        while len(data) < n and (more := self._raw.read(n - len(data))):
            data += more
        return data

    def take_over(self, other: RecordFile) -> None:
        """Goes on in another file, which holds the same or what is left of it; the own one is let go."""
        with contextlib.suppress(OSError):
            self._raw.close()
        self._raw, self.path = other._raw, other.path
        self.size, self.cut_at = other.size, other.cut_at

    def sync(self) -> None:
        """Puts all of it on the disk. Raises OSError: some systems say only then that there was no room."""
        os.fsync(self._raw.fileno())

    def flush(self) -> None:
        """Nothing is ever buffered here."""

    def tell(self) -> int:
        """Where the next record begins."""
        return self.size

    def close(self) -> None:
        """Ends writing. Raises OSError: some systems say only then that there was no room."""
        self._raw.close()

    def remove(self) -> None:
        """Ends writing and takes the file away, unless its name leads to another one by now, or the system cannot
        say so. Never raises."""
        if self._raw.closed:
            return
        with contextlib.suppress(OSError):
            status = self.status()
            if os.name == "nt":  # where an open file cannot be taken away, or replaced
                self._raw.close()
            if is_at(status, self.path):
                self.path.unlink()
        with contextlib.suppress(OSError):
            self._raw.close()


def _appending(path: str, flags: int) -> int:
    return os.open(path, flags | os.O_APPEND, 0o666)
