"""Rescue of a take whose recording was cut off or whose file is damaged."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from core.errors import TakeError
from core.takes.index import Progress
from core.takes.lock import lock
from core.takes.reader import Take, open_take
from core.takes.seal import counts_found, write_sealed
from core.takes.take import EXTENSION, TakeCounts

DAMAGED = "damaged file"
"""Reason under which a recovered take counts frames that its original could not give back."""


@dataclass(frozen=True)
class Recovery:
    """What became of a take.

    path: the recovered take, None if the original is sealed and whole: nothing to do.
    recovered, lost: raw frames in it, and raw frames known to be missing. recovered_solved, lost_solved: the same of
    solved frames. findings: what was wrong, in sentences.
    """

    source: Path
    path: Path | None
    recovered: int
    lost: int
    recovered_solved: int
    lost_solved: int
    findings: tuple[str, ...]

    @property
    def complete(self) -> bool:
        """Whether every frame that was in the file is safe."""
        return not self.lost and not self.lost_solved

    @property
    def exit_code(self) -> int:
        """Of the command line: 0 nothing to do or complete, 3 done with loss."""
        return 0 if self.complete else 3

    def __str__(self) -> str:
        if self.path is None:
            return f"{self.source} is whole: nothing to recover."
        loss = "nothing lost" if self.complete else f"{self.lost} raw and {self.lost_solved} solved frames lost"
        return f"{self.path}: {self.recovered} raw and {self.recovered_solved} solved frames recovered, {loss}."


def recover(path: Path | str, progress: Progress | None = None) -> Recovery:
    """Writes what is readable of a take as a sealed take beside it, `<stem>_recovered.mcap` or the next free name.

    Never changes the original and never overwrites. Raises FormatError for what is no take, TakeError for one that
    is being recorded, holds nothing, or cannot be copied. An exception out of `progress` cancels."""
    with open_take(path) as take:
        lock(take.fileno(), take.path)
        whole = take.sealed and take.complete
        target = None if whole else _write(take, progress)
        return Recovery(
            take.path, target, len(take.raw), take.lost_raw, len(take.solved), take.lost_solved, take.damage
        )


def _write(take: Take, progress: Progress | None) -> Path:
    if not len(take.raw) and not len(take.solved):
        raise TakeError(f"Take {take.path} holds no readable frame.", "There is nothing in it to recover.")
    target = _reserve(take.path)
    try:
        write_sealed(take, target, take.info, _counts(take), None, progress)
    except BaseException:
        target.unlink(missing_ok=True)
        raise
    return target


def _reserve(path: Path) -> Path:
    """A new file of a name that was free."""
    for number in range(1, 10_000):
        target = path.with_name(f"{path.stem}_recovered{number if number > 1 else ''}{EXTENSION}")
        try:
            target.touch(exist_ok=False)
        except FileExistsError:
            continue
        except OSError as error:
            raise TakeError(
                f"{target} cannot be created ({error.strerror or error}).",
                "Copy the take to a folder you can write to.",
            ) from error
        return target
    raise TakeError(f"All names {path.stem}_recovered... are taken.", "Move some of these takes away.")


def _counts(take: Take) -> TakeCounts:
    """The counts of the original, with what damage took from it moved to dropped."""
    if take.counts is None:
        return counts_found(take)
    dropped = dict(take.counts.dropped)
    missing = take.counts.written - len(take.raw)
    if missing > 0:
        dropped[DAMAGED] = dropped.get(DAMAGED, 0) + missing
    return TakeCounts(
        take.counts.received, len(take.raw), dropped, take.counts.lost, take.counts.rejected, len(take.solved)
    )
