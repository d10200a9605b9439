"""The server's clock as seen from here."""

from __future__ import annotations

from collections import deque

DRIFT = 1e-4
"""Two quartz clocks part by less than this [s/s]."""

ECHOES = 16
"""Echoes remembered."""


class ClockSync:
    """Maps the server's clock onto this machine's.

    An echo brackets the server's time between its sending and its answer's arrival, so the offset is known to
    half the round trip, and to less as it ages: the echo with the least uncertainty now is used. Without echoes
    (old servers, listening only) a packet's own sending time bounds the offset from one side, and the quickest
    packet is the best guess.
    """

    def __init__(self) -> None:
        self._echoes: deque[tuple[float, float, float]] = deque(maxlen=ECHOES)  # sent, round trip, offset
        self._passive: tuple[float, float] | None = None  # when, offset

    def reset(self) -> None:
        """Forget everything: another server, or the same one started anew."""
        self._echoes.clear()
        self._passive = None

    def echo(self, sent_s: float, server_s: float, received_s: float) -> None:
        """One echo: our clock, the server's, ours."""
        round_trip = received_s - sent_s
        if round_trip >= 0:
            self._echoes.append((sent_s, round_trip, server_s - (sent_s + received_s) / 2))

    def packet(self, server_s: float, arrival_s: float) -> None:
        """One packet sent at `server_s` by the server's clock."""
        offset = server_s - arrival_s
        if self._passive is None or offset >= self._passive[1] - DRIFT * (arrival_s - self._passive[0]):
            self._passive = arrival_s, offset

    @property
    def synchronised(self) -> bool:
        """Whether echoes were answered."""
        return bool(self._echoes)

    @property
    def round_trip_s(self) -> float:
        """The shortest of the remembered round trips [s], NaN if none."""
        return min((echo[1] for echo in self._echoes), default=float("nan"))

    def host_s(self, server_s: float, now_s: float) -> float:
        """A time of the server's clock by ours [s]; `now_s` if nothing is known of its clock."""
        if self._echoes:
            return server_s - min(self._echoes, key=lambda e: e[1] / 2 + DRIFT * (now_s - e[0]))[2]
        if self._passive is not None:
            return server_s - self._passive[1]
        return now_s
