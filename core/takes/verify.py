"""Is a take what it should be? Every record is read, every count compared."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from core.errors import PhalanxError
from core.frames import IntArray
from core.takes.index import Index, Progress, check_magic, sealed_index
from core.takes.reader import Take, open_take
from core.takes.records import MESSAGE_HEAD, TakeFile
from core.takes.recover import DAMAGED
from core.takes.scan import scan
from core.takes.seal import device_gaps
from core.takes.store import Frames
from core.takes.take import TakeCounts

_SCAN_SHARE = 0.3  # of the progress


@dataclass(frozen=True)
class Finding:
    """One thing worth knowing. problem: the take is not what it should be; warning: look; note: as it may be."""

    level: Literal["problem", "warning", "note"]
    text: str


@dataclass(frozen=True)
class Report:
    """What was found in a take. raw, solved, marks: records of each kind that are readable."""

    path: Path
    sealed: bool
    raw: int
    solved: int
    marks: int
    counts: TakeCounts | None
    findings: tuple[Finding, ...]

    @property
    def ok(self) -> bool:
        """Whether there is no problem; warnings and notes may be."""
        return all(finding.level != "problem" for finding in self.findings)


def verify(path: Path | str, progress: Progress | None = None) -> Report:
    """Reads a take from end to end. Raises FormatError for what is no take, TakeError for one that cannot be read."""
    with open_take(path) as take:
        findings = list(_findings(take, progress))
        if progress:
            progress(1.0)
        return Report(
            take.path, take.sealed, len(take.raw), len(take.solved), len(take.marks), take.counts, tuple(findings)
        )


def _findings(take: Take, progress: Progress | None) -> Iterator[Finding]:
    for text in take.damage:
        yield Finding("problem", text)
    if not take.sealed:
        yield Finding("warning", "Not sealed: it was not stopped properly, or is being recorded. Recover it.")
    yield from _index_findings(take, progress)
    try:
        _ = take.profile
    except PhalanxError as error:
        yield Finding("problem", str(error))
    recovered = take.counts.dropped.get(DAMAGED, 0) if take.counts else 0
    yield from _numbering("raw", take.raw, recovered)
    yield from _numbering("solved", take.solved, len(take.solved) if recovered else 0)
    raw, bad_times, back_times = _read_raw(take, progress)
    yield from _count_findings(take, raw.sequences)
    if raw.unreadable:
        yield Finding("problem", f"{raw.unreadable} raw frames cannot be read: {raw.first_error}")
    if bad_times:
        yield Finding("warning", f"{bad_times} raw frames have a time that is not a number.")
    if back_times:
        yield Finding("warning", f"Time does not advance at {back_times} raw frames.")
    if restarts := int((np.diff(raw.sequences) <= 0).sum()):
        yield Finding("warning", f"The device counted its frames anew, or the same again, {restarts} times.")
    yield from _solved_findings(take, raw, progress)


@dataclass
class _Read:
    sequences: IntArray
    unreadable: int = 0
    first_error: str = ""


def _index_findings(take: Take, progress: Progress | None) -> Iterator[Finding]:
    """Whether the index of a sealed take leads to every record, and to nothing else."""
    file = TakeFile(take.path)
    try:
        check_magic(file)
        index = sealed_index(file)
        if index is None:
            return
        found = scan(file, (lambda share: progress(_SCAN_SHARE * share)) if progress else None)
        for text in found.damage:
            yield Finding("problem", text)
        for topic in index.topics:
            if not np.array_equal(_columns(index, topic), _columns(found, topic)):
                yield Finding("problem", f"The index of {topic} does not agree with its records.")
    finally:
        file.close()


def _columns(index: Index, topic: str) -> IntArray:
    return index.topics[topic].columns()


def _numbering(name: str, frames: Frames[object], recovered: int) -> Iterator[Finding]:
    numbers = [-1]
    for i in range(len(frames)):
        with suppress(PhalanxError):  # said where the frame itself is read
            numbers.append(MESSAGE_HEAD.unpack(frames.message(i)[0])[1])
    steps = np.diff(np.array(numbers, dtype=np.int64))
    missing = int((steps[steps > 1] - 1).sum())
    if missing > recovered:
        yield Finding("problem", f"{missing} {name} records are missing from the file by their numbers.")
    elif missing:
        yield Finding("note", f"{missing} {name} records were lost to damage before this take was recovered.")
    if (steps <= 0).any():
        yield Finding("problem", f"{int((steps <= 0).sum())} {name} records are out of order by their numbers.")


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
        yield Finding("warning", f"{counts.dropped_total} frames were dropped while recording: {reasons}.")
    if counts.lost:
        yield Finding("warning", f"{counts.lost} frames of the device never arrived.")
    if counts.rejected:
        yield Finding("warning", f"{counts.rejected} packets could not be read.")
    gaps = device_gaps(sequences)
    if gaps > counts.lost + counts.dropped_total:
        yield Finding(
            "warning",
            f"The device's numbers skip {gaps} frames; lost and dropped account for "
            f"{counts.lost + counts.dropped_total}.",
        )


def _read_raw(take: Take, progress: Progress | None) -> tuple[_Read, int, int]:
    """Reads every raw frame; (frames, times that are not finite, times that do not advance)."""
    read, sequences, host = _Read(np.empty(0, np.int64)), [], []
    for i in range(len(take.raw)):
        try:
            frame = take.raw[i]
        except PhalanxError as error:
            read.unreadable += 1
            read.first_error = read.first_error or str(error)
            continue
        sequences.append(frame.sequence)
        host.append(frame.times.host_s)
        if progress and i % 256 == 0:
            progress(_SCAN_SHARE + (0.6 - _SCAN_SHARE) * i / len(take.raw))
    read.sequences = np.array(sequences, dtype=np.int64)
    times = np.array(host)
    finite = np.isfinite(times)
    return read, int((~finite).sum()), int((np.diff(times[finite]) <= 0).sum())


def _solved_findings(take: Take, raw: _Read, progress: Progress | None) -> Iterator[Finding]:
    known, strangers, unreadable, first = set(raw.sequences.tolist()), 0, 0, ""
    for i in range(len(take.solved)):
        try:
            strangers += take.solved[i].sequence not in known
        except PhalanxError as error:
            unreadable += 1
            first = first or str(error)
        if progress and i % 256 == 0:
            progress(0.6 + 0.4 * i / len(take.solved))
    if unreadable:
        yield Finding("problem", f"{unreadable} solved frames cannot be read: {first}")
    if strangers:
        yield Finding("warning", f"{strangers} solved frames have no raw frame.")
    if len(take.solved) < len(take.raw):
        yield Finding("note", f"{len(take.raw) - len(take.solved)} raw frames were not solved while recording.")
