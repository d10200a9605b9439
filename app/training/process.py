"""`phalanx train labeller` in a process of its own: capture goes on meanwhile, and PyTorch never enters this one."""

from __future__ import annotations

import logging
import traceback
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from multiprocessing.connection import Connection
from typing import Any

from app.work_process import heard, serve_work, tell, work_process
from core.errors import CancelledError, PhalanxError

_LOOK_S = 0.1
_TASK = "train the network"
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
    action = "Free some memory or choose fewer threads, then start again."
    with work_process(_serve, (list(words),), "phalanx-training", _TASK, action) as line:
        told = _follow(line, report, stopped, dropped)
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
            told = heard(line)
            if "progress" not in told:
                return told
            report(TrainingProgress(**told["progress"]))
    raise CancelledError


# In the other process.


def _serve(words: list[str], line: Connection) -> None:
    serve_work(_TASK, lambda: _trained(words, line), line)


def _trained(words: list[str], line: Connection) -> dict[str, Any]:
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
            tell(line, {"progress": asdict(known)})

        return {"card": make(order, report, line.poll)}
    except (BrokenPipeError, ConnectionResetError):
        raise
    except PhalanxError as error:
        return {"what": error.what, "action": error.action, "trace": ""}
    except Exception as error:
        what = f"Training failed: unexpected {type(error).__name__}: {error}."
        return {"what": what, "action": "The details are in the log file.", "trace": traceback.format_exc()}
