"""Reading a take: sealed, not sealed, cut short or damaged."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from functools import cached_property
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np

from core.cast import Cast
from core.errors import FormatError, TakeError
from core.frames import MarkerFrame, TrackedFrame
from core.profile import Profile
from core.streams import StreamInfo
from core.takes.codec import decode_clock, decode_mark, decode_raw, decode_solved
from core.takes.container import (
    COUNTS,
    DEVICE,
    FRAMES,
    INFO,
    LIBRARIES,
    MARK,
    RAW,
    SOLVED,
    TOPICS,
    clock_topic,
    profile_name,
)
from core.takes.hole_losses import with_losses
from core.takes.holes import Holes, holes_of
from core.takes.index import Index, Progress, WrongIndexError, check_magic, has_checksum, sealed_index, sound_ending
from core.takes.records import TakeFile
from core.takes.scan import scan
from core.takes.store import Frames, Store
from core.takes.streams import TakeStream, named_streams
from core.takes.take import (
    MOST_PERFORMERS,
    SOLVED_STREAM,
    Mark,
    TakeCounts,
    TakeInfo,
    counts_from_text,
    info_from_text,
    performers_from_text,
)
from core.takes.verdict import Account, Verdict, frames_verdict, verdict_of
from core.words import count


class Take:
    """A take on disk, open for reading. Its frames are read when asked for, from any thread.

    counts: None if the take was never sealed. sealed: its recording was ended properly.
    damage: what is wrong with the file, in sentences; () if nothing. faults: what is not as it should be though every
    record is there, in sentences: known only after core.takes.checked has read all of it.
    untimed: frames of each stream of which nothing tells when they were taken, as its recorder counted them, or
    core.takes.checked has.
    lost_raw, lost_solved, lost_marks: frames and marks that are known to have been in the file and cannot be read.
    libraries: versions of the programs that recorded it.
    profiles_data: the text of each performer's profile, None where that part of the file is damaged.
    streams: what devices sent, by the streams' keys: the one that was solved first, if any was, then as connected.
    raw: the frames of that one. topics: frames and clock samples of all, and solved frames, by topic. start_ns: MCAP
    time from which times count.
    """

    def __init__(self, file: TakeFile, index: Index) -> None:
        """Use open_take."""
        self.path = file.path
        self.sealed = index.sealed
        self.index = index
        self.faults: tuple[str, ...] = ()
        self.libraries: Mapping[str, str] = index.metadata.get(LIBRARIES, {})
        self.counts: TakeCounts | None = counts_from_text(index.metadata.get(COUNTS, {}))
        profiles = [index.attachments.get(profile_name(performer)) for performer in range(MOST_PERFORMERS)]
        found = max((i + 1 for i, data in enumerate(profiles) if data is not None), default=1)
        self.profiles_data = tuple(profiles[: max(found, performers_from_text(index.metadata.get(INFO, {})))])
        self._file = file
        self.info: TakeInfo = info_from_text(
            index.metadata.get(INFO, {}), index.metadata.get(DEVICE, {}), self.path.stem, self._modified()
        )
        store = Store(file, index.chunks)
        self.start_ns = start_ns = _start_ns(index)
        raw, solved, marks = (index.columns(topic) for topic in (RAW, SOLVED, MARK))
        self.raw: Frames[MarkerFrame] = Frames(store, raw, start_ns, decode_raw)
        self.solved: Frames[TrackedFrame] = Frames(store, solved, start_ns, decode_solved)
        named, streams_damage = named_streams(index, store, start_ns)
        if self.counts is not None:
            others = {one.info.key: one.counts for one in named if one.counts is not None and not one.solved}
            self.counts = replace(self.counts, others=others)
        self.lost_raw, self.lost_solved = index.lost[RAW], index.lost[SOLVED]
        self.marks, self.mark_records, marks_damage = _readable(Frames(store, marks, start_ns, decode_mark))
        self.lost_marks = index.lost[MARK] + len(marks.T) - len(self.marks)
        self.damage = (*index.damage, *marks_damage, *self._miscounted(), *streams_damage)
        if self.damage and self.counts:
            self.lost_raw = max(self.counts.written - len(self.raw), 0)
            self.lost_solved = max(self.counts.solved - len(self.solved), 0)
        self.streams: dict[str, TakeStream] = {one.info.key: one for one in self._streams(named, store)}
        counted = ((key, stream.counts) for key, stream in self.streams.items())
        self.untimed: Mapping[str, int] = {key: 0 if of is None else of.untimed for key, of in counted}
        self.topics: dict[str, Frames[Any]] = {RAW: self.raw, SOLVED: self.solved}
        for stream in self.streams.values():
            self.topics |= stream.topics

    def _streams(self, named: Sequence[TakeStream], store: Store) -> Iterator[TakeStream]:
        """Those that are named, with what the take says of the one that was solved; where none is, that of its
        device."""
        device, others = self.info.device, [one for one in named if not one.solved]
        if len(others) < len(named):
            yield replace(named[0], frames=self.raw, counts=self.counts, lost=self.lost_raw)
        elif self.raw or not named:
            info = StreamInfo(
                "", device.get("kind", ""), device.get("title", ""), "markers", self.info.rate_hz, "sight", "residual"
            )
            clock = Frames(store, self.index.columns(clock_topic(SOLVED_STREAM)), 0, decode_clock)
            yield TakeStream(SOLVED_STREAM, info, self.raw, clock, self.counts, self.lost_raw)
        yield from others

    @property
    def solving(self) -> str:
        """Key of the stream that was solved, "" also where it has no name, or where none was."""
        return next((key for key, stream in self.streams.items() if stream.solved), "")

    @property
    def numbers(self) -> dict[int, StreamInfo]:
        """The streams that it names, by their numbers in the file."""
        return {stream.number: stream.info for key, stream in self.streams.items() if key}

    @property
    def n_frames(self) -> int:
        """All frames of it that can be read, raw and solved, of all streams."""
        return len(self.solved) + sum(len(stream.frames) for stream in self.streams.values())

    @property
    def lost(self) -> dict[str, int]:
        """Records of each of its topics that are known to have been in the file and cannot be read."""
        lost = {RAW: self.lost_raw, SOLVED: self.lost_solved}
        for stream in self.streams.values():
            lost |= stream.lost_by_topic
        return lost

    def words_for(self, topic: str) -> str:
        """What its records are called: 'raw', 'solved', by the key of their stream."""
        beside = ((key, stream) for key, stream in self.streams.items() if topic != RAW and topic in stream.topics)
        return next((f"{key} clock" if topic.endswith("/clock") else key for key, stream in beside), topic[1:])

    @property
    def n_beside(self) -> int:
        """Frames of other streams, and clock samples, that can be read."""
        streams = self.streams.values()
        return sum(len(one.clock) + (0 if one.solved else len(one.frames)) for one in streams)

    @property
    def lost_beside(self) -> int:
        """Frames of other streams, and clock samples, that are known to have been in the file and cannot be read."""
        streams = self.streams.values()
        return sum(one.lost_clock + (0 if one.solved else one.lost) for one in streams)

    def _miscounted(self) -> Iterator[str]:
        """Where what was sealed is not what is there."""
        if self.counts is None:
            if COUNTS in self.index.metadata:
                yield "Its counts cannot be read."
            return
        known = bool(self.index.damage)  # then `account.unreadable` says how many it took
        stated = (("raw", self.counts.written, len(self.raw)), ("solved", self.counts.solved, len(self.solved)))
        for name, stated_n, found in stated:
            if found > stated_n or (found < stated_n and not known):
                yield f"It should hold {stated_n:,} {name} frames and holds {found:,}."

    def of_index(self, index: Index) -> Take:
        """The same open file by another index; this one must not be used any more, and either closes both."""
        return Take(self._file, index)

    def by_records(self, progress: Progress | None = None) -> Take:
        """The same open file by its records, where its own index does not lead to every one of them, and to nothing
        else; otherwise this take."""
        if not self.index.stated:
            return self
        found = scan(self._file, progress)
        found.damage += [
            f"The index of {topic} does not agree with its records."
            for topic in TOPICS
            if (topic in self.index.topics or topic in found.topics)
            and not np.array_equal(self.index.columns(topic), found.columns(topic))
        ]
        return self.of_index(found) if found.damage else self

    @property
    def profile(self) -> Profile:
        """Performer and glove, as recorded; the first of several. Raises as `profiles`."""
        return self._profile(0)

    @property
    def profiles(self) -> Cast:
        """Every performer, in the order in which solved hands number them. Raises TakeError or FormatError if one is
        damaged."""
        return tuple(self._profile(performer) for performer in range(len(self.profiles_data)))

    def _profile(self, performer: int) -> Profile:
        data = self.profiles_data[performer]
        which = f" of performer {performer + 1}" if len(self.profiles_data) > 1 else ""
        what, action = f"The profile{which} saved in take {self.path}", "Choose a profile for it yourself."
        if data is None:
            raise TakeError(f"{what} is damaged.", action)
        try:
            text = data.decode()
        except UnicodeDecodeError as error:
            raise TakeError(f"{what} is not text.", action) from error
        return Profile.from_json(text, what)

    @property
    def span_s(self) -> tuple[float, float]:
        """When recording began and ended [s], in the time of the frames: as its recorder said, else by the frames: of
        the stream that was solved, or where none was of all."""
        counts, all_frames = self.counts, [one.frames for one in self.streams.values()]
        ends_s = [float(one.times_s[-1]) for one in ([self.raw] if self.raw else all_frames) if one]
        if counts is None or counts.length_s is None:
            return 0.0, max(ends_s, default=0.0)
        begin_s = -(counts.first_s or 0.0)
        return begin_s, max([begin_s + counts.length_s, *ends_s])

    @property
    def duration_s(self) -> float:
        """How long it was recorded, with or without frames [s]."""
        begin_s, end_s = self.span_s
        return end_s - begin_s

    @property
    def holes(self) -> Holes:
        """Where it holds no frames of the stream that was solved, or else of the first, in the time of the frames."""
        return next(iter(self._holes.values()))

    def holes_in(self, stream: str) -> Holes:
        """Where one of its streams holds no frames, in the same time."""
        return self._holes[stream]

    @cached_property
    def _holes(self) -> dict[str, Holes]:
        known = self.counts is not None and self.counts.length_s is not None
        span_s, found = self.span_s if known else (), {}
        for key, stream in self.streams.items():
            rate_hz = self.info.rate_hz if stream.solved else stream.info.rate_hz
            holes = holes_of(stream.frames.times_s, rate_hz, *span_s)
            if known:  # frames of a file that is played late may be of before
                holes = holes.within(*self.span_s)
            owned = holes.owned(stream.counts.standstills if stream.counts is not None else ())
            found[key] = with_losses(owned, stream.frames, stream.counts, stream.lost)
        return found

    @property
    def account(self) -> Account:
        """What the verdict rests on."""
        beside = {key: self._account_of(stream) for key, stream in self.streams.items() if not stream.solved}
        return Account(
            len(self.raw), len(self.solved), self.counts, self.holes, self.duration_s, self.sealed, self.damage,
            self.lost_raw, self.lost_solved, faults=self.faults, untimed=self.untimed.get(self.solving, 0),
            solves=len(beside) < len(self.streams), beside=beside,
        )  # fmt: skip

    def _account_of(self, stream: TakeStream) -> Account:
        n, of = len(stream.frames), stream.counts
        counts = None
        if of is not None:
            counts = TakeCounts(of.received, of.written, of.dropped, of.lost, of.rejected, standstills=of.standstills)
        key = stream.info.key
        return Account(
            n, n, counts, self.holes_in(key), self.duration_s, self.sealed,
            lost_raw=stream.lost, untimed=self.untimed[key],
        )  # fmt: skip

    @property
    def verdict(self) -> Verdict:
        """What is to be thought of it."""
        return verdict_of(self.account)

    def verdict_in(self, stream: str) -> Verdict:
        """What is to be thought of the frames of one of its streams."""
        account = self.account
        return frames_verdict(account.beside.get(stream, account))

    @property
    def problems(self) -> tuple[str, ...]:
        """All that makes it other than it should be, in sentences."""
        balance = "" if self.counts is None else self.counts.imbalance
        others = (
            f"Stream {key}: {one.counts.imbalance}"
            for key, one in self.streams.items()
            if not one.solved and one.counts is not None and one.counts.imbalance
        )
        return (*self.damage, *filter(None, (self.account.unreadable, *self.faults, balance)), *others)

    @property
    def complete(self) -> bool:
        """Whether nothing is known to be missing or damaged."""
        return not self.damage and not self.lost_raw and not self.lost_solved

    def fileno(self) -> int:
        """The file's descriptor, for a lock."""
        return self._file.fileno()

    def close(self) -> None:
        """Ends reading; frames cannot be asked for any more."""
        self._file.close()

    def __enter__(self) -> Take:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _modified(self) -> datetime:
        return datetime.fromtimestamp(self._file.modified_s, UTC)


