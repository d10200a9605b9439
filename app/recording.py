"""One take being written: bounded queues and a thread of its own, from the first frame to the sealed file."""

from __future__ import annotations

import logging
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future, wait
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from app.disk_room import DiskRoom, free_text, room_to_begin
from app.disk_wait import STALL_S, DiskWait, disk_answers, disk_hangs
from app.mailbox import Fifo
from app.rescued import rescued_folder
from app.take_sealing import seal, why_not_sealed
from app.take_summary import (
    RecordingNumbers,
    SealingNumbers,
    TakeSummary,
    is_of_disk,
    not_finished,
    not_written,
    unwritable,
)
from app.take_tally import TakeTally
from app.unfinished import finish_before_exit
from core.cast import Cast
from core.errors import PhalanxError, TakeError
from core.frames import TrackedFrame
from core.level import Level
from core.streams import Record, Sample, StreamInfo
from core.takes.disk import RESERVE
from core.takes.holes import Holes
from core.takes.reader import open_take
from core.takes.safekeeping import Notice
from core.takes.take import Mark, TakeInfo
from core.takes.verdict import Finding
from core.takes.writer import TakeWriter
from devices.device import Health

LOG = logging.getLogger("phalanx")

QUEUE_FRAMES = 5120
"""Frames of each stream that may wait for the disk: 43 s at 120 Hz. One that is too much for it costs no other."""
SOLVED_SHARE = 0.6
"""Of so many, poses may wait: they can be made again."""
DRAIN_S = 10.0
"""How long sealing waits for the engine to finish the take's last frames."""
DISK_CHECK_S = 0.5
"""How often it is looked whether the file is still there, and how much room there is."""
NOTES_EVERY_S = 0.5
"""How often notes that are being typed go to the disk."""
EXIT_PATIENCE_S = 30.0
"""How long the end of this process waits for a disk that does not answer while a take is finished."""

QUEUE_FULL = "writer queue full"
DISK_ERROR = "disk error"
DISK_HANGS = "disk did not answer"
UNWRITABLE = "cannot be written"
"""Of a frame that no take can hold: that it came costs no other its place."""


class _Moment(NamedTuple):
    """That is marked. at_s: by the host's clock [s]."""

    at_s: float
    text: str


