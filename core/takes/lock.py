"""One process at a time may write to a take, and whether one does can be asked."""

from __future__ import annotations

import os
import sys
import time
from contextlib import suppress
from pathlib import Path

from core.errors import TakeError

UNLOCKED_S = 86400.0
"""What cannot be locked may be in use until nothing of it was written for so long [s]. Age tells it, for the number of
a process may be another's by then, or be of another computer; a day, for a share may hang and a computer sleep for
hours."""


def lock(fd: int, path: Path) -> bool:
    """Locks an open file until it is closed; whether that could be done: some file systems, as of network shares, have
    no locks, and it is as safe as anything else there. Raises TakeError if another has it.

    Windows needs none of this: there a file that somebody writes to cannot be replaced.
    """
    if sys.platform == "win32":
        return True
    import fcntl

    try:
        fcntl.flock(fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError as error:
        raise TakeError(f"Take {path} is being recorded or sealed.", "Wait until that is done.") from error
    except OSError:
        return False
    return True


def locked(path: Path) -> bool | None:
    """Whether a process holds the lock of this file; None where that cannot be told: it is gone, or its file system has
    no locks. What must not be asked about is another's."""
    try:
        if sys.platform == "win32":
            path.rename(path)  # refused while it is open
            return False
        return _flocked(path)
    except (BlockingIOError, PermissionError):
        return True
    except OSError:
        return None


def in_use(path: Path, made: Path) -> bool:
    """Whether a process may be at `made`, a file or a folder, for which it holds the lock of `path`."""
    held = locked(path)
    return written_lately(made) if held is None else held


def written_lately(made: Path) -> bool:
    """Whether anything of a file or folder was written so lately that a process may be at it that has no lock."""
    newest_s = 0.0
    with suppress(OSError):
        for one in (made, *made.rglob("*")):
            newest_s = max(newest_s, one.lstat().st_mtime)
    return time.time() - newest_s < UNLOCKED_S


def _flocked(path: Path) -> bool:
    """Raises BlockingIOError if another has the lock, and OSError where nobody can have it."""
    if sys.platform != "win32":
        import fcntl

        fd = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
        try:
            fcntl.flock(fd, fcntl.LOCK_SH | fcntl.LOCK_NB)  # network disks lock more only for those who may write
        finally:
            os.close(fd)
    return False
