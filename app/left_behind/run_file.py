"""One small file per process in the log folder: which takes it recorded, and, should a fault end it, where that was.

It goes at a clean end. One that is left belongs to a process that was ended otherwise; while a process lives, its file
is locked.
"""

from __future__ import annotations

import faulthandler
import os
import platform
import re
import sys
import time
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

from app.notifications import log_folder
from core.errors import TakeError
from core.takes.lock import lock, locked, written_lately
from core.takes.take import program_version

if TYPE_CHECKING:
    from app.session import Session

RUNNING, REPORT = "running-", "crash-"
_RECORDING, _SEALED, _DISPLAY_GONE = "recording: ", "sealed: ", "the display went away: "
_MOVED = "no longer recorded in: "
_ENDED = "ended, and told of"
_PROCESS = re.compile(r"^process: (\d+) on (.+)$", re.MULTILINE)
_FAULT = re.compile(r"^(?:Fatal Python error|Windows fatal exception): (.+)$", re.MULTILINE)
_JUST_MADE_S = 1.0  # not locked yet
_MOST_REPORTS = 10
_MOST_BYTES = 1 << 20


class RunFile:
    """That of this process, from now until `close`. A folder that cannot be written is no reason not to run: there is
    no file then."""

    def __init__(self, what: str, folder: Path | None = None) -> None:
        """what: this process, in words."""
        now = datetime.now()
        self._path = (folder or log_folder()) / f"{RUNNING}{now:%Y%m%d-%H%M%S}-{os.getpid()}.txt"
        self._file = None
        self._before = faulthandler.is_enabled()
        with suppress(OSError, TakeError):
            self._path.parent.mkdir(parents=True, exist_ok=True)
            self._file = self._path.open("x", encoding="utf-8", buffering=1, errors="surrogateescape")
            lock(self._file.fileno(), self._path)
            self._file.write(
                f"Phalanx {program_version()}, {what}\nbegun: {now.isoformat(timespec='seconds')}\n"
                f"process: {os.getpid()} on {platform.node()}\n"
                f"Python {platform.python_version()} on {platform.platform()}\n"
            )
            faulthandler.enable(self._file)

    def follow(self, session: Session) -> None:
        """Write down which takes it begins and seals."""
        session.on_begun, session.on_moved, session.on_sealed = self.recording, self.moved, self.sealed

    def recording(self, take: Path) -> None:
        """A take has begun."""
        self._write(f"{_RECORDING}{take.absolute()}")

    def moved(self, before: Path, now: Path) -> None:
        """A take that has begun is recorded on under another name."""
        self.recording(now)
        self._write(f"{_MOVED}{before.absolute()}")

    def sealed(self, take: Path) -> None:
        """It is finished, or has left no file."""
        self._write(f"{_SEALED}{take.absolute()}")

    def display_gone(self) -> None:
        """The display went away, and with it this process will end: the next start tells of it."""
        self._write(f"{_DISPLAY_GONE}{datetime.now().isoformat(timespec='seconds')}")

    def close(self) -> None:
        """A clean end: there is nothing to tell."""
        if self._file is not None:
            faulthandler.disable()
            if self._before:
                faulthandler.enable()
            self._file.close()
            self._file = None
            with suppress(OSError):
                self._path.unlink()

    def _write(self, line: str) -> None:
        if self._file is not None:
            with suppress(OSError, ValueError):
                self._file.write(line.replace("\n", " ") + "\n")

    def __enter__(self) -> RunFile:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()


@dataclass(frozen=True)
class EndedRun:
    """A process that did not come to its end.

    path: of its file. what: the process, in words. begun: as it wrote it. fault: what ended it, "" if that is not known
    (killed, the machine lost its power). takes: those that it was recording or finishing. display_gone: when its
    display went away, if that ended it. finished: the takes that it finished after that.
    """

    path: Path
    what: str
    begun: datetime
    fault: str
    takes: tuple[Path, ...]
    display_gone: datetime | None = None
    finished: tuple[Path, ...] = ()


