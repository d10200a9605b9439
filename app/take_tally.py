"""Where every frame of a take went while it is recorded, of each stream and all poses."""

from __future__ import annotations

import threading
from collections import Counter
from collections.abc import Mapping, Sequence

from app.stream_figures import StreamFigures
from app.stream_tally import StreamTally
from core.cast import Cast
from core.frames import TrackedFrame
from core.streams import ClockSample, Sample, StreamInfo
from core.takes.holes import Holes
from core.takes.take import DAMAGED, Mark, TakeCounts
from core.takes.tracked import TrackedCount
from core.takes.writer import Readable, ReadableFrames
from devices.common.clock import host_clock
from devices.device import Health


class TakeTally:
    """Counts what comes, what is written and what is not. For any thread: figures that belong together are read while
    `lock` is held.

    started_s: by the host's clock. streams: of each, by its key, in the order of the take. solving: key of the one that
    is solved, None for none. solved: poses written. pending: those that the engine owes. marks: that were set; marked:
    that are written. unsolved: frames that have no pose, by reason.
    """

    def __init__(
        self, profiles: Cast, streams: Sequence[StreamInfo], solving: str, rate_hz: float, began_s: float | None = None
    ) -> None:
        """profiles: whose hands are counted. streams, solving: as the writer has them. rate_hz: of the stream that is
        solved. began_s: when the take began, by the host's clock; None: now [s]."""
        self.lock = threading.RLock()
        self.started_s = host_clock() if began_s is None else began_s
        self.solving = None if streams and not solving else solving
        self.streams = {
            one.key: StreamTally(one.title, rate_hz if one.key == solving else one.rate_hz, self.started_s)
            for one in sorted(streams, key=lambda one: one.key != solving)
        } or {"": StreamTally("", rate_hz, self.started_s)}
        self.solved = self.pending = self.marks = self.marked = 0
        self.unsolved: Counter[str] = Counter()
        self.tracked = TrackedCount(profiles)
        self._stopped_s: float | None = None

    @property
    def elapsed_s(self) -> float:
        """Since the start, or from it to the end [s]."""
        return (self._stopped_s or host_clock()) - self.started_s

    @property
    def received(self) -> int:
        """Frames of all streams."""
        return sum(one.received for one in self.streams.values())

    @property
    def written(self) -> int:
        """Frames of all streams."""
        return sum(one.written for one in self.streams.values())

    @property
    def poses_waiting(self) -> int:
        """Poses that are neither written nor refused yet."""
        stream = self._solved_stream
        came = stream.received if stream is not None else 0
        return came - self.solved - self.unsolved.total() - self.pending

    def came(self, sample: Sample) -> bool:
        """A sample has arrived; whether the engine owes its pose."""
        with self.lock:
            stream = self.streams[sample.stream]
            if isinstance(sample.frame, ClockSample):
                stream.clock_received += 1
                return False
            stream.came(sample.frame.times)
            owed = sample.stream == self.solving
            self.pending += owed
            return owed

    def waiting(self, sample: Sample) -> int:
        """How many of its kind wait for the disk, of its stream."""
        stream = self.streams[sample.stream]
        return stream.clock_waiting if isinstance(sample.frame, ClockSample) else stream.waiting

    def dropped(self, reason: str) -> int:
        """Frames of all streams that are not written for this reason."""
        return sum(one.dropped[reason] for one in self.streams.values())

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
        """A mark is set; when, by the host's clock [s]."""
        with self.lock:
            self.marks += 1
            return host_clock()

    def time_of(self, at_s: float) -> float:
        """A moment of the host's clock in the time of the take, 0 for what was before its first frame [s]."""
        with self.lock:
            return 0.0 if self._first_s is None else max(at_s - self._first_s, 0.0)

    @property
    def time_counts(self) -> bool:
        """Whether the frame is there from which times count, and no other will be."""
        solved = self._solved_stream
        return self._first_s is not None if solved is None else solved.first_s is not None

    def kept(self, item: Sample | TrackedFrame | Mark) -> None:
        """It is written."""
        with self.lock:
            if isinstance(item, TrackedFrame):
                self.solved += 1
                self.tracked.add(item)
            elif isinstance(item, Mark):
                self.marked += 1
            elif isinstance(item.frame, ClockSample):
                self.streams[item.stream].clock += 1
            else:
                self.streams[item.stream].kept(item.frame.times)

    def not_kept(self, item: Sample | TrackedFrame | Mark, reason: str) -> None:
        """It cannot be written."""
        with self.lock:
            if isinstance(item, TrackedFrame):
                self.unsolved[reason] += 1
            elif isinstance(item, Sample):
                stream = self.streams[item.stream]
                if isinstance(item.frame, ClockSample):
                    stream.clock_dropped += 1
                else:
                    stream.dropped[reason] += 1

    def only(self, readable: Readable) -> int:
        """From now on only what can be read is called written. How many frames cannot."""
        with self.lock:
            lost = 0
            for key, stream in self.streams.items():
                solved = key == self.solving
                left = readable.beside.get(key, ReadableFrames())
                if solved:
                    left = ReadableFrames(readable.raw, readable.untimed)
                if lost_here := stream.only(*left):
                    lost += lost_here
                    if solved:
                        stream.first_s = readable.first_s
            if (unsolved := self.solved - readable.solved) > 0:
                self.solved, self.unsolved[DAMAGED] = readable.solved, self.unsolved[DAMAGED] + unsolved
        return lost

    def end(self, meanwhile: Mapping[str, Health], ended_s: float | None = None) -> None:
        """No more frames are accepted. What the devices counted meanwhile, as `Recorder.stop` has it. ended_s: when the
        take ended, by the host's clock; None: now [s]."""
        with self.lock:
            self.told(meanwhile)
            # What was exposed later than this has not arrived; a file's reader may be far behind.
            behind_s = max(stream.behind_s for stream in self.streams.values())
            self._stopped_s = max((ended_s or host_clock()) - behind_s, self.started_s)

    def told(self, meanwhile: Mapping[str, Health]) -> None:
        """What the devices have counted since the take began, by stream."""
        with self.lock:
            for key, health in meanwhile.items():
                self.streams[key].meanwhile = health

    def counts(self) -> TakeCounts:
        """As the file will say."""
        with self.lock:
            zero_s, solved = self._zero_s, self._solved_stream
            others = {key: one.counts(zero_s) for key, one in self.streams.items() if key != self.solving}
            of = (solved or StreamTally("", 0.0, self.started_s)).counts(zero_s)
            return TakeCounts(
                of.received, of.written, of.dropped, of.lost, of.rejected, self.solved, dict(self.unsolved),
                self.tracked.by_hand, self.elapsed_s,
                None if self._first_s is None else max(self._first_s - self.started_s, 0.0), others,
                late=of.late, repeated=of.repeated, untimed=of.untimed, standstills=of.standstills,
            )  # fmt: skip

    def if_lost(self, reason: str) -> tuple[dict[str, dict[str, int]], dict[str, int], int]:
        """Dropped frames by stream, and unsolved ones, if all that waits for the disk is lost for this reason; how many
        frames wait."""
        with self.lock:
            dropped = {key: Counter(one.dropped) for key, one in self.streams.items()}
            waiting = {key: one.waiting for key, one in self.streams.items()}
            unsolved, owed = Counter(self.unsolved), self.poses_waiting + max(self.pending, 0)
        for counter, n in (*((dropped[key], n) for key, n in waiting.items()), (unsolved, owed)):
            if n > 0:
                counter[reason] += n
        return {key: dict(one) for key, one in dropped.items()}, dict(unsolved), sum(waiting.values())

    def figures(self) -> dict[str, StreamFigures]:
        """Of each stream, now."""
        now_s, zero_s = host_clock(), self._zero_s
        return {
            key: one.figures(zero_s, one.heard_holes(zero_s), one.silences.since_s(now_s))
            for key, one in self.streams.items()
        }

    def figures_at_end(
        self, holes: Mapping[str, Holes], dropped: Mapping[str, Mapping[str, int]]
    ) -> dict[str, StreamFigures]:
        """Of each stream, once it has ended. holes: as the file says; of others what was heard. dropped: if other than
        counted."""
        zero_s, end_s = self._zero_s, self.started_s + self.elapsed_s
        found: dict[str, StreamFigures] = {}
        for key, one in self.streams.items():
            seen = holes[key] if key in holes else one.heard_holes(zero_s, end_s)
            found[key] = one.figures(zero_s, seen, dropped=dropped.get(key))
        return found

    @property
    def _solved_stream(self) -> StreamTally | None:
        return None if self.solving is None else self.streams[self.solving]

    @property
    def _first_s(self) -> float | None:
        """When the first frame was taken from which times count: of the stream that is solved, else of any."""
        solved = self._solved_stream
        if solved is not None and solved.first_s is not None:
            return solved.first_s
        return min((one.first_s for one in self.streams.values() if one.first_s is not None), default=None)

    @property
    def _zero_s(self) -> float:
        return self.started_s if self._first_s is None else self._first_s
