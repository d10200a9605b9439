"""The stream of clouds that training drinks from."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from core.frames import IntArray
from core.markers.layout import MarkerLayout
from core.training.clouds import Clouds, made
from core.training.layouts import drawn
from core.training.poses import Pool

BATCH = 96
LAYOUTS, CLOUDS_PER_LAYOUT = 8, 64
BOTH_HANDS = 0.1
"""Share of the batches in which two hands are near each other."""
_MIXED = 5.0  # points by which the clouds of a batch differ at most, or so


def supply(seed: int, pool: Pool, own: MarkerLayout | None = None, batch: int = BATCH) -> Iterator[Clouds]:
    """Batches without end; the same ones for the same seed and pool. own: the only layout, if there is one."""
    random = np.random.default_rng([seed, 2])
    kinds = [_shuffled(random, pool, own, batch, both) for both in (False, True)]
    while True:
        yield next(kinds[int(random.random() < BOTH_HANDS)])


def taken(clouds: Clouds, rows: IntArray) -> Clouds:
    """Some of the clouds, without the columns that all of them leave empty."""
    most = int(clouds.valid[rows].sum(axis=1).max())
    return replace(
        clouds,
        points_m=clouds.points_m[rows, :most],
        valid=clouds.valid[rows, :most],
        label=clouds.label[rows, :most],
        side=clouds.side[rows, :most],
        layout=clouds.layout[rows],
        told_m=clouds.told_m[rows],
    )


def _shuffled(
    random: np.random.Generator, pool: Pool, own: MarkerLayout | None, batch: int, both: bool
) -> Iterator[Clouds]:
    """Made many at a time, which is quicker, and mixed, so that a batch has many layouts."""
    while True:
        clouds = made(random, pool, [drawn(random, own) for _ in range(LAYOUTS)], CLOUDS_PER_LAYOUT, both)
        # Clouds of about one size together, or most of a batch would be padding; batches in any order.
        order = np.argsort(clouds.valid.sum(axis=1) + random.uniform(0.0, _MIXED, len(clouds.layout)))
        firsts = np.arange(0, len(order), batch)
        for first in random.permutation(firsts):
            yield taken(clouds, order[first : first + batch])
