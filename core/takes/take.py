"""What a take says about itself: information, marks, counts; and their plain-text form in the file."""

from __future__ import annotations

import platform
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from typing import Any

from core.frames import Standstill
from core.printable import MOST_OF_TEXT, printable, printable_lines

EXTENSION = ".mcap"
FORMAT_VERSION = 3
"""Rises when a reader of the version before could misread a take, or lose what it holds (docs/take-format.md)."""

PERFORMERS_VERSION, ONE_PERFORMER_VERSION = 2, 1
"""Of takes of several performers and of one, that hold no more than the stream that was solved: readers of that time
read them."""

RATINGS = ("", "A", "alt", "no good")
"""What an operator may say of a take; "" is not rated yet."""

SOLVED_STREAM = 1
"""Number of the stream that was solved."""

LOOKED_BACK = "Looked back: saved after it had happened, from the last seconds that are always kept."
"""What people are told of such a take."""

MOST_STREAMS = 64
MOST_PERFORMERS = 64
"""In one take; a larger number is damage."""

DAMAGED = "damaged file"
"""Reason under which a recovered take counts frames that its original could not give back."""

BY_CHOICE = "left out by choice"
"""Reason under which a take counts frames that have no pose because only every n-th was to be solved."""

_COUNT = re.compile("[0-9]{1,12}")
_YEARS = range(1970, 9999)  # beyond them a time zone away may be none
_LONGEST_S = 1e8
"""Three years. What counts more than this, or in more digits than a century of frames needs, is damage."""

_LIBRARIES = ("phalanx", "numpy", "scipy", "numba", "mcap", "protobuf")
_MOST_STANDSTILLS = 10_000
_YES = "yes"
_DROPPED, _UNSOLVED, _TRACKED = "dropped.", "unsolved.", "tracked."
_ALWAYS, _SOMETIMES = ("received", "written", "lost", "rejected"), ("late", "repeated", "untimed")
"""Counts of a stream; the latter are written where they are not 0: not in takes made before them."""


@dataclass(frozen=True)
class TakeInfo:
    """What an operator knows of a take.

    created_utc: when recording started, with its time zone. rate_hz: nominal frames per second, NaN if unknown.
    device: what the device says of itself, by name. rating: one of RATINGS. shot:
    what was captured, as it stood in the name's template. looked_back: it was saved after it had happened; nobody
    recorded it while it did.
    """

    name: str
    performer: str = ""
    created_utc: datetime = field(default_factory=lambda: datetime.now(UTC))
    rate_hz: float = float("nan")
    device: Mapping[str, str] = field(default_factory=dict)
    notes: str = ""
    rating: str = ""
    shot: str = ""
    looked_back: bool = False

    def __post_init__(self) -> None:
        for text in ("name", "performer", "rating", "shot"):
            object.__setattr__(self, text, printable(getattr(self, text)))
        object.__setattr__(self, "notes", printable_lines(self.notes))
        device = {printable(key): printable(value, MOST_OF_TEXT) for key, value in self.device.items()}
        object.__setattr__(self, "device", device)


@dataclass(frozen=True, slots=True)
class Mark:
    """A moment worth finding again. time_s: from the first raw frame of the take, by the host clock [s]."""

    time_s: float
    text: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "text", printable(self.text, MOST_OF_TEXT))


@dataclass(frozen=True)
class StreamCounts:
    """Where every frame of a stream went: received = written + dropped.

    received: frames that reached this machine while recording. written: of these, in the take.
    dropped: of these, not in the take, by reason. lost: frames the device counted that never arrived, or too late.
    rejected: packets that arrived and could not be read. late: those of the lost that did arrive. repeated: frames that
    came twice. untimed: frames written of which nothing tells when they were taken. standstills: when this program did
    not run, with the part of `lost` that is their fault.
    """

    received: int
    written: int
    dropped: Mapping[str, int] = field(default_factory=dict)
    lost: int = 0
    rejected: int = 0
    late: int = field(default=0, kw_only=True)
    repeated: int = field(default=0, kw_only=True)
    untimed: int = field(default=0, kw_only=True)
    standstills: tuple[Standstill, ...] = field(default=(), kw_only=True)

    def __post_init__(self) -> None:
        object.__setattr__(self, "dropped", _by_printable(self.dropped))

    @property
    def dropped_total(self) -> int:
        """Frames dropped for any reason."""
        return sum(self.dropped.values())

    @property
    def words(self) -> str:
        """'Received 3,368 = written 3,360 + dropped 8'."""
        return f"Received {self.received:,} = written {self.written:,} + dropped {self.dropped_total:,}"

    @property
    def unread(self) -> int:
        """Of the lost frames, those that were lost while this program stood still."""
        return min(sum(one.lost for one in self.standstills), self.lost)

    @property
    def balanced(self) -> bool:
        """Whether received = written + dropped."""
        return self.received == self.written + self.dropped_total

    @property
    def imbalance(self) -> str:
        """What does not add up, as a sentence; "" if all does."""
        if self.balanced:
            return ""
        return (
            f"Its counts do not balance: received {self.received:,}, written {self.written:,}, "
            f"dropped {self.dropped_total:,}."
        )


