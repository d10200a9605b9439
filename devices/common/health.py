"""What has become of the frames of one stream: in figures, and in the words of its light."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Generic, TypeVar

from core.frames import Standstill, Times, stood_still
from devices.common.counting import Arrival, SequenceCounter
from devices.common.hearing import RECENT_S, Hearing
from devices.common.rate import RateMeter
from devices.common.stamps import Came
from devices.device import Health, Level

LIKELY_RATE_HZ = 120.0
"""Assumed until the device tells, or a second of frames does [Hz]."""

TOGETHER_S = 0.001
"""Frames are read in the order of their arrival; two clocks of the kernel may differ by less than this [s]."""

NO_FRAMES_S = 1.0
"""A stream without a frame for this long has stopped [s]."""

F = TypeVar("F")


class Tally(Generic[F]):
    """Puts the frames of one stream in order, and keeps count of them. Fed by the receiving thread, read by any.

    received: handed on. untimed: of them, those of which nothing tells when they were taken. rate_hz, latency_s: of the
    last second, and of the last frame. latest_s: when the last one arrived. standstills: when nobody read.
    """

    def __init__(self) -> None:
        self.sequence: SequenceCounter[tuple[F, Came]] = SequenceCounter()
        self.received = 0
        self.untimed = 0
        self.rate_hz = 0.0
        self.latency_s = math.nan
        self.latest_s = -math.inf
        self.standstills: list[Standstill] = []
        self._rate = RateMeter()
        self._surely_s = -math.inf  # when the last frame came, at the earliest
        self._lost_recently = 0
        self._lost_s = -math.inf  # when the last loss was noticed
        self._unread_s = -math.inf  # when the last loss of a standstill was noticed
        self._untimed_s = -math.inf  # when the last frame of unknown time came

    def arrived(
        self, frame: F, number: int, device_s: float, came: Came, rate_hz: float, *, live: bool = True
    ) -> list[tuple[F, Came, Arrival]]:
        """The frames to hand on now that `frame` has arrived, in order: often it alone.

        number, device_s: its own, and by its device's clock (NaN if that has none). rate_hz: as the device says, 0 if
        it does not. In playback (not `live`) numbers jump as the operator scrubs.
        """
        arrival_s, last_s = came.latest_s, self._surely_s
        if 0 < self.latest_s - arrival_s < TOGETHER_S:
            arrival_s = self.latest_s
        self.latest_s = max(arrival_s, self.latest_s)
        self._surely_s = self.latest_s - came.slack_s
        before, came = self.sequence.lost, Came(arrival_s, came.slack_s)
        rate_hz = rate_hz or self.rate_hz or LIKELY_RATE_HZ
        ready = self.sequence.arrived(
            (frame, came), number, device_s, arrival_s, rate_hz, live=live, slack_s=came.slack_s
        )
        if (lost := self.sequence.lost - before) > 0:
            self._count_lost(lost, last_s, arrival_s)
        return [(*one, said) for one, said in ready]

    def handed_on(self, times: Times) -> None:
        """Count one of them as handed on."""
        self.received += 1
        self._rate.add(times.arrival_s)
        self.rate_hz = self._rate.rate_hz(times.arrival_s)
        if times.known:
            self.latency_s = times.latency_s
        else:
            self.untimed += 1
            self._untimed_s = self.latest_s

    def _count_lost(self, lost: int, last_s: float, arrival_s: float) -> None:
        """Frames that should have come since `last_s`: because this program stood still, if it did for most of that
        time, else on the way."""
        missing_s, stood_s, latest = arrival_s - last_s, 0.0, -1
        for i, one in enumerate(self.standstills):
            begin_s, end_s = one.reach_s
            if end_s > last_s:
                asleep_s = one.seconds - (one.to_s - one.from_s)  # no clock of ours tells it
                within_s = min(end_s, arrival_s) - max(begin_s, last_s)
                missing_s, stood_s, latest = missing_s + asleep_s, stood_s + asleep_s + max(within_s, 0.0), i
        if latest >= 0 and stood_s > missing_s / 2:
            one = self.standstills[latest]
            self.standstills[latest] = replace(one, lost=one.lost + lost)
            self._unread_s = arrival_s
            return
        recent = self._lost_recently if arrival_s - self._lost_s < RECENT_S else 0
        self._lost_recently, self._lost_s = recent + lost, arrival_s

    # ---- what is told, from any thread

    def fresh(self, now_s: float) -> bool:
        """Whether frames come in."""
        return now_s - self.latest_s < NO_FRAMES_S

    def losses(self, now_s: float, advice: str) -> str:
        """What to say of frames that were lost just now, if any; else "". advice: against losses on the way."""
        if now_s - self._unread_s < RECENT_S:
            last = next(one for one in reversed(self.standstills) if one.lost)
            return f"{stood_still([last])}: {last.lost:,} frames of that time are lost."
        if now_s - self._lost_s < RECENT_S:
            on_the_way = self.sequence.lost - sum(one.lost for one in self.standstills)
            return f"{self._lost_recently:,} frames lost on the way just now, {on_the_way:,} in all. {advice}"
        return ""

    def without_time(self, now_s: float) -> str:
        """What to say of frames of unknown time, if some came just now; else ""."""
        if now_s - self._untimed_s >= RECENT_S:
            return ""
        return (
            f"{self.untimed:,} frames came while this machine slept or its clock was set: their time is unknown. "
            "Keep it from sleeping while it captures."
        )

    def heard(self, senders: str, here: str, who: str) -> str:
        """What comes in, for the case that nothing is understood. senders: as `Hearing.text` says. here: where it is
        heard. who: counts the frames."""
        said = (
            (self.sequence.late, "came too late"),
            (self.sequence.repeated, "came twice"),
            (self.sequence.restarts, f"times {who} counted anew"),
            (self.untimed, "of unknown time"),
        )
        parts = [f"{here} hears {senders or 'nothing'}", *(f"{n:,} {what}" for n, what in said if n)]
        return "; ".join(parts) + "."

    def health(self, level: Level, reason: str, now_s: float, hearing: Hearing) -> Health:
        """The figures, with this light; what is of the connection is added by the device."""
        fresh = self.fresh(now_s)
        return Health(
            level=level,
            reason=reason,
            received=self.received,
            lost=self.sequence.lost,
            late=self.sequence.late,
            repeated=self.sequence.repeated,
            rejected=hearing.rejected,
            untimed=self.untimed,
            rate_hz=self.rate_hz if fresh else 0.0,
            latency_s=self.latency_s if fresh else math.nan,
            last_error=hearing.last_error,
            standstills=tuple(self.standstills),
        )
