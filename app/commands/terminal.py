"""Progress on standard error, and a calm end by Ctrl+C."""

from __future__ import annotations

import signal
import sys
import threading
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from types import FrameType

from app.commands.printable_output import unfiltered
from core.printable import printable

_PERIOD_S = 0.2
_MOST_SAID = 20_000


def say(text: str) -> None:
    """One line of progress."""
    print(printable(text, _MOST_SAID), file=sys.stderr, flush=True)


def warn(name: str, warnings: Iterable[str]) -> None:
    """What the reader of a file found amiss and went on without, one line each. name: the file's."""
    for text in warnings:
        say(f"phalanx: {name}: {text}")


class Progress:
    """A line that counts: rewritten in place on a terminal, silent where nobody watches.

    Call it as core does its `progress`: with the share done, 0..1, and perhaps a text.
    """

    def __init__(self, what: str) -> None:
        self._what = what
        self._live = sys.stderr.isatty()
        self._last = 0.0

    def __call__(self, share: float, text: str = "") -> None:
        """`share` of the work is done."""
        self.show(f"{100.0 * min(max(share, 0.0), 1.0):3.0f} % {text}".rstrip())

    def show(self, text: str) -> None:
        """Any other text instead of a share."""
        now = time.monotonic()
        if self._live and now - self._last > _PERIOD_S:
            self._last = now
            line = printable(f"{self._what}: {text}")
            print(f"\r\x1b[K{line}", end="", file=unfiltered(sys.stderr), flush=True)

    def done(self) -> None:
        """Clears the line."""
        if self._live:
            print("\r\x1b[K", end="", file=unfiltered(sys.stderr), flush=True)


@contextmanager
def until_stopped() -> Iterator[threading.Event]:
    """Yields an event that Ctrl+C or a termination request sets; a second Ctrl+C interrupts at once."""
    stopped = threading.Event()

    def stop(number: int, frame: FrameType | None) -> None:
        if stopped.is_set():
            raise KeyboardInterrupt
        stopped.set()

    before = {number: signal.signal(number, stop) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield stopped
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
