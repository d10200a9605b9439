"""Whatever ends this process in order, the takes that are written are finished first."""

from __future__ import annotations

import atexit
import logging
import os
import sys
import threading
import weakref
from contextlib import suppress
from typing import NoReturn, Protocol


class Unfinished(Protocol):
    """Something that must not be cut off."""

    def finish_before_exit(self) -> None:
        """Wait until it is done, or until waiting is no use."""


_WAITING: weakref.WeakSet[Unfinished] = weakref.WeakSet()


def finish_before_exit(unfinished: Unfinished) -> None:
    """Have it finished before this process ends. Threads that do not keep a process alive still run then."""
    _WAITING.add(unfinished)


@atexit.register
def _finish() -> None:
    with suppress(KeyboardInterrupt):
        for unfinished in list(_WAITING):
            unfinished.finish_before_exit()


def at_work() -> bool:
    """Whether a thread of Phalanx is still at something, such as a compilation, that cannot be interrupted, and that
    the interpreter would be taken away from at its own end."""
    return any(thread.daemon and thread.name.startswith("phalanx") for thread in threading.enumerate())


def end_process(status: int) -> NoReturn:
    """End this process now, takes first, whatever its threads do: in an end by itself they would keep the interpreter,
    for minutes at the first start."""
    _finish()
    logging.shutdown()
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError, AttributeError):
            stream.flush()
    os._exit(status)
