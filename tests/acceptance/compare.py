"""Comparing what a program found with what is true."""

from __future__ import annotations

from typing import Any

import numpy as np

from core.frames import FloatArray
from core.takes.export.options import ExportOptions

TO_M = {"mm": 0.001, "cm": 0.01, "m": 1.0}

OPTIONS = {
    "as it is": ExportOptions(),
    "with joints": ExportOptions(joints=True),
    "measured, Z up, metres": ExportOptions(joints=True, measured=True, up="z", unit="m"),
    "every second frame": ExportOptions(rate_hz=60.0),
}
"""What exports of points and skeletons are asked for."""


def points_m(found: dict[str, Any], unit: str | None = None) -> FloatArray:
    """(t, m, 3) float64 [m] of a file of points. unit: of one that does not say it."""
    return np.array(found["points"], dtype=np.float64) * TO_M[unit or found["unit"]]


def difference(found: FloatArray, expected: FloatArray, of: str) -> tuple[int, float]:
    """How many values were compared, and the largest difference. What is missing must be missing in both."""
    assert found.shape == expected.shape, f"{of}: {found.shape} instead of {expected.shape}"
    np.testing.assert_array_equal(np.isnan(found), np.isnan(expected), err_msg=f"{of}: what is missing")
    there = ~np.isnan(expected)
    return found.size, float(np.abs(found - expected)[there].max(initial=0.0))
