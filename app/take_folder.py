"""A take folder that has gone, by itself or with its disk: takes must not go to where it was."""

from __future__ import annotations

from pathlib import Path

from core.errors import TakeError
from core.takes.take import EXTENSION


class TakeFolder:
    """Knows a folder again. One that is not there is made by the first take, but for one that was there with takes in
    it and was renamed or moved, and one on a disk that was unmounted or a share that is away: takes would lie apart
    from those before, or under the disk, seen by nobody once it is back.

    meant: it may be made with all the folders that it lies in, for somebody chose it just now.
    """

    def __init__(self, folder: Path, meant: bool) -> None:
        self.folder, self._meant = folder, meant
        self._disk: int | None = None
        self._held_takes = False  # at any time since then

    def take_begun(self) -> None:
        """A take is being recorded into it."""
        self._held_takes = True

    def check(self) -> None:
        """Raises TakeError where it is away, or its disk is."""
        folder = self.folder
        there = folder.is_dir()
        gone = TakeError(
            f"The take folder {folder} is not there.", "Connect its disk or network folder, or choose another folder."
        )
        if not there and not self._meant and not folder.parent.is_dir():
            raise gone
        disk, holds_takes = _disk_of(folder), there and _holds_takes(folder)
        moved = self._disk is not None and disk != self._disk
        if moved and (not there or (self._held_takes and not holds_takes)):
            raise gone
        if not there and self._held_takes:
            raise TakeError(
                f"The take folder {folder} is not there, and it held takes.",
                "Choose it where it is now if it was renamed or moved, or choose another folder.",
            )
        if there:
            self._meant, self._disk = False, disk
            self._held_takes = self._held_takes or holds_takes


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
