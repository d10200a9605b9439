"""How frames pass between threads: a queue, and a mailbox that keeps the latest."""

from __future__ import annotations

import queue
import threading
from typing import Generic, TypeVar

T = TypeVar("T")


class Fifo(Generic[T]):
    """First in, first out. Putting never waits; whoever puts something in looks after how much there is."""

    def __init__(self) -> None:
        self._items: queue.SimpleQueue[T] = queue.SimpleQueue()

    @property
    def depth(self) -> int:
        """Items waiting."""
        return self._items.qsize()

    def put(self, item: T) -> None:
        """Append `item`."""
        self._items.put(item)

    def take(self, timeout_s: float) -> T | None:
        """The oldest item, waiting at most `timeout_s`; None if none came."""
        try:
            return self._items.get(timeout=timeout_s)
        except queue.Empty:
            return None


class Latest(Generic[T]):
    """A mailbox that holds one item. Putting overwrites, taking never waits: neither side blocks the other."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._item: T | None = None
        self._number = 0

    def put(self, item: T) -> None:
        """Replace whatever is in the box."""
        with self._lock:
            self._item = item
            self._number += 1

    def clear(self) -> None:
        """Empty the box."""
        with self._lock:
            self._item = None

    def newer(self, than: int) -> tuple[int, T | None]:
        """(number, item) of what is in the box, the item None if it is the one already seen."""
        with self._lock:
            return self._number, (self._item if self._number != than else None)

    def peek(self) -> T | None:
        """What is in the box."""
        return self._item
