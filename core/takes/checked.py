"""A take read from end to end, so that whoever asks (`info`, `verify`, `recover`) says the same of it.

Opening a take believes the file's own index where its checksums are right. Here every record is looked at: what cannot
be read is left out of the take and said as its damage; what is there, but not as it should be, are its faults.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from core.errors import FormatError, PhalanxError
from core.frames import FloatArray, InertialFrame, IntArray, MarkerFrame
from core.gaps import NO_GAPS, Gaps, gaps_of, present
from core.streams import ClockSample
from core.takes.codec import decode_solved, solved_record
from core.takes.container import FRAMES, RAW, SOLVED
from core.takes.index import Index, Progress
from core.takes.reader import Take
from core.takes.records import MESSAGE_HEAD
from core.takes.scan import mended_numbers, missing_numbers
from core.takes.store import Frames
from core.takes.take import DAMAGED
from core.words import count


@dataclass(frozen=True)
class Stream:
    """All records of a topic. numbers: (n,) int64 of them. sequences, host_s: (k,) of those that can be read; clock
    samples have no sequences. unreadable: which of them cannot; first_error: why the first of these cannot. performers:
    of whom there are hands in them. points: in them. gaps: points that are none."""

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
    """A take, all of whose frames can be read, and what was read, by topic. take: in the place of the one that was
    opened."""

    take: Take
    topics: Mapping[str, Stream]

    @property
    def raw(self) -> Stream:
        """Frames of the stream that was solved."""
        return self.topics[RAW]

    @property
    def solved(self) -> Stream:
        """What the engine made of them."""
        return self.topics[SOLVED]

    @property
    def condition(self) -> str:
        """What it is, behind its name in a sentence: the same in every command."""
        take = self.take
        frames = take.n_frames
        if not take.complete:
            return f"is damaged; {'`phalanx recover` saves what can be read' if frames else 'no frame can be read'}"
        if take.problems:
            return "can be read in full, but is not as it should be"
        if not take.sealed:
            return f"is not sealed; {'`phalanx recover` seals it' if frames else 'it holds no frame'}"
        if not take.verdict.whole:
            return "can be read in full, but is not all that there should be" if frames else "holds no frame"
        return "is whole"


def check(take: Take, progress: Progress | None = None) -> Checked:
    """Reads all of an open take. progress: told the share done, 0..1. Raises TakeError where the disk does not read,
    and whatever `progress` raises."""
    take = take.by_records(part(progress, 0.0, 0.2))
    topics, total, done = {}, max(sum(map(len, take.topics.values())), 1), 0
    for topic, frames in take.topics.items():
        begin, done = done, done + len(frames)
        topics[topic] = _read(frames, part(progress, 0.2 + 0.8 * begin / total, 0.2 + 0.8 * done / total))
    if any(stream.unreadable for stream in topics.values()):
        take = take.of_index(_left_out(take, topics))
    take.faults = tuple(_faults(take, topics))
    take.untimed = {
        key: int((~np.isfinite(topics[stream.frames_topic].host_s)).sum()) for key, stream in take.streams.items()
    }
    if progress:
        progress(1.0)
    return Checked(take, topics)


def _left_out(take: Take, streams: Mapping[str, Stream]) -> Index:
    """Its index without the frames that cannot be read."""
    index = take.index
    topics, lost, damage = dict(index.topics), Counter(index.lost), list(index.damage)
    for topic, stream in streams.items():
        if n := len(stream.unreadable):
            topics[topic] = topics[topic].without(stream.unreadable)
            lost[topic] += n
            damage.append(f"{count(n, f'{take.words_for(topic)} frame')} cannot be read: {stream.first_error}")
    return replace(index, topics=topics, lost=lost, damage=damage)


def _read(frames: Frames[Any], progress: Progress | None) -> Stream:
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
        elif isinstance(frame, InertialFrame):
            sequences.append(frame.sequence)
            host_s.append(frame.times.host_s)
        elif isinstance(frame, ClockSample):
            host_s.append(frame.host_s)
        else:
            sequences.append(frame.sequence)
            host_s.append(frame.host_s)
            performers = max(performers, *(hand.performer + 1 for hand in frame.hands), 0)
    return Stream(
        np.array(numbers, dtype=np.int64), np.array(sequences, dtype=np.int64), np.array(host_s, dtype=np.float64),
        tuple(unreadable), errors[0] if errors else "", performers, points, gaps,
    )  # fmt: skip


def _faults(take: Take, topics: Mapping[str, Stream]) -> Iterator[str]:
    """What recovering does not mend."""
    try:
        _ = take.profiles
    except PhalanxError as error:
        yield str(error)
    if (performers := topics[SOLVED].performers) > (n := len(take.profiles_data)):
        yield f"It has hands of {count(performers, 'performer')} and the profiles of {n}."
    counted = {stream.frames_topic for stream in take.streams.values() if stream.counts is not None}
    counted |= {SOLVED} if take.counts is not None else set()
    before = lost_before(take)
    for topic, stream in topics.items():
        name, lost = take.words_for(topic), take.lost.get(topic, 0)
        missing = missing_numbers(stream.numbers)
        # Where the counts tell how many are lost, numbers that tell of more are damaged themselves.
        told = topic in counted and lost > 0
        told_before = topic in before if topic in FRAMES else bool(before)
        if missing > lost and not told and not told_before:
            yield (
                f"{count(missing, f'{name} record is', f'{name} records are')} missing from the file by their numbers."
            )
        mended = mended_numbers(stream.numbers)
        if wrong := int((mended != stream.numbers).sum()):
            yield f"{count(wrong, f'{name} record has', f'{name} records have')} a damaged number."
        if backwards := int((np.diff(mended) <= 0).sum()):
            yield (f"{count(backwards, f'{name} record is', f'{name} records are')} out of order by their numbers.")


def lost_before(take: Take) -> dict[str, int]:
    """Frames that a take says were lost to damage before it was sealed, of the streams that lost some, by their
    topics."""
    counts = {stream.frames_topic: stream.counts for stream in take.streams.values()}
    return {topic: n for topic, of in counts.items() if of is not None and (n := of.dropped.get(DAMAGED, 0))}


def part(progress: Progress | None, begin: float, end: float) -> Progress | None:
    """The progress of a part of the work, from one share of it to another."""
    return None if progress is None else lambda share: progress(begin + (end - begin) * share)
