"""Telling how far an export is, and stopping it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sized
from typing import TypeVar

from core.errors import CancelledError

Callback = Callable[[float, str], bool | None]
"""Called with the share done (0..1) and a text; False cancels."""

EVERY = 256
"""Frames between two calls."""

T = TypeVar("T")


class Progress:
    """A callback, and the part of the whole that one step of the work is."""

    def __init__(self, callback: Callback | None, low: float = 0.0, high: float = 1.0) -> None:
        self._callback = callback
        self._low, self._high = low, high

    def __call__(self, done: float, text: str) -> None:
        """`done`: share of this part, 0..1. Raises CancelledError if the operator stops."""
        share = self._low + min(max(done, 0.0), 1.0) * (self._high - self._low)
        if self._callback is not None and self._callback(share, text) is False:
            raise CancelledError

    def part(self, low: float, high: float) -> Progress:
        """The progress of a piece of this part, from `low` to `high` (0..1)."""
        width = self._high - self._low
        return Progress(self._callback, self._low + low * width, self._low + high * width)

    def over(self, frames: Iterable[T], text: str, n_frames: int | None = None) -> Iterator[T]:
        """The frames, one by one, telling how many were handed out."""
        total = n_frames if n_frames is not None else len(frames) if isinstance(frames, Sized) else 0
        for i, frame in enumerate(frames):
            if i % EVERY == 0:
                self(i / max(total, 1), f"{text}: frame {i} of {total}")
            yield frame
        self(1.0, text)
