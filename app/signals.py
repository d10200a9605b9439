"""How others ask this process to end: Ctrl+C, SIGTERM, a terminal that closes (SIGHUP), Ctrl+Break."""

from __future__ import annotations

import math
import os
import signal
import socket
import stat
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any, NoReturn

from core.printable import MOST_OF_TEXT, printable

HANG_UP = getattr(signal, "SIGHUP", None)
SAME_S = 0.1
"""Two Ctrl+C that come closer than this are one, told twice: by the terminal, and by a program in between [s]."""
CLEARING_S = 2.0
"""Who asks often asks twice (SIGTERM and SIGHUP, the shell and the terminal): the second does not interrupt what clears
up after the first [s]."""
AT_ONCE_S = 10.0
"""How long a command has to say what it leaves after a second Ctrl+C [s]."""
INTERRUPTED = 130
"""Exit status of a process that Ctrl+C ended where it stood (128 + SIGINT)."""


def requests() -> list[int]:
    """What asks this process to end, beside Ctrl+C. What the one who began it had it ignore (nohup) stays ignored."""
    numbers = [getattr(signal, name) for name in ("SIGTERM", "SIGHUP", "SIGBREAK") if hasattr(signal, name)]
    return [number for number in numbers if signal.getsignal(number) is not signal.SIG_IGN]


def words_of(number: int) -> str:
    """What is said of a command that was ended so."""
    return "Stopped by Ctrl+C." if number == signal.SIGINT else f"Stopped by {signal.Signals(number).name}."


@contextmanager
def heard(by: Callable[[int], None], here: Callable[[int], None] = lambda number: None) -> Iterator[None]:
    """While it lasts, `by` is told of Ctrl+C and of each request to end, by its number, on a thread of its own: at
    once, whatever the main thread does or waits for. here: told in the main thread, when that comes to it, and may
    raise. To be used in the main thread."""
    ours, theirs = socket.socketpair()
    theirs.setblocking(False)
    numbers = [signal.SIGINT, *requests()]
    before = {number: signal.signal(number, lambda number, frame: here(number)) for number in numbers}
    wakes = signal.set_wakeup_fd(theirs.fileno(), warn_on_full_buffer=False)
    thread = threading.Thread(target=_listen, args=(ours, set(numbers), by), name="phalanx-signals", daemon=True)
    thread.start()
    try:
        yield
    finally:
        try:
            signal.set_wakeup_fd(wakes)
            theirs.close()
            thread.join()
            ours.close()
        finally:
            _restore(before)


def _listen(line: socket.socket, numbers: set[int], by: Callable[[int], None]) -> None:
    while told := line.recv(64):
        for number in told:
            if number in numbers:
                if number == HANG_UP:
                    leave_terminal()
                by(number)


@contextmanager
def interrupting() -> Iterator[None]:
    """While it lasts, Ctrl+C and a request to end are KeyboardInterrupt, which says what asked. A second Ctrl+C
    interrupts what clears up after the first; see `Patience` for what is after that. Does nothing but in the main
    thread, or where whoever began this process had Ctrl+C ignored: then requests to end alone are heard."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    patience, interruption = Patience(), _Interruption()
    before, sys.unraisablehook = sys.unraisablehook, interruption.lost
    ignored = signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    interruption.then = before

    def hear(number: int) -> None:
        if not (interruption.repeated or (ignored and number == signal.SIGINT)):
            patience.take(number)

    def here(number: int) -> None:
        if not (ignored and number == signal.SIGINT):
            interruption.come(number)

    try:
        with heard(hear, here):
            yield
    finally:
        sys.unraisablehook = before


class _Interruption:
    """KeyboardInterrupt for what asks to end, once more if it was lost."""

    def __init__(self) -> None:
        self.then: Callable[[Any], object] = sys.__unraisablehook__
        self.repeated = False
        self._asked, self._asked_s = Asked(), -math.inf

    def come(self, number: int) -> None:
        """In the main thread."""
        if not self._asked.take(number) and time.monotonic() - self._asked_s < CLEARING_S:
            return
        self._asked_s = time.monotonic()
        raise KeyboardInterrupt(words_of(number))

    def lost(self, raised: Any) -> None:
        """For sys.unraisablehook: what comes within the callback of a weak reference, or a finaliser, is dropped by the
        interpreter, and the command would go on as if nobody had asked."""
        if not issubclass(raised.exc_type, KeyboardInterrupt):
            self.then(raised)
            return
        self._asked, self._asked_s, self.repeated = Asked(), -math.inf, True
        threading.Timer(SAME_S, os.kill, (os.getpid(), signal.SIGINT)).start()


def _restore(before: dict[int, Any]) -> None:
    for number, handler in before.items():
        signal.signal(number, handler)


class Asked:
    """Counts the requests to end. `when` it came, None before. The first Ctrl+C is one; the next ends at once."""

    def __init__(self) -> None:
        self.when_s: float | None = None

    def take(self, number: int) -> bool:
        """One more. Whether this process is to end at once."""
        now_s = time.monotonic()
        if self.when_s is None:
            self.when_s = now_s
            return False
        return number == signal.SIGINT and now_s - self.when_s > SAME_S


class Patience:
    """What becomes of a process that is asked to end again: after a second Ctrl+C it has AT_ONCE_S to end, at a third
    it ends where it stands.

    again: set by the second. left: what is left then, in a sentence; called on any thread, must wait for nothing.
    """

    def __init__(self, left: Callable[[], str] = lambda: "") -> None:
        self.again = threading.Event()
        self._left, self._asked = left, Asked()

    def take(self, number: int) -> None:
        """One more request; on any thread."""
        if not self._asked.take(number):
            return
        if self.again.is_set():
            self._end("third")
        self.again.set()
        patience = threading.Timer(AT_ONCE_S, self._end, ("second",))
        patience.daemon = True
        patience.start()

    def _end(self, which: str) -> NoReturn:
        end_at_once(f"Ended at once by a {which} Ctrl+C. {self._left()}".rstrip())


def end_at_once(text: str) -> NoReturn:
    """Ends this process where it stands, whatever its threads wait for. text: the last that is said."""
    with suppress(OSError):
        os.write(2, f"phalanx: {printable(text, MOST_OF_TEXT)}\n".encode())
    os._exit(INTERRUPTED)


def leave_terminal() -> None:
    """The terminal is being closed: from now on what would go there goes nowhere, where it failed else."""
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError, AttributeError):
            if stat.S_ISCHR(os.fstat(stream.fileno()).st_mode):
                leave(stream)


def leave(stream: Any) -> None:
    """What is written to this stream goes nowhere from now on."""
    with suppress(OSError, ValueError):  # ValueError: it is no file, as in a test
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, stream.fileno())
        os.close(nowhere)


def deaf() -> None:
    """In a process that helps another: Ctrl+C, and a terminal that closes, are for the one that the operator sees, and
    this one ends with it."""
    for number in (signal.SIGINT, HANG_UP):
        if number is not None:
            signal.signal(number, signal.SIG_IGN)
