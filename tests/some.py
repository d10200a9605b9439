"""Loops that check something run at least once."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TypeVar

T = TypeVar("T")


def some(things: Iterable[T]) -> Iterator[T]:
    """All of them, one after the other; the test fails where there is none, for it would have checked nothing."""
    there = False
    for thing in things:
        there = True
        yield thing
    assert there, "nothing was checked: there is none"
