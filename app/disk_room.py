"""Room on the disk of a take that is recorded: measured, warned of, and the end when there is no more."""

from __future__ import annotations

import math
import shutil
from collections.abc import Callable
from pathlib import Path

from core.disk_error import why
from core.errors import TakeError
from core.level import Level
from core.takes.disk import RESERVE, WARN_BELOW_S, DiskMeter, duration_text
from core.takes.safekeeping import Notice


def free_text(n: int) -> str:
    """Bytes free for people, never more than there are: '12.3 GB', below one '812 MB'."""
    if n >= 10**9:
        return f"{n // 10**8 / 10:,.1f} GB"
    return f"{n // 10**6} MB" if n >= 10**6 or n <= 0 else "under 1 MB"


def recording_left(free: int, bytes_per_s: float) -> str:
    """How long takes of this rate can be recorded in the bytes free, in words; "" while the rate is unknown."""
    if not bytes_per_s > 0:
        return ""
    seconds = max(free - RESERVE, 0) / (2 * bytes_per_s)  # sealing makes a copy, as DiskMeter knows
    return f"At the rate of the last take that is {duration_text(seconds)} of recording."


def room_to_begin(folder: Path, reserve: int) -> int:
    """Bytes free in the folder of a take that is to begin, which is made. Raises TakeError if it cannot be used, or if
    less than `reserve` is free."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        free = shutil.disk_usage(folder).free
    except OSError as error:
        raise TakeError(
            f"The take folder {folder} cannot be used ({why(folder, error)}).", "Choose another folder."
        ) from error
    if free < reserve:
        raise TakeError(
            f"Only {free_text(free)} are free in {folder}.",
            f"Recording needs {free_text(reserve)}: free some space or choose another folder.",
        )
    return free


class DiskRoom:
    """For the thread that writes; figures are read from any.

    free: bytes free when they were last asked. bytes_per_s: what the take needs; 0 within the first second.
    seconds_left: how long the recording can go on; infinite while that is unknown.
    """

    def __init__(self, free: int, reserve: int, notify: Callable[[Notice], None]) -> None:
        """reserve: bytes that stay free. notify: told once when the disk will be full within ten minutes, and once when
        it cannot be asked."""
        self.free, self.bytes_per_s, self.seconds_left = free, 0.0, math.inf
        self._meter = DiskMeter(reserve)
        self._notify = notify
        self._warned = self._blind = False

    def full(self, folder: Path, now_s: float, bytes_written: int) -> bool:
        """Whether the recording must end, so that there is room to seal it. To be called about once a second."""
        try:
            self.free = shutil.disk_usage(folder).free
        except OSError as error:
            if not self._blind:
                self._blind = True
                what = f"How much room {folder} has cannot be asked ({error.strerror or error})."
                self._notify(Notice(Level.WARNING, what, "Check the disk of the take folder."))
            return False
        self._meter.add(now_s, bytes_written)
        self.bytes_per_s, self.seconds_left = self._meter.bytes_per_s, self._meter.time_left_s(self.free)
        if self._meter.room(self.free) < 0:
            return True
        if self.seconds_left < WARN_BELOW_S and not self._warned:
            self._warned = True
            what = f"The disk holds {duration_text(self.seconds_left)} more of recording ({free_text(self.free)} free)."
            self._notify(Notice(Level.WARNING, what, "Free some space or change the take folder before the next take."))
        return False
