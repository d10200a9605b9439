"""The engine on its thread: frames in by a bounded queue, poses out by calls, and never an exception out."""

from __future__ import annotations

import gc
import logging
import threading
import time
from collections import deque
from collections.abc import Callable
from typing import Protocol

from app.live_numbers import LiveFrame, SolverMeter
from app.mailbox import BoundedQueue
from app.notifications import NotificationCentre
from app.recording import Recorder
from core.cast import Cast
from core.frames import HandKey, MarkerFrame, TrackedFrame
from core.gap_filling import GapFiller

LOG = logging.getLogger("phalanx")

QUEUE_FRAMES = 240
"""Frames that may wait for the engine: two seconds at 120 Hz, so that a hiccup of the machine costs nothing."""

NOT_READY = "solver starting"
QUEUE_FULL = "engine queue full"
FAILED = "solver error"


class EngineLike(Protocol):
    """What the session asks of an engine (core.engine.Engine)."""

    def step(self, frame: MarkerFrame) -> TrackedFrame: ...  # noqa: D102

    def reset(self) -> None: ...  # noqa: D102

    def search(self, hand: HandKey) -> None: ...  # noqa: D102


class SolverThread:
    """Solves frames in the order they came. `offer` never waits.

    on_solved: called on this thread for every frame with its points and its pose, smoothed and `look_ahead_s` later.
    A take gets every pose at once, as it was solved: what a gap hides may be found out better afterwards.
    """

    def __init__(
        self,
        profiles: Cast,
        engine: Callable[[Cast], EngineLike],
        warm_up: Callable[[], object],
        on_solved: Callable[[LiveFrame], None],
        notifications: NotificationCentre,
        queue_frames: int = QUEUE_FRAMES,
    ) -> None:
        self.profiles = profiles
        self.meter = SolverMeter()
        self.ready = threading.Event()
        self.status = "Not started."
        self._make, self._warm_up, self._on_solved = engine, warm_up, on_solved
        self._notifications = notifications
        self._queue: BoundedQueue[tuple[MarkerFrame, Recorder | None] | Callable[[], None]] = BoundedQueue(queue_frames)
        self._engine: EngineLike | None = None
        self.look_ahead_s = 0.0
        self._filler: GapFiller | None = None
        self._held: deque[MarkerFrame] = deque()  # points of the frames that the filler holds back
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="phalanx-engine", daemon=True)

    @property
    def queue_depth(self) -> int:
        """Frames waiting."""
        return self._queue.depth

    @property
    def queue_size(self) -> int:
        """Frames that may wait."""
        return self._queue.size

    def start(self) -> None:
        """Warm up in the background, then solve."""
        self.status = "Preparing the solver…"
        self._thread.start()

    def close(self, timeout_s: float | None = None) -> bool:
        """End the thread; False if it has not ended in time (the first compilation cannot be interrupted)."""
        self._stop.set()
        if self._thread.is_alive():
            self._thread.join(timeout_s)
        return not self._thread.is_alive()

    def offer(self, frame: MarkerFrame, recorder: Recorder | None) -> None:
        """One frame to be solved; the recorder gets its pose, or the reason why there is none."""
        reason = NOT_READY if not self.ready.is_set() else ""
        if not reason and not self._queue.offer((frame, recorder)):
            reason = QUEUE_FULL
        if reason:
            if reason != NOT_READY:
                self.meter.dropped(reason)
            if recorder is not None:
                recorder.unsolved(reason)

    def set_profiles(self, profiles: Cast) -> None:
        """Solve for other performers from the next frame on."""

        def change() -> None:
            engine = self._make(profiles)
            self._engine, self.profiles = engine, profiles
            self._begin_filling()

        self._queue.force(change)

    def set_look_ahead(self, seconds: float) -> None:
        """Hold frames back for so long from the next frame on."""
        self.look_ahead_s = seconds
        self._queue.force(self._begin_filling)

    def reset(self) -> None:
        """Forget the hands and search again."""

        def begin_anew() -> None:
            if self._engine is not None:
                self._engine.reset()
                self._begin_filling()

        self._queue.force(begin_anew)

    def search(self, hand: HandKey) -> None:
        """Forget one hand and search it again."""

        def begin_anew() -> None:
            if self._engine is not None:
                self._engine.search(hand)

        self._queue.force(begin_anew)

    # The engine thread.

    def _begin_filling(self) -> None:
        """What is held back is not shown any more: it belongs to what went before."""
        self._filler = GapFiller(self.profiles, self.look_ahead_s)
        self._held.clear()

    def _run(self) -> None:
        try:
            started = time.monotonic()
            self._warm_up()
            self._engine = self._make(self.profiles)
            self._begin_filling()
            gc.collect()
            gc.freeze()  # what lives now lives on: later collections need not look at it and stay short
            LOG.info("Solver ready after %.1f s", time.monotonic() - started)
        except Exception as error:
            self.status = "The solver could not start."
            self._notifications.error(error, "Solver", "Starting the solver")
            return
        self.status = "Ready."
        self.ready.set()
        while not self._stop.is_set():
            item = self._queue.take(0.1)
            if item is None:
                continue
            if callable(item):
                try:
                    item()
                except Exception as error:
                    self._notifications.error(error, "Solver", "Changing the solver")
                continue
            self._solve(*item)

    def _solve(self, frame: MarkerFrame, recorder: Recorder | None) -> None:
        assert self._engine is not None
        assert self._filler is not None
        started = time.perf_counter()
        try:
            solved = self._engine.step(frame)
        except Exception as error:
            self.meter.dropped(FAILED)
            if recorder is not None:
                recorder.unsolved(FAILED)
            self._notifications.error(error, "Solver", "Solving a frame")
            try:
                self._engine.reset()
            except Exception:
                LOG.exception("Resetting the solver")
            return
        if recorder is not None:
            recorder.solved(solved)
        found = time.perf_counter()
        self._held.append(frame)
        try:
            due = self._filler.push(solved)
        except Exception as error:
            self._notifications.error(error, "Solver", "Filling gaps")
            self._begin_filling()
            return
        done = time.perf_counter()
        self.meter.solved({**solved.stage_s, "smooth": done - found}, done - started)
        for shown in due:
            self.meter.handed_on(shown)
            self._on_solved(LiveFrame(self._held.popleft(), shown, self.profiles))
