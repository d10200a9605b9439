"""Takes of several streams: two optical systems, of which one is solved, a glove, and the clocks of two of them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from itertools import islice
from pathlib import Path

from core.frames import InertialFrame, MarkerFrame, TrackedFrame
from core.profile import load_profile
from core.streams import ClockSample, Record
from core.takes.reader import Take
from core.takes.take import Mark, StreamCounts, TakeCounts, TakeInfo
from core.takes.writer import TakeWriter
from tests.core.takes.frames import GLOVE, OPTICAL, OTHER, bits, plain_bones, plain_frame, plain_sample, plain_solved

STREAMS = (GLOVE, OPTICAL, OTHER)
"""In the order in which they were connected."""

N_BONES, N_POINTS = 3, 4


def events(n: int) -> Iterator[tuple[str, Record | TrackedFrame]]:
    """What comes in a session of n frames of the one that is solved, by stream; solved frames by ""."""
    for i in range(n):
        if i % 2 == 0:
            yield GLOVE.key, plain_bones(i // 2, N_BONES)
        yield OPTICAL.key, plain_frame(i, N_POINTS)
        if i % 6 == 1:
            yield GLOVE.key, plain_sample(i // 6)
        yield "", replace(plain_solved(i), at_host_s=1000.25 + i / 120, of=((OPTICAL.key, i), (GLOVE.key, i // 2)))
        if i % 6 == 3:
            yield OPTICAL.key, plain_sample(i // 6)
        if i % 3 == 2:
            yield OTHER.key, replace(plain_frame(i // 3, 2, 40.0), timecode=f"00:00:00:{i // 3 % 40:02}")


@dataclass
class Written:
    """What a take should hold, in order: of one stream each, and solved."""

    frames: dict[str, list[MarkerFrame | InertialFrame]] = field(default_factory=dict)
    clock: dict[str, list[ClockSample]] = field(default_factory=dict)
    solved: list[TrackedFrame] = field(default_factory=list)

    def add(self, stream: str, record: Record | TrackedFrame) -> None:
        if isinstance(record, TrackedFrame):
            self.solved.append(record)
        elif isinstance(record, ClockSample):
            self.clock.setdefault(stream, []).append(record)
        else:
            self.frames.setdefault(stream, []).append(record)

    @property
    def bits(self) -> object:
        named = [(info.key, self.frames.get(info.key, []), self.clock.get(info.key, [])) for info in STREAMS]
        of = {key: bits((tuple(frames), tuple(clock))) for key, frames, clock in named}
        return of, bits(tuple(self.solved))

    @property
    def counts(self) -> TakeCounts:
        def of(key: str) -> StreamCounts:
            return StreamCounts(len(self.frames.get(key, [])), len(self.frames.get(key, [])))

        n, others = of(OPTICAL.key), {key: of(key) for key in (GLOVE.key, OTHER.key)}
        return TakeCounts(n.received, n.written, solved=len(self.solved), others=others)


def write(writer: TakeWriter, stream: str, record: Record | TrackedFrame) -> None:
    if isinstance(record, TrackedFrame):
        writer.solved(record)
    else:
        writer.raw(stream, record)


def begin(path: Path) -> TakeWriter:
    info = TakeInfo(path.stem, rate_hz=120, device={"kind": "natnet"})
    return TakeWriter(path, info, load_profile("schroeder6"), STREAMS, OPTICAL.key)


def record(path: Path, n: int, sealed: bool = False) -> tuple[Written, list[int]]:
    """Writes a take; what it holds, and the file's size before the first record and after each."""
    writer, written = begin(path), Written()
    sizes = [writer.bytes_written]
    for stream, one in events(n):
        write(writer, stream, one)
        written.add(stream, one)
        sizes.append(writer.bytes_written)
    writer.mark(Mark(0.1, "clap"))
    if sealed:
        writer.seal(written.counts)
    else:
        writer.close()
    return written, sizes


def held(take: Take) -> object:
    """What a take holds, to compare with Written.bits."""
    of = {key: bits((tuple(stream.frames), tuple(stream.clock))) for key, stream in take.streams.items()}
    return {info.key: of.pop(info.key) for info in STREAMS} | of, bits(tuple(take.solved))


def n_events(n: int) -> int:
    """How many come in a session of n frames."""
    return sum(1 for _ in events(n))


def first_of(k: int) -> Written:
    """The first k records of a session."""
    written = Written()
    for stream, one in islice(events(k), k):
        written.add(stream, one)
    return written


def n_records(take: Take) -> int:
    """How many records of streams, and poses, a take holds."""
    return sum(map(len, take.topics.values()))
