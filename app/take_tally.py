"""Where every frame of a take went while it is recorded, and when none came."""

from __future__ import annotations

import math
import threading
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

from app.silences import Silences
from core.cast import Cast
from core.frames import MarkerFrame, Standstill, Times, TrackedFrame
from core.takes.holes import Holes
from core.takes.take import DAMAGED, Mark, TakeCounts
from core.takes.tracked import TrackedCount
from core.takes.writer import Readable
from devices.common.clock import host_clock


class TakeTally:
    """Counts what comes, what is written and what is not. For any thread: figures that belong together are read while
    `lock` is held.

    started_s: by the host's clock. received, written, solved: frames. pending: those whose pose the engine owes. marks:
    that were set; marked: that are written. dropped, unsolved: frames that are not written, or have no pose, by reason.
    lost, rejected, late, repeated, untimed: as in TakeSummary. silences: long ones, as they are heard.
    """

    def __init__(self, profiles: Cast) -> None:
        """The take begins now. profiles: whose hands are counted."""
        self.lock = threading.RLock()
        self.started_s = host_clock()
        self.received = self.written = self.solved = self.pending = self.marks = self.marked = 0
        self.lost = self.rejected = self.late = self.repeated = self.untimed = 0
        self.dropped: Counter[str] = Counter()
        self.unsolved: Counter[str] = Counter()
        self.tracked = TrackedCount(profiles)
        self.silences = Silences(self.started_s)
        self._stopped_s: float | None = None
        self._first_s: float | None = None  # of the first frame, by the host's clock
        self._behind_s = 0.0
        self._standstills: Sequence[Standstill] = ()

    @property
    def elapsed_s(self) -> float:
        """Since the start, or from it to the end [s]."""
        return (self._stopped_s or host_clock()) - self.started_s

    def came(self, times: Times) -> None:
        """A frame has arrived, and the engine owes its pose."""
        with self.lock:
            self.silences.arrived(times.arrival_s, host_clock())
            self._behind_s = times.latency_s if times.latency_s > 0 else 0.0
            self.received += 1
            self.pending += 1

    def answered(self, no_pose: str = "") -> None:
        """The engine owes one pose less. no_pose: why there is none."""
        with self.lock:
            self.pending -= 1
            if no_pose:
                self.unsolved[no_pose] += 1

    def answered_no_more(self, reason: str) -> None:
        """Poses that are still owed come too late."""
        with self.lock:
            if self.pending > 0:
                self.unsolved[reason] += self.pending
                self.pending = 0

    def mark(self) -> float:
        """A mark is set; when, from the first frame [s]."""
        with self.lock:
            self.marks += 1
            return 0.0 if self._first_s is None else max(host_clock() - self._first_s, 0.0)

    def kept(self, item: MarkerFrame | TrackedFrame | Mark) -> None:
        """It is written."""
        with self.lock:
            if isinstance(item, MarkerFrame):
                self.written += 1
                self.untimed += not item.times.known
                if self._first_s is None and math.isfinite(item.times.begins_s):
                    self._first_s = item.times.begins_s
            elif isinstance(item, TrackedFrame):
                self.solved += 1
                self.tracked.add(item)
            else:
                self.marked += 1

    def not_kept(self, item: MarkerFrame | TrackedFrame | Mark, reason: str) -> None:
        """It cannot be written."""
        with self.lock:
            if isinstance(item, MarkerFrame):
                self.dropped[reason] += 1
            elif isinstance(item, TrackedFrame):
                self.unsolved[reason] += 1

    def only(self, readable: Readable) -> int:
        """From now on only what can be read is called written. How many frames cannot."""
        with self.lock:
            if (lost := self.written - readable.raw) > 0:
                self.written, self.dropped[DAMAGED] = readable.raw, self.dropped[DAMAGED] + lost
                self._first_s, self.untimed = readable.first_s, readable.untimed
            if (unsolved := self.solved - readable.solved) > 0:
                self.solved, self.unsolved[DAMAGED] = readable.solved, self.unsolved[DAMAGED] + unsolved
        return max(lost, 0)

    def end(self, lost: int, rejected: int, late: int, repeated: int, standstills: Sequence[Standstill]) -> None:
        """No more frames are accepted. What the device lost meanwhile, as `Recorder.stop` has it."""
        with self.lock:
            self.lost, self.rejected, self.late, self.repeated = lost, rejected, late, repeated
            self._standstills = standstills
            # What was exposed later than this has not arrived; a file's reader may be far behind.
            self._stopped_s = max(host_clock() - self._behind_s, self.started_s)

    def counts(self) -> TakeCounts:
        """As the file will say."""
        with self.lock:
            return TakeCounts(
                self.received, self.written, dict(self.dropped), self.lost, self.rejected, self.solved,
                dict(self.unsolved), self.tracked.by_hand, self.elapsed_s,
                None if self._first_s is None else max(self._first_s - self.started_s, 0.0),
                standstills=self.standstills, untimed=self.untimed,
            )  # fmt: skip

    def if_lost(self, reason: str) -> tuple[dict[str, int], dict[str, int], int]:
        """Dropped and unsolved frames if all that waits for the disk is lost for this reason; how many frames wait."""
        with self.lock:
            dropped, unsolved = Counter(self.dropped), Counter(self.unsolved)
            waiting = self.received - self.written - dropped.total()
            owed = self.received - self.solved - unsolved.total()
        for counter, n in ((dropped, waiting), (unsolved, owed)):
            if n > 0:
                counter[reason] += n
        return dict(dropped), dict(unsolved), waiting

    @property
    def standstills(self) -> tuple[Standstill, ...]:
        """In the time of the take."""
        zero_s = self.started_s if self._first_s is None else self._first_s
        return tuple(replace(one, from_s=one.from_s - zero_s, to_s=one.to_s - zero_s) for one in self._standstills)

    def heard_holes(self, rate_hz: float) -> Holes:
        """The long silences as holes, in the time of the take. rate_hz: NaN if unknown."""
        end_s = self.started_s + self.elapsed_s
        holes = self.silences.holes(end_s, self._first_s or self.started_s, rate_hz)
        return holes.owned(self.standstills)
