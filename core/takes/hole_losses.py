"""Why there are no frames in a hole: nothing came, or what came is not in the file. A loss that is counted already must
not be told a second time as silence of the device."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace

import numpy as np

from core.errors import PhalanxError
from core.takes.holes import Holes
from core.takes.records import MESSAGE_HEAD
from core.takes.streams import Recorded, stamp_at
from core.takes.take import DAMAGED, StreamCounts

_MOST = 1.25  # of the frames dropped: how many are missing in a hole is known about
_FEW = 3


def with_losses(holes: Holes, frames: Recorded, counts: StreamCounts | None, lost: int) -> Holes:
    """The holes of a stream, `came` where the file has lost the frames, or they were never written.

    frames: those of it that can be read. lost: those known to have been in the file that cannot be.
    """
    dropped = 0 if counts is None else counts.dropped_total
    damaged = lost + (0 if counts is None else counts.dropped.get(DAMAGED, 0))
    if not len(holes) or not (dropped or damaged):
        return holes
    in_file = 0 if counts is None else counts.written + counts.dropped.get(DAMAGED, 0)
    never_written = dropped - (0 if counts is None else counts.dropped.get(DAMAGED, 0))
    times_s, came = frames.times_s, holes.came.copy()
    for i in np.argsort(-holes.frames, kind="stable"):
        if holes.own[i]:
            continue
        missing = int(holes.frames[i])
        after = _next(times_s, float(holes.to_s[i]))
        numbers, device = _skipped(frames, after, in_file)
        if damaged and numbers and 2 * numbers >= missing:
            came[i] = True
        elif never_written and missing <= _MOST * never_written + _FEW and (device is None or 2 * device >= missing):
            came[i] = True
            never_written = max(never_written - missing, 0)
    return replace(holes, came=came)


def _next(times_s: np.ndarray, to_s: float) -> int:
    """The frame that ends a hole; as many as there are where it goes on to the end."""
    is_end = np.abs(times_s - to_s) < 1e-9
    return int(np.argmax(is_end)) if is_end.any() else len(times_s)


def _skipped(frames: Recorded, after: int, in_file: int) -> tuple[int, int | None]:
    """What the numbers of the records, and those of the device, pass over before a frame: of the latter nothing is
    known at the ends. in_file: records that were ever in the file."""
    with suppress(PhalanxError):  # a take that was not read through may be damaged there
        before = _numbers(frames, after - 1) if after else None
        behind = _numbers(frames, after) if after < len(frames) else None
        first = -1 if before is None else before[0]
        last = max(in_file, first + 1) if behind is None else behind[0]
        device = None if before is None or behind is None else behind[1] - before[1] - 1
        return last - first - 1, device
    return 0, None


def _numbers(frames: Recorded, i: int) -> tuple[int, int]:
    """Of a frame: that of its record, and its device's."""
    return MESSAGE_HEAD.unpack(frames.message(i)[0])[1], stamp_at(frames, i)[0]
