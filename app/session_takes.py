"""The takes of a session: the one that is recorded, of all armed streams, and those that are being finished."""

from __future__ import annotations

import threading
import time
from abc import ABC, abstractmethod
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import suppress
from functools import partial
from pathlib import Path

from app.armed import ArmedStream
from app.disk_wait import AT_ONCE_S, DiskWait, Opening
from app.notifications import NotificationCentre
from app.receiver import Receiver
from app.recording import Recorder
from app.take_info import take_info
from app.take_summary import SealingNumbers, TakeSummary
from core.cast import Cast
from core.errors import PhalanxError, TakeError
from core.level import Level
from core.takes.safekeeping import Notice
from core.takes.take import Mark, TakeInfo
from devices.device import Health


class SessionTakes(ABC):
    """Begins takes, ends them and has them finished, for a session that has the streams. Thread-safe.

    on_take: told of every take that has ended. on_begun, on_moved, on_sealed: of every one that begins, is moved and is
    sealed: for what outlives this process, should it not end well.
    """

    def __init__(self, notifications: NotificationCentre, disk_reserve_bytes: int) -> None:
        self.notifications = notifications
        self.on_take: Callable[[TakeSummary], None] = lambda summary: None
        self.on_begun: Callable[[Path], None] = lambda path: None
        self.on_moved: Callable[[Path, Path], None] = lambda before, now: None
        self.on_sealed: Callable[[Path], None] = lambda path: None
        self._reserve = disk_reserve_bytes
        self._lock = threading.RLock()
        self._recorder: Recorder | None = None
        self._recorded: dict[ArmedStream, Health] = {}  # with what had been counted when the take began
        self._opening: tuple[Path, DiskWait] | None = None  # a take that is to begin is with the disk
        self._sealing: list[Recorder] = []
        self._ending = False

    # What the session is to have.

    @property
    @abstractmethod
    def streams(self) -> tuple[ArmedStream, ...]:
        """All that are armed."""

    @property
    @abstractmethod
    def solving(self) -> str:
        """Key of the one that is solved, "" for none."""

    @property
    @abstractmethod
    def profiles(self) -> Cast:
        """The performers."""

    @abstractmethod
    def _why_not_ready(self) -> str:
        """What a take waits for, "" for nothing."""

    @abstractmethod
    def _settle(self) -> None:
        """Solve the stream that is to be solved, if that may change. Under the lock."""

    # Takes.

    @property
    def recording(self) -> bool:
        """A take is being written and accepts frames."""
        return self._recorder is not None

    @property
    def recorded(self) -> tuple[ArmedStream, ...]:
        """The streams of the take that is being written, () if none is; also those that have ended since."""
        return tuple(self._recorded)

    @property
    def _taken(self) -> bool:
        """A take is recorded, or is about to be: what is solved stays so."""
        return self.recording or self._opening is not None

    @property
    def recording_name(self) -> str:
        """Name of the take being written, empty if none is."""
        recorder = self._recorder
        return recorder.info.name if recorder is not None else ""

    @property
    def unsealed(self) -> tuple[Path, ...]:
        """The takes that are being written or finished. Waits for nothing: to be asked at any moment."""
        return tuple(path for path, _ in self.unsealed_numbers)

    @property
    def unsealed_numbers(self) -> tuple[tuple[Path, SealingNumbers], ...]:
        """The same, each with how much of it is on the disk. Waits for nothing."""
        recorders = [recorder for recorder in list(self._sealing) if not recorder.finished.done()]
        recorder = self._recorder
        return tuple((one.path, one.sealing) for one in ([*recorders, recorder] if recorder is not None else recorders))

    def take_info(self, name: str, *, performer: str | None = None, notes: str = "", shot: str = "") -> TakeInfo:
        """What is known of a take that begins now: of its devices, and of its performers if nobody says who they
        are."""
        if performer is None:
            performer = ", ".join(filter(None, (profile.performer for profile in self.profiles)))
        return take_info(name, self.streams, self.solving, performer=performer, notes=notes, shot=shot)

    def start_recording(self, path: Path, info: TakeInfo) -> Future[TakeSummary]:
        """Begin a take of all streams that are armed now. Opens its file, so it may take some milliseconds. The future
        gives the summary once the take is finished, whoever or whatever ends it.

        After `begin_no_more` none begins, and no file is left.

        Raises TakeError if a take is running, the solver is not ready, no device streams, or the file cannot be made.
        """
        disk = DiskWait()
        with self._lock:
            streams, solving = self._may_record(path), self.solving
            self._opening = path.parent, disk
        try:
            # Not under the lock, which the window takes too: the disk may hang.
            with disk:
                recorder = Recorder(
                    path, info, self.profiles, [one.info for one in streams], solving,
                    on_fault=self._recording_failed, on_notice=self._notice, disk_reserve_bytes=self._reserve,
                )  # fmt: skip
            with self._lock:
                begins = not self._ending
                if begins:
                    try:
                        recorded = {one: one.receiver.counted(one.key) for one in streams}
                    except BaseException:
                        recorder.discard()
                        raise
                    self._recorded, self._recorder = recorded, recorder
                    self.on_begun(recorder.path)
            if not begins:
                with disk:
                    recorder.discard().exception()  # once it comes back, its file has gone
        finally:
            with self._lock:
                self._opening = None
                self._settle()
        for receiver in {one.receiver: None for one in self.streams}:
            self._say_late(receiver)
        return recorder.finished

    def _may_record(self, path: Path) -> tuple[ArmedStream, ...]:
        """The streams that would be recorded. Raises TakeError."""
        if self._recorder is not None:
            raise TakeError(f"Take {self._recorder.info.name} is still being recorded.", "Stop it first.")
        if self._opening is not None:
            raise TakeError("A take is being begun; its disk has not answered yet.", "Check the disk.")
        if why := self._why_not_ready():
            raise TakeError(f"Recording is not possible yet: {why}", "Try again in some seconds.")
        streams = self.streams
        if not streams:
            raise TakeError("No device is connected, so there is nothing to record.", "Connect a device first.")
        for finishing in self._sealing:
            if finishing.sealing.stalled_s and finishing.path.parent == path.parent:
                raise TakeError(
                    f"The disk of {path.parent} does not answer; take {finishing.info.name} waits for it.",
                    "Check the disk, or choose a folder on another one.",
                )
        return streams

    def _say_late(self, receiver: Receiver) -> None:
        """A take holds the streams that it began with, and so it is said of a device that comes later."""
        with self._lock:
            recorder = self._recorder
            late = receiver.streaming and all(one.receiver is not receiver for one in self._recorded)
        if recorder is not None and late:
            self.notifications.warning(
                f"{receiver.title} is not in take {recorder.info.name}, which began before it was connected.",
                "To record it too, stop the recording and begin another take.", receiver.title,
            )  # fmt: skip

    @property
    def opening(self) -> Opening | None:
        """A take that is to begin and waits for its disk, None if none does."""
        folder, disk = self._opening or (Path(), None)
        seconds = disk.seconds if disk is not None else 0.0
        return Opening(folder, seconds) if seconds >= AT_ONCE_S else None

    def begin_no_more(self) -> None:
        """The session ends: a take that waits for its disk does not begin any more."""
        with self._lock:
            self._ending = True

    def stop_recording(self) -> Future[TakeSummary]:
        """End the take. It is sealed on its own thread; the next may start at once.

        The future gives the summary. Raises TakeError if nothing is recorded.
        """
        recorder, meanwhile = self._end_take()
        return recorder.stop(meanwhile)

    def solve_no_more(self) -> None:
        """Finish takes of what just happened without the poses that are not there yet."""
        for recorder in list(self._sealing):
            recorder.stop()

    def discard_recording(self) -> Future[TakeSummary]:
        """End a take that never really began: without a frame in it, it leaves no file. Raises as `stop_recording`."""
        recorder, _ = self._end_take()
        return recorder.discard()

    def give_up_finishing(self) -> None:
        """Wait no longer for takes that are being finished; what is on disk of them is said at once."""
        for recorder in list(self._sealing):
            recorder.give_up()

    def _end_take(self) -> tuple[Recorder, dict[str, Health]]:
        """The take that ends, and what became of its streams before they came here."""
        with self._lock:
            recorder, meanwhile = self._recorder, self._meanwhile()
            if recorder is None:
                raise TakeError("No take is being recorded.", "Start one first.")
            self._recorder, self._recorded = None, {}
            self._sealing.append(recorder)
            self._settle()
        recorder.finished.add_done_callback(lambda _: self._sealed(recorder))
        return recorder, meanwhile

    def _meanwhile(self) -> dict[str, Health]:
        """Of each stream that is recorded, what its device has counted since the take began."""
        return {one.key: one.receiver.counted(one.key).since(before) for one, before in self._recorded.items()}

    def _stop_if_recording(self) -> None:
        with suppress(TakeError):  # it may have been ended by a fault this moment
            self.stop_recording()

    def mark(self, text: str = "") -> Mark:
        """Remember this moment of the take. Raises TakeError if nothing is recorded."""
        recorder = self._recorder
        if recorder is None:
            raise TakeError("A mark needs a take.", "Start recording first.")
        return recorder.mark(text)

    def set_notes(self, text: str) -> None:
        """Notes of the take that is being written, or has just been ended by a fault and is being finished."""
        with self._lock:
            ended = (one for one in reversed(self._sealing) if not one.info.looked_back)
            recorder = self._recorder or next(ended, None)
        if recorder is not None:
            recorder.set_notes(text)

    def seal(self, timeout_s: float) -> None:
        """End the take that runs, if one does, and wait until it and those before are on disk, so long at most [s]."""
        deadline = time.monotonic() + timeout_s
        self._stop_if_recording()
        self.solve_no_more()
        for recorder in list(self._sealing):
            with suppress(TimeoutError):
                recorder.finished.exception(max(deadline - time.monotonic(), 0.1))
            while recorder in self._sealing and time.monotonic() < deadline:
                time.sleep(0.005)  # until `on_sealed` knows it: this process may end next

    def _sealed(self, recorder: Recorder) -> None:
        finished = recorder.finished
        error = finished.exception()
        if error is None and (finished.result().sealed or not finished.result().bytes):
            self.on_sealed(finished.result().path)
        with self._lock:
            self._sealing.remove(recorder)
        if error is not None:
            self.notifications.error(error, "Recorder", "Finishing the take")
            return
        summary = finished.result()
        verdict = summary.verdict
        action = " ".join(text for text in verdict.texts if text != summary.problem)  # said when it came
        if verdict.level is Level.PROBLEM:
            self.notifications.problem(f"Take {summary.name}: {verdict.headline}.", action, "Recorder")
        elif verdict.level is Level.WARNING:
            self.notifications.warning(f"Take {summary.name} is saved: {verdict.headline}.", action, "Recorder")
        else:
            self.notifications.info(f"Take {summary.name} is saved. {summary.line}.", source="Recorder")
        self.on_take(summary)

    def _recording_failed(self, fault: PhalanxError) -> None:
        self.notifications.error(fault, "Recorder")
        self._stop_if_recording()

    def _notice(self, notice: Notice) -> None:
        if notice.moved is not None:
            self.on_moved(*notice.moved)
        say = {Level.PROBLEM: self.notifications.problem, Level.WARNING: self.notifications.warning}
        over = partial(self.notifications.info, settles=True)
        say.get(notice.level, over)(notice.what, notice.action, "Recorder")
