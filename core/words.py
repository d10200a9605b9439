"""Numbers and nouns in sentences."""

from __future__ import annotations

from collections.abc import Sequence


def count(n: int, noun: str, many: str = "") -> str:
    """'1 frame', '1,200 frames'. many: the noun for several, where it does not end in s."""
    return f"1 {noun}" if n == 1 else f"{n:,} {many or noun + 's'}"


def ordinal(n: int) -> str:
    """'1st', '2nd', '3rd', '4th', '11th', '22nd'."""
    endings = {1: "st", 2: "nd", 3: "rd"}
    return f"{n}{'th' if n % 100 in (11, 12, 13) else endings.get(n % 10, 'th')}"


def listed(words: Sequence[str]) -> str:
    """'a', 'a and b', 'a, b and c'; '' of none."""
    return " and ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)
