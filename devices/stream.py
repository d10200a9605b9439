"""What every device counts and measures of its stream: time, rate, gaps."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum
from typing import Generic, TypeVar

host_clock: Callable[[], float] = time.perf_counter
"""This machine's monotonic clock [s], the one of `Times.host_s` and `Times.arrival_s`.

On Linux and macOS it is the clock of time.monotonic() to the bit. On Windows, before Python 3.13, that one ticks every
15.6 ms only, longer than a frame.
"""


class RateMeter:
    """Frames per second over the last second."""

    def __init__(self, window_s: float = 1.0) -> None:
        self._window_s = window_s
        self._stamps: deque[float] = deque()

    def add(self, now_s: float) -> None:
        """Count one frame."""
        self._stamps.append(now_s)
        self._trim(now_s)

    def rate_hz(self, now_s: float) -> float:
        """Rate at `now_s` [Hz]; while the window fills, of what there is."""
        self._trim(now_s)
        n = len(self._stamps)
        if n < 2:
            return 0.0
        span = self._stamps[-1] - self._stamps[0]
        return (n - 1) / span if span > 0 else 0.0

    def _trim(self, now_s: float) -> None:
        stamps = self._stamps
        while stamps and stamps[0] <= now_s - self._window_s:
            stamps.popleft()


class Arrival(Enum):
    """What the number of a frame says of it."""

    NEXT = "next"  # newer than the last
    RESTART = "restart"  # the first after its source began to count anew


F = TypeVar("F")


@dataclass
class _Run(Generic[F]):
    """Frames between two restarts of their source. missing: numbers that were passed over, the latest ones."""

    last: int
    time_s: float
    missing: set[int] = field(default_factory=set)


@dataclass(frozen=True)
class _Held(Generic[F]):
    """A frame of which later ones tell whether it was overtaken or is the first of a source that began anew."""

    frame: F
    sequence: int
    time_s: float
    arrival_s: float


class SequenceCounter(Generic[F]):
    """Puts what arrives in order by the stream's own frame numbers, and counts what cannot be handed on.

    A number that steps back is a frame that was overtaken on the way, one that came twice, or the first of a source
    that began anew (it was started again, or plays a loop). What is overtaken is so by some milliseconds: a longer
    step back, by the source's clock or its numbers, is a restart at once. Of a shorter one the frames behind it tell:
    if the source goes on above, it was late; if it goes on below, it has begun anew. They are held until then.

    lost: numbers that are not handed on: they never arrived, or too late. late: those of them that did arrive.
    repeated: frames that arrived twice. restarts: of the source.
    What was handed on, `late`, `repeated` and what is held make up what arrived.
    """

    OVERTAKEN_S = 0.25
    """A frame this much older than the last has not been overtaken on the way: its source began anew [s]."""

    HOLD_S, HOLD_FRAMES = 0.02, 3
    """A source that stays below the last number for so long, and so many frames, has begun anew [s]."""

    MOST_HELD = 64
    """However fast they arrive: a reader that was held up gets all that waited at once."""

    MOST_MISSING = 1024
    """Numbers remembered as passed over; what is later than that is not expected any more."""

    GAP_S = 600.0
    """A gap longer than this is another stream, not a loss [s]."""

    def __init__(self) -> None:
        self.lost = 0
        self.late = 0
        self.repeated = 0
        self.restarts = 0
        self._run: _Run[F] | None = None
        self._before: tuple[_Run[F], float] | None = None  # the run before the restart, and when that was
        self._held: list[_Held[F]] = []

    def forget(self) -> None:
        """The next frame is taken as it comes: the stream was paused here."""
        self._overtaken(rate_hz=1.0)
        self._run = self._before = None

    def arrived(
        self, frame: F, sequence: int, time_s: float, arrival_s: float, rate_hz: float, *, live: bool = True
    ) -> list[tuple[F, Arrival]]:
        """The frames to hand on now that `frame` has arrived, in order: often it alone.

        sequence, time_s: its number and time by its source's clock (NaN if it has none). arrival_s: by ours, in the
        order of the calls. A source that is started anew counts from zero; by the time it is heard again its numbers
        may have passed the last one, but not by as many as the clock has gone on. In playback (not `live`) numbers
        jump as the operator scrubs.
        """
        run, rate_hz = self._run, max(rate_hz, 1.0)
        new = _Held(frame, sequence, time_s, arrival_s)
        if run is None or not live:
            self._overtaken(rate_hz)
            self._run = _Run(sequence, time_s)
            return [(frame, Arrival.NEXT)]
        step = sequence - run.last
        elapsed = (time_s - run.time_s) * rate_hz  # frames by the clock
        if self._from_before(new, rate_hz):
            return []
        if step <= 0 and not time_s > run.time_s and max(-step, -elapsed) < rate_hz * self.OVERTAKEN_S:
            self._held.append(new)
            return self._released(rate_hz)
        self._overtaken(rate_hz)
        if step <= 0 or step > rate_hz * self.GAP_S or elapsed < 0 or step < 0.5 * elapsed - 2:
            return [self._restarted(new)]
        self.lost += step - 1
        run.missing.update(range(max(run.last + 1, sequence - self.MOST_MISSING), sequence))
        if len(run.missing) > self.MOST_MISSING:
            run.missing = set(sorted(run.missing)[-self.MOST_MISSING :])
        run.last, run.time_s = sequence, time_s
        return [(frame, Arrival.NEXT)]

    def _restarted(self, new: _Held[F]) -> tuple[F, Arrival]:
        assert self._run is not None
        self.restarts += 1
        self._before = self._run, new.arrival_s
        self._run = _Run(new.sequence, new.time_s)
        return new.frame, Arrival.RESTART

    def _released(self, rate_hz: float) -> list[tuple[F, Arrival]]:
        """What is held, once it is clear that the source goes on from there."""
        held = self._held
        waited_s = held[-1].arrival_s - held[0].arrival_s
        if (len(held) < self.HOLD_FRAMES or waited_s < self.HOLD_S) and len(held) < self.MOST_HELD:
            return []
        self._held = []
        out = [self._restarted(held[0])]
        for old in held[1:]:
            out += self.arrived(old.frame, old.sequence, old.time_s, old.arrival_s, rate_hz)
        return out

    def _overtaken(self, rate_hz: float) -> None:
        """What is held was late: the source goes on above it."""
        for old in self._held:
            assert self._run is not None
            self._count_late(self._run, old, rate_hz)
        self._held = []

    def _from_before(self, new: _Held[F], rate_hz: float) -> bool:
        """Whether a frame was overtaken by the restart of its source: it goes on with the numbers from before it."""
        if self._before is None:
            return False
        run, at_s = self._before
        near = self._near(rate_hz)
        if new.arrival_s - at_s > near / rate_hz:
            self._before = None
            return False
        assert self._run is not None
        if abs(new.sequence - run.last) > near or abs(new.sequence - self._run.last) <= near:
            return False
        self._count_late(run, new, rate_hz)
        return True

    def _near(self, rate_hz: float) -> float:
        """Frames within which one overtakes another."""
        return max(self.HOLD_S * rate_hz, self.HOLD_FRAMES)

    def _count_late(self, run: _Run[F], late: _Held[F], rate_hz: float) -> None:
        """One that is not handed on. run: the frames that it belongs to."""
        behind = run.last - late.sequence
        if late.sequence in run.missing:  # counted as lost when it was passed over
            run.missing.remove(late.sequence)
            self.late += 1
        elif behind < 0:  # the end of what was before a restart
            run.missing.update(range(run.last + 1, late.sequence))
            run.last = late.sequence
            self.lost -= behind
            self.late += 1
        elif behind <= self._near(rate_hz):
            self.repeated += 1
        else:  # no copy comes so late: of a source that began anew, unnoticed
            self.lost += 1
            self.late += 1
