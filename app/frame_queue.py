"""What waits for the engine: frames, of which the oldest give way, and commands, which never do."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable
from typing import Generic, TypeVar

F = TypeVar("F")
Command = Callable[[], None]


class FrameQueue(Generic[F]):
    """First in, first out. Nobody waits to put something in. Frames are of a type that cannot be called."""

    def __init__(self, size: int) -> None:
        """size: frames that may wait."""
        self.size = size
        self._items: deque[F | Command] = deque()
        self._frames = 0
        self._lock = threading.Lock()
        self._filled = threading.Condition(self._lock)

    @property
    def depth(self) -> int:
        """Frames waiting."""
        return self._frames

    def put(self, frame: F) -> list[F]:
        """Append a frame. What has to give way for it: the oldest frames beyond `size`."""
        with self._lock:
            self._items.append(frame)
            self._frames += 1
            over = self._take_out(lambda _: self._frames > self.size) if self._frames > self.size else []
            self._filled.notify()
        return over

    def command(self, do: Command) -> None:
        """Append something to be done between the frames before it and those after."""
        with self._lock:
            self._items.append(do)
            self._filled.notify()

    def take_out(self, which: Callable[[F], bool]) -> list[F]:
        """Every frame waiting of which this is true, taken out; commands and other frames keep their order."""
        with self._lock:
            return self._take_out(which)

    def take(self, timeout_s: float) -> F | Command | None:
        """The oldest item, waiting at most `timeout_s`; None if none came."""
        until_s = time.monotonic() + timeout_s
        with self._lock:
            while not self._items:
                left_s = until_s - time.monotonic()
                if left_s <= 0.0 or not self._filled.wait(left_s):
                    break
            if not self._items:
                return None
            item = self._items.popleft()
            if not callable(item):
                self._frames -= 1
            return item

    def _take_out(self, which: Callable[[F], bool]) -> list[F]:
        out: list[F] = []
        stay: deque[F | Command] = deque()
        for item in self._items:
            if not callable(item) and which(item):
                out.append(item)
                self._frames -= 1
            else:
                stay.append(item)
        self._items = stay
        return out
