"""A recording of another program as a take: its points as raw frames, with what the engine makes of them."""

from __future__ import annotations

import contextlib
import shutil
import tempfile
import time
from collections.abc import Iterator, Sequence
from datetime import UTC, datetime
from pathlib import Path

from core.cast import Cast, performer_names
from core.errors import TakeError
from core.recording import Recording
from core.takes.lock import lock
from core.takes.take import TakeInfo

FILE_KIND = "file"
"""What a take says of its device that came from a file of another program."""

_DRAFTS = ".import-"  # not listed as a take that was cut off
_LOCK = "lock"
_LOCKED_WITHIN_S = 60.0


def info_of(path: Path, recording: Recording, cast: Cast, name: str = "") -> TakeInfo:
    """What can be said of it. Recorded: when the file says, or else when it was last changed, the nearest that every
    file tells. What its reader found amiss is kept with what the device says of itself."""
    created = datetime.now(UTC)
    if recording.recorded is not None:
        created = recording.recorded.astimezone(UTC)
    else:
        with contextlib.suppress(OSError, OverflowError, ValueError):
            created = datetime.fromtimestamp(path.stat().st_mtime, UTC)
    device = {"kind": FILE_KIND, "title": path.name}
    if recording.warnings:
        device["warnings"] = " ".join(recording.warnings)
    return TakeInfo(
        name=name or path.stem,
        performer=", ".join(filter(None, performers_of(cast))),
        created_utc=created,
        rate_hz=recording.rate_hz,
        device=device,
    )


def performers_of(cast: Cast) -> Sequence[str]:
    """The performers by name, as far as they have one."""
    return performer_names(cast) if len(cast) > 1 else (cast[0].performer,)


@contextlib.contextmanager
def draft_folder(folder: Path) -> Iterator[Path]:
    """A folder within the takes' for a take that is being made; it goes in the end. Raises OSError.

    It holds a file that is locked for as long, so that `clear_drafts` can tell it from what a process left that was
    ended in the middle: the number of a process may be another's by then, or be of another computer.
    """
    drafts = Path(tempfile.mkdtemp(prefix=_DRAFTS, dir=folder))
    try:
        with (drafts / _LOCK).open("wb") as held:
            lock(held.fileno(), drafts)
            yield drafts
    finally:
        shutil.rmtree(drafts, ignore_errors=True)


def clear_drafts(folder: Path) -> None:
    """Removes what imports left that were ended in the middle; nothing of those that run, wherever they do."""
    for drafts in folder.glob(f"{_DRAFTS}*"):
        with contextlib.suppress(OSError):
            if not _in_use(drafts):
                shutil.rmtree(drafts, ignore_errors=True)


def _in_use(drafts: Path) -> bool:
    held = drafts / _LOCK
    try:
        with held.open("r+b") as stream:
            lock(stream.fileno(), drafts)
        held.unlink()  # Windows refuses that while it is open
    except (TakeError, PermissionError):
        return True
    except FileNotFoundError:  # made in this moment, or by a version without locks
        return time.time() - drafts.stat().st_mtime < _LOCKED_WITHIN_S
    return False
