"""The last seconds of all that devices sent, so that what just happened can still be saved, and looked at closely.

What came from a device that has fallen out since stays: the seconds before that are those that are asked for.
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import inf
from typing import NamedTuple

from core.frames import InertialFrame, MarkerFrame
from core.streams import ClockSample, Record, StreamInfo
from core.takes.seal import device_gaps
from devices.common.clock import host_clock
from devices.device import Health

LOOK_BACK_S = 30.0
"""What came in so long is kept, counted back from the last record of any stream [s]."""

MOST_BYTES = 1 << 28
"""Of memory, about: where more comes in the seconds become fewer. 30 s of 200 points at 960 Hz fit."""

HEALTH_S = 0.25
"""How often it is noted what a device has lost up to then [s]."""

_RECORD, _BODY, _BONE = 1000, 600, 150
"""About how many bytes a record takes besides its points, for each of its rigid bodies and for each of its bones."""


class Kept(NamedTuple):
    """A record as it came: when, by this machine's monotonic clock [s], and of which stream."""

    came_s: float
    stream: StreamInfo
    record: Record


@dataclass(frozen=True)
class Past:
    """What came in a stretch of time, in the order in which it came.

    health: of each stream, by its key: what its device says it lost meanwhile, and from up to HEALTH_S before on.
    silent: streams that were armed in this time and sent nothing.
    """

    kept: Sequence[Kept] = ()
    health: Mapping[str, Health] = field(default_factory=dict)
    silent: Sequence[StreamInfo] = ()

    @cached_property
    def streams(self) -> dict[str, StreamInfo]:
        """By their keys, in the order in which they were first heard, and last those that never were."""
        found = {one.stream.key: one.stream for one in self.kept}
        return {key: found[key] for key in self.health if key in found} | {one.key: one for one in self.silent}

    def among(self, armed: Sequence[StreamInfo]) -> Past:
        """The same, with those of the streams armed meanwhile that sent nothing."""
        silent = [one for one in armed if one.key not in self.streams]
        return Past(self.kept, {**{one.key: Health() for one in silent}, **self.health}, silent)

    @property
    def begin_s(self) -> float:
        """When the first record came [s]."""
        return self.kept[0].came_s

    @property
    def end_s(self) -> float:
        """When the last record came [s]."""
        return self.kept[-1].came_s

    def frames(self, key: str) -> list[MarkerFrame | InertialFrame]:
        """Those of one stream."""
        return [one.record for one in self.kept if one.stream.key == key and not isinstance(one.record, ClockSample)]

    def counted(self, key: str) -> Health:
        """What was lost of a stream in this time, by its device and by the numbers of its frames: whichever is less,
        for those may leap for other reasons, too, as in playback. Of standstills those of this time."""
        said = self.health[key]
        lost = min(said.lost, device_gaps([frame.sequence for frame in self.frames(key)]))
        standstills = [one for one in said.standstills if one.to_s > self.begin_s and one.from_s < self.end_s]
        return replace(said, lost=lost, late=min(said.late, lost), standstills=tuple(standstills))


class LookBack:
    """A ring of records. They are shared with whoever else has them. For any thread; nobody waits here for long."""

    def __init__(
        self, seconds: float = LOOK_BACK_S, most_bytes: int = MOST_BYTES, clock: Callable[[], float] = host_clock
    ) -> None:
        """clock: [s]."""
        self._seconds, self._most, self._clock = seconds, most_bytes, clock
        self._kept: deque[Kept] = deque()
        self._bytes = 0
        self._counted: dict[str, Callable[[str], Health]] = {}
        self._said: dict[str, deque[tuple[float, Health]]] = {}  # now and then, by the streams' keys
        self._lock = threading.Lock()

    def add(self, stream: StreamInfo, record: Record, counted: Callable[[str], Health]) -> None:
        """A record has come. counted: what the device has lost of a stream up to now, by its key."""
        key, size = stream.key, bytes_of(record)
        with self._lock:
            now_s = self._clock()
            kept = self._kept
            kept.append(Kept(now_s, stream, record))
            self._bytes += size
            while kept and (self._bytes > self._most or kept[0].came_s < now_s - self._seconds):
                self._bytes -= bytes_of(kept.popleft().record)
            self._counted[key] = counted
            said = self._said.setdefault(key, deque())
            due = not said or now_s - said[-1][0] >= HEALTH_S
        if due:
            told = counted(key)  # of the device that this thread reads: not under the lock
            with self._lock:
                said.append((now_s, told))
                while len(said) > 1 and said[1][0] <= now_s - self._seconds:  # one of before is enough
                    said.popleft()

    @property
    def seconds(self) -> float:
        """How much there is [s]."""
        with self._lock:
            return self._kept[-1].came_s - self._kept[0].came_s if self._kept else 0.0

    @property
    def silent_s(self) -> float:
        """Since the last record came, infinite if none did [s]."""
        with self._lock:
            return self._clock() - self._kept[-1].came_s if self._kept else inf

    def recent(self) -> Past:
        """All that there is. Of a stream that has come to send something else only that."""
        with self._lock:
            kept, counted = tuple(self._kept), dict(self._counted)
            before = {key: _at(said, kept[0].came_s) for key, said in self._said.items() if said and kept}
        what = {one.stream.key: one.stream.what for one in kept}
        same = tuple(one for one in kept if one.stream.what == what[one.stream.key])
        return Past(same, {key: counted[key](key).since(then) for key, then in before.items()})

    def about(self, frame: MarkerFrame) -> tuple[list[MarkerFrame], int] | None:
        """All frames of the stream that this very frame is of, and its place among them; None if it is not there any
        more."""
        with self._lock:
            kept = tuple(self._kept)
        key = next((one.stream.key for one in reversed(kept) if one.record is frame), None)
        if key is None:
            return None
        frames = [one.record for one in kept if one.stream.key == key and isinstance(one.record, MarkerFrame)]
        return frames, next(i for i, one in enumerate(frames) if one is frame)


def _at(said: Sequence[tuple[float, Health]], moment_s: float) -> Health:
    """What was said last before a moment, or else first."""
    return next((health for came_s, health in reversed(said) if came_s <= moment_s), said[0][1])


def bytes_of(record: Record) -> int:
    """About what it takes in memory."""
    if isinstance(record, MarkerFrame):
        points = record.points_m.nbytes + record.ids.nbytes + record.residuals_m.nbytes
        return _RECORD + points + _BODY * len(record.rigid_bodies)
    if isinstance(record, InertialFrame):
        return _RECORD + _BONE * len(record.rotations_wxyz)
    return _RECORD
