"""A device's clock as seen from here."""

from __future__ import annotations

import math
from collections import deque
from typing import NamedTuple

DRIFT = 1e-4
"""Two quartz clocks part by less than this [s/s]."""

ECHOES = 16
"""Echoes remembered."""


JUMP_S = 0.005
"""A step beyond what two echoes allow is no drift: the server was started anew [s]."""


LONGEST_DELAY_S = 1.0
"""A packet this much slower than the quickest was not slow: the clock was set back [s]."""


BORNE_OUT_S = 1.0
"""A packet far quicker than all others is believed if another comes as quickly within this time [s]."""


class ClockSync:
    """Maps the clock of a device, or of the server that speaks for it, onto this machine's.

    An echo brackets the server's time between its sending and its answer's arrival, so the offset is known to
    half the round trip, and to less as it ages: the echo with the least uncertainty now is used. A packet bounds
    the offset from one side: it cannot arrive before it was sent. Where there are no echoes (old servers,
    listening only) the quickest packet is the best guess. No echo and no packet is believed alone against those
    before it: it may be spoilt.
    """

    def __init__(self) -> None:
        self._echoes: deque[_Echo] = deque(maxlen=ECHOES)
        self._odd: _Echo | None = None  # the last one, where it contradicts them
        self._quickest: tuple[_Bound, ...] = ()  # the two quickest packets, the quicker first
        self._slow: _Bound | None = None  # the last packet, where it was too slow for a packet

    def reset(self) -> None:
        """Forget everything: another server, or the same one started anew."""
        self._echoes.clear()
        self._odd = None
        self.begin_anew()

    def begin_anew(self) -> None:
        """The server stamps its frames anew: what earlier packets told does not hold for those to come. Echoes are of
        another clock, and tell themselves when that began anew."""
        self._quickest, self._slow = (), None

    def echo(self, sent_s: float, server_s: float, received_s: float) -> None:
        """One echo: our clock, the server's, ours. The second that contradicts those before begins anew."""
        round_trip = received_s - sent_s
        if round_trip < 0:
            return
        new = _Echo(sent_s, round_trip, server_s - (sent_s + received_s) / 2)
        if self._echoes and not new.agrees(self._echoes[-1]):
            odd, self._odd = self._odd, new
            if odd is None or not new.agrees(odd):
                return
            self.reset()
            self._echoes.append(odd)
        self._odd = None
        self._echoes.append(new)

    def packet(self, server_s: float, arrival_s: float) -> None:
        """One packet sent at `server_s` by the server's clock."""
        new, used = _Bound(arrival_s, server_s - arrival_s), self._bound(arrival_s)
        if used is not None and used.at(arrival_s) - new.offset_s > LONGEST_DELAY_S:
            slow, self._slow = self._slow, new
            if slow is not None and abs(slow.offset_s - new.offset_s) < LONGEST_DELAY_S:
                self._quickest, self._slow = (slow, new), None
            return
        self._slow = None
        kept = self._quickest
        if len(kept) == 2 and used is kept[1] and arrival_s - kept[0].when_s > BORNE_OUT_S:
            kept = kept[1:]  # no other came as quickly
        ordered = sorted((*kept, new), key=lambda bound: bound.at(arrival_s), reverse=True)
        self._quickest = tuple(ordered[:2])

    def _bound(self, now_s: float) -> _Bound | None:
        """The quickest packet that another bears out; the only one."""
        match self._quickest:
            case (first, second) if first.at(now_s) - second.at(now_s) > JUMP_S:
                return second
            case (first, *_):
                return first
        return None

    @property
    def known(self) -> bool:
        """Whether anything is known of the server's clock."""
        return bool(self._echoes or self._quickest)

    @property
    def synchronised(self) -> bool:
        """Whether echoes were answered."""
        return bool(self._echoes)

    @property
    def doubted(self) -> bool:
        """Whether the last echo contradicts those before: another is wanted at once."""
        return self._odd is not None

    @property
    def round_trip_s(self) -> float:
        """The shortest of the remembered round trips [s], NaN if none."""
        return min((echo.round_trip_s for echo in tuple(self._echoes)), default=math.nan)  # read by any thread

    def host_s(self, server_s: float, now_s: float) -> float:
        """A time of the server's clock by ours [s]; `now_s` if nothing is known of its clock."""
        used = self._bound(now_s)
        if not self._echoes:
            return now_s if used is None else server_s - used.offset_s
        echo = min(self._echoes, key=lambda echo: echo.error_s(now_s))
        offset = echo.offset_s
        # Beyond what the echo allows the bound is none: a take is played back with the stamps of its day.
        if used is not None and offset < used.at(now_s) <= offset + echo.error_s(now_s):
            offset = used.at(now_s)
        return server_s - offset

    def explains(self, sent_s: float, arrival_s: float) -> bool:
        """Whether a packet sent at `sent_s` by the server's clock can have arrived so early. If not, what is known of
        that clock holds no longer: the server was started anew, or this machine slept, and its clock with it."""
        error_s = min((echo.error_s(arrival_s) for echo in self._echoes), default=0.0)
        return self.host_s(sent_s, arrival_s) <= arrival_s + error_s + JUMP_S


class _Echo(NamedTuple):
    sent_s: float
    round_trip_s: float
    offset_s: float

    def error_s(self, now_s: float) -> float:
        """How far off its offset may be at `now_s`."""
        return self.round_trip_s / 2 + DRIFT * abs(now_s - self.sent_s)

    def agrees(self, other: _Echo) -> bool:
        """Whether both can be of one clock."""
        bound = (self.round_trip_s + other.round_trip_s) / 2 + DRIFT * abs(self.sent_s - other.sent_s)
        return abs(self.offset_s - other.offset_s) <= bound + JUMP_S


class _Bound(NamedTuple):
    """A packet's offset. The true one is at least that, but for drift."""

    when_s: float
    offset_s: float

    def at(self, now_s: float) -> float:
        return self.offset_s - DRIFT * (now_s - self.when_s)
