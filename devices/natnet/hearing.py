"""What comes in, from whom, for the case that nothing is understood."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

from devices.natnet.wire import Version

ADDRESSES = 16
"""Senders told apart; sixteen names tell enough."""


@dataclass
class _Sender:
    frames: int = 0
    answers: int = 0
    rejected: int = 0


class Hearing:
    """Packets by sender. Counted by the receiving thread, read by any."""

    def __init__(self) -> None:
        self.rejected = 0
        self.rejected_s = float("-inf")
        self.last_error = ""
        self._senders: dict[str, _Sender] = {}

    def frame(self, address: str) -> None:
        """A frame came."""
        self._of(address).frames += 1

    def answer(self, address: str) -> None:
        """Another message came."""
        self._of(address).answers += 1

    def reject(self, address: str, why: str, now: float) -> None:
        """A packet could not be decoded."""
        self._of(address).rejected += 1
        self.rejected += 1
        self.rejected_s = now
        self.last_error = f"A packet from {address} was not understood. {why}"

    def forget(self) -> None:
        """Begin anew, but for the counts."""
        self._senders = {}

    def text(self, used: Collection[str], version: Version | None) -> str:
        """Who sent what; frames are of `version`, those of senders not `used` are marked so."""
        senders = []
        for address, sender in list(self._senders.items()):
            parts = []
            if sender.frames:
                ours = f" of NatNet {version[0]}.{version[1]}" if version is not None else ""
                parts.append(f"{sender.frames} frames" + (ours if address in used else " (another server, not used)"))
            if sender.answers:
                parts.append(f"{sender.answers} answers")
            if sender.rejected:
                parts.append(f"{sender.rejected} packets not understood")
            senders.append(f"{address}: " + ", ".join(parts))
        return "; ".join(senders)

    def _of(self, address: str) -> _Sender:
        if address not in self._senders and len(self._senders) >= ADDRESSES:
            address = "others"
        return self._senders.setdefault(address, _Sender())
