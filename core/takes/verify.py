"""Is a take what it should be? Every record is read, every count compared."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import numpy as np

from core.frames import IntArray, stood_still
from core.gaps import Gaps
from core.takes.checked import Checked, Stream, check, lost_before, part
from core.takes.container import RAW, SOLVED
from core.takes.formats.take import gap_warnings
from core.takes.holes import Holes
from core.takes.index import Progress
from core.takes.rate import rate_warning
from core.takes.reader import open_take
from core.takes.scan import missing_numbers
from core.takes.seal import device_gaps
from core.takes.streams import TakeStream
from core.takes.take import DAMAGED, StreamCounts, TakeCounts
from core.takes.verdict import NOT_SEALED, Verdict
from core.words import count


@dataclass(frozen=True)
class Finding:
    """One thing worth knowing. problem: the take is not what it should be; warning: look; note: as it may be."""

    level: Literal["problem", "warning", "note"]
    text: str


@dataclass(frozen=True)
class Report:
    """What was found in a take. condition: what it is, behind its name in a sentence. verdict: of all commands.
    raw, solved, marks: records of each kind that are readable. points: in all raw frames. gaps: points of theirs that
    are none. streams: frames of each of the other streams that are readable, by its key. lost: of each stream those
    that were in the file and cannot be read, by its key."""

    path: Path
    sealed: bool
    condition: str
    raw: int
    solved: int
    marks: int
    counts: TakeCounts | None
    points: int
    gaps: Gaps
    findings: tuple[Finding, ...]
    verdict: Verdict
    streams: Mapping[str, int] = field(default_factory=dict)
    lost: Mapping[str, int] = field(default_factory=dict)

    @property
    def ok(self) -> bool:
        """Whether there is no problem; warnings and notes may be."""
        return all(finding.level != "problem" for finding in self.findings)


def verify(path: Path | str, progress: Progress | None = None) -> Report:
    """Reads a take from end to end. Raises FormatError for what is no take, TakeError for one that cannot be read."""
    with open_take(path, part(progress, 0.0, 0.1)) as opened:
        checked = check(opened, part(progress, 0.1, 1.0))
        take = checked.take
        return Report(
            take.path, take.sealed, checked.condition, len(take.raw), len(take.solved), len(take.marks), take.counts,
            checked.raw.points, checked.raw.gaps, tuple(_findings(checked)),
            take.verdict,
            {key: len(stream.frames) for key, stream in take.streams.items() if not stream.solved},
            {key: stream.lost for key, stream in take.streams.items()},
        )  # fmt: skip


def _findings(checked: Checked) -> Iterator[Finding]:
    take, raw, solved = checked.take, checked.raw, checked.solved
    for text in take.problems:
        yield Finding("problem", text)
    if not take.sealed:
        yield Finding("warning", NOT_SEALED)
    elif take.counts is None and not take.damage:
        yield Finding("warning", "It has no counts: its recording was never sealed, and another program wrote it anew.")
    before = lost_before(take)
    if before:
        yield from _lost_before(checked, before)
    yield from _count_findings(take.counts, raw.sequences, take.lost_raw)
    yield from _hole_findings(take.counts, take.holes)
    yield from _device_findings(raw)
    for text in raw_warnings(raw, take.info.rate_hz):
        yield Finding("warning", text)
    gone = take.lost_raw + before.get(RAW, 0)
    if (strangers := int((~np.isin(solved.sequences, raw.sequences)).sum())) > gone:
        yield Finding("warning", f"{count(strangers, 'solved frame has', 'solved frames have')} no raw frame.")
    if (unsolved := len(take.raw) - len(take.solved)) > 0:
        left_out = take.counts.left_out if take.counts is not None else 0
        chosen = f", {left_out:,} of them by choice" if left_out else ""
        what = count(unsolved, "raw frame was", "raw frames were")
        yield Finding("note", f"{what} not solved while recording{chosen}.")
    for key, other in take.streams.items():
        if not other.solved:
            for finding in _of_other(checked, other):
                yield Finding(finding.level, f"Stream {key}: {finding.text}")


def _of_other(checked: Checked, other: TakeStream) -> Iterator[Finding]:
    """What is found in a stream beside the one that was solved."""
    stream, holes = checked.topics[other.frames_topic], checked.take.holes_in(other.info.key)
    if checked.take.counts is not None and other.counts is None:
        yield Finding("warning", "It has no counts.")
    yield from _count_findings(other.counts, stream.sequences, other.lost)
    yield from _hole_findings(other.counts, holes)
    yield from _device_findings(stream, "frame")
    for text in raw_warnings(stream, other.info.rate_hz):
        yield Finding("warning", text)


def _lost_before(checked: Checked, before: Mapping[str, int]) -> Iterator[Finding]:
    """Of a take whose file was damaged before it was sealed: what its counts do not say."""
    take = checked.take
    for topic, stream in checked.topics.items():
        missing, known = missing_numbers(stream.numbers), take.lost.get(topic, 0) + before.get(topic, 0)
        if topic == SOLVED and missing:
            yield Finding("note", f"{count(missing, 'pose')} were lost to damage of its file before it was sealed.")
        elif topic != SOLVED and missing > known:
            name = take.words_for(topic)
            more = count(missing - known, f"more {name} record is", f"more {name} records are")
            yield Finding("note", f"{more} missing.")


def raw_warnings(raw: Stream, rate_hz: float) -> tuple[str, ...]:
    """What there is to warn of in the numbers, times and points of raw frames. rate_hz: as stated, NaN if unknown."""
    restarts = int((np.diff(raw.sequences) <= 0).sum())
    anew = f"The device counted its frames anew, or the same again, {count(restarts, 'time')}." if restarts else ""
    rate = rate_warning(raw.sequences, raw.host_s, rate_hz)
    return (*(text for text in (anew, rate) if text), *gap_warnings(raw.gaps, raw.points))


def _count_findings(counts: StreamCounts | None, sequences: IntArray, unreadable: int) -> Iterator[Finding]:
    if counts is None:
        return
    damaged = counts.dropped.get(DAMAGED, 0)
    if dropped := counts.dropped_total - damaged:
        reasons = ", ".join(f"{n:,} {reason}" for reason, n in counts.dropped.items() if n and reason != DAMAGED)
        yield Finding("warning", f"{count(dropped, 'frame was', 'frames were')} dropped while recording: {reasons}.")
    if damaged:
        yield Finding("warning", f"{count(damaged, 'frame was', 'frames were')} lost from the file: it was damaged.")
    if lost_on_the_way := counts.lost - counts.unread:
        yield Finding("warning", f"{count(lost_on_the_way, 'frame')} of the device never arrived.")
    if counts.rejected:
        yield Finding("warning", f"{count(counts.rejected, 'packet')} could not be read.")
    gaps, known = device_gaps(sequences), counts.lost + counts.dropped_total + unreadable
    if gaps > known:
        yield Finding(
            "warning", f"The device's numbers skip {count(gaps, 'frame')}; lost and dropped account for {known:,}."
        )


def _hole_findings(counts: StreamCounts | None, holes: Holes) -> Iterator[Finding]:
    yield from _standstill_findings(counts, holes.standing)
    if len(silences := holes.silences):
        yield Finding("warning", f"{silences.words}: nothing came then.")


def _standstill_findings(counts: StreamCounts | None, own: Holes) -> Iterator[Finding]:
    if counts is None or not counts.standstills:
        return
    level: Literal["warning", "note"] = "warning"
    if counts.unread:
        lost = count(counts.unread, "frame of that time is", "frames of that time are") + " lost"
    elif len(own):
        lost = own.words
    else:
        lost, level = "nothing was lost", "note"
    yield Finding(level, f"{stood_still(counts.standstills)}: {lost}.")


def _device_findings(raw: Stream, frame: str = "raw frame") -> Iterator[Finding]:
    finite = np.isfinite(raw.host_s)
    if bad := int((~finite).sum()):
        yield Finding("warning", f"{count(bad, f'{frame} has', f'{frame}s have')} a time that is not a number.")
    if back := int((np.diff(raw.host_s[finite]) <= 0).sum()):
        yield Finding("warning", f"Time does not advance at {count(back, frame)}.")
