"""A tour of the real window on the built-in performer: connect, track, record, export, look; leaves files behind."""

from __future__ import annotations

import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from threading import Event

from PySide6.QtCore import QEventLoop, QTimer

from app import settings as names
from app.application import Running, start, take_screenshot
from app.settings import Settings
from app.take_summary import TakeSummary
from core.cast import hand_names, hands_of
from core.disk_error import why
from core.errors import PhalanxError
from core.frames import HandState
from core.takes.export import FORMATS, export
from core.takes.reader import open_take
from core.takes.solution import Solution

READY_S = 180.0
TRACKED_S = 60.0
SEALED_S = 120.0
EXPORTED_S = 600.0
SIZE = (1600, 1000)
LOOK_MS = 50
NEVER = Event()
Say = Callable[[str], None]


@dataclass(frozen=True)
class TourResult:
    """What the tour left behind. rms_m: by hand, at the screenshot. latency_s: exposure to solved, median."""

    summary: TakeSummary
    exports: list[Path]
    screenshots: list[Path]
    rms_m: dict[str, float]
    rate_hz: float
    latency_s: float


def run_demo_tour(
    folder: Path, seconds: float = 8.0, say: Say = lambda text: None, stopped: Event = NEVER
) -> TourResult:
    """Record a take of `seconds`, export it in every format and take pictures, all into `folder`.

    say: told each step. stopped: ends it early; what is recorded then is saved. Needs a display (a virtual one will
    do). Raises PhalanxError with the step that failed, and KeyboardInterrupt once stopped.
    """
    folder = folder.resolve()
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise PhalanxError(
            f"The folder {folder} cannot be made ({why(folder, error)}).", "Choose another with --out."
        ) from error
    settings = Settings(None)
    settings.set(names.TAKE_FOLDER, str(folder))
    settings.set(names.PERFORMER, "demo")
    settings.set(names.SHOT, "tour")
    say("Opening the window on the built-in performer.")
    running = start(settings, demo=True)
    try:
        running.window.resize(*SIZE)
        return _tour(running, folder, seconds, say, stopped)
    finally:
        running.window.stop_and_close()


def _tour(running: Running, folder: Path, seconds: float, say: Say, stopped: Event) -> TourResult:
    window, session = running.window, running.session
    wait, rest = partial(until, stopped=stopped), partial(pause, stopped=stopped)
    say("Preparing the solver: the first time this takes up to a quarter of a minute.")
    wait(lambda: session.ready, READY_S, "The solver did not get ready")
    wait(lambda: both_tracked(running), TRACKED_S, "The hands were not found")
    wait(lambda: window.record_action.isEnabled(), TRACKED_S, "Recording did not become possible")
    say(f"Both hands are tracked. Recording {seconds:g} s.")
    finished: list[TakeSummary] = []
    window.worker.take_finished.connect(finished.append)
    refusals: list[Exception] = []
    window.worker.recording_refused.connect(refusals.append)
    window.record_action.trigger()
    wait(lambda: session.recording or bool(refusals), TRACKED_S, "Recording did not start")
    if refusals:
        raise refusals[0]
    rest(seconds / 2)
    window.mark_action.trigger()
    rest(seconds / 2)
    frame = session.latest.peek()
    hands = frame.solved.hands if frame is not None else ()
    numbers = session.numbers().solver
    pictures = [folder / "live.png"]
    take_screenshot(window, pictures[0])
    window.record_action.trigger()
    wait(lambda: bool(finished), SEALED_S, "The take was not finished")
    summary = finished[0]
    say(f"{summary.path.name}: {summary.line}.")
    say("Exporting in every format; each file is read back and compared.")
    exports = _export(summary.path, folder / f"{summary.name}_exports", stopped)
    say("Opening the take in review.")
    window.review_take(summary.path)
    rest(3.0)
    pictures.append(folder / "review.png")
    take_screenshot(window, pictures[1])
    named = hand_names(session.profiles)
    rms_m = {named[hand.key]: hand.rms_m for hand in hands if hand.state is HandState.TRACKED}
    return TourResult(summary, exports, pictures, rms_m, numbers.rate_hz, numbers.latency_s)


def _export(path: Path, directory: Path, stopped: Event) -> list[Path]:
    def work() -> list[Path]:
        with open_take(path) as take:
            return export(Solution.of_take(take), list(FORMATS), directory)

    with ThreadPoolExecutor(1, thread_name_prefix="phalanx-export") as pool:
        job = pool.submit(work)
        until(job.done, EXPORTED_S, "The export did not finish", stopped)
        return job.result()


def both_tracked(running: Running) -> bool:
    """Does the latest frame have every hand of the profiles?"""
    frame = running.session.latest.peek()
    return (
        frame is not None
        and len(frame.solved.hands) == len(hands_of(running.session.profiles))
        and all(hand.state is HandState.TRACKED for hand in frame.solved.hands)
    )


def until(condition: Callable[[], bool], timeout_s: float, problem: str, stopped: Event = NEVER) -> None:
    """Let the window live until the condition holds. Raises PhalanxError if it does not in time."""
    deadline = time.monotonic() + timeout_s
    while not condition():
        if time.monotonic() > deadline:
            raise PhalanxError(f"{problem} within {timeout_s:g} s.", "See the log file for the reason.")
        pause(0.05, stopped)


def pause(seconds: float, stopped: Event = NEVER) -> None:
    """Let the window live for some seconds. Raises KeyboardInterrupt once stopped."""
    loop, look = QEventLoop(), QTimer()
    look.timeout.connect(lambda: loop.quit() if stopped.is_set() else None)
    look.start(LOOK_MS)
    QTimer.singleShot(round(seconds * 1000), loop.quit)
    loop.exec()
    if stopped.is_set():
        raise KeyboardInterrupt("Stopped before the end of the tour; what was recorded is saved.")
