"""How fast a recording fills its disk, and how long that can go on."""

from __future__ import annotations

import math
import shutil
from collections import deque
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Literal

STOP_BELOW = 10**9
"""Free bytes below which recording must stop [byte]."""

WARN_BELOW_S = 600.0
"""Time left below which the operator is warned [s]."""

WINDOW_S = 30.0


@dataclass(frozen=True)
class DiskState:
    """What to tell the operator. free: bytes. time_left_s: NaN while unknown. stop: there is no room to go on."""

    level: Literal["good", "warning", "problem"]
    text: str
    free: int
    time_left_s: float

    @property
    def stop(self) -> bool:
        """Whether recording must end now, while there is room to seal."""
        return self.level == "problem"


class DiskMeter:
    """Bytes per second of a recording: the median of its seconds over the last 30, so that one slow moment of the
    disk changes nothing."""

    def __init__(self) -> None:
        self._seconds: deque[float] = deque(maxlen=round(WINDOW_S))
        self._since: tuple[float, int] | None = None
        self._bytes = 0

    def add(self, now_s: float, bytes_written: int) -> None:
        """To be called some times a second with a monotonic clock and the size of the take so far."""
        self._bytes = bytes_written
        if self._since is None or bytes_written < self._since[1]:
            self._since = (now_s, bytes_written)
            return
        elapsed = now_s - self._since[0]
        if elapsed >= 1.0:
            self._seconds.append((bytes_written - self._since[1]) / elapsed)
            self._since = (now_s, bytes_written)

    @property
    def bytes_per_s(self) -> float:
        """NaN within the first second."""
        return median(self._seconds) if self._seconds else math.nan

    def state(self, free: int) -> DiskState:
        """What a number of free bytes means for this recording."""
        return disk_state(free, self._bytes, self.bytes_per_s)


def disk_state(free: int, take_bytes: int = 0, bytes_per_s: float = math.nan) -> DiskState:
    """What a number of free bytes means for a take of a size and rate.

    Sealing needs room for a copy of the take, so every byte recorded counts twice, and those there are once more."""
    left_s = math.nan
    if bytes_per_s > 0:
        left_s = max(0.0, (free - STOP_BELOW - take_bytes) / (2 * bytes_per_s))
    if free < STOP_BELOW:
        return DiskState(
            "problem", f"{size_text(free)} left on this disk: free some space or choose another.", free, 0.0
        )
    room = f"{size_text(free)} free"
    if math.isnan(left_s):
        return DiskState("good", room, free, left_s)
    room += f", time for {duration_text(left_s)}"
    if left_s < WARN_BELOW_S:
        return DiskState("warning", f"{room}: free some space after this take.", free, left_s)
    return DiskState("good", room, free, left_s)


def free_bytes(folder: Path | str) -> int | None:
    """Free bytes of the disk that holds a folder, or will hold it; None if the system does not say."""
    place = Path(folder).absolute()
    for candidate in (place, *place.parents):
        try:
            return shutil.disk_usage(candidate).free
        except FileNotFoundError:
            continue
        except OSError:
            return None
    return None


def size_text(size: float) -> str:
    """Bytes for people: 3 digits and a unit."""
    for unit in ("B", "kB", "MB", "GB"):
        if abs(size) < 999.5:
            return f"{size:.3g} {unit}"
        size /= 1000
    return f"{size:.3g} TB"


def duration_text(seconds: float) -> str:
    """Seconds for people: the largest unit that fits."""
    if seconds < 120:
        return f"{seconds:.0f} s"
    if seconds < 7200:
        return f"{seconds / 60:.0f} min"
    return f"{seconds / 3600:.0f} h" if seconds < 360000 else "days"
