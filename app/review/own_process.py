"""Long work in a process of its own: in the window's process it would take the interpreter away from the solver."""

from __future__ import annotations

import contextlib
import json
import logging
import multiprocessing
import os
import sys
import time
import traceback
from collections.abc import Callable, Mapping
from multiprocessing.connection import Connection
from typing import Any

from app.left_behind.run_file import RunFile, report_of
from app.review.job import Report
from app.signals import deaf
from core.errors import CancelledError, DeviceError, ExportError, FormatError, PhalanxError, TakeError

NICENESS = 10
_LOOK_S = 0.1
_TELL_S = 0.05
_KINDS = {kind.__name__: kind for kind in (PhalanxError, FormatError, DeviceError, TakeError, ExportError)}

log = logging.getLogger("phalanx")


def run(
    task: str, arguments: Mapping[str, Any], report: Report, clear_up: Callable[[int], None] = lambda pid: None
) -> Any:
    """Run a function of `app.review.tasks` to its end. Blocks: for the thread of a job.

    arguments and the result: what JSON can say. clear_up: removes what was half done, if the process (its id) had to
    be ended or broke down. Raises the PhalanxError that the task raised, one that says so if the process broke down,
    and CancelledError once `report` is stopped. The process has ended in every case.
    """
    context = multiprocessing.get_context("spawn")
    line, theirs = context.Pipe()
    process = context.Process(
        target=_serve, args=(task, json.dumps(arguments), theirs), name=f"phalanx-{task}", daemon=True
    )
    process.start()
    theirs.close()
    whole = False
    try:
        told = _follow(line, report)
        whole = True
    except (EOFError, ConnectionResetError):
        process.join()
        report_file = report_of(process.pid)
        raise PhalanxError(
            f"The process that was to {task} the take broke down (exit code {process.exitcode}).",
            "Nothing half done was kept. Try again; if it happens again, free some memory and report it"
            + (f", with {report_file}." if report_file else "."),
        ) from None
    finally:
        process.kill()
        process.join()
        line.close()
        report_of(process.pid)
        if not whole and process.pid is not None:
            clear_up(process.pid)
    if "result" in told:
        return told["result"]
    if told["trace"]:
        log.error("%s", told["trace"])
    raise _KINDS[told["kind"]](told["what"], told["action"])


def _follow(line: Connection, report: Report) -> dict[str, Any]:
    """What the process told last. Raises EOFError if it ended before."""
    while not report.stopped:
        if not line.poll(_LOOK_S):
            continue
        told: dict[str, Any] = json.loads(line.recv_bytes())
        if "share" not in told:
            return told
        report(told["share"], told["text"])
    raise CancelledError


# In the other process.


def _serve(task: str, arguments: str, line: Connection) -> None:
    with contextlib.suppress(BrokenPipeError, ConnectionResetError):  # the window has gone: nobody waits for this
        with RunFile(f"the process that was to {task} the take"):
            told = _do(task, json.loads(arguments), line)
        _tell(line, told)


def _do(task: str, arguments: dict[str, Any], line: Connection) -> dict[str, Any]:
    deaf()
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    step_back()
    told_s = 0.0

    def progress(share: float, text: str = "") -> None:
        nonlocal told_s
        if time.monotonic() - told_s >= _TELL_S:
            _tell(line, {"share": share, "text": text})
            told_s = time.monotonic()

    try:
        from app.review import tasks

        return {"result": tasks.TASKS[task](**arguments, progress=progress)}
    except (BrokenPipeError, ConnectionResetError):
        raise
    except PhalanxError as error:
        kind = type(error).__name__
        return {
            "kind": kind if kind in _KINDS else "PhalanxError",
            "what": error.what,
            "action": error.action,
            "trace": "",
        }
    except Exception as error:
        what = f"Unexpected {type(error).__name__} in the process that was to {task} the take: {error}."
        action = "The details are in the log file; please report them."
        return {"kind": "PhalanxError", "what": what, "action": action, "trace": traceback.format_exc()}


def _tell(line: Connection, told: dict[str, Any]) -> None:
    line.send_bytes(json.dumps(told).encode())


def step_back() -> None:
    """Below normal priority: capture goes first."""
    if sys.platform == "win32":
        import ctypes

        below_normal = 0x4000  # BELOW_NORMAL_PRIORITY_CLASS of SetPriorityClass
        this_process = ctypes.c_void_p(-1)  # the pseudo handle that GetCurrentProcess gives
        ctypes.windll.kernel32.SetPriorityClass(this_process, below_normal)
    else:
        os.nice(NICENESS)
