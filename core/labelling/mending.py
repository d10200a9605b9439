"""Other names for the points of a hand that is tracked, and whether they are better (Han 2018, 4.4; Fig. 7).

Proposed are: the names as they are; those carried by ids alone; those that the pose suggests by nearness; neighbouring
fingers exchanged, tips alone or more; and, where it is asked, those of the network. All are solved at once. They are
judged by how well the hand then explains the points, by the ids, which rarely change their marker, by how the digits
were moving, and by what the network is sure of.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from core.frames import NO_POINT, FloatArray, IntArray
from core.kinematics.solver import HandPose
from core.labelling.asking import QUESTIONS, Asker
from core.labelling.assignment import assign
from core.labelling.continuity import PLACED_BY, back_nats, naming_nats
from core.labelling.network import NamedHand
from core.labelling.search import TemplateSearch
from core.track import LEAST_STD_M, HandTrack

KEPT = QUESTIONS // 2
"""Questions of a frame that are left to hands that are lost."""

BETTER_NATS = 1.0
"""What a new explanation must gain, or labels would flicker."""

BROKEN_ID_NATS, YOUNG_ID_NATS = 5.0, 1.0
"""What a device id that changes its marker costs, and one whose name was a guess: two fingers whose names were
exchanged as they crossed must be able to change them back."""

MOST_TOLD_NATS = 4.0
"""What a name costs at most that the network is sure is another."""

SURPRISE_SHARE = 0.3
"""Of the nats that digits cost which are elsewhere than their motion led: joints do not surprise one by one."""

MISFIT_NATS = 12.0
"""What a point costs at most for lying off its marker."""

SEEN_NATS = -4.0
"""What a named point costs where its marker's place was not known beforehand: less than a ghost beside a gap."""


class Mender:
    """Mends the labels of tracked hands."""

    def __init__(self, searches: Sequence[TemplateSearch], asker: Asker) -> None:
        self._searches = searches
        self._asker = asker

    @property
    def ready(self) -> bool:
        """May another hand be looked at in this frame?"""
        return self._asker.left > KEPT

    def ask(self, track: HandTrack, points_m: FloatArray, rows: IntArray) -> NamedHand | None:
        """What the network calls the points `rows`; `point` are rows of the frame. None if it cannot be asked now."""
        name = self._asker.name(track.performer, points_m[rows])
        if name is None:
            return None
        return NamedHand(name.side, _rows(name.point, rows), name.confidence, name.hidden)

    def improve(
        self, track: HandTrack, points_m: FloatArray, rows: IntArray, name: NamedHand | None, crossed: bool
    ) -> bool:
        """Take up names for the points `rows` (sorted, holding the track's own) that are clearly better.

        name: what the network calls these points, None if it was not asked. crossed: may fingers have been exchanged?
        """
        points, present = points_m[rows], _inverse_rows(track.point, rows)
        carried = np.where(track.carried, present, NO_POINT)
        search = self._searches[track.performer]
        proposals = [present, carried, assign(track.expected_m(), points, track.outlier_m)]
        if crossed:
            proposals += search.exchanged(present)
        told, told_nats = present, np.zeros(len(present))
        if name is not None:
            odds = name.confidence / np.maximum(1.0 - name.confidence, 1e-9)
            told_nats = np.clip(np.log(np.maximum(odds, 1.0)), 0.0, MOST_TOLD_NATS)
            told = _inverse_rows(name.point, rows)
            proposals += [told, np.where(carried != NO_POINT, carried, _without(told, carried))]
        poses = search.solve_all(track.predicted, points, proposals)
        before = track.pose.copy()
        naming = self._naming(track, points_m, rows)
        track.pose = before
        broken = np.where(track.provisional, YOUNG_ID_NATS, BROKEN_ID_NATS)
        costs = np.empty(len(proposals))
        for i, (pose, point) in enumerate(zip(poses, proposals, strict=True)):
            costs[i] = _misfit(track, pose, points, point) + SURPRISE_SHARE * track.surprise(pose.theta_rad)
            fresh = np.flatnonzero((point != NO_POINT) & (point != carried))
            costs[i] += naming[fresh, point[fresh]].sum()
            costs[i] += broken[(carried != NO_POINT) & (point != carried)].sum()
            costs[i] += told_nats[point != told].sum()
        best = int(np.argmin(costs))
        if costs[best] > costs[0] - BETTER_NATS:
            return False
        track.mend(poses[best], _rows(proposals[best], rows))
        track.solve(points_m)
        return True

    @staticmethod
    def _naming(track: HandTrack, points_m: FloatArray, rows: IntArray) -> FloatArray:
        """(m, len(rows)) nats for a name that no id carries."""
        ids_alone = np.where(track.carried, track.point, NO_POINT)
        if (ids_alone != NO_POINT).sum() < PLACED_BY:
            return np.full((len(track.point), len(rows)), SEEN_NATS)
        placed = track.placed(points_m, ids_alone)
        return naming_nats(points_m[rows], *placed, back_nats(track, rows))


def _misfit(track: HandTrack, pose: HandPose, points_m: FloatArray, point: IntArray) -> float:
    """Nats by which points lie off their markers."""
    seen = point != NO_POINT
    std_m = max(LEAST_STD_M, track.typical_rms_m)
    off = np.square(track.seen_at(pose)[seen] - points_m[point[seen]]).sum(axis=1) / std_m**2
    return float(np.minimum(0.5 * off, MISFIT_NATS).sum())


def _without(point: IntArray, taken: IntArray) -> IntArray:
    """Names less those of points that have one already."""
    return np.where(np.isin(point, taken[taken != NO_POINT]), NO_POINT, point)


def _rows(point: IntArray, rows: IntArray) -> IntArray:
    """Indices into a cluster as indices into the frame."""
    return np.where(point == NO_POINT, NO_POINT, rows[point])


def _inverse_rows(point: IntArray, rows: IntArray) -> IntArray:
    """Indices into the frame as indices into sorted `rows`, which hold them all."""
    return np.where(point == NO_POINT, NO_POINT, np.searchsorted(rows, point))
