"""Which points of a frame an operator has picked. Knows no window."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from core.frames import NO_ID, HandState, IntArray, MarkerFrame, TrackedFrame

Key = tuple[int, int]
"""An id and -1 where the device gives ids, which last over frames; else -1 and the row in the frame picked from."""


def pickable(frame: MarkerFrame | None, tracked: TrackedFrame | None) -> IntArray:
    """Rows of the points that carry no hand's name."""
    if frame is None:
        return np.empty(0, dtype=np.int64)
    free = np.isfinite(frame.points_m).all(axis=1)
    for hand in tracked.hands if tracked is not None else ():
        if hand.state is HandState.TRACKED:
            free[hand.point[(hand.point >= 0) & (hand.point < len(free))]] = False
    return np.flatnonzero(free)


class PointSelection:
    """Points in the order in which they were picked."""

    def __init__(self) -> None:
        self._keys: dict[Key, None] = {}
        self._of: MarkerFrame | None = None  # the frame whose rows count

    def __len__(self) -> int:
        return len(self._keys)

    def clear(self) -> None:
        """Nothing is picked."""
        self._keys.clear()

    def rows(self, frame: MarkerFrame | None) -> list[int]:
        """The row of each picked point in a frame, in order, -1 where it is not in it."""
        if frame is None:
            return [-1] * len(self._keys)
        row_of = {id_: row for row, id_ in enumerate(frame.ids.tolist()) if id_ != NO_ID}
        same = frame is self._of
        return [row_of.get(id_, -1) if id_ != NO_ID else row if same else -1 for id_, row in self._keys]

    def pick(self, frame: MarkerFrame, rows: Iterable[int], *, more: bool) -> None:
        """Pick points of a frame in place of what was picked, or besides it (more)."""
        if not more:
            self.clear()
        self._anchor(frame)
        self._keys.update(dict.fromkeys(self._key(frame, row) for row in rows))

    def toggle(self, frame: MarkerFrame, row: int) -> None:
        """Pick one more point, or leave it out again."""
        self._anchor(frame)
        key = self._key(frame, row)
        if key in self._keys:
            del self._keys[key]
        else:
            self._keys[key] = None

    def _anchor(self, frame: MarkerFrame) -> None:
        if frame is not self._of:  # rows of another frame mean nothing here
            self._keys = {key: None for key in self._keys if key[0] != NO_ID}
            self._of = frame

    @staticmethod
    def _key(frame: MarkerFrame, row: int) -> Key:
        id_ = int(frame.ids[row])
        return (id_, -1) if id_ != NO_ID else (NO_ID, row)
