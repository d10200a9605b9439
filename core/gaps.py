"""What is a point and what is none: the one rule, for every format and for what comes live.

Programs write a marker that no camera saw as NaN, as a blank, as exactly 0 0 0, with a negative residual, or far
outside of any room.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from core.frames import BoolArray, FloatArray

FARTHEST_M = 1000.0
"""No capture volume reaches farther from its origin [m]: what lies beyond is damage or a wrong unit."""


@dataclass(frozen=True)
class Gaps:
    """Points that a recording does not have, and why.

    absent: NaN, left blank, or marked as missing in the way of the format. zero: exactly at 0 0 0. far: beyond
    FARTHEST_M along an axis.
    """

    absent: int = 0
    zero: int = 0
    far: int = 0

    @property
    def total(self) -> int:
        """For whatever reason."""
        return self.absent + self.zero + self.far

    @property
    def words(self) -> str:
        """'10,455 gaps (12 at 0 0 0, 3 beyond 1000 m)', '2 gaps at 0 0 0', 'no gaps'."""
        if not self.total:
            return "no gaps"
        count = "1 gap" if self.total == 1 else f"{self.total:,} gaps"
        reasons = {"at 0 0 0": self.zero, f"beyond {FARTHEST_M:g} m": self.far}
        only = next((where for where, n in reasons.items() if n == self.total), None)
        if only:
            return f"{count} {only}"
        told = ", ".join(f"{n:,} {where}" for where, n in reasons.items() if n)
        return count + (f" ({told})" if told else "")

    def share(self, points: int) -> float:
        """Of all points that there should be, 0..1. points: how many there are."""
        return self.total / max(points + self.total, 1)

    def figures(self, points: int) -> dict[str, float]:
        """What `--json` says of them, for every kind of recording alike. points: how many there are."""
        return {
            "total": self.total, "absent": self.absent, "zero": self.zero, "far": self.far, "share": self.share(points)
        }  # fmt: skip

    def __add__(self, other: Gaps) -> Gaps:
        """Those of both."""
        return Gaps(self.absent + other.absent, self.zero + other.zero, self.far + other.far)


NO_GAPS = Gaps()


def present(points_m: FloatArray) -> BoolArray:
    """(...) bool of points (..., 3) float64 [m]: which are points. NaN is none, nor is any that is not finite."""
    present: BoolArray = (np.abs(points_m) <= FARTHEST_M).all(axis=-1) & np.asarray(points_m.any(axis=-1))
    return present


def open_gaps(points_m: FloatArray, used: BoolArray | None = None) -> Gaps:
    """Makes NaN of every row of (t, m, 3) float64 [m] that is no point, in place, and counts them.

    used: (t, m) bool, where there should be one; None: everywhere.
    """
    found = gaps_of(points_m, used)
    points_m[~present(points_m)] = np.nan
    return found


def gaps_of(points_m: FloatArray, used: BoolArray | None = None) -> Gaps:
    """Counts the rows of (..., 3) float64 [m] that are no points, and leaves them. used: as in `open_gaps`."""
    absent = np.isnan(points_m).any(axis=-1)
    zero = ~absent & ~points_m.any(axis=-1)
    far = ~(present(points_m) | absent | zero)
    if used is not None:
        absent &= used
    return Gaps(int(absent.sum()), int(zero.sum()), int(far.sum()))
