"""Where a command is to write, looked at before anything is begun: a device, a pipe or a folder is no file, and nothing
but a folder holds files."""

from __future__ import annotations

import stat
from pathlib import Path

from core.disk_error import in_the_way
from core.errors import PhalanxError

_KINDS = (
    (stat.S_ISDIR, "a folder"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
    (stat.S_ISFIFO, "a pipe"),
    (stat.S_ISSOCK, "a socket"),
)


def out_file(text: str) -> Path:
    """The file that is to be written; it may be there already. For argparse. Raises PhalanxError."""
    kind = _kind(text)
    if kind:
        raise PhalanxError(
            f"{text or '.'} is {kind}, not a file: nothing is written there.", "Give the name of a file."
        )
    if wrong := in_the_way(Path(text).parent):
        raise PhalanxError(f"{wrong}: nothing is written there.", "Give the name of a file in a folder.")
    return Path(text)


def out_folder(text: str) -> Path:
    """The folder for files; it need not be there. For argparse. Raises PhalanxError."""
    kind = _kind(text)
    if kind not in ("", "a folder"):
        raise PhalanxError(f"{text} is {kind}, not a folder: nothing is written there.", "Give the name of a folder.")
    if text and (wrong := in_the_way(Path(text))):
        raise PhalanxError(f"{wrong}: nothing is written there.", "Give the name of a folder.")
    return Path(text)


def _kind(text: str) -> str:
    """What has this name, if it is no ordinary file; "" if it is, or nothing has it."""
    try:
        mode = Path(text).stat().st_mode
    except (OSError, ValueError):  # whoever writes there says why not
        return ""
    return next((kind for is_kind, kind in _KINDS if is_kind(mode)), "")
