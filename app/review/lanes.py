"""What a lane of the timeline shows at each pixel, and the words of its ruler. Knows no window."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from app.review.analysis import Cell
from core.frames import IntArray

EMPTY, SEEN, MISSING = len(Cell), len(Cell) + 1, len(Cell) + 2
"""Cells of a marker's lane: its hand is not tracked; it is seen; it is hidden."""

GUESSED = len(Cell) + 3
"""Cell of a hand's lane: it is tracked, and some of its joints are a guess."""

HOLE = len(Cell) + 4
"""Cell of any lane: there is no frame."""

# where several frames share a pixel, the worst shows
_WORST_FIRST = (HOLE, Cell.LOST, MISSING, Cell.SEARCHING, GUESSED, Cell.TRACKED, SEEN, Cell.UNSOLVED, EMPTY)


def worst_cells(cells: NDArray[np.uint8], starts: IntArray, ends: IntArray) -> NDArray[np.uint8]:
    """(w,) uint8: of the frames starts[i]:ends[i] (at least one) the cell that most needs to be seen."""
    severity = np.empty(len(_WORST_FIRST), np.uint8)
    severity[list(_WORST_FIRST)] = np.arange(len(_WORST_FIRST))[::-1]
    n = len(cells)
    begin = np.clip(starts, 0, n - 1)
    end = np.clip(np.maximum(ends, begin + 1), 1, n)
    bounds = np.empty(2 * len(begin), np.int64)
    bounds[0::2], bounds[1::2] = begin, end
    ranked = np.append(severity[cells], np.uint8(0))
    worst = np.maximum.reduceat(ranked, bounds)[0::2]
    return np.asarray(_WORST_FIRST, np.uint8)[::-1][worst]


def tick_step(span_s: float, width: float) -> tuple[float, int]:
    """Seconds between the ticks of a ruler, about 90 pixels apart, and the decimals their labels need."""
    wanted_s = max(span_s, 1e-3) * 90 / max(width, 90)
    for step_s in (0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 1800):
        if step_s >= wanted_s:
            return step_s, max(0, math.ceil(-math.log10(step_s) - 1e-9))
    return 3600.0, 0


def clock(time_s: float, decimals: int = 1) -> str:
    """12:34.5 of seconds, for ruler and fields."""
    unit = 10**decimals
    ticks = round(abs(time_s) * unit)
    minutes, rest = divmod(ticks, 60 * unit)
    seconds = f"{rest / unit:0{3 + decimals if decimals else 2}.{decimals}f}"
    return f"{'-' if time_s < 0 and ticks else ''}{minutes}:{seconds}"
