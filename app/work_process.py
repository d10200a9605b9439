"""A process beside the window for long work: within the window's own it would take the interpreter away from the
solver."""

from __future__ import annotations

import json
import multiprocessing
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from multiprocessing.connection import Connection
from typing import Any

from app.left_behind.run_file import RunFile, report_of
from app.signals import deaf
from core.errors import PhalanxError

NICENESS = 10


@contextmanager
def work_process(
    serve: Callable[..., None], arguments: tuple[Any, ...], name: str, task: str, action: str,
    clear_up: Callable[[int], None] = lambda pid: None,
) -> Iterator[Connection]:  # fmt: skip
    """The line to a process that runs `serve(*arguments, line)`. It has ended when the block has, whatever happens.

    task: what it was to do, for people; action: what to do if it breaks down. clear_up: removes what was half done, if
    the block does not come to its end; told the process's id. Raises PhalanxError if the process broke down, which the
    block is told by EOFError or ConnectionResetError.
    """
    context = multiprocessing.get_context("spawn")
    line, theirs = context.Pipe()
    process = context.Process(target=serve, args=(*arguments, theirs), name=name, daemon=True)
    process.start()
    theirs.close()
    whole = False
    try:
        yield line
        whole = True
    except (EOFError, ConnectionResetError):
        process.join()
        report = report_of(process.pid)
        raise PhalanxError(
            f"The process that was to {task} broke down (exit code {process.exitcode}).",
            action + (f" The report of the fault is {report}." if report else ""),
        ) from None
    finally:
        process.kill()
        process.join()
        line.close()
        report_of(process.pid)  # what one that was ended here left is no report
        if not whole and process.pid is not None:
            clear_up(process.pid)


def serve_work(task: str, work: Callable[[], dict[str, Any]], line: Connection) -> None:
    """In the other process: does the work and tells what came of it. task: as in `work_process`."""
    deaf()
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    _step_back()
    with suppress(BrokenPipeError, ConnectionResetError):  # the window has gone: nobody waits for this
        with RunFile(f"the process that was to {task}"):
            told = work()
        tell(line, told)


def tell(line: Connection, told: dict[str, Any]) -> None:
    """Raises BrokenPipeError or ConnectionResetError where nobody listens any more."""
    line.send_bytes(json.dumps(told).encode())


def heard(line: Connection) -> dict[str, Any]:
    """What was told next. Raises EOFError or ConnectionResetError where the other process has ended."""
    told: dict[str, Any] = json.loads(line.recv_bytes())
    return told


def _step_back() -> None:
    """Below normal priority: capture goes first."""
    if sys.platform == "win32":
        import ctypes

        below_normal = 0x4000  # BELOW_NORMAL_PRIORITY_CLASS of SetPriorityClass
        this_process = ctypes.c_void_p(-1)  # the pseudo handle that GetCurrentProcess gives
        ctypes.windll.kernel32.SetPriorityClass(this_process, below_normal)
    else:
        os.nice(NICENESS)
