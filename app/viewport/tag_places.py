"""Where the names of markers go: beside their markers, away from the hand, none over another. Knows no window."""

from __future__ import annotations

from collections.abc import Hashable, Sequence

import numpy as np

from core.frames import BoolArray, FloatArray, IntArray

_N_WAYS = 12
_REACHES_PX = (3.0, 15.0, 29.0, 45.0, 63.0, 85.0, 109.0)
"""From the edge of the marker."""

_TURN_PX = 12.0
"""How much nearer a place must be to go against the way out of the hand."""

_COVERED_PX = 18.0
"""How much nearer a place must be to cover a marker."""

_STAYS = -0.35
"""A name stays where it was until it points so far back into the hand (cosine to the way out)."""

_HABIT_PX = 16.0
"""How much nearer a place must be to leave the one of the frame before."""

_JUMP_PX = 12.0
"""Markers that turn or grow by more in one frame are seen from elsewhere, and all names are placed anew."""

_RETURNS = 2
"""Names that had to go farther away and look for a nearer place in one frame, in turn: all at once would cost time."""

_ANGLES_RAD = 2.0 * np.pi * np.arange(_N_WAYS) / _N_WAYS
_WAYS = np.stack([np.cos(_ANGLES_RAD), np.sin(_ANGLES_RAD)], axis=1)
_OFFSETS = np.repeat(np.asarray(_REACHES_PX), _N_WAYS)
_EVERY = np.arange(len(_OFFSETS))
_WAY_OF = np.tile(np.arange(_N_WAYS), len(_REACHES_PX))


class TagPlaces:
    """Remembers where each name was, so that names do not jump about while hands move."""

    def __init__(self) -> None:
        self._chosen: dict[Hashable, int] = {}
        self._turn = 0
        self._keys: tuple[Hashable, ...] = ()
        self._from_centre_px: FloatArray = np.empty((0, 2))

    def place(
        self,
        keys: Sequence[Hashable],
        anchors_px: FloatArray,
        sizes_px: FloatArray,
        centres_px: FloatArray,
        room_px: tuple[float, float],
        points_px: FloatArray,
        radius_px: float,
    ) -> FloatArray:
        """(n, 2) float64 [pixels], the upper left corners of n names.

        keys: whose names they are, the same from frame to frame. anchors_px: (n, 2), the markers. sizes_px: (n, 2) of
        the names. centres_px: (n, 2), the middle of the hand each marker is on: names go away from it.
        room_px: width and height of the screen; a marker on it has its name on it. points_px: (k, 2), all there is not
        to be covered, of radius radius_px.
        """
        n = len(keys)
        if not n:
            self._chosen = {}
            return np.empty((0, 2))
        out = anchors_px - centres_px
        if self._keys == tuple(keys) and np.median(np.abs(out - self._from_centre_px).max(axis=1)) > _JUMP_PX:
            self._chosen = {}
        self._keys, self._from_centre_px = tuple(keys), out
        out = out / np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-9)
        before = np.array([self._chosen.get(key, -1) for key in keys])
        corners = np.empty((n, 2))
        chosen = before.copy()
        shift = _OFFSETS + radius_px
        discs = points_px - radius_px, np.full(points_px.shape, 2 * radius_px)
        kept = _stay(before, anchors_px, sizes_px, out, shift, room_px, corners)
        far = np.flatnonzero(kept & (before >= _N_WAYS))
        kept[np.roll(far, -self._turn)[:_RETURNS]] = False
        self._turn = (self._turn + _RETURNS) % max(len(far), 1)
        # the outermost first: they have the room, and leave it to those within
        for i in np.argsort(-np.linalg.norm(anchors_px - centres_px, axis=1), kind="stable"):
            if not kept[i]:
                every = _corners(anchors_px[i], sizes_px[i], _EVERY, shift, room_px)
                chosen[i] = _best(every, sizes_px[i], out[i], before[i], discs, (corners[kept], sizes_px[kept]))
                corners[i] = every[chosen[i]]
                kept[i] = True
        self._chosen = dict(zip(keys, chosen.tolist(), strict=True))
        return corners


def _stay(
    before: IntArray,
    anchors_px: FloatArray,
    sizes_px: FloatArray,
    out: FloatArray,
    shift_px: FloatArray,
    room_px: tuple[float, float],
    corners: FloatArray,
) -> BoolArray:
    """(n,) bool: the names that can stay where they were beside their markers. Writes their corners."""
    stay = (before >= 0) & ((_WAYS[_WAY_OF[before]] * out).sum(axis=1) > _STAYS)
    index = np.flatnonzero(stay)
    if len(index):
        corners[index] = _corners(anchors_px[index], sizes_px[index], before[index], shift_px, room_px)
        over = np.triu(_overlaps(corners[index], sizes_px[index], corners[index], sizes_px[index]), 1)
        stay[index[over.any(axis=0)]] = False
    return stay


def _corners(
    anchor_px: FloatArray, size_px: FloatArray, choice: IntArray, shift_px: FloatArray, room_px: tuple[float, float]
) -> FloatArray:
    """(c, 2): corners of names at places `choice` (c,) about anchors of sizes (2,) or (c, 2), kept on the screen."""
    corners: FloatArray = anchor_px + _WAYS[_WAY_OF[choice]] * (shift_px[choice, None] + size_px / 2) - size_px / 2
    on_screen = ((anchor_px >= 0) & (anchor_px <= room_px)).all(axis=-1, keepdims=True)
    return np.where(on_screen, np.clip(corners, 0.0, np.maximum(room_px - size_px, 0.0)), corners)


_Boxes = tuple[FloatArray, FloatArray]
"""(n, 2) upper left corners and (n, 2) sizes."""


def _best(every: FloatArray, size_px: FloatArray, out: FloatArray, before: int, points: _Boxes, taken: _Boxes) -> int:
    """The nearest free one of every place, on the way out; if none is free, the one that hides least. before: the
    place of the last frame, -1 for none."""
    boxes = every, np.broadcast_to(size_px, every.shape)
    cost = _OFFSETS + _TURN_PX * (1.0 - _WAYS[_WAY_OF] @ out) + _COVERED_PX * _overlaps(*boxes, *points).sum(axis=1)
    if before >= 0:
        cost[before] -= _HABIT_PX
    return int(np.lexsort((cost, _overlaps(*boxes, *taken).sum(axis=1)))[0])


def _overlaps(a_px: FloatArray, a_sizes_px: FloatArray, b_px: FloatArray, b_sizes_px: FloatArray) -> BoolArray:
    """(a, b) bool: which of the boxes, by corner and size, overlap."""
    a_end, b_end = a_px + a_sizes_px, b_px + b_sizes_px
    over: BoolArray = a_px[:, 0, None] < b_end[:, 0]
    over &= b_px[:, 0] < a_end[:, 0, None]
    over &= a_px[:, 1, None] < b_end[:, 1]
    over &= b_px[:, 1] < a_end[:, 1, None]
    return over
