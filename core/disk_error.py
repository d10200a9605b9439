"""What to do when the system refuses to write: advice that fits its reason."""

from __future__ import annotations

import errno
import os
from pathlib import Path

_FULL = (errno.ENOSPC, errno.EDQUOT)
_FORBIDDEN = (errno.EACCES, errno.EPERM, errno.EROFS)


def why(path: Path, error: OSError) -> str:
    """The reason in words. path: the folder or file that was to be written; a file that stands where a folder is needed
    is named."""
    if isinstance(error, FileExistsError | NotADirectoryError) and (text := in_the_way(path)):
        return text
    return error.strerror or str(error)


def remedy(error: OSError) -> str:
    """What to do about it, as a sentence."""
    if error.errno in _FULL:
        return "Free space on its disk and try again."
    if error.errno in _FORBIDDEN:
        return "Choose a folder that you may write to, or have its permissions changed."
    if error.errno == errno.EFBIG:
        return "Choose a folder on another disk: this one takes no larger file."
    if error.errno == errno.ENAMETOOLONG:
        return "Give it a shorter name."
    if isinstance(error, FileExistsError | NotADirectoryError):
        return "Choose another folder."
    return "Check its disk and try again, or choose another folder."


def in_the_way(folder: Path) -> str:
    """What stands where a folder is, or is to be made, as words; "" if nothing does."""
    for path in (folder, *folder.parents):
        try:
            if path.is_dir():
                return ""
            if os.path.lexists(path):
                kind = "a file" if path.exists() else "a link that leads nowhere"
                return f"{path} is {kind}, not a folder"
        except (OSError, ValueError):
            return ""
    return ""
