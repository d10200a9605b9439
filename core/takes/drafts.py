"""Folders for what is being made, held while somebody is at it: so what a killed process left is told from them."""

from __future__ import annotations

import contextlib
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

from core.takes import lock

IMPORT = ".import-"
"""Begins the name of a folder for a take that is being made; not listed as a take that was cut off."""
EXPORT = ".export-"
"""Of one for files of an export; the process follows."""
SOLVED = "phalanx-solved-"
"""Of one for a solution that was not saved, among the temporary files."""

_LOCK = "lock"


class Draft:
    """A folder that goes when it is closed.

    It holds a file that is locked for as long, so that `left` can tell it from what a process left that was ended in
    the middle: the number of a process may be another's by then, or be of another computer.
    """

    def __init__(self, prefix: str, folder: Path | str | None = None) -> None:
        """Within `folder`, None: among the temporary files. Raises OSError."""
        self.path = Path(tempfile.mkdtemp(prefix=prefix, dir=folder))
        try:
            self._held = (self.path / _LOCK).open("wb")
            lock.lock(self._held.fileno(), self.path)
        except BaseException:
            shutil.rmtree(self.path, ignore_errors=True)
            raise

    def close(self) -> None:
        """Removes it with all that is in it."""
        self._held.close()
        shutil.rmtree(self.path, ignore_errors=True)


@contextlib.contextmanager
def draft_folder(folder: Path) -> Iterator[Path]:
    """A folder within the takes' for a take that is being made; it goes in the end. Raises OSError."""
    draft = Draft(IMPORT, folder)
    try:
        yield draft.path
    finally:
        draft.close()


def left(folder: Path, prefix: str) -> list[Path]:
    """What killed processes left there; nothing of those that run, wherever they do. Raises OSError."""
    return [drafts for drafts in sorted(folder.glob(f"{prefix}*")) if drafts.is_dir() and not in_use(drafts)]


def clear_drafts(folder: Path) -> None:
    """Removes what imports left that were ended in the middle."""
    with contextlib.suppress(OSError):
        for drafts in left(folder, IMPORT):
            shutil.rmtree(drafts, ignore_errors=True)


def in_use(drafts: Path) -> bool:
    """Whether a process may be at it."""
    return lock.in_use(drafts / _LOCK, drafts)
