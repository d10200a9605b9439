"""Hands as they are called in the window: by side, and where there are several performers by whose they are."""

from __future__ import annotations

from collections.abc import Sequence

from core.cast import Cast, hands_of, performer_names
from core.frames import HandKey


def performer_titles(cast: Cast) -> tuple[str, ...]:
    """'Anna', 'Performer 2', all different; () for a single one, whose hands need no name before them."""
    return performer_names(cast, "Performer ") if len(cast) > 1 else ()


def hand_titles(cast: Cast) -> dict[HandKey, str]:
    """'Left hand'; of several performers 'Anna · left'."""
    titles = performer_titles(cast)
    return {key: side_title(titles, key) + ("" if titles else " hand") for key in hands_of(cast)}


def side_title(performers: Sequence[str], hand: HandKey) -> str:
    """'Left'; of several performers 'Anna · left'. performers: as performer_titles gives them."""
    several = hand.performer < len(performers)
    return f"{performers[hand.performer]} · {hand.side}" if several else hand.side.capitalize()


def shortened(name: str, longest: int) -> str:
    """A name in so many characters at most: its beginning and its end, which tells it from others alike."""
    if len(name) <= longest:
        return name
    end = (longest - 1) // 2
    return f"{name[: longest - 1 - end].rstrip()}…{name[-end:].lstrip()}"
