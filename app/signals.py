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
from types import FrameType
from typing import Any, NoReturn

from core.printable import MOST_OF_TEXT, printable

HANG_UP = getattr(signal, "SIGHUP", None)
SAME_S = 0.1
"""Two Ctrl+C that come closer than this are one, told twice: by the terminal, and by a program in between [s]."""
CLEARING_S = 2.0
"""Who asks often asks twice (SIGTERM and SIGHUP, the shell and the terminal): the second does not interrupt what clears
up after the first [s]."""
INTERRUPTED = 130
"""Exit status of a process that Ctrl+C ended where it stood (128 + SIGINT)."""


def requests() -> list[int]:
    """What asks this process to end, beside Ctrl+C. What the one who began it had it ignore (nohup) stays ignored."""
    numbers = [getattr(signal, name) for name in ("SIGTERM", "SIGHUP", "SIGBREAK") if hasattr(signal, name)]
    return [number for number in numbers if signal.getsignal(number) is not signal.SIG_IGN]


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
        signal.set_wakeup_fd(wakes)
        _restore(before)
        theirs.close()
        thread.join()
        ours.close()


def _listen(line: socket.socket, numbers: set[int], by: Callable[[int], None]) -> None:
    while told := line.recv(64):
        for number in told:
            if number in numbers:
                if number == HANG_UP:
                    leave_terminal()
                by(number)


@contextmanager
def interrupting() -> Iterator[None]:
    """While it lasts, a request to end is as Ctrl+C is: KeyboardInterrupt, which says what asked. Does nothing but in
    the main thread."""
    asked_s = -math.inf

    def stop(number: int, frame: FrameType | None) -> None:
        nonlocal asked_s
        if number == HANG_UP:
            leave_terminal()
        if time.monotonic() - asked_s < CLEARING_S:
            return
        asked_s = time.monotonic()
        raise KeyboardInterrupt(f"Stopped by {signal.Signals(number).name}.")

    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {number: signal.signal(number, stop) for number in requests()}
    try:
        yield
    finally:
        _restore(before)


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
