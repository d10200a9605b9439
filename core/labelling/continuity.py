"""Names for the points of hands that are already tracked (Han 2018, 4.2; Schröder 2017, eq. 5).

A point that keeps its device id keeps its name, as long as it is where that marker could be. These points place the
hand, and with it the markers that have none: each is expected somewhere, and is off by as much as the hand's pose and
motion leave open. All points without a name are dealt to those markers of all hands at once; a point that came out of
nowhere competes with being a ghost. So a marker that was hidden may be found the further away the longer it was gone
(the adaptive threshold of Maycock 2015, as told by Schröder), but only as far as its neighbours let it go.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.optimize import linear_sum_assignment

from core.frames import NO_ID, NO_POINT, FloatArray, HandKey, IntArray
from core.track import HandTrack

ID_GATE_M = 0.040
"""A point with a known id further off than this has been given another marker's id."""

PLACED_BY = 6
"""So many points with known ids place a hand for the others."""

GATE_M = 0.018
GATE_GROWTH_M_PER_S = 0.060
MAX_GATE_M = 0.035
"""How far from its expected place a marker may be found where too few ids tell where the hand is: it moved."""

GHOST_NATS = 10.0
"""Minus the logarithm of how often a ghost appears in a given cm^3 beside a hand in a given frame: one in a frame or
two somewhere around it."""

BACK_NATS, NEW_ID_NATS = 3.0, 2.0
"""The same for a hidden marker that is seen again in this very frame: gaps last some twenty frames; and for one that
lost its id without a gap."""

OLDER_NATS = 8.0
"""What it costs at most that a point had been there, without a name, while the marker was still seen elsewhere: as
much as it was sure that it was the marker that was seen."""


MOST_TOGETHER = 12
"""So many frames a marker may carry a ghost's point while its own is there without a name. A point that was there for
longer beside a marker that was seen is another's, such as a pen's, and its staying speaks for nothing."""

LASTING_NATS, MOST_LASTING_NATS = 0.15, 12.0
"""What every frame that a point has been there without a name speaks against its being a ghost, which die of age: each
frame one in seven; and how much it may at most."""

STRAYED_NATS = 2.3
"""What it costs that a digit did, while it was hidden, what nothing seen speaks of: one in ten does."""

TAIL = 12.0
TAIL_NATS = 0.5 * (TAIL + 3.0)
"""Degrees of freedom of how hands surprise: Student's t in space."""


def gates_m(track: HandTrack) -> FloatArray:
    """(m,) float64 [m]: how far from its expected place each marker may reappear on a hand that is not yet placed."""
    gates: FloatArray = np.minimum(GATE_M + GATE_GROWTH_M_PER_S * track.hidden_s, MAX_GATE_M)
    return gates


def naming_nats(
    points_m: FloatArray, expected_m: FloatArray, cov_m2: FloatArray, strayed_m2: FloatArray, back: FloatArray
) -> FloatArray:
    """(m, n) float64: what it costs to say that a point is a marker, less what it costs to call it a ghost.

    back: (m, n), as from `back_nats`; all else as for `place_nats`. Negative: it rather is the marker.
    """
    return place_nats(points_m, expected_m, cov_m2, strayed_m2) + back - GHOST_NATS


def place_nats(points_m: FloatArray, expected_m: FloatArray, cov_m2: FloatArray, strayed_m2: FloatArray) -> FloatArray:
    """(m, n) float64: what it costs that a marker is where a point is.

    points_m: (n, 3) [m]. expected_m: (m, 3) [m], cov_m2 (m, 3, 3) [m^2], strayed_m2 the same should the digit have gone
    its own way while it was hidden.
    """
    off_m = points_m[None] - expected_m[:, None]
    return np.minimum(_nats_per_cm3(off_m, cov_m2), _nats_per_cm3(off_m, strayed_m2) + STRAYED_NATS)


def exact_nats(std_m: float) -> float:
    """`place_nats` of a point that is where its marker is expected."""
    return float(_nats_per_cm3(np.zeros((1, 1, 3)), std_m**2 * np.eye(3)[None])[0, 0])


def _nats_per_cm3(off_m: FloatArray, cov_m2: FloatArray) -> FloatArray:
    """(m, n), minus the logarithm of Student's density in space, at off_m (m, n, 3) [m], of covariance (m, 3, 3)."""
    cov_cm2 = 1e4 * cov_m2
    squared = ((1e2 * off_m @ np.linalg.inv(cov_cm2)) * (1e2 * off_m)).sum(axis=2)
    size = 1.5 * np.log(2.0 * np.pi) + 0.5 * np.linalg.slogdet(cov_cm2)[1]
    nats: FloatArray = TAIL_NATS * np.log1p(squared / TAIL) + size[:, None]
    return nats


def back_nats(track: HandTrack, rows: IntArray, *, seen_elsewhere: bool = True) -> FloatArray:
    """(m, len(rows)) float64: what it costs that a marker without an id is seen in this frame, and as that point.

    seen_elsewhere: does it count that the marker was seen under another id while the point was there?
    """
    shown = np.where(track.ids != NO_ID, NEW_ID_NATS, 0.0)
    back = np.where(track.hidden_frames > 0, BACK_NATS, shown)[:, None]
    nameless = track.nameless[rows][None]
    together = nameless - track.hidden_frames[:, None]
    lasting = np.minimum(LASTING_NATS * nameless, MOST_LASTING_NATS)
    elsewhere = seen_elsewhere * np.clip(track.sure_nats, 0.0, OLDER_NATS)[:, None]
    nats: FloatArray = back + np.where(together > 0, elsewhere, 0.0) - np.where(together > MOST_TOGETHER, 0.0, lasting)
    return nats


