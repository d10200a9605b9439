"""What arrives, put in order by the stream's own numbers; and what cannot be handed on, counted."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from enum import Enum
from typing import Generic, TypeVar


class Arrival(Enum):
    """What the number of a frame says of it."""

    NEXT = "next"  # newer than the last
    RESTART = "restart"  # the first after its source began to count anew


F = TypeVar("F")


@dataclass(frozen=True, eq=False)
class _Frame(Generic[F]):
    """A frame and what it says of its place. behind: it may have been overtaken on the way by the last one."""

    frame: F
    sequence: int
    time_s: float
    arrival_s: float
    slack_s: float
    behind: bool = False


@dataclass
class _Run(Generic[F]):
    """Frames between two restarts of their source. last: the newest. missing: numbers passed over, the latest ones."""

    last: _Frame[F]
    missing: set[int] = field(default_factory=set)


class SequenceCounter(Generic[F]):
    """Puts what arrives in order by the stream's own frame numbers, and counts what cannot be handed on.

    A number that does not go on from the last one is a frame that was overtaken on the way, one that came twice, the
    first of a source that began anew (it was started again, or plays a loop), the first behind a long loss, or one
    that was spoilt. Its own packet cannot tell, so it is held until those behind it do: if the source goes on above
    the last number, it was late, or spoilt where it lay farther off than any is overtaken; if the next goes on from
    it, the source has jumped there.

    lost: numbers that are not handed on: they never arrived, too late, or spoilt. late: those of them that did arrive.
    repeated: frames that arrived twice. spoilt: frames whose number or time those behind them did not bear out.
    restarts: of the source. What was handed on, `late`, `repeated`, `spoilt` and what is held make up what arrived.
    """

    OVERTAKEN_S = 0.25
    """A frame this much older than the last has not been overtaken on the way [s]."""

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
        self.spoilt = 0
        self.restarts = 0
        self._run: _Run[F] | None = None
        self._before: tuple[_Run[F], float] | None = None  # the run before the restart, and when that was
        self._held: list[_Frame[F]] = []  # since the source last went on
        self._doubted: list[tuple[_Frame[F], int]] = []  # before that, with the last number as it was then

    def forget(self) -> None:
        """The next frame is taken as it comes: the stream was paused here."""
        for old in [*(one for one, _ in self._doubted), *self._held]:
            if old.behind:
                self._count_late(old, rate_hz=1.0)
            else:
                self.lost += 1
                self.late += 1
        self._held, self._doubted = [], []
        self._run = self._before = None

    def arrived(
        self,
        frame: F,
        sequence: int,
        time_s: float,
        arrival_s: float,
        rate_hz: float,
        *,
        live: bool = True,
        slack_s: float = 0.0,
    ) -> list[tuple[F, Arrival]]:
        """The frames to hand on now that `frame` has arrived, in order: often it alone.

        sequence, time_s: its number and time by its source's clock (NaN if it has none). arrival_s: by ours, in the
        order of the calls; it may have been so much earlier as `slack_s`. A source that is started anew counts from
        zero; by the time it is heard again its numbers may have passed the last one, but not by as many as the clock
        has gone on. In playback (not `live`) numbers jump as the operator scrubs.
        """
        run, rate_hz = self._run, max(rate_hz, 1.0)
        new = _Frame(frame, sequence, time_s, arrival_s, slack_s)
        if run is None or not live:
            self._gone_on(rate_hz)
            self._run = _Run(new)
            return [(frame, Arrival.NEXT)]
        if self._from_before(new, rate_hz):
            return []
        if self._follows(run.last, new, rate_hz):
            self._gone_on(rate_hz)
            return [self._next(new)]
        step, elapsed = sequence - run.last.sequence, (time_s - run.last.time_s) * rate_hz
        overtaken = step <= 0 and not elapsed > 0 and max(-step, -elapsed) < rate_hz * self.OVERTAKEN_S
        before = self._held[-1] if self._held else None
        self._held.append(replace(new, behind=overtaken))
        if before is not None and not before.behind and self._follows(before, new, rate_hz):
            return self._jumped(rate_hz)
        return self._stayed_below(rate_hz)

    def _follows(self, old: _Frame[F], new: _Frame[F], rate_hz: float, *, borne_out: bool = False) -> bool:
        """Whether `new` goes on where `old` was: its number a little, or as far as time went on.

        borne_out: another says so too; then any clock may vouch for the time.
        """
        step = new.sequence - old.sequence
        elapsed = (new.time_s - old.time_s) * rate_hz  # frames by its clock
        behind = 0.5 * elapsed - 2 - self._near(rate_hz)  # the rate may be that of a burst
        if step <= 0 or step > rate_hz * self.GAP_S or elapsed < 0 or step < behind:
            return False
        if borne_out or not elapsed > 0:  # it has no clock, or one that stands still
            arrived = (new.arrival_s - old.arrival_s + old.slack_s) * rate_hz
            elapsed = max(elapsed, arrived) if elapsed > 0 else arrived
        return step <= 2 * elapsed + self._near(rate_hz)

    def _next(self, new: _Frame[F]) -> tuple[F, Arrival]:
        """The source went on."""
        run = self._run
        assert run is not None
        first = run.last.sequence + 1
        self.lost += new.sequence - first
        run.missing.update(range(max(first, new.sequence - self.MOST_MISSING), new.sequence))
        if len(run.missing) > self.MOST_MISSING:
            run.missing = set(sorted(run.missing)[-self.MOST_MISSING :])
        run.last = new
        return new.frame, Arrival.NEXT

    def _restarted(self, new: _Frame[F]) -> tuple[F, Arrival]:
        assert self._run is not None
        self.restarts += 1
        self._before = self._run, new.arrival_s
        self._run = _Run(new)
        return new.frame, Arrival.RESTART

    def _jumped(self, rate_hz: float) -> list[tuple[F, Arrival]]:
        """The last two that are held go on from one another: the source is there now, and what they lead back to is
        its own as well."""
        assert self._run is not None
        row = [self._held.pop()]
        for old in reversed([*(one for one, _ in self._doubted), *self._held]):
            if not old.behind and self._follows(old, row[0], rate_hz):
                row.insert(0, old)
        first, last = row[0], self._run.last
        others = [one for one in (*(one for one, _ in self._doubted), *self._held) if one not in row]
        self._held, self._doubted = [], []
        for old in others:
            if old.behind:
                self._count_late(old, rate_hz)
        went_on = self._follows(last, first, rate_hz, borne_out=True)
        out = [self._next(first) if went_on else self._restarted(first)]
        out += [self._next(new) for new in row[1:]]
        for old in others:
            if old.behind:
                continue
            if abs(old.sequence - first.sequence) <= self._near(rate_hz):  # of where it is now, overtaken or twice
                self._count_late(old, rate_hz)
            else:
                self.spoilt += 1
        return out

    def _stayed_below(self, rate_hz: float) -> list[tuple[F, Arrival]]:
        """What is held, once it is clear that the source does not go on from where it was."""
        held = self._held
        waited_s = held[-1].arrival_s - held[0].arrival_s
        if (len(held) < self.HOLD_FRAMES or waited_s < self.HOLD_S) and len(held) < self.MOST_HELD:
            return []
        self._held = []
        out = [self._restarted(held[0])]
        for old in held[1:]:
            out += self.arrived(old.frame, old.sequence, old.time_s, old.arrival_s, rate_hz, slack_s=old.slack_s)
        return out

    def _gone_on(self, rate_hz: float) -> None:
        """The source went on from where it was: what is held was late, or is doubted the more the farther it goes."""
        if self._run is None:
            return
        for old in self._held:
            if old.behind:
                self._count_late(old, rate_hz)
            else:
                self._doubted.append((old, self._run.last.sequence))
        self._held = []
        if self._doubted:
            passed = self._run.last.sequence - self._near(rate_hz)
            kept = [(one, at) for one, at in self._doubted if at > passed]
            self.spoilt += len(self._doubted) - len(kept)
            self._doubted = kept

    def _from_before(self, new: _Frame[F], rate_hz: float) -> bool:
        """Whether a frame was overtaken by the restart of its source: it goes on with the numbers from before it."""
        if self._before is None:
            return False
        run, at_s = self._before
        near = self._near(rate_hz)
        if new.arrival_s - at_s > near / rate_hz:
            self._before = None
            return False
        assert self._run is not None
        if abs(new.sequence - run.last.sequence) > near or abs(new.sequence - self._run.last.sequence) <= near:
            return False
        self._count_late(new, rate_hz, run)
        return True

    def _near(self, rate_hz: float) -> float:
        """Frames within which one overtakes another."""
        return max(self.HOLD_S * rate_hz, self.HOLD_FRAMES)

    def _count_late(self, late: _Frame[F], rate_hz: float, run: _Run[F] | None = None) -> None:
        """One that is not handed on. run: the frames that it belongs to, if not the latest."""
        run = run or self._run
        assert run is not None
        behind = run.last.sequence - late.sequence
        if late.sequence in run.missing:  # counted as lost when it was passed over
            run.missing.remove(late.sequence)
            self.late += 1
        elif behind < 0:  # the end of what was before a restart
            run.missing.update(range(run.last.sequence + 1, late.sequence))
            run.last = late
            self.lost -= behind
            self.late += 1
        elif behind <= self._near(rate_hz):
            self.repeated += 1
        else:  # no copy comes so late: of a source that began anew, unnoticed
            self.lost += 1
            self.late += 1
