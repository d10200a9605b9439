"""The file that a take is recorded into."""

from __future__ import annotations

import contextlib
import os
from io import FileIO
from pathlib import Path

from core.errors import TakeError
from core.takes.lock import lock
from core.takes.place import Place, is_at, place_of


class RecordFile:
    """Unbuffered output for `mcap.writer.Writer`, which hands over whole records: all of a record is written or
    nothing, so that a full disk leaves a file that ends with a whole record. For one thread."""

    def __init__(self, path: Path) -> None:
        """Raises FileExistsError or another OSError, or TakeError, and then leaves nothing behind."""
        self.path = path
        self._raw = FileIO(path, "x+b")
        self.size = 0
        self.cut = 0  # bytes that another program took off its end; seen here, for the next record hides it
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
        """Where it lies now."""
        return place_of(self._raw.fileno(), self.path)

    def status(self) -> os.stat_result:
        """Of the open file, whatever its name leads to. Raises OSError."""
        return os.fstat(self._raw.fileno())

    def write(self, data: bytes | bytearray | memoryview) -> None:
        """Appends a record. Raises TakeError, and then nothing of it is in the file."""
        if self._raw.closed:
            raise TakeError(f"Take {self.path} is not being recorded any more.", "Start a new take.")
        rest = memoryview(data)
        try:
            if not self.cut:
                self.cut = max(self.size - os.fstat(self._raw.fileno()).st_size, 0)
            while rest:
                rest = rest[self._raw.write(rest) :]
        except OSError as error:
            with contextlib.suppress(OSError):
                os.ftruncate(self._raw.fileno(), self.size)
                self._raw.seek(self.size)
            raise TakeError(
                f"Take {self.path} cannot be written ({error.strerror or error}); what it holds is safe.",
                "Free space on its disk or record to another one.",
            ) from error
        self.size += len(data)

    def read(self, offset: int, n: int) -> bytes:
        """n bytes of what was written, fewer where somebody cut the file short. Raises OSError."""
        try:
            self._raw.seek(offset)
            data = b""
            while len(data) < n and (more := self._raw.read(n - len(data))):
                data += more
            return data
        finally:
            self._raw.seek(self.size)

    def take_over(self, other: RecordFile) -> None:
        """Goes on in another file, which holds the same; the own one is let go."""
        with contextlib.suppress(OSError):
            self._raw.close()
        self._raw, self.path = other._raw, other.path

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
        """Ends writing and takes the file away, unless its name leads to another one by now."""
        if self._raw.closed:
            return
        status = self.status()
        if os.name == "nt":  # where an open file cannot be taken away, or replaced
            self._raw.close()
        with contextlib.suppress(OSError):
            if is_at(status, self.path):
                self.path.unlink()
        with contextlib.suppress(OSError):
            self._raw.close()
