"""One take as a line of the browser: its figures and what is wrong with it, in words. Knows no window."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from core.errors import PhalanxError
from core.level import Level
from core.printable import printable
from core.takes.reader import Take, open_take
from core.takes.take import EXTENSION


@dataclass(frozen=True)
class TakeRow:
    """What the browser shows of a file. frames and duration_s are 0 and hands (as L R) empty for what cannot be read.
    frames: of the stream that was solved; where none was, of all.

    problems: sentences; () for a good take. level: the light. looked_back: it was saved after it had happened.
    """

    path: Path
    name: str
    created: datetime
    bytes: int
    modified_s: float
    duration_s: float = 0.0
    frames: int = 0
    hands: str = ""
    rating: str = ""
    performer: str = ""
    sealed: bool = True
    readable: bool = True
    damaged: bool = False
    level: Level = Level.GOOD
    problems: tuple[str, ...] = ()
    looked_back: bool = False


def take_files(folder: Path) -> list[Path]:
    """The takes of a folder, the newest first. Raises OSError if it cannot be listed."""
    modified_s: dict[Path, float] = {}
    for path in folder.iterdir():
        if path.suffix == EXTENSION and path.is_file():
            with suppress(FileNotFoundError):  # gone since the folder was listed
                modified_s[path] = path.stat().st_mtime
    return sorted(modified_s, key=modified_s.__getitem__, reverse=True)


def unread_row(path: Path) -> TakeRow:
    """The line of a file that is not read yet."""
    return TakeRow(path, printable(path.stem), datetime.now(UTC), 0, 0.0, level=Level.IDLE)


def read_row(path: Path) -> TakeRow:
    """The line of one file. Never raises: what is wrong is in it."""
    name = printable(path.stem)
    try:
        size, modified_s = path.stat().st_size, path.stat().st_mtime
    except OSError as error:
        why = (f"It cannot be read ({error.strerror or error}).",)
        return TakeRow(path, name, datetime.now(UTC), 0, 0.0, readable=False, level=Level.PROBLEM, problems=why)
    created = datetime.fromtimestamp(modified_s, UTC)
    try:
        with open_take(path) as take:
            return _row(take, size, modified_s)
    except (PhalanxError, OSError) as error:
        return TakeRow(
            path, name, created, size, modified_s, readable=False, level=Level.PROBLEM, problems=(str(error),)
        )


def _row(take: Take, size: int, modified_s: float) -> TakeRow:
    verdict = take.verdict
    problems, level = verdict.texts, verdict.level
    try:
        cast = take.profiles
        between = "" if len(cast) > 1 else " "  # "L R", of two performers "LR LR"
        hands = " ".join(between.join(side[0].upper() for side in profile.sides) for profile in cast)
    except PhalanxError as error:
        hands = ""
        problems, level = (*problems, str(error)), Level.PROBLEM
    info, frames = take.info, len(take.raw) or sum(len(stream.frames) for stream in take.streams.values())
    return TakeRow(
        take.path, info.name, info.created_utc, size, modified_s, take.duration_s, frames, hands, info.rating,
        info.performer, take.sealed, True, not take.complete, level, problems, info.looked_back,
    )  # fmt: skip
