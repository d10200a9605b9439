"""One take being written: a bounded queue and a thread of its own, from the first frame to the sealed file."""

from __future__ import annotations

import logging
import math
import shutil
import threading
import time
from collections import Counter
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from app.mailbox import BoundedQueue
from core.cast import Cast
from core.errors import PhalanxError, TakeError
from core.frames import MarkerFrame, TrackedFrame
from core.takes.disk import RESERVE, WARN_BELOW_S, DiskMeter, duration_text
from core.takes.holes import NO_HOLES, Holes
from core.takes.reader import open_take
from core.takes.take import Mark, TakeCounts, TakeInfo
from core.takes.tracked import TrackedCount
from core.takes.verdict import Account, Verdict, verdict_of
from core.takes.writer import TakeWriter
from devices.stream import host_clock

LOG = logging.getLogger("phalanx")

QUEUE_FRAMES = 8192
"""Items that may wait for the disk: half a minute of raw and solved frames at 120 Hz."""
SOLVED_SHARE = 0.75
"""Solved frames are refused when the queue is this full: the rest is for raw ones, which cannot be made again."""
DRAIN_S = 10.0
"""How long sealing waits for the engine to finish the take's last frames."""
DISK_CHECK_S = 1.0
LONG_SILENCE_S = 0.5
"""Without frames for so long a take says so while it runs, and goes on saying it [s]."""
NOTES_EVERY_S = 0.5
"""How often notes that are being typed go to the disk."""

QUEUE_FULL = "writer queue full"
DISK_ERROR = "disk error"


@dataclass(frozen=True)
class RecordingNumbers:
    """A take while it is written. seconds_left: what the disk still holds at the present rate, infinite if unknown.

    silent_s: since the last frame, or since the start if none came [s]. holes_s: without frames before that [s].
    """

    name: str
    path: Path
    elapsed_s: float
    received: int
    written: int
    solved: int
    dropped: dict[str, int]
    bytes_written: int
    bytes_per_s: float
    disk_free: int
    seconds_left: float
    queue_depth: int
    marks: int
    silent_s: float = 0.0
    holes_s: float = 0.0


@dataclass(frozen=True)
class TakeSummary:
    """What became of a take. received = written + dropped. unsolved: frames on disk without a pose, by reason.

    duration_s: from the start of the recording to its end. lost: frames that the device sent and that never came, or
    too late. late: those of them that came after newer ones. repeated: frames that came twice. holes: where no frames
    came. tracked: as in TakeCounts. sealed: the file is complete and indexed; if not it is
    readable, and `problem` says why.
    """

    name: str
    path: Path
    duration_s: float
    received: int
    written: int
    solved: int
    dropped: dict[str, int] = field(default_factory=dict)
    unsolved: dict[str, int] = field(default_factory=dict)
    lost: int = 0
    rejected: int = 0
    marks: int = 0
    bytes: int = 0
    sealed: bool = False
    problem: str = ""
    holes: Holes = NO_HOLES
    tracked: dict[str, int] = field(default_factory=dict)
    late: int = 0
    repeated: int = 0

    @property
    def verdict(self) -> Verdict:
        """What is to be thought of it: the same as of its file."""
        counts = TakeCounts(
            self.received,
            self.written,
            self.dropped,
            self.lost,
            self.rejected,
            self.solved,
            self.unsolved,
            self.tracked,
        )
        return verdict_of(
            Account(
                self.written, self.solved, counts, self.holes, self.duration_s, self.sealed, problem=self.problem
            )
        )  # fmt: skip

    @property
    def whole(self) -> bool:
        """Every frame that should have been is on disk."""
        return self.sealed and not self.dropped and not self.lost and not self.rejected and not len(self.holes)

    @property
    def line(self) -> str:
        """The figures in one line for people."""
        parts = [f"Received {self.received:,} = written {self.written:,} + dropped {sum(self.dropped.values()):,}"]
        parts += [f"{reason}: {count:,}" for reason, count in self.dropped.items()]
        if len(self.holes):
            parts.append(self.holes.words)
        if self.lost:
            late = f" ({self.late:,} of them came too late)" if self.late else ""
            parts.append(f"lost before this machine: {self.lost:,}{late}")
        if self.repeated:
            parts.append(f"came twice: {self.repeated:,}")
        if self.rejected:
            parts.append(f"unreadable packets: {self.rejected:,}")
        parts.append(f"solved {self.solved:,}")
        parts += [f"not solved, {reason}: {count:,}" for reason, count in self.unsolved.items()]
        return "; ".join(parts)


