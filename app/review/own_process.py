"""The tasks of review, each in a process of its own."""

from __future__ import annotations

import json
import logging
import time
import traceback
from collections.abc import Callable, Mapping
from multiprocessing.connection import Connection
from typing import Any

from app.review.job import Report
from app.work_process import heard, serve_work, tell, work_process
from core.errors import CancelledError, DeviceError, ExportError, FormatError, PhalanxError, TakeError

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
    action = "Nothing half done was kept. Try again; if it happens again, free some memory and report it."
    with work_process(
        _serve, (task, json.dumps(arguments)), f"phalanx-{task}", f"{task} the take", action, clear_up
    ) as line:
        told = _follow(line, report)
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
        told = heard(line)
        if "share" not in told:
            return told
        report(told["share"], told["text"])
    raise CancelledError


# In the other process.


def _serve(task: str, arguments: str, line: Connection) -> None:
    serve_work(f"{task} the take", lambda: _do(task, json.loads(arguments), line), line)


def _do(task: str, arguments: dict[str, Any], line: Connection) -> dict[str, Any]:
    told_s = 0.0

    def progress(share: float, text: str = "") -> None:
        nonlocal told_s
        if time.monotonic() - told_s >= _TELL_S:
            tell(line, {"share": share, "text": text})
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
