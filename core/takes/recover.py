"""Rescue of a take whose recording was cut off or whose file is damaged."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

from core.errors import TakeError
from core.takes.checked import check, part
from core.takes.index import Progress
from core.takes.lock import lock
from core.takes.reader import Take, open_take
from core.takes.seal import COPY_SUFFIX, counts_found, write_sealed
from core.takes.take import DAMAGED, EXTENSION, TakeCounts
from core.takes.verdict import Verdict
from core.words import count


@dataclass(frozen=True)
class Recovery:
    """What became of a take.

    path: the recovered take, None if the original is sealed and whole: nothing to do.
    recovered, lost: raw frames in it, and raw frames known to be missing. recovered_solved, lost_solved: the same of
    solved frames; lost_marks of marks. findings: what was wrong, in sentences. condition: what the
    original is, behind its name. verdict: on the take that there is now, with what recovering does not mend.
    """

    source: Path
    path: Path | None
    recovered: int
    lost: int
    recovered_solved: int
    lost_solved: int
    lost_marks: int
    findings: tuple[str, ...]
    condition: str
    verdict: Verdict

    @property
    def complete(self) -> bool:
        """Whether every frame and mark that was in the file is safe."""
        return not self.lost and not self.lost_solved and not self.lost_marks

    def __str__(self) -> str:
        if self.path is None:
            return f"{self.source} {self.condition}: nothing to recover."
        marks = f" and {count(self.lost_marks, 'mark')}" if self.lost_marks else ""
        loss = f"{self.lost} raw and {self.lost_solved} solved frames{marks} lost"
        loss = "nothing lost" if self.complete else loss
        return f"{self.path}: {self.recovered} raw and {self.recovered_solved} solved frames recovered, {loss}."


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
            take.lost_marks, take.problems, checked.condition,
            take.verdict if target is None else _verdict(target, take.faults),
        )  # fmt: skip


def _verdict(path: Path, faults: tuple[str, ...]) -> Verdict:
    with open_take(path, check=False) as take:  # read back just now
        take.faults = faults
        return take.verdict


def _write(take: Take, progress: Progress | None) -> Path:
    if not len(take.raw) and not len(take.solved):
        raise TakeError(f"Take {take.path} holds no readable frame.", "There is nothing in it to recover.")
    # Whoever recovers a take holds the lock on it, so that nobody else takes this name meanwhile.
    target = _free_name(take.path)
    copy = target.with_name(target.name + COPY_SUFFIX)  # not a take's name, should this be interrupted
    try:
        write_sealed(take, copy, take.info, _counts(take), None, progress)
        copy.rename(target)
    except OSError as error:
        raise TakeError(
            f"{target} cannot be created ({error.strerror or error}).", "Copy the take to a folder you can write to."
        ) from error
    finally:
        with suppress(OSError):
            copy.unlink(missing_ok=True)
    return target


def _free_name(path: Path) -> Path:
    number = 1
    while (target := path.with_name(f"{path.stem}_recovered{number if number > 1 else ''}{EXTENSION}")).exists():
        number += 1
    return target


def _counts(take: Take) -> TakeCounts:
    """The counts of the original, with what damage took from it moved to dropped, and what nobody counted received."""
    if take.counts is None:
        return counts_found(take)
    dropped = dict(take.counts.dropped)
    missing = take.counts.written - len(take.raw)
    if missing > 0:
        dropped[DAMAGED] = dropped.get(DAMAGED, 0) + missing
    return replace(
        take.counts,
        received=take.counts.received + max(-missing, 0),
        written=len(take.raw),
        dropped=dropped,
        solved=len(take.solved),
        untimed=take.untimed,
    )