def open_take(path: Path | str, progress: Progress | None = None, check: bool = True) -> Take:
    """Opens a take of any state. progress is told the share done, 0 to 1. check: False does not read a sealed take
    through, for lists of many takes; damage is then found when a frame is read, as an error.

    Raises FormatError for a file that is no take, or a take of a newer version; TakeError for one that cannot be
    read or holds nothing.
    """
    file = TakeFile(Path(path))
    try:
        index = _index_of(file, progress, check)
        if INFO not in index.metadata and not any(len(places) for places in index.topics.values()):
            if not index.library:
                raise FormatError(
                    f"{file.path} is not a take: it ends or is damaged at its beginning.", "Choose another take."
                )
            raise TakeError(
                f"Take {file.path} ends before its first frame ({file.size} bytes).",
                "There is nothing in it to recover.",
            )
        take = Take(file, index)
        if take.lost_marks:  # which is to be laid to the file, or to its index
            take = take.by_records(progress)
    except BaseException:
        file.close()
        raise
    if progress:
        progress(1.0)
    return take


def _index_of(file: TakeFile, progress: Progress | None, check: bool) -> Index:
    """Its own index where that can be believed, else what its records say. Raises FormatError and TakeError."""
    check_magic(file)
    end, wrong = sound_ending(file, progress, check), False
    try:
        if end is not None and (index := sealed_index(file, end)) is not None:
            return index
    except WrongIndexError:
        wrong = True
    index = scan(file, progress)
    if not index.damage and wrong:
        index.damage.append("Its index does not lead to its records, though every one is readable.")
    elif not index.damage and end is None and has_checksum(file):
        index.damage.append("The file has changed since it was sealed, though every record is readable.")
    return index


def _start_ns(index: Index) -> int:
    """MCAP time from which times count: of the first raw frame, else of the first solved one, else of any stream's."""
    for topic in (RAW, SOLVED):
        if places := index.topics.get(topic):
            return places.log_ns[0]
    first = [places.columns()[:, 0].tolist() for topic, places in index.topics.items() if topic in FRAMES and places]
    return int(min(first, default=[0, 0, 0])[2])


def _readable(frames: Frames[Mark]) -> tuple[tuple[Mark, ...], Frames[Mark], list[str]]:
    """Marks that can be read, their records, and what is wrong with the others: one of them costs no take."""
    marks, bad, why = [], [], ""
    for i in range(len(frames)):
        try:
            marks.append(frames[i])
        except FormatError as error:
            bad.append(i)
            why = why or error.what
    damage = [f"{count(len(bad), 'mark')} cannot be read: {why}"] if bad else []
    return tuple(marks), frames.without(bad), damage