class Recorder:
    """Writes one take. `raw`, `solved` and `unsolved` never wait and never raise.

    on_fault: called once, on the writer thread, when the disk fails or is nearly full; the recording should then be
    stopped. on_warning: called once if the disk will be full within ten minutes.
    """

    def __init__(
        self,
        path: Path,
        info: TakeInfo,
        profiles: Cast,
        *,
        on_fault: Callable[[PhalanxError], None] = lambda error: None,
        on_warning: Callable[[str, str], None] = lambda text, action: None,
        disk_reserve_bytes: int = RESERVE,
        queue_frames: int = QUEUE_FRAMES,
    ) -> None:
        """Opens the file. Raises TakeError, and then nothing is left behind."""
        self.path, self.info = path, info
        self._on_fault, self._on_warning = on_fault, on_warning
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            free = shutil.disk_usage(path.parent).free
        except OSError as error:
            raise TakeError(
                f"The take folder {path.parent} cannot be used ({error.strerror or error}).", "Choose another folder."
            ) from error
        if free < disk_reserve_bytes:
            raise TakeError(
                f"Only {free / 1e9:.1f} GB are free in {path.parent}.",
                f"Recording needs {disk_reserve_bytes / 1e9:.1f} GB: free some space or choose another folder.",
            )
        self._writer = TakeWriter(path, info, profiles)
        self._queue: BoundedQueue[MarkerFrame | TrackedFrame | Mark] = BoundedQueue(queue_frames)
        self._solved_limit = int(queue_frames * SOLVED_SHARE)
        self._lock = threading.Lock()
        self._stopping = threading.Event()
        self._started_s = host_clock()
        self._stopped_s: float | None = None
        self._first_s: float | None = None  # host time of the first frame that has one
        self._silences: list[tuple[float, float]] = []  # from, to [s] by the host's clock
        self._arrived_s, self._behind_s = self._started_s, 0.0
        self._tracked = TrackedCount(profiles)
        self._received = self._written = self._solved = self._pending = self._marks = 0
        self._lost = self._rejected = self._late = self._repeated = 0
        self._progress = 0.0
        self._dropped: Counter[str] = Counter()
        self._unsolved: Counter[str] = Counter()
        self._fault: PhalanxError | None = None
        self._notes = info.notes
        self._disk_free = free
        self._meter = DiskMeter(disk_reserve_bytes)
        self._warned = False
        self.finished: Future[TakeSummary] = Future()
        self._thread = threading.Thread(target=self._run, name=f"phalanx-writer-{info.name}", daemon=False)
        self._thread.start()

    # What the device and engine threads call.

    def raw(self, frame: MarkerFrame) -> bool:
        """Take one frame from the device; the engine owes its pose. False once the take is being closed."""
        with self._lock:
            if self._stopping.is_set():
                return False
            now_s = host_clock()
            if now_s - self._arrived_s >= LONG_SILENCE_S:
                self._silences.append((self._arrived_s, now_s))
            self._arrived_s = now_s
            self._behind_s = frame.times.latency_s if frame.times.latency_s > 0 else 0.0
            self._received += 1
            self._pending += 1
            if self._fault is not None:
                self._dropped[DISK_ERROR] += 1
            elif not self._queue.offer(frame):
                self._dropped[QUEUE_FULL] += 1
        return True

    def solved(self, frame: TrackedFrame) -> None:
        """The pose of a frame given to `raw`."""
        refused = self._queue.depth >= self._solved_limit or not self._queue.offer(frame)
        with self._lock:
            self._pending -= 1
            if refused:
                self._unsolved[QUEUE_FULL] += 1

    def unsolved(self, reason: str) -> None:
        """A frame given to `raw` will have no pose."""
        with self._lock:
            self._pending -= 1
            self._unsolved[reason] += 1

    # What the operator's side calls.

    @property
    def elapsed_s(self) -> float:
        """Since the start [s]."""
        return (self._stopped_s or host_clock()) - self._started_s

    def mark(self, text: str = "") -> Mark:
        """Remember this moment."""
        with self._lock:
            first_s = self._first_s
            self._marks += 1
        since = 0.0 if first_s is None else max(host_clock() - first_s, 0.0)
        mark = Mark(since, text)
        self._queue.force(mark)
        return mark

    def set_notes(self, text: str) -> None:
        """What the take says of itself; may change until it is sealed."""
        self._notes = text

    @property
    def progress(self) -> float:
        """How far sealing is, 0 to 1."""
        return self._progress

    def stop(self, lost: int = 0, rejected: int = 0, late: int = 0, repeated: int = 0) -> Future[TakeSummary]:
        """Accept no more frames and seal the take on its own thread. May be called twice.

        lost: frames that the device sent during the take and that never arrived, or too late. rejected: packets it
        could not read. late: those of the lost that did arrive. repeated: frames that came twice.
        """
        with self._lock:
            if not self._stopping.is_set():
                self._lost, self._rejected = lost, rejected
                self._late, self._repeated = late, repeated
                # What was exposed later than this has not arrived; a file's reader may be far behind.
                self._stopped_s = max(host_clock() - self._behind_s, self._started_s)
                self._stopping.set()
        return self.finished

    def numbers(self) -> RecordingNumbers:
        """The figures now."""
        with self._lock:
            return RecordingNumbers(
                self.info.name, self.path, self.elapsed_s, self._received, self._written, self._solved,
                dict(self._dropped), self._writer.bytes_written, self._meter.bytes_per_s, self._disk_free,
                self._meter.time_left_s(self._disk_free), self._queue.depth, self._marks,
                host_clock() - self._arrived_s, sum(end_s - begin_s for begin_s, end_s in self._silences),
            )  # fmt: skip

    # The writer thread.

    def _run(self) -> None:
        try:
            self._write_until_stopped()
            summary = self._seal()
        except BaseException as error:
            LOG.exception("The writer of take %s failed", self.info.name)
            self.finished.set_exception(error)
        else:
            self.finished.set_result(summary)

    def _write_until_stopped(self) -> None:
        check_at = time.monotonic()
        notes_at = check_at + NOTES_EVERY_S
        give_up_at = float("inf")
        while True:
            item = self._queue.take(0.05)
            if item is not None:
                self._write(item)
            now = time.monotonic()
            if self._stopping.is_set():
                give_up_at = min(give_up_at, now + DRAIN_S)
                if (item is None and self._pending <= 0) or now >= give_up_at:
                    break
                continue
            if now >= check_at:
                self._check_disk(now)
                check_at = now + DISK_CHECK_S
            if now >= notes_at:
                self._write_notes()
                notes_at = now + NOTES_EVERY_S
        while (item := self._queue.take(0.0)) is not None:
            self._write(item)

    def _write(self, item: MarkerFrame | TrackedFrame | Mark) -> None:
        if self._fault is None:
            try:
                if isinstance(item, MarkerFrame):
                    self._writer.raw(item)
                elif isinstance(item, TrackedFrame):
                    self._writer.solved(item)
                else:
                    self._writer.mark(item)
            except Exception as error:
                self._fail(error)
        with self._lock:
            if isinstance(item, MarkerFrame):
                if self._fault is None:
                    self._written += 1
                    if self._first_s is None and math.isfinite(item.times.host_s):
                        self._first_s = item.times.host_s
                else:
                    self._dropped[DISK_ERROR] += 1
            elif isinstance(item, TrackedFrame):
                if self._fault is None:
                    self._solved += 1
                    self._tracked.add(item)
                else:
                    self._unsolved[DISK_ERROR] += 1

    def _write_notes(self) -> None:
        """Those typed so far outlive this process; a disk that takes them no more says so at the frames."""
        if self._notes != self.info.notes:
            self.info = replace(self.info, notes=self._notes)
            with suppress(TakeError):
                self._writer.set_info(self.info)

    def _fail(self, error: Exception) -> None:
        if isinstance(error, PhalanxError):
            fault = error
        else:
            why = getattr(error, "strerror", None) or str(error) or type(error).__name__
            fault = TakeError(
                f"Take {self.info.name} can no longer be written ({why}).",
                f"What was written up to now is kept in {self.path}. Check the disk, then record again.",
            )
            fault.__cause__ = error
        with self._lock:
            self._fault = fault
        self._on_fault(fault)

    def _check_disk(self, now_s: float) -> None:
        try:
            free = shutil.disk_usage(self.path.parent).free
        except OSError:
            return
        with self._lock:
            self._disk_free = free
            self._meter.add(now_s, self._writer.bytes_written)
            left_s = self._meter.time_left_s(free)
        if self._fault is None and self._meter.room(free) < 0:
            self._on_fault(
                TakeError(
                    f"The disk is nearly full ({free / 1e9:.1f} GB left); take {self.info.name} was stopped and saved.",
                    "Free some space or choose another folder, then record again.",
                )
            )
        elif left_s < WARN_BELOW_S and not self._warned:
            self._warned = True
            self._on_warning(
                f"The disk holds {duration_text(left_s)} more of recording.",
                "Free some space or change the take folder before the next take.",
            )

    def _seal(self) -> TakeSummary:
        with self._lock:
            if self._pending > 0:
                self._unsolved["solver too late"] += self._pending
                self._pending = 0
            counts = TakeCounts(
                received=self._received,
                written=self._written,
                dropped=dict(self._dropped),
                lost=self._lost,
                rejected=self._rejected,
                solved=self._solved,
                unsolved=dict(self._unsolved),
                tracked=self._tracked.by_hand,
                length_s=self.elapsed_s,
                first_s=None if self._first_s is None else max(self._first_s - self._started_s, 0.0),
            )
        self._write_notes()
        sealed, problem = True, self._fault.what if self._fault else ""
        try:
            self._writer.seal(counts, self._sealed_part)
        except Exception as error:
            LOG.exception("Take %s could not be sealed", self.info.name)
            sealed = False
            why = error.what if isinstance(error, PhalanxError) else str(error)
            problem = problem or f"The take could not be sealed ({why}); every frame written is readable."
        try:
            size = self.path.stat().st_size
        except OSError:
            size = self._writer.bytes_written
        return TakeSummary(
            self.info.name, self.path, self.elapsed_s, counts.received, counts.written, counts.solved,
            dict(self._dropped), dict(self._unsolved), self._lost, self._rejected, self._marks, size, sealed, problem,
            self._holes(sealed), self._tracked.by_hand, self._late, self._repeated,
        )  # fmt: skip

    def _holes(self, sealed: bool) -> Holes:
        """As the file says; where it cannot be asked, the long silences that were heard. To keep the time of every
        frame until then would take 24 MB an hour at 836 Hz."""
        if sealed:
            with suppress(PhalanxError, OSError), open_take(self.path, check=False) as take:
                return take.holes
        end_s = self._started_s + self.elapsed_s
        tail = [(self._arrived_s, end_s)] if end_s - self._arrived_s >= LONG_SILENCE_S else []
        from_s, to_s = np.array([*self._silences, *tail]).reshape(-1, 2).T - (self._first_s or self._started_s)
        rate_hz = self.info.rate_hz if math.isfinite(self.info.rate_hz) else 0.0
        return Holes(from_s, to_s, np.rint((to_s - from_s) * rate_hz).astype(np.int64))

    def _sealed_part(self, part: float) -> None:
        self._progress = part
