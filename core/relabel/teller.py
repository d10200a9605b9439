"""Told how far passes over a recording are."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import TypeVar

from core.errors import CancelledError

_Item = TypeVar("_Item")

Progress = Callable[[float, str], bool | None]
"""Called with the share done (0..1) and a text; False cancels."""

PROGRESS_FRAMES = 50


class Teller:
    """Says how far all passes together are."""

    def __init__(self, progress: Progress | None, n_frames: int) -> None:
        self._progress, self._n = progress, n_frames
        self._share = 0.0

    def through(self, items: Iterable[_Item], text: str, until: float) -> Iterator[_Item]:
        """The same items, one for each frame at most; with all of them the share done has come to `until`."""
        begin = self._share
        for done, item in enumerate(items):
            yield item
            if self._progress is not None and done % PROGRESS_FRAMES == PROGRESS_FRAMES - 1:
                share = begin + (until - begin) * min(done / max(self._n, 1), 1.0)
                if self._progress(share, f"{text}, frame {done + 1:,} of {self._n:,}") is False:
                    raise CancelledError
        self._share = until
