"""What comes in, from whom, for the case that nothing is understood."""

from __future__ import annotations

from dataclasses import dataclass

from devices.natnet.wire import Version

ADDRESSES = 16
"""Senders told apart; sixteen names tell enough."""


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
        self.unused_s = float("-inf")
        """When the last frame of a sender came that is not the one in use."""
        self._unused: str = ""
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
        self._unused, self.unused_s = _named(address, port, server), now

    @property
    def unused(self) -> str:
        """Who sent the last frame that was not used, and how many packets in all."""
        sender = self._senders.get(self._unused) or self._senders.get(_OTHERS)
        return f"{self._unused} ({sender.unused} so far)" if sender is not None else self._unused

    def forget(self) -> None:
        """Begin anew, but for the counts."""
        self._senders = {}
        self.unused_s = float("-inf")

    def text(self, version: Version | None) -> str:
        """Who sent what; frames that are used are of `version`."""
        senders = []
        for address, sender in list(self._senders.items()):
            parts = []
            if sender.frames:
                ours = f" of NatNet {version[0]}.{version[1]}" if version is not None else ""
                parts.append(f"{sender.frames} frames" + ours)
            if sender.answers:
                parts.append(f"{sender.answers} answers")
            if sender.unused:
                parts.append(f"{sender.unused} packets (another server, not used)")
            if sender.rejected:
                parts.append(f"{sender.rejected} packets not understood")
            senders.append(f"{address}: " + ", ".join(parts))
        return "; ".join(senders)

    def _of(self, name: str) -> _Sender:
        if name not in self._senders and len(self._senders) >= ADDRESSES:
            name = _OTHERS
        return self._senders.setdefault(name, _Sender())


_OTHERS = "others"


def _named(address: str, port: int, server: str) -> str:
    return f"{address} port {port}" if address == server else address
