"""Names for the points of hands that are already tracked (Han 2018, 4.2; Schröder 2017, eq. 5).

A point that keeps its device id keeps its name, as long as it is where that marker could be. These points place the
hand, and with it the markers that have none: each is expected somewhere, and is off by as much as the hand's pose and
motion leave open. All points without a name are dealt to those markers of all hands at once; a point that came out of
nowhere competes with being a ghost. So a marker that was hidden may be found the further away the longer it was gone
(the adaptive threshold of Maycock 2015, as told by Schröder), but only as far as its neighbours let it go.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import linear_sum_assignment

from core.frames import NO_ID, NO_POINT, FloatArray, IntArray
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

BACK_NATS = 3.0
"""The same for a hidden marker that is seen again in this very frame: gaps last some twenty frames."""


TAIL = 8.0
TAIL_NATS = 0.5 * (TAIL + 3.0)
"""Degrees of freedom of how hands surprise: Student's t in space."""


def gates_m(track: HandTrack) -> FloatArray:
    """(m,) float64 [m]: how far from its expected place each marker may reappear on a hand that is not yet placed."""
    gates: FloatArray = np.minimum(GATE_M + GATE_GROWTH_M_PER_S * track.hidden_s, MAX_GATE_M)
    return gates


def naming_nats(points_m: FloatArray, expected_m: FloatArray, std_m: FloatArray, back: FloatArray) -> FloatArray:
    """(m, n) float64: what it costs to say that a point is a marker, less what it costs to call it a ghost.

    points_m: (n, 3) [m], of which nothing is known. expected_m: (m, 3) [m], std_m (m,) [m] per axis. back: (m,) cost of
    the marker's being seen in this frame. Negative: it rather is the marker.
    """
    squared = np.square(points_m[None] - expected_m[:, None]).sum(axis=2)
    variance = np.square(std_m)[:, None]
    density = TAIL_NATS * np.log1p(squared / (variance * TAIL)) + 1.5 * np.log(2.0 * np.pi * variance * 1e4)  # per cm^3
    nats: FloatArray = density + back[:, None] - GHOST_NATS
    return nats


def back_nats(track: HandTrack) -> FloatArray:
    """(m,) float64: what it costs that a marker without an id is seen in this frame."""
    return np.where(track.hidden_s > 0.0, BACK_NATS, 0.0)


class Continuity:
    """Labels the tracked hands of a frame."""

    def label(self, points_m: Sequence[FloatArray], ids: IntArray, tracks: Sequence[HandTrack]) -> None:
        """Write `point` of every track.

        points_m: for each track the frame's points (n, 3) float64 [m] as its (mirrored) hand sees them.
        ids: (n,) int64.
        """
        taken = np.zeros(len(ids), dtype=np.bool_)
        row_of_id = {id_: row for row, id_ in enumerate(ids.tolist()) if id_ != NO_ID}
        for track, points in zip(tracks, points_m, strict=True):
            track.point[:] = NO_POINT
            track.carried[:] = False
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


def _of_placed(track: HandTrack, points_m: FloatArray, free: IntArray, markers: IntArray) -> FloatArray:
    """(markers, free) nats, where known ids say where the hand is."""
    reach_m = MAX_GATE_M + 2.0 * MAX_GATE_M * np.minimum(track.hidden_s[markers], 1.0)
    near = np.square(points_m[free][None] - track.expected_m()[markers][:, None]).sum(axis=2) < reach_m[:, None] ** 2
    cost = np.zeros(near.shape)
    if not near.any():
        return cost
    there, std_m = track.placed(points_m, track.point)
    track.std_m[markers] = std_m[markers]
    nats = naming_nats(points_m[free], there[markers], std_m[markers], back_nats(track)[markers])
    cost[near] = nats[near]
    return cost


def _of_moved(track: HandTrack, points_m: FloatArray, markers: IntArray) -> FloatArray:
    """(markers, free) nats, where nearly every marker has moved on under another id or none: by distance alone."""
    gates = gates_m(track)[markers]
    squared = np.square(points_m[None] - track.expected_m()[markers][:, None]).sum(axis=2)
    track.std_m[markers] = gates / 3.0
    nats: FloatArray = GHOST_NATS * np.minimum(squared / np.square(gates)[:, None] - 1.0, 0.0)
    return nats
