"""What comes in now, for lights and words: every stream that is armed, and every device that is being connected."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from app.armed import ArmedStream
from app.receiver import Receiver
from app.session import Session
from core.streams import StreamInfo
from devices.device import Health, Level

GRAVEST = (Level.PROBLEM, Level.WARNING, Level.IDLE, Level.GOOD)

SOLVED, RECORDED, LEFT_OUT = "Solved", "Recorded only", "Not in this take"
ROLE_TIPS = {
    "": "",
    SOLVED: "The hands are solved from it, and it is recorded. Tracking has the choice.",
    RECORDED: "It is recorded with the others; the hands are not solved from it.",
    LEFT_OUT: "It was connected after the take began, and is not recorded. It will be in the next take.",
}


@dataclass(frozen=True)
class Incoming:
    """One stream, or a device of which none is there yet. key: "" of the latter. title: what people call it."""

    receiver: Receiver
    key: str
    title: str
    health: Health
    solved: bool = False

    @property
    def flows(self) -> bool:
        """Frames come."""
        return self.health.connected and self.health.rate_hz > 0

    @property
    def reason(self) -> str:
        """How it is doing, with its name before it."""
        return f"{self.title}: {self.health.reason}"


def incoming(session: Session) -> list[Incoming]:
    """In order of connection; devices that are being connected or given back last."""
    armed, solving = session.streams, session.solving
    found = [
        Incoming(one.receiver, one.key, stream_title(one.info, one.receiver), one.health(), one.key == solving)
        for one in armed
    ]
    there = [one.receiver for one in armed]
    return found + [
        Incoming(receiver, "", receiver.title, receiver.health())
        for receiver in session.receivers
        if receiver.active and receiver not in there
    ]


def solved_one(streams: Iterable[Incoming]) -> Incoming | None:
    """The one that the hands are solved from."""
    return next((one for one in streams if one.solved), None)


def stream_title(info: StreamInfo, receiver: Receiver) -> str:
    """The device's; of several streams with what the device calls this one: 'Gloves COM3, left'."""
    return receiver.title if len(receiver.streams) < 2 else f"{receiver.title}, {short_name(info)}"


def short_name(info: StreamInfo) -> str:
    """What its device calls it: 'left'."""
    return info.key.rpartition("/")[2]


def gravest(streams: Sequence[Incoming]) -> Incoming:
    """The one that most needs to be seen; of those that are alike the first. At least one is needed."""
    return min(streams, key=lambda one: GRAVEST.index(one.health.level))


def role(stream: ArmedStream, session: Session, recorded: Iterable[str] | None) -> str:
    """What becomes of a stream, in words; "" where there is but the one that is solved, or that is going to be.
    recorded: the keys of those in the take that runs, None if none does."""
    if recorded is not None and stream.key not in recorded:
        return LEFT_OUT
    solving = session.solving
    if stream.key == solving:
        return SOLVED if len(session.streams) > 1 else ""
    return RECORDED if solving or not stream.optical else ""


def ended_device(session: Session) -> Receiver | None:
    """Of a session of which nothing is connected, the device to speak of: one that failed, else one that was played to
    its end."""
    devices = session.receivers
    failed = next((one for one in devices if one.health().level is Level.PROBLEM), None)
    return failed or next((one for one in devices if one.finished), None)
