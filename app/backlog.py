"""Whether what waits gets less: what comes in faster than it can be solved must not be shown later and later."""

from __future__ import annotations

import math
from collections import deque

PATIENCE_S = 0.2
"""A backlog that has not shrunk for so long does not shrink."""

STALL_S = 0.1
"""A frame that took longer is a hiccup of the machine: how the backlog goes on shows after it."""

LEAST_GAIN = 0.01
"""Who works off less than this share of what comes in does not work it off."""


class Backlog:
    """Looks at what waits whenever a frame is taken.

    It shrinks if fewer frames wait than did, or if they have waited less long. Of frames that come in bunches the one
    goes up and down, where none come any more the other goes up; while it truly grows, both do.
    """

    def __init__(self) -> None:
        self._looks: deque[tuple[float, int, float]] = deque()  # when, frames, for how long
        self._last_s, self._stalled = math.inf, False

    def stuck(self, now_s: float, frames: int, waited_s: float) -> bool:
        """True if it has not shrunk for PATIENCE_S; what waits should be skipped then.

        frames: that wait behind the one that was taken. waited_s: for how long that one did.
        """
        looks = self._looks
        stalled = now_s - self._last_s > STALL_S
        if not frames or (stalled and not self._stalled):
            looks.clear()
        self._last_s, self._stalled = now_s, stalled
        if not frames:
            return False
        while len(looks) > 1 and looks[1][0] <= now_s - PATIENCE_S:
            looks.popleft()
        if looks and looks[0][0] <= now_s - PATIENCE_S:
            most, longest_s = max(look[1] for look in looks), max(look[2] for look in looks)
            if frames >= most and waited_s >= longest_s - LEAST_GAIN * PATIENCE_S:
                looks.clear()
                return True
        looks.append((now_s, frames, waited_s))
        return False
