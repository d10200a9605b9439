"""How long a thread has been waiting for the disk, as other threads see it."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType

from core.level import Level
from core.takes.safekeeping import Notice

STALL_S = 2.0
"""A disk that has not answered for so long is said to hang [s]."""
AT_ONCE_S = 0.5
"""An answer within this is no wait that anybody need know of [s]."""


class DiskWait:
    """Entered by the one thread that writes, for as long as it is with the disk; `seconds` is read by any."""

    def __init__(self) -> None:
        self._since_s: float | None = None

    @property
    def seconds(self) -> float:
        """Since the thread went to the disk, or since it last heard of it; 0 while it is not there [s]."""
        since_s = self._since_s
        return 0.0 if since_s is None else time.monotonic() - since_s

    @property
    def stalled(self) -> bool:
        """Whether the disk hangs."""
        return self.seconds >= STALL_S

    def answered(self) -> None:
        """The disk has done a part of what it was asked for."""
        self._since_s = time.monotonic()

    def __enter__(self) -> None:
        self._since_s = time.monotonic()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._since_s = None


@dataclass(frozen=True)
class Opening:
    """A take that is to begin and waits for its disk. folder: of the take. seconds: how long it has waited."""

    folder: Path
    seconds: float

    @property
    def stalled(self) -> bool:
        """Whether the disk hangs."""
        return self.seconds >= STALL_S


def disk_hangs(folder: Path, take: str, seconds: float) -> Notice:
    """Of a take that waits for its disk. seconds: since when [s]."""
    what = f"The disk of {folder} has not answered for {seconds:.0f} s: take {take} waits."
    action = "Check the disk and its cable or network. What waits in memory is written as soon as it answers."
    return Notice(Level.PROBLEM, what, action)


def disk_answers(folder: Path, lost: int) -> Notice:
    """That is over. lost: frames that did not fit into memory meanwhile."""
    meanwhile = f"{lost:,} frames were lost meanwhile." if lost else "No frame was lost."
    return Notice(Level.WARNING if lost else Level.GOOD, f"The disk of {folder} answers again. {meanwhile}")
