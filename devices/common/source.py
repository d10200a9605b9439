"""Whose frames are used, of all that arrive."""

from __future__ import annotations

from collections.abc import Collection

Sender = tuple[str, int]
"""Address and port."""

SILENCE_S = 1.0
"""One who has sent nothing for this long has stopped: another may be taken up [s]."""


class Source:
    """Frames are those of one sender at a time: the chosen server.

    It may send from any port, and one with several network cards from another address than the one that answers. So
    the first sender is used, and another only once that one has been silent. Two kinds of sender step in at once: the
    server's own address in place of another, and there the ports that it told in place of others. A sender that is not
    the server is waited with as long, lest it be taken up before the server begins.

    server: its address, "" where nobody is asked and any may be the one. ports: the ones it is known to send from.
    """

    def __init__(self, server: str, ports: Collection[int] = ()) -> None:
        self.server = server
        self.ports = set(ports)
        self.current: Sender | None = None
        self.expected = ""
        """The address whose frames were used first; the server's, once it has sent any."""
        self._last_s = float("-inf")

    def begin(self, now_s: float) -> None:
        """Frames are wanted from now on."""
        self._last_s = max(self._last_s, now_s)

    def admits(self, sender: Sender, now_s: float) -> bool:
        """Whether a frame of theirs that arrived at `now_s` is to be used."""
        if sender == self.current or now_s - self._last_s > SILENCE_S:
            return True
        if not self.server:
            return self.current is None
        return sender[0] == self.server and (self.current is None or self._rank(sender) > self._rank(self.current))

    def use(self, sender: Sender, now_s: float) -> None:
        """A frame of theirs was used."""
        self.current = sender
        self._last_s = max(self._last_s, now_s)
        if not self.expected or sender[0] == self.server:
            self.expected = sender[0]

    @property
    def stranger(self) -> str:
        """The address that frames come from since the expected one sends none, "" if it does."""
        current = self.current
        return current[0] if current is not None and current[0] != self.expected else ""

    def _rank(self, sender: Sender) -> int:
        return (sender[0] == self.server) + (sender[0] == self.server and sender[1] in self.ports)