class Recorder:
    """Writes one take of several streams. `raw`, `solved` and `unsolved` never wait and never raise.

    on_fault: called once, on the writer thread, when the disk fails or is nearly full; the recording should then be
    stopped. on_notice: called from any thread when something befalls the file or its disk: it will be full within ten
    minutes, it hangs, the file was deleted, and when that is over.

    The thread does not keep the process alive: a disk that hangs must not. While it can write, the end of the process
    waits for it.
    """

    def __init__(
        self,
        path: Path,
        info: TakeInfo,
        profiles: Cast,
        streams: Sequence[StreamInfo] = (),
        solving: str = "",
        *,
        on_fault: Callable[[PhalanxError], None] = lambda error: None,
        on_notice: Callable[[Notice], None] = lambda notice: None,
        disk_reserve_bytes: int = RESERVE,
        queue_frames: int = QUEUE_FRAMES,
        began_s: float | None = None,
    ) -> None:
        """Opens the file. streams: all that will be in it; solving: key of the one that is solved: both as TakeWriter
        has them. queue_frames: of each stream that may wait for the disk. began_s: when the take began, by the host's
        clock; None: now [s]. Raises TakeError, and then nothing is left behind."""
        self.info = info
        self._on_fault, self._on_notice = on_fault, on_notice
        free = room_to_begin(path.parent, disk_reserve_bytes)
        self._queue: Fifo[Sample | TrackedFrame | _Moment] = Fifo()
        self._moments: deque[_Moment] = deque()  # that are marked, and not written yet
        self._most, self._most_poses = queue_frames, int(queue_frames * SOLVED_SHARE)
        self._stopping = threading.Event()
        self._tally = TakeTally(profiles, streams, solving, info.rate_hz, began_s)
        self._progress = 0.0
        self._fault: PhalanxError | None = None
        self._notes = info.notes
        self._room = DiskRoom(free, disk_reserve_bytes, on_notice)
        self._ended_by = ""  # what ended it, if nobody did
        self._disk = DiskWait()
        self._stall_said = self._discarded = self._settled = False
        self._lost_before = 0  # it hung the last time
        self._unwritable: set[str] = set()  # who sent what no take can hold
        self.finished: Future[TakeSummary] = Future()
        # Last: nothing that fails may leave a file behind.
        self._writer = TakeWriter(path, info, profiles, streams, solving, refuge=rescued_folder(), notify=on_notice)
        self._thread = threading.Thread(target=self._run, name=f"phalanx-writer-{info.name}", daemon=True)
        try:
            self._thread.start()
        except RuntimeError as error:  # the system has no more threads
            self._writer.discard()
            raise TakeError(
                f"Take {info.name} cannot be recorded ({error}).", "Close other programs, or start Phalanx anew."
            ) from error
        finish_before_exit(self)

    # What the device and engine threads call.

    def raw(self, stream: str, record: Record) -> bool:
        """Take a frame, or a clock sample, of a stream as its device sent it. Whether the engine owes its pose: not of
        a stream that is not solved, or not in this take, nor once that is being closed."""
        sample = Sample(stream, record)
        with self._tally.lock:
            if self._stopping.is_set() or stream not in self._tally.streams:
                return False
            stall_s = self._disk.seconds
            say_so = stall_s >= STALL_S and not self._stall_said
            if say_so:
                self._stall_said, self._lost_before = True, self._tally.dropped(DISK_HANGS)
            full = self._tally.waiting(sample) >= self._most
            owed = self._tally.came(sample)
            if self._fault is not None:
                self._tally.not_kept(sample, DISK_ERROR)
            elif full:
                self._tally.not_kept(sample, DISK_HANGS if stall_s >= STALL_S else QUEUE_FULL)
            else:
                self._queue.put(sample)
        if say_so:
            self._on_notice(disk_hangs(self.path.parent, self.info.name, stall_s))
        return owed

    def solved(self, frame: TrackedFrame) -> None:
        """The pose of a frame given to `raw`."""
        with self._tally.lock:
            refused = self._tally.poses_waiting >= self._most_poses
            if not refused:
                self._queue.put(frame)
            self._tally.answered(QUEUE_FULL if refused else "")

    def unsolved(self, reason: str) -> None:
        """A frame given to `raw` will have no pose."""
        self._tally.answered(reason)

    # What the operator's side calls.

    @property
    def path(self) -> Path:
        """The file; another than at the start if that was moved or had to be rescued."""
        return self._writer.path

    @property
    def elapsed_s(self) -> float:
        """Since the start [s]."""
        return self._tally.elapsed_s

    def mark(self, text: str = "") -> Mark:
        """Remember this moment."""
        moment = _Moment(self._tally.mark(), text)
        self._queue.put(moment)
        return self._mark_of(moment)

    def set_notes(self, text: str) -> None:
        """What the take says of itself; may change until it is sealed."""
        self._notes = text

    @property
    def sealing(self) -> SealingNumbers:
        """How far it is in being finished."""
        tally = self._tally
        return SealingNumbers(self.info.name, self._progress, self._stalled_s, tally.received, tally.written)

    @property
    def _stalled_s(self) -> float:
        """For how long the disk has not answered, 0 if it does [s]."""
        return self._disk.seconds if self._disk.stalled else 0.0

    def stop(self, meanwhile: Mapping[str, Health] | None = None, ended_s: float | None = None) -> Future[TakeSummary]:
        """Accept no more frames and seal the take on its own thread. May be called twice.

        meanwhile: of each stream, what its device has counted since the take began. ended_s: when it ended, by the
        host's clock; None: now [s].
        """
        with self._tally.lock:
            if not self._stopping.is_set():
                self._tally.end(meanwhile or {}, ended_s)
                self._stopping.set()
        return self.finished

    def discard(self) -> Future[TakeSummary]:
        """Accept no more frames and leave no file, unless there are frames in it: it never really began."""
        self._discarded = True
        return self.stop()

    def give_up(self) -> None:
        """Accept no more frames and wait no longer for the disk: `finished` says at once what is on it.

        If the disk answers after all while this process runs, the take is finished, and `on_notice` is told."""
        self.stop()
        with self._tally.lock:
            if self._settled:
                return
            self._settled = True
            summary = self._given_up()
        self.finished.set_result(summary)

    def numbers(self, meanwhile: Mapping[str, Health] | None = None) -> RecordingNumbers:
        """The figures now. meanwhile: as of `stop`."""
        stalled_s = self._stalled_s
        safety = self._writer.safety
        trouble, level = safety.trouble, safety.level
        if stalled_s:
            trouble, level = f"The disk has not answered for {stalled_s:.0f} s", Level.PROBLEM
        tally = self._tally
        with tally.lock:
            tally.told(meanwhile or {})
            return RecordingNumbers(
                self.info.name, self.path, tally.elapsed_s, tally.solved, self._writer.bytes_written,
                self._room.bytes_per_s, self._room.free, self._room.seconds_left, self._queue.depth, tally.marks,
                stalled_s, trouble, level if trouble else Level.GOOD, streams=tally.figures(), solving=tally.solving,
            )  # fmt: skip

    def wait_finished(self, patience_s: float) -> None:
        """Wait until the take is finished, or given up because the disk has not answered for so long."""
        while self._thread.is_alive() and not self.finished.done():
            if self._disk.seconds >= patience_s:
                self.give_up()
            wait([self.finished], 0.1)

    def finish_before_exit(self) -> None:
        """Stop, and wait until the take is finished or its disk hangs."""
        self.stop()
        self.wait_finished(EXIT_PATIENCE_S)

    # The writer thread.

    def _run(self) -> None:
        try:
            self._write_until_stopped()
            outcome: TakeSummary | BaseException = self._seal()
        except BaseException as error:
            LOG.exception("The writer of take %s failed", self.info.name)
            outcome = error
        finally:
            with suppress(TakeError):
                self._writer.close()
        with self._tally.lock:
            given_up, self._settled = self._settled, True
        if given_up:
            self._tell_after_all(outcome)
        elif isinstance(outcome, TakeSummary):
            self.finished.set_result(outcome)
        else:
            self.finished.set_exception(outcome)

    def _write_until_stopped(self) -> None:
        check_at = time.monotonic()
        notes_at = check_at + NOTES_EVERY_S
        give_up_at = float("inf")
        while True:
            rescuing = self._writer.safety.rescuing
            item = self._queue.take(0.0 if rescuing else 0.05)
            if item is not None:
                self._write(item)
            if rescuing:
                with self._disk:
                    self._writer.safety.rescue_on()
            now = time.monotonic()
            if self._stopping.is_set():
                give_up_at = min(give_up_at, now + DRAIN_S)
                if (item is None and self._tally.pending <= 0) or now >= give_up_at:
                    break
                continue
            if now >= check_at:
                with self._disk:
                    self._check_disk(now)
                check_at = now + DISK_CHECK_S
            if now >= notes_at:
                with self._disk:
                    self._write_notes()
                notes_at = now + NOTES_EVERY_S
        while (item := self._queue.take(0.0)) is not None:
            self._write(item)
        self._write_marks()

    def _write_marks(self) -> None:
        """Once it is known from when times count, or that no such frame comes."""
        while self._moments:
            self._put(self._mark_of(self._moments.popleft()))

    def _mark_of(self, moment: _Moment) -> Mark:
        return Mark(self._tally.time_of(moment.at_s), moment.text)

    def _write(self, item: Sample | TrackedFrame | _Moment) -> None:
        if isinstance(item, _Moment):
            self._moments.append(item)
        else:
            self._put(item)
        if self._moments and self._tally.time_counts:
            self._write_marks()

    def _put(self, item: Sample | TrackedFrame | Mark) -> None:
        reason = DISK_ERROR
        if self._fault is None:
            try:
                with self._disk:
                    if isinstance(item, Sample):
                        self._writer.raw(*item)
                    elif isinstance(item, TrackedFrame):
                        self._writer.solved(item)
                    else:
                        self._writer.mark(item)
                reason = ""
            except Exception as error:
                if is_of_disk(error):
                    self._fail(error)
                else:
                    reason = UNWRITABLE
                    self._say_unwritable(item, error)
            if self._stall_said:
                self._say_answered()
        if reason:
            self._tally.not_kept(item, reason)
        else:
            self._tally.kept(item)

    def _say_unwritable(self, item: Sample | TrackedFrame | Mark, error: Exception) -> None:
        """Once of each stream, and of poses and marks."""
        source = item.stream if isinstance(item, Sample) else "the solver" if isinstance(item, TrackedFrame) else "you"
        if source in self._unwritable:
            return
        self._unwritable.add(source)
        self._on_notice(unwritable(error, source, self.info.name))

    def _say_answered(self) -> None:
        self._stall_said = False
        lost = self._tally.dropped(DISK_HANGS) - self._lost_before
        self._on_notice(disk_answers(self.path.parent, lost))

    def _write_notes(self) -> None:
        """Those typed so far outlive this process; a disk that takes them no more says so at the frames."""
        if self._notes != self.info.notes:
            self.info = replace(self.info, notes=self._notes)
            with suppress(TakeError):
                self._writer.set_info(self.info)

    def _fail(self, error: Exception) -> None:
        fault = not_written(error, self.info.name, self.path, self._tally.written)
        with self._tally.lock:
            self._fault = fault
        self._on_fault(fault)

    def _check_disk(self, now_s: float) -> None:
        self._writer.safety.look()
        if self._writer.safety.safe and self._room.full(self.path.parent, now_s, self._writer.bytes_written):
            self._end_full()

    def _end_full(self) -> None:
        if self._fault is not None or self._ended_by:
            return
        left = f"{free_text(self._room.free)} left"
        self._ended_by = f"The disk was nearly full ({left}), so the recording was ended."
        what = f"The disk is nearly full ({left}): the recording of take {self.info.name} was ended."
        self._on_fault(TakeError(what, "Free some space or choose another folder, then record again."))

    def _seal(self) -> TakeSummary:
        with self._tally.lock:
            self._tally.answered_no_more("solver too late")
            empty = not self._tally.written and not self._tally.solved
        if empty and (self._fault is not None or self._discarded):
            self._writer.discard()
            none = Finding(Level.PROBLEM, "no file", "No frame was written: no file is left.")
            return replace(self._summary(False, [none]), bytes=0)
        befallen: list[Finding] = []
        sealed = True
        with self._disk:
            self._write_notes()
            try:
                seal(self._writer, self._tally, self._sealed_part)
            except Exception as error:
                LOG.exception("Take %s could not be sealed", self.info.name)
                sealed = False
                befallen.append(why_not_sealed(error, self._writer, self._tally))
        if history := self._writer.safety.history:
            short = "its file was cut" if self._writer.safety.cut else "its file was taken away"
            befallen.append(Finding(Level.WARNING, short, history))
        return self._summary(sealed, befallen)

    def _summary(
        self,
        sealed: bool,
        befallen: Sequence[Finding] = (),
        dropped: Mapping[str, Mapping[str, int]] | None = None,
        unsolved: dict[str, int] | None = None,
    ) -> TakeSummary:
        """dropped, unsolved: by stream and reason, if other than counted."""
        problem = self._fault.what if self._fault is not None else ""
        if self._ended_by:
            befallen = (*befallen, Finding(Level.WARNING, "ended early", self._ended_by))
        try:
            size = self.path.stat().st_size if sealed else self._writer.bytes_written
        except OSError:
            size = self._writer.bytes_written
        tally = self._tally
        return TakeSummary(
            self.info.name, self.path, self.elapsed_s, tally.solved, unsolved or dict(tally.unsolved), tally.marked,
            size, sealed, problem, tally.tracked.by_hand, tuple(befallen), self.info.looked_back,
            streams=tally.figures_at_end(self._holes(sealed), dropped or {}), solving=tally.solving,
        )  # fmt: skip

    def _given_up(self) -> TakeSummary:
        """What is known to be on the disk while the writer thread hangs there."""
        dropped, unsolved, waiting = self._tally.if_lost(DISK_HANGS)
        finding = not_finished(self.path, self._stalled_s, self._tally.written, waiting)
        return self._summary(False, [finding], dropped, unsolved)

    def _tell_after_all(self, outcome: TakeSummary | BaseException) -> None:
        """The disk has answered after this was given up."""
        if isinstance(outcome, TakeSummary) and outcome.sealed:
            what = f"The disk answered after all: take {self.info.name} is finished. {outcome.line}."
            self._on_notice(Notice(Level.WARNING if outcome.dropped else Level.GOOD, what))

    def _holes(self, sealed: bool) -> dict[str, Holes]:
        """As the file says, of each stream; of none where it cannot be asked."""
        if sealed:
            with suppress(PhalanxError, OSError), open_take(self.path, check=False) as take:
                return {key: take.holes_in(key) for key in take.streams}
        return {}

    def _sealed_part(self, part: float) -> None:
        self._progress = part
        self._disk.answered()
