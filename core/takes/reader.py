"""Reading a take: sealed, not sealed, cut short or damaged."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from datetime import UTC, datetime
from functools import cached_property
from pathlib import Path
from types import TracebackType

import numpy as np

from core.cast import Cast
from core.errors import FormatError, TakeError
from core.frames import MarkerFrame, TrackedFrame
from core.profile import Profile
from core.takes.codec import decode_mark, decode_raw, decode_solved
from core.takes.container import COUNTS, DEVICE, INFO, LIBRARIES, MARK, RAW, SOLVED, TOPICS, profile_name
from core.takes.holes import Holes, holes_of
from core.takes.index import Index, Progress, WrongIndexError, check_magic, has_checksum, sealed_index, sound_ending
from core.takes.records import TakeFile
from core.takes.scan import scan
from core.takes.store import Frames, Store
from core.takes.take import (
    MOST_PERFORMERS,
    Mark,
    TakeCounts,
    TakeInfo,
    counts_from_text,
    info_from_text,
    performers_from_text,
)
from core.takes.verdict import Account, Verdict, verdict_of
from core.words import count


class Take:
    """A take on disk, open for reading. Its frames are read when asked for, from any thread.

    counts: None if the take was never sealed. sealed: its recording was ended properly.
    damage: what is wrong with the file, in sentences; () if nothing. faults: what is not as it should be though every
    record is there, in sentences: known only after core.takes.checked has read all of it.
    untimed: frames of which nothing tells when they were taken, as its recorder counted them, or
    core.takes.checked has.
    lost_raw, lost_solved, lost_marks: frames and marks that are known to have been in the file and cannot be read.
    libraries: versions of the programs that recorded it.
    profiles_data: the text of each performer's profile, None where that part of the file is damaged.
    """

    def __init__(self, file: TakeFile, index: Index) -> None:
        """Use open_take."""
        self.path = file.path
        self.sealed = index.sealed
        self.index = index
        self.faults: tuple[str, ...] = ()
        self.libraries: Mapping[str, str] = index.metadata.get(LIBRARIES, {})
        self.counts: TakeCounts | None = counts_from_text(index.metadata.get(COUNTS, {}))
        self.untimed = 0 if self.counts is None else self.counts.untimed
        profiles = [index.attachments.get(profile_name(performer)) for performer in range(MOST_PERFORMERS)]
        found = max((i + 1 for i, data in enumerate(profiles) if data is not None), default=1)
        self.profiles_data = tuple(profiles[: max(found, performers_from_text(index.metadata.get(INFO, {})))])
        self._file = file
        self.info: TakeInfo = info_from_text(
            index.metadata.get(INFO, {}), index.metadata.get(DEVICE, {}), self.path.stem, self._modified()
        )
        store = Store(file, index.chunks)
        raw, solved, marks = (index.topics[topic].columns() for topic in (RAW, SOLVED, MARK))
        first = raw if raw.size else solved
        start_ns = int(first[2, 0]) if first.size else 0
        self.raw: Frames[MarkerFrame] = Frames(store, raw, start_ns, decode_raw)
        self.solved: Frames[TrackedFrame] = Frames(store, solved, start_ns, decode_solved)
        self.lost_raw, self.lost_solved = index.lost[RAW], index.lost[SOLVED]
        self.marks, self.mark_records, marks_damage = _readable(Frames(store, marks, start_ns, decode_mark))
        self.lost_marks = index.lost[MARK] + len(marks.T) - len(self.marks)
        self.damage = (*index.damage, *marks_damage, *self._miscounted())
        if self.damage and self.counts:
            self.lost_raw = max(self.counts.written - len(self.raw), 0)
            self.lost_solved = max(self.counts.solved - len(self.solved), 0)

    def _miscounted(self) -> Iterator[str]:
        """Where what was sealed is not what is there."""
        if self.counts is None:
            if COUNTS in self.index.metadata:
                yield "Its counts cannot be read."
            return
        stated = (("raw", self.counts.written, len(self.raw)), ("solved", self.counts.solved, len(self.solved)))
        for name, stated_n, found in stated:
            if stated_n != found:
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
            if not np.array_equal(self.index.topics[topic].columns(), found.topics[topic].columns())
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
        """When recording began and ended [s], in the time of the frames: as its recorder said, else by the frames."""
        counts, frames_end_s = self.counts, float(self.raw.times_s[-1]) if len(self.raw) else 0.0
        if counts is None or counts.length_s is None:
            return 0.0, frames_end_s
        begin_s = -(counts.first_s or 0.0)
        return begin_s, max(begin_s + counts.length_s, frames_end_s) if len(self.raw) else begin_s + counts.length_s

    @property
    def duration_s(self) -> float:
        """How long it was recorded, with or without frames [s]."""
        begin_s, end_s = self.span_s
        return end_s - begin_s

    @cached_property
    def holes(self) -> Holes:
        """Where it holds no frames, in the time of the frames."""
        known = self.counts is not None and self.counts.length_s is not None
        found = holes_of(self.raw.times_s, self.info.rate_hz, *(self.span_s if known else ()))
        return found.owned(self.counts.standstills if self.counts is not None else ())

    @property
    def account(self) -> Account:
        """What the verdict rests on."""
        return Account(
            len(self.raw), len(self.solved), self.counts, self.holes, self.duration_s, self.sealed, self.damage,
            self.lost_raw, self.lost_solved, faults=self.faults, untimed=self.untimed,
        )  # fmt: skip

    @property
    def verdict(self) -> Verdict:
        """What is to be thought of it."""
        return verdict_of(self.account)

    @property
    def problems(self) -> tuple[str, ...]:
        """All that makes it other than it should be, in sentences."""
        balance = "" if self.counts is None else self.counts.imbalance
        return (*self.damage, *filter(None, (self.account.unreadable, *self.faults, balance)))

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