class Continuity:
    """Labels the tracked hands of a frame."""

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Forget which points had no name."""
        self._nameless: dict[int, int] = {}  # frames by device id
        self._last_ids: frozenset[int] = frozenset()

    def skip(self, frames: int) -> None:
        """So many frames went by unseen: a point that is still there was there all the time."""
        self._nameless = {id_: there + frames for id_, there in self._nameless.items()}

    def pass_over(self, ids: frozenset[int], tracks: Sequence[HandTrack]) -> None:
        """A frame went by with points of these ids: who is no marker and has come or stayed was there without a name,
        and who has gone is new when it comes back."""
        named = {id_ for track in tracks for id_ in track.ids.tolist()}
        self._nameless = {id_: self._nameless.get(id_, 0) + 1 for id_ in ids if id_ not in named}
        self._last_ids &= ids

    def keep(self, hands: Mapping[HandKey, HandKey]) -> None:
        """Points are remembered here, not hands."""

    def label(self, points_m: Sequence[FloatArray], ids: IntArray, tracks: Sequence[HandTrack]) -> None:
        """Write `point` of every track.

        points_m: for each track the frame's points (n, 3) float64 [m] as its (mirrored) hand sees them.
        ids: (n,) int64.
        """
        taken = np.zeros(len(ids), dtype=np.bool_)
        names = self._nameless
        nameless = np.array([names.get(id_, 0) for id_ in ids.tolist()], dtype=np.int64)
        newcomer = np.array([id_ != NO_ID and id_ not in self._last_ids for id_ in ids.tolist()], dtype=np.bool_)
        self._last_ids = frozenset(ids.tolist())
        row_of_id = {id_: row for row, id_ in enumerate(ids.tolist()) if id_ != NO_ID}
        for track, points in zip(tracks, points_m, strict=True):
            track.point[:] = NO_POINT
            track.carried[:] = False
            track.nameless, track.newcomer = nameless, newcomer
            known = [(k, row_of_id[id_]) for k, id_ in enumerate(track.ids.tolist()) if id_ in row_of_id]
            if known:
                there = track.expected_m()
                markers, rows = np.asarray(known).T
                fits = ~taken[rows] & (np.square(points[rows] - there[markers]).sum(axis=1) < ID_GATE_M**2)
                track.point[markers[fits]] = rows[fits]
                track.carried[markers[fits]] = True
                taken[rows[fits]] = True
        free = np.flatnonzero(~taken)
        if len(free):
            self._label_rest(points_m, tracks, free)
            for track in tracks:
                taken[track.point[track.observed]] = True
        self._nameless = {id_: names.get(id_, 0) + 1 for id_ in ids[~taken].tolist() if id_ != NO_ID}

    @staticmethod
    def _label_rest(points_m: Sequence[FloatArray], tracks: Sequence[HandTrack], free: IntArray) -> None:
        """Deal the free points to the markers without one, of all hands together."""
        costs: list[FloatArray] = []
        owners: list[tuple[HandTrack, int]] = []
        for track, points in zip(tracks, points_m, strict=True):
            open_markers = np.flatnonzero(track.point == NO_POINT)
            if len(open_markers) == 0:
                continue
            owners += [(track, int(k)) for k in open_markers]
            if track.carried.sum() >= PLACED_BY:
                costs.append(_of_placed(track, points, free, open_markers))
            else:
                costs.append(_of_moved(track, points[free], open_markers))
        if not owners:
            return
        cost = np.concatenate(costs)
        for row, column in zip(*linear_sum_assignment(np.minimum(cost, 0.0)), strict=True):
            if cost[row, column] < 0.0:
                track, marker = owners[row]
                track.point[marker] = free[column]
                found_m = points_m[tracks.index(track)][free[column]]
                track.off_m[marker] = found_m - track.expected_m()[marker]


def _of_placed(track: HandTrack, points_m: FloatArray, free: IntArray, markers: IntArray) -> FloatArray:
    """(markers, free) nats, where known ids say where the hand is."""
    reach_m = MAX_GATE_M + 2.0 * MAX_GATE_M * np.minimum(track.hidden_s[markers], 1.0)
    near = np.square(points_m[free][None] - track.expected_m()[markers][:, None]).sum(axis=2) < reach_m[:, None] ** 2
    cost = np.zeros(near.shape)
    if not near.any():
        return cost
    there, cov_m2, strayed_m2 = track.placed(points_m, track.point)
    track.cov_m2[markers], track.strayed_m2[markers] = cov_m2[markers], strayed_m2[markers]
    back = back_nats(track, free)[markers]
    nats = naming_nats(points_m[free], there[markers], cov_m2[markers], strayed_m2[markers], back)
    cost[near] = nats[near]
    return cost


def _of_moved(track: HandTrack, points_m: FloatArray, markers: IntArray) -> FloatArray:
    """(markers, free) nats, where nearly every marker has moved on under another id or none: by distance alone."""
    gates = gates_m(track)[markers]
    squared = np.square(points_m[None] - track.expected_m()[markers][:, None]).sum(axis=2)
    track.cov_m2[markers] = track.strayed_m2[markers] = np.square(gates / 3.0)[:, None, None] * np.eye(3)
    nats: FloatArray = GHOST_NATS * np.minimum(squared / np.square(gates)[:, None] - 1.0, 0.0)
    return nats
