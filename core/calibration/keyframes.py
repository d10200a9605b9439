"""Which frames to calibrate from: few, and as unlike each other as they can be."""

from __future__ import annotations

import numpy as np

from core.frames import FloatArray, IntArray

MOST_SWEEPS = 3


def farthest_points(features: FloatArray, count: int) -> IntArray:
    """Rows of `features` (n, d) that lie far from each other: (min(count, n),) int64, increasing.

    First each is the farthest from those before; then each in turn is taken out and put back where it is farthest
    from all others, until none moves (farthest-point optimization: Schlömer, Heck and Deussen 2011; for postures:
    Schröder 2017, "Geometric feasibility").
    """
    n = len(features)
    if count >= n:
        return np.arange(n)
    chosen = [int(np.argmin(_squared(features, features.mean(axis=0))))]
    nearest = _squared(features, features[chosen[0]])
    while len(chosen) < count:
        chosen.append(int(np.argmax(nearest)))
        nearest = np.minimum(nearest, _squared(features, features[chosen[-1]]))
    table = np.stack([_squared(features, features[row]) for row in chosen])  # (count, n)
    for _ in range(MOST_SWEEPS):
        moved = False
        for i in range(count):
            others = np.delete(table, i, axis=0).min(axis=0)
            best = int(np.argmax(others))
            if others[best] > others[chosen[i]]:
                chosen[i], moved = best, True
                table[i] = _squared(features, features[best])
        if not moved:
            break
    return np.sort(np.asarray(chosen, dtype=np.int64))


def _squared(features: FloatArray, from_: FloatArray) -> FloatArray:
    distances: FloatArray = ((features - from_) ** 2).sum(axis=1)
    return distances
