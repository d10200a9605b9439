"""Files that processes left which were ended in the middle, and that nobody needs: to be cleared, never of one that
lives."""

from __future__ import annotations

import os
import shutil
import sys
import tempfile
import time
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from app.left_behind.cut_takes import copies_alone, cut_before_a_frame, holds_nothing, source_of
from app.settings import default_path
from core.takes import drafts
from core.takes.lock import in_use
from core.takes.seal import COPY_SUFFIX
from core.takes.take import EXTENSION

_STILL_S = 600.0
"""What was written to within this time, and has no lock that would tell, may be in use [s]."""
_TRAINING_STILL_S = 86400.0


@dataclass(frozen=True)
class Leftover:
    """path: of a file or folder. what: in words, with why it can go. bytes: of all of it."""

    path: Path
    what: str
    bytes: int


def leftovers(takes: Path) -> list[Leftover]:
    """All that is found beside takes, among the temporary files and beside the settings. takes: their folder."""
    return [Leftover(path, what, _bytes(path)) for path, what in dict(_found(takes)).items()]


def clear(takes: Path, files: Iterable[Leftover]) -> tuple[list[Leftover], dict[Path, str]]:
    """Removes those that are still of no use to anybody: some time may have gone by since they were found. Returns what
    is gone, and why the system refused the others."""
    gone, refused = [], {}
    there = {one.path for one in leftovers(takes)}
    for one in files:
        if one.path not in there:
            continue
        try:
            if one.path.is_dir() and not one.path.is_symlink():
                shutil.rmtree(one.path)
            else:
                one.path.unlink(missing_ok=True)
        except OSError as error:
            refused[one.path] = error.strerror or str(error)
        else:
            gone.append(one)
    return gone, refused


def _found(takes: Path) -> Iterator[tuple[Path, str]]:
    with suppress(OSError):
        for copy in sorted(takes.glob(f"*{EXTENSION}{COPY_SUFFIX}")):
            source = source_of(copy)
            if source is not None and not in_use(source, copy) and _unused(copy, source):
                yield copy, f"a copy of {source.name} that was being made; the take itself is there"
    for copy in copies_alone(takes):
        if holds_nothing(copy):
            yield copy, "the beginning of a copy of a take that is gone; it holds no frame"
    for take in cut_before_a_frame(takes):
        yield take, "a take that was cut off before its first frame"
    for folder in (takes, *_folders_in(takes)):
        with suppress(OSError):
            for path in drafts.left(folder, drafts.EXPORT):
                yield path, "an export that was not finished: it can be made again"
    with suppress(OSError):
        for path in drafts.left(takes, drafts.IMPORT):
            yield path, "an import that was not finished: it can be made again"
    temporary = Path(tempfile.gettempdir())
    with suppress(OSError):
        for path in drafts.left(temporary, drafts.SOLVED):
            if _ours(path):
                yield path, "a solution that was not saved: its take can be solved again"
        for path in temporary.glob("phalanx-training-*"):
            if _ours(path) and _still_s(path) > _TRAINING_STILL_S:
                yield path, "the layout of a training that was ended"
    with suppress(OSError):
        for path in (takes / "networks").glob("*.onnx.part"):
            if _still_s(path) > _STILL_S:
                yield path, "half of a network"
    with suppress(OSError):
        for path in default_path().parent.glob("settings.*.part"):
            if _still_s(path) > _STILL_S:
                yield path, "half of the settings, which are there"


def _folders_in(takes: Path) -> list[Path]:
    """Exports go to folders beside their takes."""
    with suppress(OSError):
        return sorted(path for path in takes.iterdir() if path.is_dir() and not path.name.startswith("."))
    return []


def _unused(copy: Path, source: Path) -> bool:
    """A copy of a take by its own name is made under the lock of that take; others may be in use unlocked."""
    return copy.name == source.name + COPY_SUFFIX or _still_s(copy) > _STILL_S


def _ours(path: Path) -> bool:
    return sys.platform == "win32" or path.stat().st_uid == os.getuid()


def _still_s(path: Path) -> float:
    return time.time() - path.stat().st_mtime


def _bytes(path: Path) -> int:
    total = 0
    for one in (path, *path.rglob("*")) if path.is_dir() else (path,):
        with suppress(OSError):
            status = one.lstat()
            total += status.st_size if not one.is_dir() else 0
    return total
