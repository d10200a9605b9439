"""The streams of a take: how they are numbered when it is written, and each of them when it is read."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import get_args

from core.errors import TakeError
from core.frames import InertialFrame, MarkerFrame, Times
from core.streams import ClockSample, StreamInfo, What
from core.takes.codec import decode_clock, decode_inertial, decode_raw, inertial_stamp, raw_stamp
from core.takes.container import INFO, clock_topic, frames_topic, stream_counts_name, stream_name
from core.takes.index import Index
from core.takes.store import Frames, Store
from core.takes.stream_text import MOST_BONES, stream_from_text
from core.takes.take import MOST_STREAMS, SOLVED_STREAM, StreamCounts, stream_counts_from_text
from core.words import count

_WHATS: tuple[What, ...] = get_args(What)
_NUMBERS = re.compile("[0-9]{1,2}( [0-9]{1,2})*")


def numbered(streams: Sequence[StreamInfo], solving: str) -> dict[int, StreamInfo]:
    """Streams by their numbers in a take. solving: key of the one that is solved, "" for none. Raises TakeError."""
    by_key = {info.key: info for info in streams}
    if len(by_key) < len(streams) or "" in by_key:
        keys = ", ".join(repr(info.key) for info in streams)
        raise TakeError(f"The streams of a take need names that differ, and these are {keys}.", "Name them otherwise.")
    if len(by_key) > MOST_STREAMS - 1:
        raise TakeError(f"{len(by_key)} streams in a take.", f"It holds {MOST_STREAMS - 1} at most.")
    for info in streams:
        if len(info.bone_names) > MOST_BONES:
            raise TakeError(f"Stream {info.key} has {len(info.bone_names)} bones.", f"A take has {MOST_BONES} at most.")
    if not solving:
        return dict(enumerate(streams, SOLVED_STREAM + 1))
    solved = by_key.pop(solving, None)
    if solved is None or solved.what != "markers":
        optical = ", ".join(info.key for info in streams if info.what == "markers") or "none"
        raise TakeError(
            f"Stream {solving!r} cannot be solved: there is none of this name with markers.", f"There is {optical}."
        )
    return dict(enumerate((solved, *by_key.values()), SOLVED_STREAM))


Recorded = Frames[MarkerFrame] | Frames[InertialFrame]


def stamp_at(frames: Recorded, i: int) -> tuple[int, Times]:
    """The sequence number and the times of a frame, without the rest. Raises FormatError."""
    stamp = raw_stamp if frames.decode is decode_raw else inertial_stamp
    return stamp(frames.message(i)[1])


@dataclass(frozen=True)
class TakeStream:
    """One stream of an open take.

    number: in the file. info: what is true of all its frames; of a take made before streams, or from a file of another
    program, what that says of its device, and the key is "". frames, clock: as they were recorded, read when asked for.
    counts: None where the take has none. lost, lost_clock: frames and clock samples that are known to have been in the
    file and cannot be read.
    """

    number: int
    info: StreamInfo
    frames: Recorded
    clock: Frames[ClockSample]
    counts: StreamCounts | None
    lost: int = 0
    lost_clock: int = 0

    @property
    def solved(self) -> bool:
        """Whether it is the one that was solved."""
        return self.number == SOLVED_STREAM

    @property
    def frames_topic(self) -> str:
        """Where its frames are in the file."""
        return frames_topic(self.number, self.info.what)

    @property
    def topics(self) -> dict[str, Recorded | Frames[ClockSample]]:
        """Its frames and clock samples by their topics."""
        return {self.frames_topic: self.frames, clock_topic(self.number): self.clock}

    @property
    def lost_by_topic(self) -> dict[str, int]:
        """Frames and clock samples that are lost, by their topics."""
        return dict(zip(self.topics, (self.lost, self.lost_clock), strict=True))

    def damage(self, known: bool) -> Iterator[str]:
        """What the file lacks of it, in sentences; of the one that was solved, of its clock alone: the take says the
        rest. known: whether that the file is damaged is said already; then how many frames that cost is enough."""
        name = f"stream {self.info.key}"
        if not self.solved:
            if self.lost:
                yield f"{count(self.lost, 'frame')} of {name} cannot be read."
            stated = len(self.frames) if self.counts is None else self.counts.written
            if len(self.frames) > stated or (len(self.frames) < stated and not known):
                yield f"It should hold {count(stated, 'frame')} of {name} and holds {len(self.frames):,}."
        if self.lost_clock:
            yield f"{count(self.lost_clock, 'clock sample')} of {name} cannot be read."


def named_streams(index: Index, store: Store, start_ns: int) -> tuple[list[TakeStream], list[str]]:
    """The streams that a take names, or that there are records of, in the order of their numbers, no two of one key;
    and what is wrong with them, in sentences. That of /raw is among them only where the take names it."""
    streams: list[TakeStream] = []
    damage: list[str] = []
    for number in _numbers(index):
        stream, wrong = _stream(index, store, start_ns, number)
        while any(other.info.key == stream.info.key for other in streams):  # no writer does so
            stream = replace(stream, info=replace(stream.info, key=f"{stream.info.key} ({number})"))
        streams.append(stream)
        damage += [*wrong, *stream.damage(bool(index.damage))]
    return streams, damage


def _numbers(index: Index) -> list[int]:
    said = index.metadata.get(INFO, {}).get("streams", "")
    numbers = set(map(int, said.split(" "))) if _NUMBERS.fullmatch(said) else set()
    return [
        number
        for number in range(1, MOST_STREAMS + 1)
        if number in numbers
        or stream_name(number) in index.metadata
        or clock_topic(number) in index.topics
        or (number != SOLVED_STREAM and _held(index, number))
    ]


def _held(index: Index, number: int) -> list[What]:
    """Kinds of frames that there are of a stream: one, if it is right."""
    return [what for what in _possible(number) if frames_topic(number, what) in index.topics]


def _possible(number: int) -> tuple[What, ...]:
    return ("markers",) if number == SOLVED_STREAM else _WHATS


def _stream(index: Index, store: Store, start_ns: int, number: int) -> tuple[TakeStream, list[str]]:
    held, possible, damage = _held(index, number), _possible(number), []
    text = index.metadata.get(stream_name(number))
    info = stream_from_text(text or {}, (held or possible)[0], f"stream {number}")
    what = info.what if info.what in (held or possible) else (held or possible)[0]
    if text is None:
        damage.append(f"What it says of {info.key} cannot be read.")
    if what != info.what or len(held) > 1:
        damage.append(f"Stream {info.key} holds frames of another kind than it says.")
    topic, clock = frames_topic(number, what), clock_topic(number)
    places = index.columns(topic)
    counted = index.metadata.get(stream_counts_name(number))
    counts = None if counted is None else stream_counts_from_text(counted)
    if counted is not None and counts is None:
        damage.append(f"The counts of stream {info.key} cannot be read.")
    lost = index.lost[topic] if counts is None else max(counts.written - places.shape[1], 0)
    lost += sum(len(index.topics[frames_topic(number, one)]) for one in held if one != what)
    frames: Recorded
    if what == "markers":
        frames = Frames(store, places, start_ns, decode_raw)
    else:
        frames = Frames(store, places, start_ns, decode_inertial)
    samples = Frames(store, index.columns(clock), start_ns, decode_clock)
    return TakeStream(number, replace(info, what=what), frames, samples, counts, lost, index.lost[clock]), damage
