"""What comes in, from whom, for the case that nothing is understood."""

from __future__ import annotations

from dataclasses import dataclass

ADDRESSES = 16
"""Senders told apart; sixteen names tell enough."""

RECENT_S = 5.0
"""For how long a loss or a bad packet shows in the light [s]."""

NAMED_S = 5.0
"""Of several who send at once one is named until none has sent for so long [s]."""


@dataclass
class _Sender:
    frames: int = 0
    answers: int = 0
    rejected: int = 0
    unused: int = 0


class Hearing:
    """Packets by sender. Counted by the receiving thread, read by any."""

    def __init__(self) -> None:
        self.rejected = 0
        self.rejected_s = float("-inf")
        self.last_error = ""
        self.unused, self.unused_s = "", float("-inf")
        """Who sent frames that are not used because another is, and when the last came."""
        self._senders: dict[str, _Sender] = {}

    def frame(self, address: str) -> None:
        """A frame came."""
        self._of(address).frames += 1

    def answer(self, address: str) -> None:
        """Another message came."""
        self._of(address).answers += 1

    def reject(self, address: str, why: str, now: float, packets: int = 1) -> None:
        """A packet could not be decoded, or was not to be believed."""
        self._of(address).rejected += packets
        self.rejected += packets
        self.rejected_s = now
        self.last_error = f"A packet from {address} was not understood. {why}"

    def other(self, address: str, port: int, server: str) -> None:
        """A message of someone who is not the one in use; of the server's own computer the port tells which."""
        self._of(_named(address, port, server)).unused += 1

    def other_frame(self, address: str, port: int, server: str, now: float) -> None:
        """The same of a frame."""
        self.other(address, port, server)
        if now - self.unused_s > NAMED_S:
            self.unused = _named(address, port, server)
        self.unused_s = max(now, self.unused_s)

    def forget(self) -> None:
        """Begin anew, but for the counts."""
        self._senders = {}
        self.unused_s = float("-inf")

    def not_understood(self, now_s: float) -> str:
        """What to say of packets that were not, if some came just now; else ""."""
        recent = now_s - self.rejected_s < RECENT_S
        return f"{self.rejected:,} packets were not understood. {self.last_error}" if recent else ""

    def not_used(self, now_s: float) -> str:
        """What to say of another sender, if one sent frames just now; else ""."""
        if now_s - self.unused_s >= RECENT_S:
            return ""
        return (
            f"Frames of another sender, {self.unused}, arrive as well and are not used. "
            "Find out who else streams to this machine."
        )

    def text(self, form: str = "") -> str:
        """Who sent what. form: of the frames that are used, by name and version, "" if unknown."""
        senders = []
        for address, sender in list(self._senders.items()):
            parts = []
            if sender.frames:
                parts.append(f"{sender.frames:,} frames" + (f" of {form}" if form else ""))
            if sender.answers:
                parts.append(f"{sender.answers:,} answers")
            if sender.unused:
                parts.append(f"{sender.unused:,} packets (another server, not used)")
            if sender.rejected:
                parts.append(f"{sender.rejected:,} packets not understood")
            senders.append(f"{address}: " + ", ".join(parts))
        return "; ".join(senders)

    def _of(self, name: str) -> _Sender:
        if name not in self._senders and len(self._senders) >= ADDRESSES:
            name = _OTHERS
        return self._senders.setdefault(name, _Sender())


_OTHERS = "others"


def _named(address: str, port: int, server: str) -> str:
    return f"{address} port {port}" if address == server else address
