"""Is a take what it should be? Every record is read, every count compared."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from core.errors import PhalanxError
from core.frames import FloatArray, IntArray, MarkerFrame, TrackedFrame
from core.gaps import NO_GAPS, Gaps, gaps_of, present
from core.takes.formats.take import gap_warnings
from core.takes.index import Progress, check_magic, sealed_index
from core.takes.rate import rate_warning
from core.takes.reader import Take, open_take
from core.takes.records import MESSAGE_HEAD, TakeFile
from core.takes.recover import DAMAGED
from core.takes.scan import scan
from core.takes.seal import device_gaps
from core.takes.store import Frames
from core.takes.take import TakeCounts
from core.words import count


@dataclass(frozen=True)
class Finding:
    """One thing worth knowing. problem: the take is not what it should be; warning: look; note: as it may be."""

    level: Literal["problem", "warning", "note"]
    text: str


@dataclass(frozen=True)
class Report:
    """What was found in a take. raw, solved, marks: records of each kind that are readable. points: in all raw frames.
    gaps: points of theirs that are none."""

    path: Path
    sealed: bool
    raw: int
    solved: int
    marks: int
    counts: TakeCounts | None
    points: int
    gaps: Gaps
    findings: tuple[Finding, ...]

    @property
    def ok(self) -> bool:
        """Whether there is no problem; warnings and notes may be."""
        return all(finding.level != "problem" for finding in self.findings)


def verify(path: Path | str, progress: Progress | None = None) -> Report:
    """Reads a take from end to end. Raises FormatError for what is no take, TakeError for one that cannot be read."""
    with open_take(path) as take:
        raw = read_stream(take.raw, _part(progress, 0.0, 0.2))
        findings = tuple(_findings(take, raw, _part(progress, 0.2, 1.0)))
        if progress:
            progress(1.0)
        return Report(
            take.path, take.sealed, len(take.raw), len(take.solved), len(take.marks), take.counts, raw.points,
            raw.gaps, findings,
        )  # fmt: skip


def _findings(take: Take, raw: Stream, progress: Progress | None) -> Iterator[Finding]:
    for text in take.damage:
        yield Finding("problem", text)
    if not take.sealed:
        yield Finding("warning", "Not sealed: it was not stopped properly, or is being recorded. Recover it.")
    yield from _index_findings(take, _part(progress, 0.0, 0.3))
    try:
        _ = take.profiles
    except PhalanxError as error:
        yield Finding("problem", str(error))
    solved = read_stream(take.solved, _part(progress, 0.3, 1.0))
    damaged = take.counts is not None and take.counts.dropped.get(DAMAGED, 0) > 0
    yield from _stream_findings("raw", raw, damaged)
    yield from _stream_findings("solved", solved, damaged)
    if solved.performers > (n := len(take.profiles_data)):
        yield Finding("problem", f"It has hands of {count(solved.performers, 'performer')} and the profiles of {n}.")
    yield from _count_findings(take, raw.sequences)
    if len(take.holes):
        yield Finding("warning", f"{take.holes.words}: nothing came then.")
    yield from _device_findings(raw)
    for text in raw_warnings(raw, take.info.rate_hz):
        yield Finding("warning", text)
    if strangers := int((~np.isin(solved.sequences, raw.sequences)).sum()):
        yield Finding("warning", f"{count(strangers, 'solved frame has', 'solved frames have')} no raw frame.")
    if (unsolved := len(take.raw) - len(take.solved)) > 0:
        yield Finding("note", f"{count(unsolved, 'raw frame was', 'raw frames were')} not solved while recording.")


@dataclass(frozen=True)
class Stream:
    """All frames of a topic. numbers: (n,) of their records. sequences, host_s: (k,) of those that can be read.
    performers: of whom there are hands in them. points: in them. gaps: points that are none."""

    numbers: IntArray
    sequences: IntArray
    host_s: FloatArray
    unreadable: int
    first_error: str
    performers: int
    points: int
    gaps: Gaps


def read_stream(frames: Frames[MarkerFrame] | Frames[TrackedFrame], progress: Progress | None) -> Stream:
    """Reads all of them; what cannot be read is counted and passed over. progress: told the share done, 0..1."""
    numbers, sequences, host_s, errors = [-1], [], [], []
    performers = points = 0
    gaps = NO_GAPS
    for i in range(len(frames)):
        if progress and i % 256 == 0:
            progress(i / len(frames))
        try:
            head, data = frames.message(i)
            numbers.append(MESSAGE_HEAD.unpack(head)[1])
            frame = frames.decode(data)
        except PhalanxError as error:
            errors.append(str(error))
            continue
        sequences.append(frame.sequence)
        host_s.append(frame.times.host_s)
        if isinstance(frame, TrackedFrame):
            performers = max(performers, *(hand.performer + 1 for hand in frame.hands), 0)
        elif not (kept := present(frame.points_m)).all():
            points += int(kept.sum())
            gaps += gaps_of(frame.points_m)
        else:
            points += len(kept)
    return Stream(
        np.array(numbers, dtype=np.int64),
        np.array(sequences, dtype=np.int64),
        np.array(host_s, dtype=np.float64),
        len(errors),
        errors[0] if errors else "",
        performers,
        points,
        gaps,
    )


def raw_warnings(raw: Stream, rate_hz: float) -> tuple[str, ...]:
    """What there is to warn of in the times and the points of raw frames. rate_hz: as stated, NaN if unknown."""
    rate = rate_warning(raw.sequences, raw.host_s, rate_hz)
    return (*([rate] if rate else ()), *gap_warnings(raw.gaps, raw.points))


def _index_findings(take: Take, progress: Progress | None) -> Iterator[Finding]:
    """Whether the index of a sealed take leads to every record, and to nothing else."""
    file = TakeFile(take.path)
    try:
        check_magic(file)
        index = sealed_index(file)
        if index is None:
            return
        found = scan(file, progress)
        for text in found.damage:
            yield Finding("problem", text)
        for topic in index.topics:
            if not np.array_equal(index.topics[topic].columns(), found.topics[topic].columns()):
                yield Finding("problem", f"The index of {topic} does not agree with its records.")
    finally:
        file.close()


def _stream_findings(name: str, stream: Stream, damaged: bool) -> Iterator[Finding]:
    """damaged: the take was recovered from a damaged one and says so."""
    if stream.unreadable:
        yield Finding("problem", f"{count(stream.unreadable, f'{name} frame')} cannot be read: {stream.first_error}")
    steps = np.diff(stream.numbers)
    missing = int((steps[steps > 1] - 1).sum())
    if missing and not damaged:
        are = count(missing, f"{name} record is", f"{name} records are")
        yield Finding("problem", f"{are} missing from the file by their numbers.")
    elif missing:
        were = count(missing, f"{name} record was", f"{name} records were")
        yield Finding("note", f"{were} lost to damage before this take was recovered.")
    if backwards := int((steps <= 0).sum()):
        yield Finding(
            "problem", f"{count(backwards, f'{name} record is', f'{name} records are')} out of order by their numbers."
        )


def _count_findings(take: Take, sequences: IntArray) -> Iterator[Finding]:
    counts = take.counts
    if counts is None:
        if take.sealed:
            yield Finding("problem", "Its counts are missing or cannot be read.")
        return
    if not counts.balanced:
        yield Finding(
            "problem",
            f"Its counts do not balance: received {counts.received}, written {counts.written}, "
            f"dropped {counts.dropped_total}.",
        )
    for name, stated, found in (("raw", counts.written, len(take.raw)), ("solved", counts.solved, len(take.solved))):
        if stated != found:
            yield Finding("problem", f"It should hold {stated} {name} frames and holds {found}.")
    if counts.dropped_total:
        reasons = ", ".join(f"{n} {reason}" for reason, n in counts.dropped.items() if n)
        yield Finding(
            "warning", f"{count(counts.dropped_total, 'frame was', 'frames were')} dropped while recording: {reasons}."
        )
    if counts.lost:
        yield Finding("warning", f"{count(counts.lost, 'frame')} of the device never arrived.")
    if counts.rejected:
        yield Finding("warning", f"{count(counts.rejected, 'packet')} could not be read.")
    gaps, known = device_gaps(sequences), counts.lost + counts.dropped_total
    if gaps > known:
        yield Finding(
            "warning", f"The device's numbers skip {count(gaps, 'frame')}; lost and dropped account for {known}."
        )


def _device_findings(raw: Stream) -> Iterator[Finding]:
    finite = np.isfinite(raw.host_s)
    if bad := int((~finite).sum()):
        yield Finding("warning", f"{count(bad, 'raw frame has', 'raw frames have')} a time that is not a number.")
    if back := int((np.diff(raw.host_s[finite]) <= 0).sum()):
        yield Finding("warning", f"Time does not advance at {count(back, 'raw frame')}.")
    if restarts := int((np.diff(raw.sequences) <= 0).sum()):
        yield Finding("warning", f"The device counted its frames anew, or the same again, {count(restarts, 'time')}.")


def _part(progress: Progress | None, begin: float, end: float) -> Progress | None:
    return None if progress is None else lambda share: progress(begin + (end - begin) * share)
