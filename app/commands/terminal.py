"""Progress on standard error, and a calm end by Ctrl+C."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager

from app.commands.printable_output import unfiltered
from app.signals import Asked, Patience, heard, words_of
from core.printable import printable

_PERIOD_S = 0.2
_MOST_SAID = 20_000


def say(text: str) -> None:
    """One line of progress."""
    _put(printable(text, _MOST_SAID) + "\n")


def tell(text: str) -> None:
    """One line of what a command is asked for."""
    print(text, flush=True)


def _put(text: str) -> None:
    print(text, end="", file=unfiltered(sys.stderr), flush=True)


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
            _put(f"\r\x1b[K{line}")

    def done(self) -> None:
        """Clears the line."""
        if self._live:
            _put("\r\x1b[K")


class Stopped(threading.Event):
    """Set by the first request to end. words: what asked, in a sentence. again: set by the second Ctrl+C. watched:
    whoever is asked looks at `again` himself, and is not interrupted: so nothing that he has to say is lost."""

    def __init__(self, again: threading.Event) -> None:
        super().__init__()
        self.again = again
        self.words = ""
        self.watched = False

    def check(self) -> None:
        """Raises KeyboardInterrupt, with the words, once somebody has asked."""
        if self.is_set():
            raise KeyboardInterrupt(self.words)


@contextmanager
def until_stopped(left: Callable[[], str] = lambda: "") -> Iterator[Stopped]:
    """Yields an event that Ctrl+C sets, or a request to end, or a terminal that closes. A second Ctrl+C interrupts; if
    that does not end this process soon, or there is a third, it ends where it stands.

    left: what becomes then of what was being made, in a sentence. Called on another thread; must wait for nothing.
    """
    patience, interrupted = Patience(left), Asked()
    stopped = Stopped(patience.again)

    def hear(number: int) -> None:
        stopped.words = stopped.words or words_of(number)
        stopped.set()
        patience.take(number)

    def interrupt(number: int) -> None:
        if (interrupted.take(number) or stopped.again.is_set()) and not stopped.watched:
            raise KeyboardInterrupt(stopped.words)

    with heard(hear, interrupt):
        yield stopped
