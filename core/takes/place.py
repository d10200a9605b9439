"""Where the file of an open take lies now: while it is written it can be deleted, moved or replaced, by a folder that
synchronises itself, by a script that cleans up, by a disk that is unmounted."""

from __future__ import annotations

import os
import sys
from dataclasses import dataclass
from enum import Enum
from pathlib import Path

from core.errors import TakeError
from core.takes.take import EXTENSION

_BINS = frozenset({"trash", "$recycle.bin", "recycler"})


class Fate(Enum):
    """What became of the name under which a take is written, as a clause."""

    HERE = "is where it was"
    MOVED = "was moved"
    DELETED = "was deleted"
    REPLACED = "was replaced by another file"
    CUT = "was cut short or written into by another program"
    UNREACHABLE = "cannot be reached any more: its folder or its disk is gone"


@dataclass(frozen=True)
class Place:
    """fate: of the name that it had. path: where the open file is found now, None if nowhere is known."""

    fate: Fate
    path: Path | None


class DisplacedError(TakeError):
    """The name of a take leads to another file, or to none: nothing is put in its place."""

    def __init__(self, path: Path) -> None:
        super().__init__(
            f"Take {path} was deleted, moved or replaced by another program.",
            "Look for it where it was put; what lies there now is left alone.",
        )


def is_at(file: os.stat_result, path: Path) -> bool:
    """Whether a name leads to this very file, as `os.fstat` gave it. A name that cannot be asked leads nowhere."""
    try:
        return os.path.samestat(path.stat(), file)
    except OSError:
        return False


def place_of(fd: int, path: Path) -> Place:
    """Where the open file is that was created as `path`. Never raises."""
    try:
        file = os.fstat(fd)
    except OSError:  # a network disk that has forgotten it
        return Place(Fate.UNREACHABLE, None)
    if is_at(file, path):
        return Place(Fate.HERE, path)
    taken = os.path.lexists(path)
    if file.st_nlink == 0:
        return Place(Fate.REPLACED if taken else Fate.DELETED, None)
    now = _name_now(fd)
    if now is None or not is_at(file, now):
        return Place(Fate.REPLACED if taken else Fate.UNREACHABLE, None)
    return Place(Fate.DELETED, None) if _thrown_away(now, path) else Place(Fate.MOVED, now)


def _name_now(fd: int) -> Path | None:
    """The name that the system knows for an open file; None where it cannot be asked."""
    try:
        if sys.platform == "linux":
            return Path(os.readlink(f"/proc/self/fd/{fd}"))  # noqa: PTH115 (no path of a file)
        if sys.platform == "darwin":
            import fcntl

            return Path(os.fsdecode(fcntl.fcntl(fd, fcntl.F_GETPATH, bytes(1024)).rstrip(b"\0")))
    except OSError:
        pass
    return None


def _thrown_away(now: Path, before: Path) -> bool:
    """Whether a file was moved where nobody looks for a take, such as a waste bin or a hidden folder."""
    hidden = any(part.startswith(".") and part not in before.parts for part in now.parts)
    return hidden or now.suffix != EXTENSION or any(part.lower() in _BINS for part in now.parts[:-1])
