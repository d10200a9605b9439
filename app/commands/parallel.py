"""The same work on many things at once, in processes, with one line of progress and a calm end by Ctrl+C.

No process outlives the one that began it, however that ends: told to stop they end their work calmly, and where it is
gone without a word (killed, out of memory) they end at once, in the middle of whatever they write.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing import connection
from types import FrameType
from typing import Any, TypeVar

from app.commands.terminal import Progress
from core.errors import CancelledError, DeviceError, ExportError, FormatError, PhalanxError, TakeError

T = TypeVar("T")
R = TypeVar("R")

_LOOK_S = 0.2
_NOT_THEIRS = {getattr(signal, name) for name in ("SIGINT", "SIGHUP") if hasattr(signal, name)}
_ENDED = 143  # exit status of a process that was asked to end (128 + SIGTERM)
_KINDS = {kind.__name__: kind for kind in (PhalanxError, FormatError, DeviceError, TakeError, ExportError)}


def usable_cores() -> int:
    """Processor cores that this process may use."""
    if sys.platform == "linux":
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def in_parallel(
    work: Callable[[T, Callable[[float, str], bool | None]], R], things: Sequence[T], at_once: int, what: str
) -> Iterator[R | PhalanxError]:
    """`work(thing, progress)` for each, `at_once` processes at a time; the results in the order of the things, and in
    place of a result the PhalanxError that was raised.

    work: a function of a module. what: begins the line of progress. When the caller stops (Ctrl+C, or closes this
    iterator), work that runs is told so by its progress, which returns False, and everything has ended when this ends;
    a second Ctrl+C ends it in the middle. Raises what `work` raises beside PhalanxError.
    """
    context = multiprocessing.get_context("spawn")
    shares = context.Array("d", len(things))
    stop = context.Event()
    line = Progress(what)
    pool = ProcessPoolExecutor(at_once, context, _begin, (work, shares, stop))
    try:
        with _until_they_have_begun():
            futures = [pool.submit(_do, i, thing) for i, thing in enumerate(things)]
        for future in futures:
            while not future.done():
                wait([future], _LOOK_S)
                finished = sum(other.done() for other in futures)
                line(sum(shares[:]) / len(things), f"({finished} of {len(things)} done)")
            line.done()
            yield _result(future)
    finally:
        _end(pool, stop)
        line.done()


def _end(pool: ProcessPoolExecutor, stop: Any) -> None:
    """Calmly; interrupted again, at once."""
    processes = list((pool._processes or {}).values())
    try:
        stop.set()
        pool.shutdown(wait=True, cancel_futures=True)
    except BaseException:
        for process in processes:  # else this process would wait for them at its own end, and they for their next work
            process.kill()
        for process in processes:
            process.join()
        raise


@contextmanager
def _until_they_have_begun() -> Iterator[None]:
    """Processes that are started here are born deaf to what is not for them, until `_begin` sees to it: a Ctrl+C while
    they import would end each with a traceback of its own. What comes for this process meanwhile is heard after."""
    if hasattr(signal, "pthread_sigmask"):
        before = signal.pthread_sigmask(signal.SIG_BLOCK, _NOT_THEIRS)
        try:
            yield
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
    else:
        yield


def _result(future: Future[Any]) -> Any:
    try:
        outcome = future.result()
    except BrokenProcessPool:
        return PhalanxError(
            "A process broke down before this was done.", "Free some memory, or do it with fewer files at once."
        )
    if isinstance(outcome, _Failed):
        return _KINDS[outcome.kind](outcome.what, outcome.action)
    return outcome


# In the other processes.


class _Failed:
    """A PhalanxError on its way between processes."""

    def __init__(self, error: PhalanxError) -> None:
        self.kind = type(error).__name__ if type(error).__name__ in _KINDS else PhalanxError.__name__
        self.what, self.action = error.what, error.action


_shared: tuple[Any, ...] = ()
_working = _asked_to_end = False


def _begin(*shared: Any) -> None:
    """First thing in every process: Ctrl+C, and a terminal that closes, are for the one that the operator sees."""
    global _shared
    for number in _NOT_THEIRS:
        signal.signal(number, signal.SIG_IGN)
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, _NOT_THEIRS)
    signal.signal(signal.SIGTERM, _terminated)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    _shared = shared


def _end_with_parent() -> None:
    """Waits for the end of the process that began this one, and then ends this one in the middle of its work: nobody
    is left to give a result its place."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        connection.wait([parent.sentinel])
        os._exit(_ENDED)


def _terminated(number: int, frame: FrameType | None) -> None:
    """Asked to end, alone or with all of its group: at the next step of its work, or at once where it has none."""
    global _asked_to_end
    _asked_to_end = True
    if not _working:
        os._exit(_ENDED)


def _do(i: int, thing: Any) -> Any:
    global _working
    work, shares, stop = _shared

    def progress(share: float, text: str = "") -> bool:
        shares[i] = share
        return not (stop.is_set() or _asked_to_end)

    _working = True
    try:
        if stop.is_set():
            raise CancelledError
        result = work(thing, progress)
    except PhalanxError as error:
        return _Failed(error)
    finally:
        shares[i] = 1.0
        _working = False
        if _asked_to_end:
            os._exit(_ENDED)
    return result
