"""How long a take is, as everything that shows it shows it."""

from __future__ import annotations


def clock(seconds: float) -> str:
    """Minutes, seconds and tenths, cut and not rounded, as a stop watch shows them."""
    tenths = int(seconds * 10 + 1e-6)  # 6.2 is 6.19999...
    return f"{tenths // 600:02d}:{tenths % 600 // 10:02d}.{tenths % 10}"
