"""Where every frame of one stream of a take went while it is recorded, and when none came."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import replace

from app.silences import Silences
from app.stream_figures import StreamFigures
from core.frames import Standstill, Times
from core.takes.holes import Holes
from core.takes.take import DAMAGED, StreamCounts
from devices.common.clock import host_clock
from devices.device import Health


class StreamTally:
    """Not for several threads at once.

    title, rate_hz: of its device. received, written, untimed, dropped: as StreamCounts has them. clock, clock_dropped:
    as StreamFigures. clock_received: samples that came. first_s: when the first frame that is written was taken, by the
    host's clock [s]; None for none. behind_s: how long the last frame had been under way [s]. meanwhile: what the
    device has counted since the take began.
    """

    def __init__(self, title: str, rate_hz: float, started_s: float) -> None:
        """started_s: when the take began, by the host's clock [s]."""
        self.title, self.rate_hz = title, rate_hz
        self.received = self.written = self.untimed = 0
        self.clock_received = self.clock = self.clock_dropped = 0
        self.dropped: Counter[str] = Counter()
        self.first_s: float | None = None
        self.behind_s = 0.0
        self.silences = Silences(started_s)
        self.meanwhile = Health()

    @property
    def waiting(self) -> int:
        """Frames that are neither written nor dropped yet."""
        return self.received - self.written - self.dropped.total()

    @property
    def clock_waiting(self) -> int:
        """Clock samples, likewise."""
        return self.clock_received - self.clock - self.clock_dropped

    def came(self, times: Times) -> None:
        """A frame has arrived."""
        self.silences.arrived(times.arrival_s, host_clock())
        self.behind_s = times.latency_s if times.latency_s > 0 else 0.0
        self.received += 1

    def kept(self, times: Times) -> None:
        """A frame is written."""
        self.written += 1
        self.untimed += not times.known
        if self.first_s is None and math.isfinite(times.begins_s):
            self.first_s = times.begins_s

    def only(self, readable: int, untimed: int) -> int:
        """From now on only so many frames are called written. How many are not any more."""
        lost = max(self.written - readable, 0)
        if lost:
            self.written, self.untimed = readable, untimed
            self.dropped[DAMAGED] += lost
        return lost

    def standstills(self, zero_s: float) -> tuple[Standstill, ...]:
        """In the time that counts from this instant of the host's clock."""
        return tuple(
            replace(one, from_s=one.from_s - zero_s, to_s=one.to_s - zero_s) for one in self.meanwhile.standstills
        )

    def counts(self, zero_s: float) -> StreamCounts:
        """As the file will say. zero_s: from when the time of the take counts, by the host's clock [s]."""
        device = self.meanwhile
        return StreamCounts(
            self.received, self.written, dict(self.dropped), device.lost, device.rejected, late=device.late,
            repeated=device.repeated, untimed=self.untimed, standstills=self.standstills(zero_s),
        )  # fmt: skip

    def heard_holes(self, zero_s: float, end_s: float = -math.inf) -> Holes:
        """The long silences, in the time of the take; up to its end [s], else those that are over."""
        return self.silences.holes(end_s, zero_s, self.rate_hz).owned(self.standstills(zero_s))

    def figures(
        self, zero_s: float, holes: Holes, silent_s: float = 0.0, dropped: Mapping[str, int] | None = None
    ) -> StreamFigures:
        """All of it. dropped: if other than counted."""
        counts = self.counts(zero_s)
        return StreamFigures(
            counts.received, counts.written, counts.dropped if dropped is None else dropped, counts.lost,
            counts.rejected, late=counts.late, repeated=counts.repeated, untimed=counts.untimed,
            standstills=counts.standstills, title=self.title, rate_hz=self.rate_hz, holes=holes, silent_s=silent_s,
            clock=self.clock, clock_dropped=self.clock_dropped,
        )  # fmt: skip
