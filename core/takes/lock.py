"""One process at a time may write to a take."""

from __future__ import annotations

import sys
from pathlib import Path

from core.errors import TakeError


def lock(fd: int, path: Path) -> None:
    """Locks an open file until it is closed. Raises TakeError if another has it.

    Windows needs none of this: there a file that somebody writes to cannot be replaced.
    """
    if sys.platform == "win32":
        return
    import fcntl

    try:
        fcntl.flock(fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError as error:
        raise TakeError(f"Take {path} is being recorded or sealed.", "Wait until that is done.") from error
    except OSError:
        pass  # a file system without locks (some network shares): as safe as anything else there
