"""When markers are hidden: as often and as long as in Han 2018, Table 3, or whenever too few cameras see them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from core.frames import BoolArray, FloatArray, IntArray


@dataclass(frozen=True)
class GapTable:
    """A row of Table 3: frames of the sequence, its gaps (runs of frames in which at least one marker is missing),
    their mean length [frames], and how many markers are missing on the average while one is."""

    frames: int
    gaps: int
    mean_frames: float
    mean_missing: float


TABLE_3 = {
    "single hand": GapTable(4785, 44, 2.11, 1.35),
    "hand-hand": GapTable(3312, 331, 4.01, 3.30),
    "hand-pen": GapTable(4511, 481, 3.39, 2.31),
    "hand-controller": GapTable(2645, 382, 2.65, 1.62),
}


def hidden_as_in(table: GapTable, counts: IntArray, random: np.random.Generator) -> BoolArray:
    """(f, n) bool: gaps as many, as long and as deep as a row of Table 3 has them, where the view is worst.

    counts: (f, n), cameras that see each marker. A gap begins rather where many markers are seen by few cameras, and
    hides those that the fewest see. Its length is geometric, the number of its markers one and a Poisson number more.
    """
    f, n = counts.shape
    poor: FloatArray = np.square(np.maximum(counts.max() - counts, 0).astype(np.float64)).sum(axis=1) + 1.0
    lengths = np.sort(random.geometric(1.0 / table.mean_frames, round(table.gaps * f / table.frames)))[::-1]
    hidden, taken = np.zeros((f, n), dtype=np.bool_), np.zeros(f + 2, dtype=np.int64)  # padded by a frame on each side
    for length in lengths:
        if length > f:
            continue
        sums = np.concatenate([[0], np.cumsum(taken)])
        free = sums[length + 2 :] == sums[: f - length + 1]  # with a whole frame before and after
        weights = poor[: f - length + 1] * free
        if not weights.any():
            break
        first = int(random.choice(len(weights), p=weights / weights.sum()))
        taken[first + 1 : first + 1 + length] = 1
        worst = counts[first + length // 2] + random.uniform(0.0, 1.5, n)
        missing = min(1 + int(random.poisson(table.mean_missing - 1.0)), n)
        hidden[first : first + length, np.argsort(worst)[:missing]] = True
    return hidden


def told(hidden: BoolArray) -> GapTable:
    """The row of Table 3 that a sequence (f, n) has."""
    missing = hidden.sum(axis=1)
    within = missing > 0
    gaps = int(within[:1].sum() + (within[1:] & ~within[:-1]).sum())
    return GapTable(len(hidden), gaps, float(within.sum() / max(gaps, 1)), float(missing.sum() / max(within.sum(), 1)))
