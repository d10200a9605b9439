"""`phalanx train labeller` in a process of its own: capture goes on meanwhile, and PyTorch never enters this one."""

from __future__ import annotations

import contextlib
import json
import logging
import multiprocessing
import os
import traceback
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from multiprocessing.connection import Connection
from typing import Any

from app.left_behind.run_file import RunFile, report_of
from app.review.own_process import step_back
from app.signals import deaf
from core.errors import CancelledError, PhalanxError

_LOOK_S = 0.1
_LOG = logging.getLogger("phalanx")


@dataclass(frozen=True)
class TrainingProgress:
    """As core.training.loop.Progress. clouds: learnt from so far. accuracy: share of validation points named right."""

    share: float
    clouds: int
    clouds_per_s: float
    accuracy: float
    left_s: float


def train(
    words: Sequence[str], report: Callable[[TrainingProgress], None], stopped: Callable[[], bool],
    dropped: Callable[[], bool] = lambda: False,
) -> dict[str, Any]:  # fmt: skip
    """Train as the words after `phalanx train` say. Blocks: for the thread of a job. Returns the network's card.

    stopped: end early, the best so far is kept and the card says so. dropped: end at once. Raises the PhalanxError that
    training raised, and CancelledError once dropped. The process has ended in every case.
    """
    context = multiprocessing.get_context("spawn")
    line, theirs = context.Pipe()
    process = context.Process(target=_serve, args=(list(words), theirs), name="phalanx-training", daemon=True)
    process.start()
    theirs.close()
    try:
        told = _follow(line, report, stopped, dropped)
    except (EOFError, ConnectionResetError):
        process.join()
        report_file = report_of(process.pid)
        raise PhalanxError(
            f"The process that was to train the network broke down (exit code {process.exitcode}).",
            "Free some memory or choose fewer threads, then start again."
            + (f" The report of a fault is {report_file}." if report_file else ""),
        ) from None
    finally:
        process.kill()
        process.join()
        line.close()
        report_of(process.pid)
    if "card" in told:
        card: dict[str, Any] = told["card"]
        return card
    if told["trace"]:
        _LOG.error("%s", told["trace"])
    raise PhalanxError(told["what"], told["action"])


def _follow(
    line: Connection, report: Callable[[TrainingProgress], None], stopped: Callable[[], bool],
    dropped: Callable[[], bool],
) -> dict[str, Any]:  # fmt: skip
    """What the process told last. Raises EOFError if it ended before."""
    asked = False
    while not dropped():
        if stopped() and not asked:
            asked = True
            line.send_bytes(b"stop")
        if line.poll(_LOOK_S):
            told: dict[str, Any] = json.loads(line.recv_bytes())
            if "progress" not in told:
                return told
            report(TrainingProgress(**told["progress"]))
    raise CancelledError


# In the other process.


def _serve(words: list[str], line: Connection) -> None:
    with contextlib.suppress(BrokenPipeError, ConnectionResetError):  # the window has gone: nobody waits for this
        with RunFile("the process that was to train a network"):
            told = _trained(words, line)
        line.send_bytes(json.dumps(told).encode())


def _trained(words: list[str], line: Connection) -> dict[str, Any]:
    deaf()
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    step_back()
    try:
        from app.cli import build_parser
        from app.commands.train import order_of

        order = order_of(build_parser(["train"]).parse_args(["train", *words]))
        from core.training.labeller import make
        from core.training.loop import Progress

        def report(progress: Progress) -> None:
            known = TrainingProgress(
                progress.share, progress.samples, progress.samples_per_s, progress.accuracy, progress.left_s
            )
            line.send_bytes(json.dumps({"progress": asdict(known)}).encode())

        return {"card": make(order, report, line.poll)}
    except (BrokenPipeError, ConnectionResetError):
        raise
    except PhalanxError as error:
        return {"what": error.what, "action": error.action, "trace": ""}
    except Exception as error:
        what = f"Training failed: unexpected {type(error).__name__}: {error}."
        return {"what": what, "action": "The details are in the log file.", "trace": traceback.format_exc()}