def ended_runs(folder: Path | None = None) -> list[EndedRun]:
    """Those whose files are left, the last one first."""
    paths = sorted((folder or log_folder()).glob(f"{RUNNING}*.txt"), reverse=True)
    return [_read(path) for path in paths if not _alive(path)]


def recorded_now(folder: Path | None = None) -> set[Path]:
    """The takes that processes which live are recording or finishing."""
    paths = (folder or log_folder()).glob(f"{RUNNING}*.txt")
    return {take for path in paths if _alive(path) for take in _read(path).takes}


def report_of(pid: int | None, folder: Path | None = None) -> Path | None:
    """The file of a process that has ended, if a fault ended it; another that it left is removed."""
    for path in (folder or log_folder()).glob(f"{RUNNING}*-{pid}.txt"):
        if not _alive(path, within_s=0.0):
            if _read(path).fault:
                return path
            path.unlink(missing_ok=True)
    return None


def settle(run: EndedRun) -> None:
    """It has been told: a report stays, as one of the last ten, and another file goes. Takes that a report names are
    still known as cut off."""
    with suppress(OSError):
        if not run.fault:
            run.path.unlink(missing_ok=True)
            return
        run.path.replace(run.path.with_name(REPORT + run.path.name.removeprefix(RUNNING)))
        if run.takes:
            lines = [f"Phalanx, {run.what}", f"begun: {run.begun.isoformat()}"]
            lines += [_ENDED, *(f"{_RECORDING}{take}" for take in run.takes)]
            run.path.write_text("\n".join(lines) + "\n", encoding="utf-8", errors="surrogateescape")
        for old in sorted(run.path.parent.glob(f"{REPORT}*.txt"))[:-_MOST_REPORTS]:
            old.unlink(missing_ok=True)


def _read(path: Path) -> EndedRun:
    text = _text(path)
    head, *lines = text.splitlines() or [""]
    takes: dict[Path, None] = {}
    begun = datetime.fromtimestamp(0)
    display_gone: datetime | None = None
    finished: list[Path] = []
    for line in lines:
        if line.startswith(_RECORDING):
            takes[Path(line.removeprefix(_RECORDING))] = None
        elif line.startswith(_SEALED):
            take = Path(line.removeprefix(_SEALED))
            takes.pop(take, None)
            if display_gone is not None:
                finished.append(take)
        elif line.startswith(_MOVED):
            takes.pop(Path(line.removeprefix(_MOVED)), None)
        elif line.startswith(_DISPLAY_GONE):
            with suppress(ValueError):
                display_gone = datetime.fromisoformat(line.removeprefix(_DISPLAY_GONE))
        elif line.startswith("begun: "):
            with suppress(ValueError):
                begun = datetime.fromisoformat(line.removeprefix("begun: "))
    fault = _FAULT.search(text)
    return EndedRun(
        path, head.partition(", ")[2] or "Phalanx", begun, fault[1].strip() if fault else "", tuple(takes),
        display_gone, tuple(finished),
    )  # fmt: skip


def _text(path: Path) -> str:
    with suppress(OSError), path.open(encoding="utf-8", errors="surrogateescape") as file:
        return file.read(_MOST_BYTES)
    return ""


def _alive(path: Path, within_s: float = _JUST_MADE_S) -> bool:
    """Whether the process of this file lives, on whatever computer. within_s: what was written to since is in use,
    locked or not [s]."""
    text = _text(path)
    if _ENDED in text.splitlines():
        return False
    held = locked(path)
    if held is None:
        return _may_live(path, text)
    with suppress(OSError):
        return held or time.time() - path.stat().st_mtime < within_s
    return False


def _may_live(path: Path, text: str) -> bool:
    """Whether the process of a file that cannot be locked may live: one of this computer by its number, else by age."""
    process = _PROCESS.search(text)
    if process is None or process[2] != platform.node() or sys.platform == "win32":
        return written_lately(path)
    try:
        os.kill(int(process[1]), 0)
    except (ProcessLookupError, OverflowError):
        return False
    except OSError:  # somebody else's
        pass
    return True
