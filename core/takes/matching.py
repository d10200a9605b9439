"""Which solved frame belongs to which raw one."""

from __future__ import annotations

import numpy as np

from core.frames import FloatArray, IntArray

SAME_INSTANT_S = 1e-6


def match_solved(raw_times_s: FloatArray, solved_times_s: FloatArray) -> IntArray:
    """(n,) int64: for each raw frame the solved frame of the same instant, -1 if there is none.

    Frames of one instant (a clock that stands still) are matched in their order.
    """
    matched = np.full(len(raw_times_s), -1, dtype=np.int64)
    if not len(solved_times_s):
        return matched
    if len(raw_times_s) == len(solved_times_s) and np.allclose(
        raw_times_s, solved_times_s, rtol=0, atol=SAME_INSTANT_S
    ):
        return np.arange(len(raw_times_s), dtype=np.int64)
    raw_order = np.argsort(raw_times_s, kind="stable")
    solved_order = np.argsort(solved_times_s, kind="stable")
    i = j = 0
    while i < len(raw_order) and j < len(solved_order):
        gap_s = raw_times_s[raw_order[i]] - solved_times_s[solved_order[j]]
        if abs(gap_s) <= SAME_INSTANT_S:
            matched[raw_order[i]] = solved_order[j]
            i, j = i + 1, j + 1
        elif gap_s < 0:
            i += 1
        else:
            j += 1
    return matched