@dataclass(frozen=True)
class TakeCounts(StreamCounts):
    """Where every frame of the stream that was solved went, what became of its poses, and the counts of the others.

    solved: solved frames in the take. unsolved: frames written without a pose, by reason. tracked: solved frames in
    which each hand is tracked, by its name ("left", of several performers "2 left"); {} if nobody counted.
    length_s: from the start of the recording to its end [s]; first_s: from the start to the frame from which times
    count [s]; None where the recorder did not say. others: counts of the other streams, by their keys.
    """

    solved: int = 0
    unsolved: Mapping[str, int] = field(default_factory=dict)
    tracked: Mapping[str, int] = field(default_factory=dict)
    length_s: float | None = None
    first_s: float | None = None
    others: Mapping[str, StreamCounts] = field(default_factory=dict)

    def __post_init__(self) -> None:
        StreamCounts.__post_init__(self)
        for names in ("unsolved", "tracked"):
            object.__setattr__(self, names, _by_printable(getattr(self, names)))

    @property
    def poseless(self) -> dict[str, int]:
        """Frames in the take without a pose, by reason: less the poses that went with their frames."""
        left = {reason: n - self.dropped.get(reason, 0) for reason, n in self.unsolved.items()}
        return {reason: n for reason, n in left.items() if n > 0}

    @property
    def left_out(self) -> int:
        """Frames in the take without a pose because only every n-th was to be solved."""
        return min(self.unsolved.get(BY_CHOICE, 0), max(self.written - self.solved, 0))


def _by_printable(numbers: Mapping[str, int]) -> dict[str, int]:
    return {printable(name): n for name, n in numbers.items()}


def utf8(text: object) -> str:
    """Text that UTF-8 can carry: a name from a damaged packet or file system must not stop a recording."""
    return str(text).encode("utf-8", "replace").decode("utf-8")


def info_to_text(info: TakeInfo, n_performers: int, streams: Collection[int] = ()) -> dict[str, str]:
    """TakeInfo without its device, as the metadata record `phalanx.take`. streams: the numbers of those that are named
    in the take."""
    several = n_performers > 1
    version = PERFORMERS_VERSION if several else ONE_PERFORMER_VERSION
    if any(number != SOLVED_STREAM for number in streams):
        version = FORMAT_VERSION
    return {
        "version": str(version),
        **({"performers": str(n_performers)} if several else {}),
        **({"streams": " ".join(map(str, streams))} if streams else {}),
        "name": info.name,
        "performer": info.performer,
        "created_utc": info.created_utc.astimezone(UTC).isoformat(),
        "rate_hz": repr(float(info.rate_hz)),
        "notes": info.notes,
        "rating": info.rating,
        **({"shot": info.shot} if info.shot else {}),
        **({"looked_back": _YES} if info.looked_back else {}),
    }


def info_from_text(text: Mapping[str, str], device: Mapping[str, str], name: str, created: datetime) -> TakeInfo:
    """The reverse of info_to_text; `name` and `created` stand in for what is missing or unreadable."""
    modified = created.astimezone(UTC)
    try:
        created = datetime.fromisoformat(text["created_utc"]).astimezone(UTC)
        if created.year not in _YEARS:
            raise ValueError(created)
    except (KeyError, ValueError, OverflowError, OSError):
        created = modified
    try:
        rate_hz = float(text["rate_hz"])
    except (KeyError, ValueError):
        rate_hz = float("nan")
    return TakeInfo(
        name=text.get("name", name),
        performer=text.get("performer", ""),
        created_utc=created,
        rate_hz=rate_hz,
        device=dict(device),
        notes=text.get("notes", ""),
        rating=text.get("rating", ""),
        shot=text.get("shot", ""),
        looked_back=text.get("looked_back") == _YES,
    )


def performers_from_text(text: Mapping[str, str]) -> int:
    """How many performers a take says it has: 1 where it says nothing that can be read."""
    number = text.get("performers", "")
    return int(number) if number in map(str, range(1, MOST_PERFORMERS + 1)) else 1


