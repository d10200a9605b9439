"""The device contract, for every system: discover, open, start, read, stop, describe.

A device is driven by exactly one thread, its receiver: `open`, `start`, `read`, `stop` and `close` are called
there, in that order, and `start`/`stop` may repeat. What it tells of itself (`streams`, `describe`, `health`, `offers`)
may be asked from any thread at any time, as may `command`.
A device never raises for what a network or a performer may do in mid-session (a lost server, a bad packet):
it counts, says so in `health`, reconnects by itself, and `read` goes on returning.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from core.errors import DeviceError
from core.frames import Standstill
from core.level import Level as Level
from core.printable import MOST_OF_TEXT, printable
from core.streams import Sample, StreamInfo
from devices.offers import Offers
from devices.parameter import Parameter as Parameter
from devices.parameter import Value as Value
from devices.parameter import checked


@dataclass(frozen=True)
class Found:
    """One server that answered a discovery. settings: parameters that open it."""

    title: str
    settings: Mapping[str, Value]

    def __post_init__(self) -> None:
        object.__setattr__(self, "title", printable(self.title))


@dataclass(frozen=True)
class Description:
    """What a connected device says of itself. rate_hz is 0 until known. details: for people, label to text."""

    title: str
    rate_hz: float = 0.0
    details: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "title", printable(self.title))
        details = {name: printable(text, MOST_OF_TEXT) for name, text in self.details.items()}
        object.__setattr__(self, "details", details)


@dataclass(frozen=True)
class Health:
    """How a device is doing, now.

    level and reason: the light and why, with what to do about it. connected: data or answers are coming.
    received: frames read. lost: frames the sequence numbers say were sent and that were not handed on: they never
    arrived, or after newer ones. late: those of the lost that did arrive. repeated: frames that arrived twice.
    rejected: packets that could not be decoded or believed, last_error: why the latest could not.
    untimed: frames read of which nothing tells when they were taken: their `Times.host_s` is NaN.
    rate_hz: frames per second over the last second. latency_s: exposure to arrival, NaN if unknown.
    heard: what comes in, from whom, for the case that nothing is understood. standstills: when nobody read the device
    because this program did not run; what was lost then is part of `lost`.
    """

    level: Level = Level.IDLE
    reason: str = "Not connected."
    connected: bool = False
    received: int = 0
    lost: int = 0
    late: int = 0
    repeated: int = 0
    rejected: int = 0
    untimed: int = 0
    reconnects: int = 0
    rate_hz: float = 0.0
    latency_s: float = math.nan
    last_error: str = ""
    heard: str = ""
    standstills: tuple[Standstill, ...] = ()

    def __post_init__(self) -> None:
        for text in ("reason", "last_error", "heard"):
            object.__setattr__(self, text, printable(getattr(self, text), MOST_OF_TEXT))

    @property
    def unread(self) -> int:
        """Of the lost frames, those that were lost while this program stood still."""
        return min(sum(one.lost for one in self.standstills), self.lost)

    def since(self, before: Health) -> Health:
        """The same, with what was lost or amiss since it was as `before`."""
        counts = ("lost", "late", "repeated", "rejected", "untimed")
        more = {name: max(getattr(self, name) - getattr(before, name), 0) for name in counts}
        return replace(self, **more, standstills=self.standstills[len(before.standstills) :])


@dataclass(frozen=True)
class RemoteCommand:
    """Something that a system can be asked to do beside streaming: to record, to play. parameters: what it must be
    told."""

    name: str
    label: str
    parameters: tuple[Parameter, ...] = ()
    help: str = ""


class Device(ABC):
    """One optical or inertial system. Subclasses name `kind`, `title` and `parameters`."""

    kind: str
    title: str
    parameters: tuple[Parameter, ...]
    can: tuple[RemoteCommand, ...] = ()
    """What it can be asked to do. One that declares any overrides `_command`."""
    has_end = False
    """Whether it begins with `start` and has an end, as a file: a recording of it misses nothing."""

    def __init__(self, **settings: object) -> None:
        """Raises DeviceError for an unknown setting or a value out of range."""
        self.settings: dict[str, Value] = checked(self.parameters, settings, self.title)

    @property
    def address(self) -> str:
        """Where it is reached, for people: a host, a port, a file. "" if nowhere in particular."""
        return ""

    @classmethod
    def discover(cls, timeout_s: float = 1.0) -> Sequence[Found]:
        """Servers that answer within `timeout_s`. Nothing found is an empty sequence, not an error."""
        return ()

    @abstractmethod
    def open(self) -> None:
        """Take sockets or ports and reach the system. Raises DeviceError; the device is then closed."""

    @abstractmethod
    def start(self) -> None:
        """Begin to stream. Raises DeviceError."""

    @abstractmethod
    def streams(self) -> tuple[StreamInfo, ...]:
        """What it sends, by keys of its own; known once it is open, () before. Thread-safe."""

    @abstractmethod
    def read(self, timeout_s: float) -> Sample | None:
        """The next frame or clock sample of one of its streams, waiting at most `timeout_s`; None if none came. Never
        raises for a bad stream."""

    @abstractmethod
    def stop(self) -> None:
        """End streaming; `start` may follow."""

    @abstractmethod
    def close(self) -> None:
        """Give every resource back. May be called twice, and after a failed open."""

    @abstractmethod
    def describe(self) -> Description:
        """What the system is. Thread-safe."""

    @abstractmethod
    def health(self) -> Health:
        """How it is doing now. Thread-safe, cheap: called at display rate."""

    def stream_health(self, key: str) -> Health:
        """How one of its streams is doing, by the key that `streams` gives it. Thread-safe, cheap. One of several
        streams tells of each apart; what is common to all of them is in each."""
        return self.health()

    def offers(self) -> Offers:
        """What the system has for a profile; known once it is open, and nothing before. Thread-safe."""
        return Offers()

    def command(self, name: str, /, **settings: object) -> None:
        """Ask the system to do one of what it `can`; returns when that is sent, not when it is done. Thread-safe.

        Raises DeviceError for a command that it cannot take, a setting that is wrong, and where it is not open.
        """
        known = {command.name: command for command in self.can}
        if name not in known:
            takes = "It can " + ", ".join(known) + "." if known else "Do it at the system itself."
            raise DeviceError(f"{self.title} cannot be asked to {name!r} from here.", takes)
        self._command(name, checked(known[name].parameters, settings, known[name].label))

    def _command(self, name: str, settings: Mapping[str, Value]) -> None:
        """Send a command that is known, with all its settings. Raises DeviceError if the device is not open."""
        raise NotImplementedError(f"{self.title} declares the command {name!r} and does not send it")

    @property
    def warnings(self) -> Sequence[str]:
        """What opening found amiss and went on without, in sentences; known once it is open."""
        return ()

    @property
    def finished(self) -> bool:
        """True once a source with an end (a file) has been read to it. Live systems never finish."""
        return False
