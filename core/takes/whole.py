"""A take written in one go from frames that are all there: solved again, or read from a file of another program."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from core.cast import Cast
from core.frames import MarkerFrame, TrackedFrame
from core.takes.seal import device_gaps
from core.takes.take import Mark, TakeCounts, TakeInfo
from core.takes.tracked import TrackedCount
from core.takes.writer import TakeWriter

Pair = tuple[MarkerFrame, TrackedFrame]


def write_take(
    target: Path | str,
    info: TakeInfo,
    cast: Cast,
    pairs: Iterable[Pair],
    marks: Sequence[Mark],
    counts: Callable[[TrackedCount], TakeCounts] | None = None,
    sealing: Callable[[float], None] | None = None,
) -> int:
    """Writes a take at `target`, which must not exist, and seals it. Returns its frames.

    pairs: each raw frame with its solution, in order; drawn one by one, so that neither need be in memory. counts: from
    the number of frames in which each hand is tracked; None: all that are given were received. sealing: told the share
    of sealing done. Raises TakeError, and whatever `pairs` and `sealing` raise; `target` is then not there.
    """
    writer = TakeWriter(target, info, cast)
    tracked, sequences, untimed = TrackedCount(cast), [], 0
    try:
        for raw, solved in pairs:
            writer.raw(raw)
            writer.solved(solved)
            tracked.add(solved)
            sequences.append(raw.sequence)
            untimed += not raw.times.known
        for mark in marks:
            writer.mark(mark)
        n = len(sequences)
        found = TakeCounts(n, n, lost=device_gaps(sequences), solved=n, tracked=tracked.by_hand, untimed=untimed)
        writer.seal(counts(tracked) if counts else found, sealing)
    except BaseException:
        writer.close()
        Path(target).unlink(missing_ok=True)
        raise
    return n