def counts_to_text(counts: TakeCounts) -> dict[str, str]:
    """TakeCounts without the other streams, as the metadata record `phalanx.counts`."""
    seconds = {"length_s": counts.length_s, "first_s": counts.first_s}
    frames = _frames_to_text(counts)
    return {
        **{name: frames.pop(name) for name in _ALWAYS},  # in the order in which all takes have them
        "solved": str(int(counts.solved)),
        **frames,
        **_numbers_to_text(_UNSOLVED, counts.unsolved),
        **_numbers_to_text(_TRACKED, counts.tracked),
        **{name: repr(float(value)) for name, value in seconds.items() if value is not None},
        **_standstills_to_text(counts.standstills),
        **_sometimes_to_text(counts),
    }


def stream_counts_to_text(counts: StreamCounts) -> dict[str, str]:
    """StreamCounts as the metadata record `phalanx.counts.<n>`."""
    return {**_frames_to_text(counts), **_standstills_to_text(counts.standstills), **_sometimes_to_text(counts)}


def _frames_to_text(counts: StreamCounts) -> dict[str, str]:
    return {
        **_numbers_to_text("", {name: getattr(counts, name) for name in _ALWAYS}),
        **_numbers_to_text(_DROPPED, counts.dropped),
    }


def _sometimes_to_text(counts: StreamCounts) -> dict[str, str]:
    return _numbers_to_text("", {name: n for name in _SOMETIMES if (n := getattr(counts, name))})


def counts_from_text(text: Mapping[str, str], others: Mapping[str, StreamCounts] | None = None) -> TakeCounts | None:
    """The reverse of counts_to_text; None if a number is missing or unreadable. others: as TakeCounts has them."""

    def seconds(key: str) -> float | None:
        value = float(text.get(key, "nan"))
        return value if 0.0 <= value <= _LONGEST_S else None

    try:
        return TakeCounts(
            **_stream_counts(text),
            solved=_number(text["solved"]),
            unsolved=_numbers_from_text(_UNSOLVED, text),
            tracked=_numbers_from_text(_TRACKED, text),
            length_s=seconds("length_s"),
            first_s=seconds("first_s"),
            others=others or {},
        )
    except (KeyError, ValueError, TypeError):
        return None


def stream_counts_from_text(text: Mapping[str, str]) -> StreamCounts | None:
    """The reverse of stream_counts_to_text; None if a number is missing or unreadable."""
    try:
        return StreamCounts(**_stream_counts(text))
    except (KeyError, ValueError, TypeError):
        return None


def _stream_counts(text: Mapping[str, str]) -> dict[str, Any]:
    always = {name: _number(text[name]) for name in _ALWAYS}
    some = {name: _number(text.get(name, "0")) for name in _SOMETIMES}
    dropped, standstills = _numbers_from_text(_DROPPED, text), _standstills_from_text(text.get("standstills", ""))
    return {**always, **some, "dropped": dropped, "standstills": standstills}


def _standstills_to_text(standstills: Sequence[Standstill]) -> dict[str, str]:
    def words(one: Standstill) -> str:
        return f"{float(one.from_s)!r} {float(one.to_s)!r} {float(one.seconds)!r} {int(one.lost)}"

    return {"standstills": "; ".join(map(words, standstills))} if standstills else {}


def _standstills_from_text(said: str) -> tuple[Standstill, ...]:
    """Raises ValueError and TypeError."""

    def standstill(from_s: str, to_s: str, long_s: str, lost: str) -> Standstill:
        one = Standstill(float(from_s), float(to_s), float(long_s), _number(lost))
        if not (-_LONGEST_S <= one.from_s <= one.to_s <= _LONGEST_S and 0.0 <= one.seconds <= _LONGEST_S):
            raise ValueError(one)
        return one

    parts = said.split("; ", _MOST_STANDSTILLS) if said else []
    return tuple(standstill(*part.split(" ")) for part in parts)


def _numbers_to_text(prefix: str, numbers: Mapping[str, int]) -> dict[str, str]:
    return {prefix + name: str(int(n)) for name, n in numbers.items()}


def _numbers_from_text(prefix: str, text: Mapping[str, str]) -> dict[str, int]:
    return {key.removeprefix(prefix): _number(n) for key, n in text.items() if key.startswith(prefix)}


def _number(digits: str) -> int:
    if not _COUNT.fullmatch(digits):
        raise ValueError(digits)
    return int(digits)


def library_versions() -> dict[str, str]:
    """Versions of this program and of what its numbers depend on, saved with every take."""
    versions = {"python": platform.python_version(), "platform": platform.platform()}
    for name in _LIBRARIES:
        try:
            versions[name] = version(name)
        except PackageNotFoundError:
            versions[name] = "not installed"
    return versions


def program_version() -> str:
    """Version of this program, as in messages about takes."""
    try:
        return version("phalanx")
    except PackageNotFoundError:
        return "(not installed)"
