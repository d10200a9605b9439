"""Labels that come with the recording: nothing to find out but the pose."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from core.cast import cast_of
from core.frames import NO_POINT, BoolArray, FloatArray, HandKey, IntArray, Side
from core.labelling.search import TemplateSearch
from core.profile import Profile
from core.track import HandTrack

LEAST_POINTS = 4

Names = Mapping[int, tuple[Side | HandKey, int]]
"""Device id to hand and index of the marker in its layout. A side alone is the first performer's."""


class GivenLabels:
    """Labeller, finder and validator for points whose id says what they are.

    profiles: of each performer, as the engine has them.
    """

    def __init__(self, profiles: Profile | Sequence[Profile], labels: Names) -> None:
        self._labels = {
            identity: (HandKey(0, hand) if isinstance(hand, str) else hand, marker)
            for identity, (hand, marker) in labels.items()
        }
        self._searches = [TemplateSearch.of(profile) for profile in cast_of(profiles)]

    def reset(self) -> None:
        """Nothing is kept from frame to frame."""

    def skip(self, frames: int) -> None:
        """Nothing is counted."""

    def keep(self, hands: Mapping[HandKey, HandKey]) -> None:
        """Nothing is kept of any hand."""

    def label(self, points_m: Sequence[FloatArray], ids: IntArray, tracks: Sequence[HandTrack]) -> None:
        """Write `point` of every track from the ids."""
        for track in tracks:
            track.point = self._points_of(track, ids)

    def find(self, points_m: Sequence[FloatArray], ids: IntArray, free: IntArray, tracks: Sequence[HandTrack]) -> None:
        """Begin every track that has labelled points enough."""
        for points, track in zip(points_m, tracks, strict=True):
            point = self._points_of(track, ids)
            if (point != NO_POINT).sum() >= LEAST_POINTS:
                search = self._searches[track.performer]
                track.begin(search.fit_labelled(points, point, track.known_scale), point, ids)
                track.label_confidence[:] = 1.0
            else:
                track.why = "too few markers" if (point != NO_POINT).any() else "no points"

    def accept(self, track: HandTrack, points_m: FloatArray, free: BoolArray) -> bool:
        """Any pose with points enough."""
        track.label_confidence[:] = 1.0
        enough = bool(track.observed.sum() >= LEAST_POINTS)
        track.why = "" if enough else "too few markers"
        return enough

    def _points_of(self, track: HandTrack, ids: IntArray) -> IntArray:
        point = np.full(len(track.point), NO_POINT, dtype=np.int64)
        own = HandKey(track.performer, track.side)
        for row, device_id in enumerate(ids):
            hand, marker = self._labels.get(int(device_id), (None, 0))
            if hand == own:
                point[marker] = row
        return point
