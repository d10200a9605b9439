"""Writing a take while it is recorded: every record goes to the operating system before the next one is taken."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable, Sequence
from io import FileIO
from pathlib import Path
from typing import IO, cast

from mcap.writer import IndexType, Writer

from core.cast import cast_of
from core.errors import TakeError
from core.frames import MarkerFrame, TrackedFrame
from core.profile import Profile
from core.takes.codec import encode_mark, encode_raw, encode_solved
from core.takes.container import MARK, RAW, SOLVED, TOPICS, Clock, add_info, begin
from core.takes.lock import lock
from core.takes.records import MAX_MESSAGE, MESSAGE_HEAD
from core.takes.seal import seal_take
from core.takes.take import EXTENSION, MOST_PERFORMERS, Mark, TakeCounts, TakeInfo, library_versions


class TakeWriter:
    """A take being recorded. Synchronous, for one thread; starts none.

    When `raw` or `solved` returns, the frame is acknowledged: it is with the operating system, and the end of this
    process by whatever means does not lose it. When one raises TakeError, that frame alone is not in the take; what
    was written stays readable, and the next frame may be tried.
    """

    def __init__(self, path: Path | str, info: TakeInfo, profiles: Profile | Sequence[Profile]) -> None:
        """Creates the file and its folder. Raises TakeError; never overwrites. profiles: of each performer."""
        self.path = Path(path)
        self.info = info
        self._counts = dict.fromkeys(TOPICS, 0)
        self._clock = Clock(info.created_utc.timestamp())
        performers = cast_of(profiles)
        self._n_performers = len(performers)
        if len(performers) > MOST_PERFORMERS:
            raise TakeError(
                f"{len(performers)} performers in take {self.path}.", f"It holds {MOST_PERFORMERS} at most."
            )
        if self.path.suffix != EXTENSION:
            raise TakeError(f"A take cannot be named {self.path.name!r}.", f"Its file name must end in {EXTENSION}.")
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self._file = _RecordFile(self.path)
        except FileExistsError as error:
            raise TakeError(
                f"Take {self.path} exists already.", "Takes are never overwritten: choose another name."
            ) from error
        except OSError as error:
            raise TakeError(f"Take {self.path} cannot be created ({error.strerror or error}).", _REMEDY) from error
        # The index is made when the take is sealed; keeping one here would only cost memory.
        self._mcap = Writer(cast(IO[bytes], self._file), use_chunking=False, index_types=IndexType.NONE)
        try:
            begin(self._mcap, info, [profile.to_json().encode() for profile in performers], library_versions())
            self._mcap.flush()  # type: ignore[no-untyped-call]
        except TakeError:
            self._file.close()
            self.path.unlink()
            raise

    @property
    def bytes_written(self) -> int:
        """Size of the file now."""
        return self._file.size

    @property
    def acknowledged(self) -> int:
        """Raw frames that the operating system holds."""
        return self._counts[RAW]

    @property
    def acknowledged_solved(self) -> int:
        """Solved frames that the operating system holds."""
        return self._counts[SOLVED]

    def raw(self, frame: MarkerFrame) -> None:
        """Adds a frame as the device sent it. Raises TakeError."""
        log_ns, publish_ns = self._clock.stamp(frame.times)
        self._add(RAW, log_ns, publish_ns, encode_raw(frame))

    def solved(self, frame: TrackedFrame) -> None:
        """Adds a frame as the engine solved it. Raises TakeError."""
        log_ns, publish_ns = self._clock.stamp(frame.times)
        self._add(SOLVED, log_ns, publish_ns, encode_solved(frame))

    def mark(self, mark: Mark) -> None:
        """Adds a mark. Raises TakeError."""
        log_ns = self._clock.at(mark.time_s)
        self._add(MARK, log_ns, log_ns, encode_mark(mark))

    def set_info(self, info: TakeInfo) -> None:
        """Says something else of the take, such as its notes. Raises TakeError; sealing says it all the same."""
        self.info = info
        add_info(self._mcap, info, self._n_performers)

    def seal(self, counts: TakeCounts, progress: Callable[[float], None] | None = None) -> None:
        """Ends the recording: replaces the file by its indexed, compressed copy once that is known to hold every
        record. May be repeated after a TakeError; until it succeeds the file as recorded stays and can be read."""
        self.close()
        seal_take(self.path, counts, progress, self.info)

    def close(self) -> None:
        """Ends the recording without sealing; the take can be read, and sealed later with seal_take."""
        self._file.close()

    def _add(self, topic: str, log_ns: int, publish_ns: int, data: bytes) -> None:
        if len(data) > MAX_MESSAGE - MESSAGE_HEAD.size:
            raise TakeError(
                f"A frame of {len(data)} bytes is too large for take {self.path}, which takes {MAX_MESSAGE} at most.",
                "Check what the device sends.",
            )
        sequence = self._counts[topic]
        self._mcap.add_message(TOPICS[topic], log_ns, data, publish_ns, sequence)
        self._counts[topic] = sequence + 1


_REMEDY = "Choose a folder that exists, can be written to and has room."


class _RecordFile:
    """Unbuffered output for `mcap.writer.Writer`, which hands over whole records: all of a record is written or
    nothing, so that a full disk leaves a file that ends with a whole record."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._raw = FileIO(path, "xb")
        self.size = 0
        lock(self._raw.fileno(), path)

    def write(self, data: bytes | bytearray | memoryview) -> None:
        if self._raw.closed:
            raise TakeError(f"Take {self._path} is not being recorded any more.", "Start a new take.")
        rest = memoryview(data)
        try:
            while rest:
                rest = rest[self._raw.write(rest) :]
        except OSError as error:
            with contextlib.suppress(OSError):
                os.ftruncate(self._raw.fileno(), self.size)
                self._raw.seek(self.size)
            raise TakeError(
                f"Take {self._path} cannot be written ({error.strerror or error}); what it holds is safe.",
                "Free space on its disk or record to another one.",
            ) from error
        self.size += len(data)

    def flush(self) -> None:
        """Nothing is ever buffered here."""

    def tell(self) -> int:
        return self.size

    def close(self) -> None:
        self._raw.close()
