"""Numbers and nouns in sentences."""

from __future__ import annotations


def count(n: int, noun: str, many: str = "") -> str:
    """'1 frame', '1,200 frames'. many: the noun for several, where it does not end in s."""
    return f"1 {noun}" if n == 1 else f"{n:,} {many or noun + 's'}"
