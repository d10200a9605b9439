"""Names for the points of hands that are already tracked (Han 2018, 4.2; Schröder 2017, eq. 5).

A point that keeps its device id keeps its name, as long as it is where that marker could be. All other points are
assigned to the remaining markers of all hands at once, by distance from where each is expected. A marker that was
hidden may have strayed further: its gate opens with time (the adaptive threshold of Maycock 2015, as told by Schröder).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from core.frames import NO_ID, NO_POINT, FloatArray, IntArray
from core.labelling.assignment import assign
from core.track import HandTrack

ID_GATE_M = 0.040
"""A point with a known id further off than this has been given another marker's id."""

GATE_M = 0.018
GATE_GROWTH_M_PER_S = 0.060
MAX_GATE_M = 0.035


def gates_m(track: HandTrack) -> FloatArray:
    """(m,) float64 [m]: how far from its expected place each marker may reappear."""
    gates: FloatArray = np.minimum(GATE_M + GATE_GROWTH_M_PER_S * track.hidden_s, MAX_GATE_M)
    return gates


class Continuity:
    """Labels the tracked hands of a frame."""

    def label(self, points_m: Sequence[FloatArray], ids: IntArray, tracks: Sequence[HandTrack]) -> None:
        """Write `point` of every track.

        points_m: for each track the frame's points (n, 3) float64 [m] as its (mirrored) hand sees them.
        ids: (n,) int64.
        """
        taken = np.zeros(len(ids), dtype=np.bool_)
        expected = [track.expected_m() for track in tracks]
        row_of_id = {id_: row for row, id_ in enumerate(ids.tolist()) if id_ != NO_ID}
        for track, points, there in zip(tracks, points_m, expected, strict=True):
            track.point[:] = NO_POINT
            track.carried[:] = False
            known = [(k, row_of_id[id_]) for k, id_ in enumerate(track.ids.tolist()) if id_ in row_of_id]
            if known:
                markers, rows = np.asarray(known).T
                fits = ~taken[rows] & (np.square(points[rows] - there[markers]).sum(axis=1) < ID_GATE_M**2)
                track.point[markers[fits]] = rows[fits]
                track.carried[markers[fits]] = True
                taken[rows[fits]] = True
        self._label_rest(points_m, tracks, expected, np.flatnonzero(~taken))

    @staticmethod
    def _label_rest(
        points_m: Sequence[FloatArray], tracks: Sequence[HandTrack], expected: Sequence[FloatArray], free: IntArray
    ) -> None:
        """Assign the free points to the markers without one; where two hands compete, the nearer takes it."""
        if len(free) == 0:
            return
        claims: dict[int, tuple[float, HandTrack, int]] = {}
        for track, points, there in zip(tracks, points_m, expected, strict=True):
            open_markers = np.flatnonzero(track.point == NO_POINT)
            found = assign(there[open_markers], points[free], gates_m(track)[open_markers])
            for k, choice in zip(open_markers, found, strict=True):
                if choice == NO_POINT:
                    continue
                row = int(free[choice])
                distance = float(np.linalg.norm(points[row] - there[k]))
                if row not in claims or distance < claims[row][0]:
                    claims[row] = (distance, track, int(k))
        for row, (_, claimant, marker) in claims.items():
            claimant.point[marker] = row
