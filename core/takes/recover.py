"""Rescue of a take whose recording was cut off or whose file is damaged."""

from __future__ import annotations

import os
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TypeVar

from core.disk_error import remedy, why
from core.errors import TakeError
from core.takes.checked import check, part
from core.takes.file_name import longer_name
from core.takes.index import Progress
from core.takes.lock import lock
from core.takes.reader import Take, open_take
from core.takes.seal import COPY_SUFFIX, counts_found, stream_counts_found, write_sealed
from core.takes.take import DAMAGED, EXTENSION, StreamCounts, TakeCounts
from core.takes.verdict import Verdict
from core.words import count

Counts = TypeVar("Counts", bound=StreamCounts)


@dataclass(frozen=True)
class OfStream:
    """What became of one stream: its frames and its clock samples, those in the take and those known to be missing."""

    solved: bool
    recovered: int
    lost: int
    clock_samples: int
    lost_clock_samples: int


@dataclass(frozen=True)
class Recovery:
    """What became of a take.

    path: the recovered take, None if the original is sealed and whole: nothing to do.
    recovered, lost: raw frames in it, and raw frames known to be missing. recovered_solved, lost_solved: the same of
    solved frames; lost_marks of marks. beside, lost_beside: of frames of other streams, and clock samples. findings:
    what was wrong, in sentences. condition: what the original is, behind its name. verdict: on the take that there is
    now, with what recovering does not mend. streams: the same of each stream, by its key.
    """

    source: Path
    path: Path | None
    recovered: int
    lost: int
    recovered_solved: int
    lost_solved: int
    lost_marks: int
    beside: int
    lost_beside: int
    findings: tuple[str, ...]
    condition: str
    verdict: Verdict
    streams: Mapping[str, OfStream] = field(default_factory=dict)

    @property
    def complete(self) -> bool:
        """Whether every frame and mark that was in the file is safe."""
        return not (self.lost or self.lost_solved or self.lost_marks or self.lost_beside)

    def __str__(self) -> str:
        if self.path is None:
            return f"{self.source} {self.condition}: nothing to recover."
        marks = f" and {count(self.lost_marks, 'mark')}" if self.lost_marks else ""
        beside = [of for of in self.streams.values() if not of.solved]
        others = f" and {sum(of.recovered for of in beside):,} frames of other streams" if beside else ""
        lost, clock = sum(of.lost for of in beside), sum(of.lost_clock_samples for of in self.streams.values())
        lost_others = f" and {lost:,} of other streams" if lost else ""
        lost_others += f" and {count(clock, 'clock sample')}" if clock else ""
        loss = f"{self.lost:,} raw and {self.lost_solved:,} solved frames{marks}{lost_others} lost"
        loss = "nothing lost" if self.complete else loss
        frames = f"{self.recovered:,} raw and {self.recovered_solved:,} solved frames{others}"
        return f"{self.path}: {frames} recovered, {loss}."


def recover(path: Path | str, progress: Progress | None = None) -> Recovery:
    """Writes what is readable of a take as a sealed take beside it, `<stem>_recovered.mcap` or the next free name.

    Never changes the original and never overwrites. Raises FormatError for what is no take, TakeError for one that
    is being recorded, holds nothing, or cannot be copied. An exception out of `progress` cancels."""
    with open_take(path, part(progress, 0.0, 0.1)) as opened:
        lock(opened.fileno(), opened.path)
        checked = check(opened, part(progress, 0.1, 0.5))
        take = checked.take
        whole = take.sealed and take.complete
        target = None if whole else _write(take, part(progress, 0.5, 1.0))
        return Recovery(
            take.path, target, len(take.raw), take.lost_raw, len(take.solved), take.lost_solved,
            take.lost_marks, take.n_beside, take.lost_beside, take.problems, checked.condition,
            take.verdict if target is None else _verdict(target, take.faults),
            {
                key: OfStream(one.solved, len(one.frames), one.lost, len(one.clock), one.lost_clock)
                for key, one in take.streams.items()
            },
        )  # fmt: skip


def _verdict(path: Path, faults: tuple[str, ...]) -> Verdict:
    with open_take(path, check=False) as take:  # read back just now
        take.faults = faults
        return take.verdict


def _write(take: Take, progress: Progress | None) -> Path:
    if not take.n_frames:
        raise TakeError(f"Take {take.path} holds no readable frame.", "There is nothing in it to recover.")
    # Whoever recovers a take holds the lock on it, so that nobody else takes this name meanwhile.
    target = _free_name(take.path)
    copy = target.with_name(target.name + COPY_SUFFIX)  # not a take's name, should this be interrupted
    try:
        write_sealed(take, copy, take.info, _counts(take), None, progress)
        copy.rename(target)
    except OSError as error:
        raise TakeError(f"{target} cannot be created ({why(target.parent, error)}).", remedy(error)) from error
    finally:
        with suppress(OSError):
            copy.unlink(missing_ok=True)
    return target


def _free_name(path: Path) -> Path:
    number = 1
    while True:
        ending = f"_recovered{number if number > 1 else ''}{EXTENSION}"
        target = path.with_name(longer_name(path.stem, ending, len(COPY_SUFFIX)))
        if not os.path.lexists(target):
            return target
        number += 1


def _counts(take: Take) -> TakeCounts:
    """The counts of the original, with what damage took from it moved to dropped, and what nobody counted received."""
    if take.counts is None:
        return counts_found(take)
    others = {
        key: stream_counts_found(one)
        if one.counts is None
        else _of_stream(one.counts, len(one.frames), take.untimed[key])
        for key, one in take.streams.items()
        if not one.solved
    }
    own = _of_stream(take.counts, len(take.raw), take.untimed.get(take.solving, 0))
    return replace(own, solved=len(take.solved), others=others)


def _of_stream(counts: Counts, readable: int, untimed: int) -> Counts:
    """What is readable is what is written; untimed: of these."""
    dropped, missing = dict(counts.dropped), counts.written - readable
    if missing > 0:
        dropped[DAMAGED] = dropped.get(DAMAGED, 0) + missing
    received = counts.received + max(-missing, 0)
    return replace(counts, received=received, written=readable, dropped=dropped, untimed=untimed)
