"""A take written in one go from frames that are all there: solved again, or read from a file of another program."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import islice
from pathlib import Path
from typing import Any

from core.cast import Cast
from core.frames import MarkerFrame, TrackedFrame
from core.streams import Record
from core.takes.reader import Take
from core.takes.seal import device_gaps
from core.takes.store import Frames, in_file_order
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
    source: Take | None = None,
) -> int:
    """Writes a take at `target`, which must not exist, and seals it. Returns its frames.

    pairs: each raw frame with its solution, in order; drawn one by one, so that neither need be in memory. counts: from
    the number of frames in which each hand is tracked; None: all that are given were received. sealing: told the share
    of sealing done. source: the open take whose raw frames these are, all of them: what its other streams and clocks
    hold goes along. Raises TakeError, and whatever `pairs` and `sealing` raise; `target` is then not there.
    """
    streams, solving = ((), "") if source is None else (tuple(source.numbers.values()), source.solving)
    writer = TakeWriter(target, info, cast, streams, solving)
    tracked, sequences, untimed = TrackedCount(cast), [], 0
    try:
        for one in pairs if source is None else _along(pairs, source):
            if isinstance(one[0], str):
                writer.raw(*one)
                continue
            raw, solved = one
            writer.raw(solving, raw)
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


def _along(pairs: Iterable[Pair], source: Take) -> Iterator[Pair | tuple[str, Record]]:
    """The pairs, and among them what else was recorded, in the order of the take."""
    beside: list[tuple[str, Frames[Any]]] = [
        (key, frames)
        for key, stream in source.streams.items()
        for frames in stream.topics.values()
        if frames is not source.raw
    ]
    pair = iter(pairs)
    for which, number in in_file_order([source.raw, *(frames for _, frames in beside)]):
        if which == 0:
            yield from islice(pair, 1)
        else:
            key, frames = beside[which - 1]
            yield key, frames[number]
    yield from pair
