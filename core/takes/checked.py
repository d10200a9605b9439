"""A take read from end to end, so that whoever asks (`info`, `verify`, `recover`) says the same of it.

Opening a take believes the file's own index where its checksums are right. Here every record is looked at: what cannot
be read is left out of the take and said as its damage; what is there, but not as it should be, are its faults.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from core.errors import FormatError, PhalanxError
from core.frames import FloatArray, IntArray, MarkerFrame, TrackedFrame
from core.gaps import NO_GAPS, Gaps, gaps_of, present
from core.takes.codec import decode_solved, solved_record
from core.takes.container import RAW, SOLVED
from core.takes.index import Index, Progress
from core.takes.reader import Take
from core.takes.records import MESSAGE_HEAD
from core.takes.scan import missing_numbers
from core.takes.store import Frames
from core.takes.take import DAMAGED
from core.words import count


@dataclass(frozen=True)
class Stream:
    """All frames of a topic. numbers: (n,) int64 of their records. sequences, host_s: (k,) of those that can be read.
    unreadable: which of them cannot; first_error: why the first of these cannot. performers: of whom there are hands
    in them. points: in them. gaps: points that are none."""

    numbers: IntArray
    sequences: IntArray
    host_s: FloatArray
    unreadable: tuple[int, ...]
    first_error: str
    performers: int
    points: int
    gaps: Gaps


@dataclass(frozen=True)
class Checked:
    """A take, all of whose frames can be read, and what was read. take: in the place of the one that was opened."""

    take: Take
    raw: Stream
    solved: Stream

    @property
    def condition(self) -> str:
        """What it is, behind its name in a sentence: the same in every command."""
        take = self.take
        frames = len(take.raw) + len(take.solved)
        if not take.complete:
            return f"is damaged; {'`phalanx recover` saves what can be read' if frames else 'no frame can be read'}"
        if take.problems:
            return "can be read in full, but is not as it should be"
        if not take.sealed:
            return f"was never sealed; {'`phalanx recover` seals it' if frames else 'it holds no frame'}"
        if not take.verdict.whole:
            return "can be read in full, but is not all that there should be" if frames else "holds no frame"
        return "is whole"


def check(take: Take, progress: Progress | None = None) -> Checked:
    """Reads all of an open take. progress: told the share done, 0..1. Raises TakeError where the disk does not read,
    and whatever `progress` raises."""
    take = take.by_records(part(progress, 0.0, 0.2))
    raw = _read(take.raw, part(progress, 0.2, 0.6))
    solved = _read(take.solved, part(progress, 0.6, 1.0))
    if raw.unreadable or solved.unreadable:
        take = take.of_index(_left_out(take.index, {RAW: raw, SOLVED: solved}))
    take.faults = tuple(_faults(take, raw, solved))
    take.untimed = int((~np.isfinite(raw.host_s)).sum())
    if progress:
        progress(1.0)
    return Checked(take, raw, solved)


def _left_out(index: Index, streams: dict[str, Stream]) -> Index:
    """The index without the frames that cannot be read."""
    topics, lost, damage = dict(index.topics), dict(index.lost), list(index.damage)
    for topic, stream in streams.items():
        if n := len(stream.unreadable):
            topics[topic] = topics[topic].without(stream.unreadable)
            lost[topic] += n
            damage.append(f"{count(n, f'{topic[1:]} frame')} cannot be read: {stream.first_error}")
    return replace(index, topics=topics, lost=lost, damage=damage)


def _read(frames: Frames[MarkerFrame] | Frames[TrackedFrame], progress: Progress | None) -> Stream:
    # A solved record says what is asked of it without being made a frame, which takes thirty times as long.
    numbers, sequences, host_s, unreadable, errors = [], [], [], [], []
    performers = points = 0
    gaps = NO_GAPS
    for i in range(len(frames)):
        if progress and i % 256 == 0:
            progress(i / len(frames))
        try:
            head, data = frames.message(i)
            numbers.append(MESSAGE_HEAD.unpack(head)[1])
            frame: Any = solved_record(data) if frames.decode is decode_solved else frames.decode(data)
        except FormatError as error:
            unreadable.append(i)
            errors.append(error.what)
            continue
        if isinstance(frame, MarkerFrame):
            sequences.append(frame.sequence)
            host_s.append(frame.times.host_s)
            if not (kept := present(frame.points_m)).all():
                points += int(kept.sum())
                gaps += gaps_of(frame.points_m)
            else:
                points += len(kept)
        else:
            sequences.append(frame.sequence)
            host_s.append(frame.host_s)
            performers = max(performers, *(hand.performer + 1 for hand in frame.hands), 0)
    return Stream(
        np.array(numbers, dtype=np.int64), np.array(sequences, dtype=np.int64), np.array(host_s, dtype=np.float64),
        tuple(unreadable), errors[0] if errors else "", performers, points, gaps,
    )  # fmt: skip


def _faults(take: Take, raw: Stream, solved: Stream) -> Iterator[str]:
    """What recovering does not mend."""
    try:
        _ = take.profiles
    except PhalanxError as error:
        yield str(error)
    if solved.performers > (n := len(take.profiles_data)):
        yield f"It has hands of {count(solved.performers, 'performer')} and the profiles of {n}."
    for name, stream, lost in (("raw", raw, take.lost_raw), ("solved", solved, take.lost_solved)):
        missing = missing_numbers(stream.numbers)
        if missing > lost and not lost_before(take):
            yield (
                f"{count(missing, f'{name} record is', f'{name} records are')} missing from the file by their numbers."
            )
        if backwards := int((np.diff(stream.numbers) <= 0).sum()):
            yield (f"{count(backwards, f'{name} record is', f'{name} records are')} out of order by their numbers.")


def lost_before(take: Take) -> bool:
    """Whether a take was recovered from a damaged one, and says so."""
    return take.counts is not None and take.counts.dropped.get(DAMAGED, 0) > 0


def part(progress: Progress | None, begin: float, end: float) -> Progress | None:
    """The progress of a part of the work, from one share of it to another."""
    return None if progress is None else lambda share: progress(begin + (end - begin) * share)
