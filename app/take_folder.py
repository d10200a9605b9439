"""A take folder whose disk has gone: takes must not go to where it was."""

from __future__ import annotations

from pathlib import Path

from core.errors import TakeError
from core.takes.take import EXTENSION


class TakeFolder:
    """Knows the folder of the last take again. One that is not there is made by the first take, but for one on a disk
    that was unmounted or a share that is away: there, takes would lie under it, seen by nobody once it is back."""

    def __init__(self) -> None:
        self._folder, self._disk, self._held_takes = Path(), 0, False

    def check(self, folder: Path, may_be_made: bool) -> None:
        """may_be_made: although the folder that it lies in is not there either. Raises TakeError where its disk is
        away."""
        there = folder.is_dir()
        gone = TakeError(
            f"The take folder {folder} is not there.", "Connect its disk or network folder, or choose another folder."
        )
        if not there and not may_be_made and not folder.parent.is_dir():
            raise gone
        disk, holds_takes = _disk_of(folder), there and _holds_takes(folder)
        if folder == self._folder and disk != self._disk and (not there or (self._held_takes and not holds_takes)):
            raise gone
        if there:
            self._folder, self._disk, self._held_takes = folder, disk, holds_takes


def _disk_of(folder: Path) -> int:
    """The disk that a folder is on, or would be."""
    for place in (folder, *folder.parents):
        try:
            return place.stat().st_dev
        except OSError:
            continue
    return 0


def _holds_takes(folder: Path) -> bool:
    try:
        return any(path.suffix.lower() == EXTENSION for path in folder.iterdir())
    except OSError:
        return False
