"""The engine on its thread: frames in by a bounded queue, poses out by calls, and never an exception out.

A hiccup is worked off without loss. An engine that is too slow for what comes in skips frames, so that what is shown
is what happens now: the raw frames are in the take, and a skipped one can be solved again from there. Where cameras are
faster than any engine, every n-th frame is solved by choice (app.every_nth).
"""

from __future__ import annotations

import gc
import logging
import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from app.backlog import Backlog
from app.every_nth import EveryNth
from app.frame_queue import Command, FrameQueue
from app.live_numbers import SKIPPED, LiveFrame, SolverMeter
from app.notifications import NotificationCentre
from app.recording import Recorder
from core.cast import Cast
from core.frames import HandKey, MarkerFrame, TrackedFrame
from core.gap_filling import GapFiller
from core.takes.take import BY_CHOICE
from devices.common.clock import host_clock

LOG = logging.getLogger("phalanx")

QUEUE_FRAMES = 240
"""Frames that may wait for the engine: two seconds at 120 Hz, so that a hiccup of the machine costs nothing. Of more
the oldest are skipped."""

NOT_READY = "solver starting"
CHANGED = "performers or device changed"
FAILED = "solver error"
NO_START = "The solver could not start."


class EngineLike(Protocol):
    """What the session asks of an engine (core.engine.Engine)."""

    def step(self, frame: MarkerFrame) -> TrackedFrame: ...  # noqa: D102

    def reset(self) -> None: ...  # noqa: D102

    def search(self, hand: HandKey) -> None: ...  # noqa: D102

    def skip(self, frames: int) -> None: ...  # noqa: D102

    def pass_over(self, frame: MarkerFrame) -> None: ...  # noqa: D102

    def change(self, profiles: Cast) -> None: ...  # noqa: D102


@dataclass(frozen=True, slots=True)
class _Waiting:
    """A frame that waits: whose take wants its pose, in which era it came, since when it waits by the host's clock.
    before: those that were left out by choice since the one before."""

    frame: MarkerFrame
    before: tuple[MarkerFrame, ...]
    recorder: Recorder | None
    era: int
    since_s: float


class SolverThread:
    """Solves frames in the order they came. `offer` never waits.

    on_solved: called on this thread for every frame with its points and its pose, smoothed and `look_ahead_s` later;
    before the engine is ready, on the caller's and without a pose.
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
        self._queue: FrameQueue[_Waiting] = FrameQueue(queue_frames)
        self._backlog = Backlog()
        self._every_nth = EveryNth()
        self._showing = threading.Lock()
        self._era = 0  # other performers and another device begin a new one; nothing of an old one is shown
        self._unseen = 0  # frames that the engine has not been told of
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
        """End the thread; False if it has not ended in time. While the solver is being prepared it is not waited for:
        the first compilation takes minutes, and cannot be interrupted."""
        self._stop.set()
        if self._thread.is_alive():
            self._thread.join(timeout_s if self.ready.is_set() else 0.0)
        return not self._thread.is_alive()

    def offer(self, frame: MarkerFrame, recorder: Recorder | None) -> None:
        """One frame to be solved; the recorder gets its pose, or the reason why there is none."""
        if self.ready.is_set():
            era = self._era
            before = self._every_nth.next(frame, era)
            if before is not None:
                waiting = _Waiting(frame, before, recorder, era, host_clock())
                self._leave_out(self._queue.put(waiting), SKIPPED)
            elif recorder is not None:
                recorder.unsolved(BY_CHOICE)
            return
        if recorder is not None:
            recorder.unsolved(NOT_READY)
        with self._showing:
            self._on_solved(LiveFrame(frame, TrackedFrame(frame.sequence, frame.times, ()), self.profiles))

    def set_profiles(self, profiles: Cast) -> None:
        """Solve for other performers from the next frame on. What came in before is not shown any more."""

        def change() -> None:
            assert self._engine is not None
            self._engine.change(profiles)
            self.profiles = profiles
            self._begin_filling()

        self.begin_anew()
        if not self.ready.is_set():
            self.profiles = profiles
        self._queue.command(change)

    def begin_anew(self) -> None:
        """What came in before is not shown any more. Of what waits only poses that are owed to a take are solved."""
        with self._showing:
            self._era += 1
        self._leave_out(self._queue.take_out(lambda waiting: waiting.recorder is None), CHANGED)

    @property
    def solve_every(self) -> int:
        """Every n-th frame is solved; 1: all."""
        return self._every_nth.n

    def set_solve_every(self, n: int) -> None:
        """Solve every n-th frame from the next one on. Raises PhalanxError for less than 1 or too large an n."""
        self._every_nth.choose(n)

    def set_look_ahead(self, seconds: float) -> None:
        """Hold frames back for so long from the next frame on."""
        self.look_ahead_s = seconds
        self._queue.command(self._begin_filling)

    def reset(self) -> None:
        """Forget the hands and search again."""

        def search_all() -> None:
            if self._engine is not None:
                self._engine.reset()
                self._begin_filling()

        self._queue.command(search_all)

    def search(self, hand: HandKey) -> None:
        """Forget one hand and search it again."""

        def search_one() -> None:
            if self._engine is not None:
                self._engine.search(hand)

        self._queue.command(search_one)

    def _leave_out(self, frames: list[_Waiting], reason: str) -> None:
        """These are not solved: said to the take that they belong to, and to the engine before its next frame."""
        if not frames:
            return
        self.meter.dropped(reason, len(frames))
        for waiting in frames:
            if waiting.recorder is not None:
                waiting.recorder.unsolved(reason)
        with self._showing:
            self._unseen += sum(1 + len(waiting.before) for waiting in frames)

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
            self.status = NO_START
            self._notifications.error(error, "Solver", "Starting the solver")
            return
        self.status = "Ready."
        self.ready.set()
        while not self._stop.is_set():
            item = self._queue.take(0.1)
            if item is None:
                continue
            if callable(item):
                self._do(item)
            elif self._backlog.stuck(host_clock(), self._queue.depth, host_clock() - item.since_s):
                self._catch_up(item)
            else:
                self._solve(item)

    def _do(self, command: Command) -> None:
        try:
            command()
        except Exception as error:
            self._notifications.error(error, "Solver", "Changing the solver")

    def _catch_up(self, newest: _Waiting) -> None:
        """Skip down to the newest frame. Commands are not skipped, and stay between the frames they came between."""
        commands: list[Command] = []
        while self._queue.depth:
            item = self._queue.take(0.0)
            assert item is not None
            if callable(item):
                commands.append(item)
                continue
            self._leave_out([newest], SKIPPED)
            for command in commands:
                self._do(command)
            commands.clear()
            newest = item
        self._solve(newest)
        for command in commands:
            self._do(command)

    def _solve(self, waiting: _Waiting) -> None:
        assert self._engine is not None
        assert self._filler is not None
        frame, recorder = waiting.frame, waiting.recorder
        if waiting.era != self._era and recorder is None:
            self._leave_out([waiting], CHANGED)
            return
        with self._showing:
            unseen, self._unseen = self._unseen, 0
        started = time.perf_counter()
        try:
            if unseen:
                self._engine.skip(unseen)
            for passed in waiting.before:
                self._engine.pass_over(passed)
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
        frames = [LiveFrame(self._held.popleft(), shown, self.profiles) for shown in due]
        with self._showing:
            if waiting.era == self._era:
                for shown in frames:
                    self.meter.handed_on(shown.solved)
                    self._on_solved(shown)
