"""Takes whose recording was cut off: readable up to their last frame, and to be made whole."""

from __future__ import annotations

import re
import time
from collections.abc import Collection, Iterable
from contextlib import closing
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from core.errors import PhalanxError, TakeError
from core.takes.index import has_ending
from core.takes.lock import in_use as may_be_in_use
from core.takes.lock import locked
from core.takes.records import TakeFile
from core.takes.scan import scan
from core.takes.seal import COPY_SUFFIX
from core.takes.take import EXTENSION

_STILL_S = 60.0
_MOST_WITHOUT_FRAMES = 1 << 24
"""A larger take holds frames: it is not read to its end to find out [byte]."""
_MADE_OF_ANOTHER = re.compile(r"_(?:recovered|solved)\d*$")


@dataclass(frozen=True)
class CutTake:
    """path: the take, or, where that is gone, the copy of it that was being made (`only_copy`). bytes: its size.
    changed: when it was written last."""

    path: Path
    bytes: int
    changed: datetime
    only_copy: bool = False


def cut_takes(folder: Path, told: Iterable[Path] = (), in_use: Collection[Path] = ()) -> list[CutTake]:
    """Those of a folder, and those of `told` that are elsewhere; the last one first.

    told: takes that an ended process was recording. in_use: takes that one which lives is. Not among them are takes
    with a recovered one beside, which is what is left to do about them.
    """
    ended = dict.fromkeys(told)
    paths = dict.fromkeys([*ended, *_of(folder, EXTENSION)])
    found = [
        _seen(path) for path in paths if path not in in_use and _cut(path, path in ended) and not _of_no_frame(path)
    ]
    found += [_seen(path, only_copy=True) for path in copies_alone(folder) if not holds_nothing(path)]
    return sorted((one for one in found if one is not None), key=lambda one: one.changed, reverse=True)


def cut_before_a_frame(folder: Path) -> list[Path]:
    """Takes that were cut off before anything came: there is nothing to be made whole."""
    return [path for path in _of(folder, EXTENSION) if _still(path) and _cut(path, ended=False) and _of_no_frame(path)]


def copies_alone(folder: Path) -> list[Path]:
    """Copies of takes that were being made, `<take>.mcap.sealing`, whose take is gone."""
    return [path for path in _of(folder, EXTENSION + COPY_SUFFIX) if source_of(path) is None and _still(path)]


def holds_nothing(path: Path) -> bool:
    """Whether it is known that no frame and no mark can be recovered from a file: empty, or cut off before the first.
    What cannot be read, or is of a newer Phalanx, may hold something."""
    try:
        with closing(TakeFile(path)) as file:
            return not file.size or not any(len(places) for places in scan(file).topics.values())
    except (PhalanxError, OSError):
        return False


def source_of(copy: Path) -> Path | None:
    """The take of which this file, `<take>.mcap.sealing`, is a copy; None if that is gone."""
    take = copy.with_name(copy.name.removesuffix(COPY_SUFFIX))
    original = take.with_name(_MADE_OF_ANOTHER.sub("", take.stem) + EXTENSION)
    return next((path for path in (take, original) if path.exists()), None)


def restore(copy: Path) -> Path:
    """Makes a take of a copy whose take is gone, which is to be made whole like any other. Raises TakeError."""
    take = copy.with_name(copy.name.removesuffix(COPY_SUFFIX))
    if take.exists():
        raise TakeError(f"Take {take} is there again.", "Nothing has to be recovered; clear the copy.")
    try:
        return copy.rename(take)
    except OSError as error:
        raise TakeError(
            f"{copy} cannot be renamed ({error.strerror or error}).", f"Rename it to {take.name} by hand."
        ) from error


def _of(folder: Path, ending: str) -> list[Path]:
    try:
        return sorted(path for path in folder.iterdir() if path.name.endswith(ending) and path.is_file())
    except OSError:
        return []


def _still(path: Path) -> bool:
    """Nobody writes to it: nothing else tells of a copy whose take is gone."""
    try:
        return time.time() - path.stat().st_mtime > _STILL_S
    except OSError:
        return False


def _cut(path: Path, ended: bool) -> bool:
    """ended: whether the process that recorded it has."""
    try:
        with closing(TakeFile(path)) as file:
            if not file.size or has_ending(file):
                return False
        if locked(path) if ended else may_be_in_use(path, path):
            return False
        return not any(path.parent.glob(f"{_escaped(path.stem)}_recovered*{EXTENSION}"))
    except (PhalanxError, OSError):
        return False


def _of_no_frame(path: Path) -> bool:
    try:
        return path.stat().st_size <= _MOST_WITHOUT_FRAMES and holds_nothing(path)
    except OSError:
        return False


def _escaped(stem: str) -> str:
    return re.sub(r"([*?[])", r"[\1]", stem)


def _seen(path: Path, only_copy: bool = False) -> CutTake | None:
    try:
        status = path.stat()
    except OSError:
        return None
    return CutTake(path, status.st_size, datetime.fromtimestamp(status.st_mtime), only_copy)
