"""The server's clock as seen from here."""

from __future__ import annotations

import math
from collections import deque

DRIFT = 1e-4
"""Two quartz clocks part by less than this [s/s]."""

ECHOES = 16
"""Echoes remembered."""


JUMP_S = 0.005
"""A step beyond what two echoes allow is no drift: the server was started anew [s]."""


LONGEST_DELAY_S = 1.0
"""A packet this much slower than the quickest was not slow: the clock was set back [s]."""


class ClockSync:
    """Maps the server's clock onto this machine's.

    An echo brackets the server's time between its sending and its answer's arrival, so the offset is known to
    half the round trip, and to less as it ages: the echo with the least uncertainty now is used. A packet bounds
    the offset from one side: it cannot arrive before it was sent. Where there are no echoes (old servers,
    listening only) the quickest packet is the best guess.
    """

    def __init__(self) -> None:
        self._echoes: deque[tuple[float, float, float]] = deque(maxlen=ECHOES)  # sent, round trip, offset
        self._passive: tuple[float, float] | None = None  # when, offset

    def reset(self) -> None:
        """Forget everything: another server, or the same one started anew."""
        self._echoes.clear()
        self._passive = None

    def begin_anew(self) -> None:
        """The server stamps its frames anew: what earlier packets told does not hold for those to come. Echoes are of
        another clock, and tell themselves when that began anew."""
        self._passive = None

    def echo(self, sent_s: float, server_s: float, received_s: float) -> None:
        """One echo: our clock, the server's, ours."""
        round_trip = received_s - sent_s
        if round_trip < 0:
            return
        offset = server_s - (sent_s + received_s) / 2
        if self._echoes:
            last_sent, last_trip, last_offset = self._echoes[-1]
            bound = (round_trip + last_trip) / 2 + DRIFT * (sent_s - last_sent)
            if abs(offset - last_offset) > bound + JUMP_S:
                self.reset()
        self._echoes.append((sent_s, round_trip, offset))

    def packet(self, server_s: float, arrival_s: float) -> None:
        """One packet sent at `server_s` by the server's clock."""
        offset = server_s - arrival_s
        if self._passive is not None:
            when, best = self._passive
            slower = best - DRIFT * (arrival_s - when) - offset
            if 0 < slower < LONGEST_DELAY_S:
                return
        self._passive = arrival_s, offset

    @property
    def synchronised(self) -> bool:
        """Whether echoes were answered."""
        return bool(self._echoes)

    @property
    def round_trip_s(self) -> float:
        """The shortest of the remembered round trips [s], NaN if none."""
        return min((echo[1] for echo in tuple(self._echoes)), default=math.nan)  # read by any thread

    def host_s(self, server_s: float, now_s: float) -> float:
        """A time of the server's clock by ours [s]; `now_s` if nothing is known of its clock."""
        bound = -math.inf
        if self._passive is not None:
            bound = self._passive[1] - DRIFT * (now_s - self._passive[0])
        if self._echoes:
            sent, round_trip, offset = min(self._echoes, key=lambda echo: echo[1] / 2 + DRIFT * (now_s - echo[0]))
            # Beyond what the echo allows the bound is none: a take is played back with the stamps of its day.
            if offset < bound <= offset + round_trip / 2 + DRIFT * (now_s - sent):
                offset = bound
            return server_s - offset
        return now_s if self._passive is None else server_s - self._passive[1]
