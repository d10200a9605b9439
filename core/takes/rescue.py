"""A take whose file was deleted, replaced or cut short under the recorder: what is still behind the open descriptor is
copied to a file that nobody else has, before anything can end this process."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Sequence
from pathlib import Path

from core.errors import TakeError
from core.takes.record_file import RecordFile
from core.takes.take import EXTENSION

RESCUED = "_rescued"
"""Behind the name of a take: its copy."""

SLICE = 1 << 22
"""Bytes copied at a time, so that frames are written between."""


def rescued_in(folder: Path, path: Path) -> list[Path]:
    """Rescued takes of a folder that were recorded under this name, the latest first."""
    found: dict[Path, float] = {}
    with contextlib.suppress(OSError):
        for file in folder.iterdir():
            if file.suffix == EXTENSION and file.stem.rstrip("0123456789") == path.stem + RESCUED:
                found[file] = file.stat().st_mtime
    return sorted(found, key=found.__getitem__, reverse=True)


class Rescue:
    """The copy of an open take, made slice by slice while its recording goes on.

    unreadable: bytes that the disk did not give back; zeros stand for them, so that all others keep their place.
    """

    def __init__(self, source: RecordFile, beginning: bytes, folders: Sequence[Path], stem: str) -> None:
        """beginning: of the file, before its first frame: the copy has it whatever became of the source's. folders:
        where the copy may go, the best first. stem: the take's name. Raises TakeError if none takes it."""
        self._source, self._beginning, self._folders, self._stem = source, beginning, list(folders), stem
        self._at = self.unreadable = 0
        self._cuts = source.cuts
        self.target = self._begin()

    @property
    def done(self) -> bool:
        """Whether the copy holds everything."""
        return self._at == self._source.size

    @property
    def share(self) -> float:
        """How much is copied, 0 to 1."""
        return self._at / max(self._source.size, 1)

    def step(self) -> bool:
        """Copies a slice; whether that was the last. A folder that has no room is left for the next. Raises TakeError
        if there is none."""
        if self._source.cuts != self._cuts:  # meanwhile: what came after it lies where this has been already
            self._cuts, self._at = self._source.cuts, min(self._at, self._source.cut_at or 0)
        n = min(SLICE, self._source.size - self._at)
        try:
            self.target.write(self._slice(n))
        except TakeError:
            self.target.remove()
            self.target, self.unreadable = self._begin(), 0
            return False
        self._at += n
        return self.done

    def give_up(self) -> None:
        """Takes away what is copied."""
        self.target.remove()

    def _slice(self, n: int) -> bytes:
        try:
            data = self._source.read(self._at, n)
        except OSError:
            data = b""
        self.unreadable += n - len(data)
        return data.ljust(n, b"\0")

    def _begin(self) -> RecordFile:
        why = "no folder is left to try"
        while self._folders:
            folder = self._folders.pop(0)
            try:
                folder.mkdir(parents=True, exist_ok=True)
                target = _free_file(folder, self._stem)
            except OSError as error:
                why = f"{folder}: {error.strerror or error}"
                continue
            try:
                target.write(self._beginning)
            except TakeError as error:
                target.remove()
                why = error.what.rstrip(".")
                continue
            self._at = self._first()
            return target
        raise TakeError(
            f"What take {self._source.path} holds could not be copied to a safe place ({why}).",
            "Free some space; it is tried again while the recording runs and when it ends.",
        )

    def _first(self) -> int:
        """Where in the source the copy goes on behind the beginning. Of a file that was cut, what stood before counts
        only if it begins as the take does: another program may have written a file of its own over it."""
        cut_at, n = self._source.cut_at, len(self._beginning)
        if cut_at is None:
            return n
        try:
            own = cut_at >= n and self._source.read(0, n) == self._beginning
        except OSError:
            own = False
        return n if own else cut_at


def _free_file(folder: Path, stem: str) -> RecordFile:
    for name in _names(stem):
        with contextlib.suppress(FileExistsError):
            return RecordFile(folder / name)
    raise AssertionError("names do not end")


def _names(stem: str) -> Iterator[str]:
    number = 1
    while True:
        yield f"{stem}{RESCUED}{number if number > 1 else ''}{EXTENSION}"
        number += 1
