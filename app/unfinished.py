"""Whatever ends this process in order, the takes that are written are finished first."""

from __future__ import annotations

import atexit
import weakref
from contextlib import suppress
from typing import Protocol


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
