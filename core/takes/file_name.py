"""File names of takes that leave room for what is put behind them: `_rescued`, `_recovered`, `.sealing`."""

from __future__ import annotations

from pathlib import Path

from core.errors import TakeError

MOST_BYTES = 255
"""Of a file name on every usual file system [byte]."""

MOST_TAKE_BYTES = 220
"""Of the file name of a take [byte]: its copies are named after it, one after another."""


def check_take_name(path: Path) -> None:
    """Raises TakeError for a file name that would leave its copies none."""
    if (size := len(path.name.encode(errors="replace"))) > MOST_TAKE_BYTES:
        raise TakeError(
            f"The file name {path.name[:40]}… takes {size} bytes, and a take's may take {MOST_TAKE_BYTES}: its "
            "sealed or rescued copy needs a longer one.",
            "Choose a shorter name.",
        )


def longer_name(stem: str, ending: str, room: int = 0) -> str:
    """stem + ending, the stem cut where that would be too long for a file name. room: bytes kept free behind it."""
    data = stem.encode(errors="surrogateescape")
    most = MOST_BYTES - len(ending.encode()) - room
    if len(data) <= most:
        return stem + ending
    return data[:most].decode(errors="ignore") + ending
