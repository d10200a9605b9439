"""Threads for calls that may never come back, such as to a disk that hangs: they do not keep the process alive."""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Callable

Call = Callable[[], object]


class DaemonPool:
    """Calls in the order in which they were given, each on one of a few threads. What a call raises is its own affair:
    it must not."""

    def __init__(self, threads: int, name: str) -> None:
        self._calls: queue.SimpleQueue[Call | None] = queue.SimpleQueue()
        self._closed = False
        self._threads = [
            threading.Thread(target=self._run, name=f"{name}_{i}", daemon=True) for i in range(threads)
        ]  # fmt: skip
        for thread in self._threads:
            thread.start()

    def submit(self, call: Call) -> None:
        """Do this when its turn comes; not at all after `close`."""
        if not self._closed:
            self._calls.put(call)

    def close(self, wait_s: float, drop: bool = False) -> bool:
        """Take no more calls, and wait for those there are; False if one does not come back in time. drop: those that
        have not begun are not done."""
        self._closed = True
        while drop:
            try:
                self._calls.get_nowait()
            except queue.Empty:
                break
        for _ in self._threads:
            self._calls.put(None)
        deadline = time.monotonic() + wait_s
        for thread in self._threads:
            thread.join(max(deadline - time.monotonic(), 0.0))
        return not any(thread.is_alive() for thread in self._threads)

    def _run(self) -> None:
        while (call := self._calls.get()) is not None:
            call()
            del call
