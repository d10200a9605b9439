"""What is to come in now, for lights and words: every stream that is armed or was recorded to its end, and every device
that is being connected or could not be."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from app.armed import ArmedStream
from app.receiver import Receiver
from app.session import Session
from core.streams import StreamInfo
from devices.device import Health, Level

GRAVEST = (Level.PROBLEM, Level.WARNING, Level.IDLE, Level.GOOD)

ENDED = "Played to its end; the take goes on without it."

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
    def ended(self) -> bool:
        """It was played to its end in the take that runs."""
        return self.health.reason == ENDED

    @property
    def state(self) -> str:
        """In two or three words, with its title before them."""
        if self.flows or self.health.rate_hz > 0:
            return f"{self.title} · {self.health.rate_hz:.0f} Hz"
        lacking = "played to its end" if self.ended else "not connected" if self.receiver.failed else "no frames"
        return f"{self.title}: {lacking}"

    @property
    def reason(self) -> str:
        """How it is doing, with its name before it."""
        return f"{self.title}: {self.health.reason}"


def incoming(session: Session) -> list[Incoming]:
    """In order of connection; devices that are being connected or given back, or could not be connected, last."""
    shown, solving = armed_or_ended(session), session.solving
    found = [
        Incoming(one.receiver, one.key, stream_title(one.info, one.receiver), stream_health(one), one.key == solving)
        for one in shown
    ]
    there = [one.receiver for one in shown]
    return found + [
        Incoming(receiver, "", receiver.title, receiver.health())
        for receiver in session.receivers
        if (receiver.active or receiver.failed) and receiver not in there
    ]


def armed_or_ended(session: Session) -> list[ArmedStream]:
    """The streams that are armed, and those of the take that runs that were played to their end in it."""
    armed = session.streams
    there = {one.key for one in armed}
    return [*armed, *(one for one in session.recorded if one.receiver.finished and one.key not in there)]


def stream_health(stream: ArmedStream) -> Health:
    """Of one of these. A file that ended has not failed."""
    return stream.health() if stream.receiver.streaming else Health(Level.WARNING, ENDED)


def solved_one(streams: Iterable[Incoming]) -> Incoming | None:
    """The one that the hands are solved from."""
    return next((one for one in streams if one.solved), None)


def stream_title(info: StreamInfo, receiver: Receiver) -> str:
    """The device's; of several streams with what the device calls this one: 'Gloves COM3, left'."""
    return receiver.title if not receiver.several else f"{receiver.title}, {short_name(info)}"


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
        return SOLVED if max(len(session.streams), len(session.recorded)) > 1 else ""
    return RECORDED if solving or not stream.optical else ""


def ended_device(session: Session) -> Receiver | None:
    """Of a session of which nothing is connected, or was to be, a device that was played to its end."""
    return next((one for one in session.receivers if one.finished), None)
