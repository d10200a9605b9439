"""What was lost: how much, by reason, since when, and what to do about it. Knows no window.

It counts since the program began or the profiles were last changed, and of each device since it was connected; what was
before is kept in words.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from app.session import SessionNumbers
from app.solver_thread import CHANGED, FAILED
from core.takes.disk import duration_text
from devices.device import Health, Level

RECENT_S = 60.0
"""How long a loss keeps its light after it stopped; the count stays."""

_NETWORK = "Use a cable, and a network of the cameras' own."
_PACKETS = "See Devices for what comes in; let nothing else send to this port."
_STILL = "Keep the computer awake while it captures, and nothing that halts the program."
_BUSY = "The solver could not keep up: close other programs or lower the camera rate."
_ERROR = "See Messages and the log file, and report it."
_AGAIN = "The raw frames are in the take: solve it again in review."
_TAKE = "The take is not whole: check its disk, and record it again."


@dataclass
class Loss:
    """Frames or poses lost for one reason. Times of the caller's clock [s]; since: of the latest spell.

    stream: of which, by its key; "" where it is of none alone. connected_s: when that was connected, which is when its
    counter began. total: since the program began or the profiles were last changed. earlier: of these, before its
    device was last connected. before: since the program began, up to the last change of the profiles.
    """

    stream: str
    what: str
    action: str
    level: Level
    connected_s: float = math.nan
    total: int = 0
    since_s: float = -math.inf
    last_s: float = -math.inf
    counted: int = 0
    earlier: int = 0
    before: int = 0

    @property
    def present(self) -> int:
        """Since its device was connected."""
        return self.total - self.earlier

    def connected(self, connected_s: float) -> None:
        """Its device was connected then, and its counter begins anew."""
        self.connected_s, self.counted, self.earlier = connected_s, 0, self.total

    def count(self, now_s: float, number: int) -> None:
        """The counter it is read from stands at `number`; one that begins anew is added to what was."""
        more = number - self.counted if number >= self.counted else number
        self.counted = number
        if more:
            if not (self.present and self.recent(now_s)):
                self.since_s = now_s
            self.total += more
            self.last_s = now_s

    def recent(self, now_s: float) -> bool:
        """Whether it is going on, or has only just stopped."""
        return now_s - self.last_s < RECENT_S

    def name(self, several: bool) -> str:
        """What was lost; several: there are several streams, so that it is said of which."""
        return f"{self.what} ({self.stream})" if several and self.stream else self.what

    def line(self, now_s: float, several: bool) -> str:
        """In words, with its times."""
        ago = now_s - self.last_s
        when = f"since {duration_text(now_s - self.since_s)}" if self.recent(now_s) else "earlier"
        last = "going on" if ago < 1 else f"the last {duration_text(ago)} ago"
        return f"{self.present:,} {self.name(several)} ({when}, {last})."


class Losses:
    """Amber for poses, which can be made again from a take; red for frames, which cannot."""

    def __init__(self) -> None:
        self._losses: dict[tuple[str, str], Loss] = {}
        self._changes = 0
        self._several = False  # streams, as yet

    def take(self, now_s: float, numbers: SessionNumbers, healths: Mapping[tuple[str, float], Health]) -> None:
        """The counters now. healths: of each stream since it was connected, by its key and when that was."""
        if numbers.changes != self._changes:
            self._begin()
            self._changes = numbers.changes
        self._several = self._several or len(healths) > 1
        for (stream, connected_s), health in healths.items():
            for what, n, action in (
                ("frames lost before this machine", health.lost - health.unread, _NETWORK),
                ("frames lost while Phalanx stood still", health.unread, _STILL),
                ("packets not understood", health.rejected, _PACKETS),
            ):
                self._count(now_s, n, what, action, Level.PROBLEM, stream, connected_s)
        for why, n in numbers.solver.dropped.items():
            if why == CHANGED:
                continue  # nobody misses them
            action = _ERROR if why == FAILED else _BUSY
            self._count(now_s, n, f"poses not solved, {why}", action, Level.WARNING)
        recording = numbers.recording
        for stream, of in recording.streams.items() if recording is not None else ():
            for why, n in of.dropped.items():
                self._count(now_s, n, f"frames not written, {why}", _TAKE, Level.PROBLEM, stream)
        if recording is None:
            for loss in self._losses.values():
                if loss.action == _TAKE:
                    loss.counted = 0  # the next take counts from none

    def _begin(self) -> None:
        """Count from none."""
        for loss in self._losses.values():
            loss.before += loss.total
            loss.total = loss.earlier = 0

    def _count(
        self, now_s: float, number: int, what: str, action: str, level: Level, stream: str = "",
        connected_s: float = 0.0,
    ) -> None:  # fmt: skip
        loss = self._losses.get((stream, what))
        if loss is None:
            if not number:
                return
            loss = self._losses[stream, what] = Loss(stream, what, action, level, connected_s)
        if loss.connected_s != connected_s:
            loss.connected(connected_s)
        loss.count(now_s, number)

    @property
    def total(self) -> int:
        """Everything lost since the program began or the profiles were last changed."""
        return sum(loss.total for loss in self._losses.values())

    def age_s(self, now_s: float) -> float:
        """Since the last loss; infinite if there was none [s]."""
        return now_s - max((loss.last_s for loss in self._losses.values() if loss.total), default=-math.inf)

    def level(self, now_s: float) -> Level:
        """The worst of what was lost in the last minute, of each device since it was connected."""
        levels = {loss.level for loss in self._losses.values() if loss.present and loss.recent(now_s)}
        return next((level for level in (Level.PROBLEM, Level.WARNING) if level in levels), Level.GOOD)

    def tip(self, now_s: float, recording: bool) -> str:
        """Every reason, the latest first, and what to do about those of the last minute."""
        losses = sorted(self._losses.values(), key=lambda loss: -loss.last_s)
        present = [loss for loss in losses if loss.present]
        lines = [loss.line(now_s, self._several) for loss in present] or ["Nothing was lost."]
        recent = [loss for loss in present if loss.recent(now_s)]
        lines += dict.fromkeys(loss.action for loss in recent)
        if recording and any(loss.level is Level.WARNING for loss in recent):
            lines.append(_AGAIN)
        for when, counts in (
            ("it was last connected", [(loss.earlier, loss) for loss in losses]),
            ("the last change of profile", [(loss.before, loss) for loss in losses]),
        ):
            if any(n for n, _ in counts):
                of = "; ".join(f"{n:,} {loss.name(self._several)}" for n, loss in counts if n)
                lines.append(f"Before {when}: {of}.")
        return "\n".join(lines)
