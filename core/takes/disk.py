"""How fast a recording fills its disk, and how long that can go on."""

from __future__ import annotations

import math
import shutil
from collections import deque
from pathlib import Path
from statistics import median

RESERVE = 10**9
"""Free bytes that recording leaves to the system [byte]."""

LOW = 10**10
"""Free bytes below which room should be made before a long day [byte]."""

WARN_BELOW_S = 600.0
"""Time left below which the operator is warned [s]."""

_WINDOW_S = 30


class DiskMeter:
    """Bytes per second of a recording: the median of its seconds over the last 30, so that one slow moment of the
    disk changes nothing. reserve: free bytes that stay."""

    def __init__(self, reserve: int = RESERVE) -> None:
        self._reserve = reserve
        self._seconds: deque[float] = deque(maxlen=_WINDOW_S)
        self._since: tuple[float, int] | None = None
        self._bytes = 0

    def add(self, now_s: float, bytes_written: int) -> None:
        """To be called about once a second with a monotonic clock and the size of the take so far."""
        self._bytes = bytes_written
        if self._since is None:
            self._since = (now_s, bytes_written)
            return
        elapsed = now_s - self._since[0]
        if elapsed >= 1.0:
            self._seconds.append((bytes_written - self._since[1]) / elapsed)
            self._since = (now_s, bytes_written)

    @property
    def bytes_per_s(self) -> float:
        """0 within the first second."""
        return median(self._seconds) if self._seconds else 0.0

    def room(self, free: int) -> int:
        """Of the bytes free, those that the take may still use; not above 0 when it must end [byte].

        Sealing needs room for a copy of the take, so what there is of it counts once more."""
        return free - self._reserve - self._bytes

    def time_left_s(self, free: int) -> float:
        """How long the recording can go on; infinite while its rate is unknown [s].

        Each byte recorded counts twice, for the copy that sealing makes."""
        return max(self.room(free), 0) / (2 * self.bytes_per_s) if self.bytes_per_s > 0 else math.inf


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


def duration_text(seconds: float) -> str:
    """Seconds for people: the largest unit that fits."""
    for below, unit_s, unit in ((120, 1, "s"), (7200, 60, "min"), (172_800, 3600, "h")):
        if seconds < below:
            return f"{seconds / unit_s:.0f} {unit}"
    return f"{min(seconds / 86_400, 999):.0f} days"
