"""Other names for the points of a hand that is tracked, and whether they are better (Han 2018, 4.4; Fig. 7).

Proposed are: the names as they are; those carried by ids alone; those that the pose suggests by nearness; neighbouring
fingers exchanged, tips alone or more; and, where it is asked, those of the network. All are solved at once. They are
judged by how well the hand then explains the points, by the ids, which rarely change their marker, by how the digits
were moving, and by what the network is sure of.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from core.frames import NO_POINT, BoolArray, FloatArray, IntArray
from core.kinematics.solver import HandPose
from core.labelling.asking import QUESTIONS, Asker
from core.labelling.assignment import assign
from core.labelling.continuity import GHOST_NATS, PLACED_BY, back_nats, exact_nats, place_nats
from core.labelling.network import NamedHand
from core.labelling.search import TemplateSearch
from core.track import REACH, HandTrack

KEPT = QUESTIONS // 2
"""Questions of a frame that are left to hands that are lost."""

BETTER_NATS = 1.0
"""What a new explanation must gain, or labels would flicker."""

BROKEN_NATS, BROKEN_ID_NATS, YOUNG_ID_NATS = 6.0, 2.0, 1.0
"""What it costs that device ids change their markers, each id that does, and each whose name was a guess: two fingers
whose names were exchanged as they crossed must be able to change them back, and that is one event."""

MOST_TOLD_NATS = 4.0
"""What a name costs at most that the network is sure is another."""

RIVAL_M, LEAST_RIVAL_M, MOST_RIVALS = 0.040, 0.012, 4
"""A point so near to a marker whose name is provisional, or at least to any whose name is young, may be that marker
instead; so many such markers are looked at."""

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
        name = self._asker.name(track.performer, points_m[rows], track.pose.scale)
        if name is None:
            return None
        return NamedHand(name.side, _rows(name.point, rows), name.confidence, name.hidden)

    def improve(
        self, track: HandTrack, points_m: FloatArray, rows: IntArray, name: NamedHand | None, against: FloatArray,
        crossed: bool,
    ) -> bool:  # fmt: skip
        """Take up names for the points `rows` (sorted, holding the track's own) that are clearly better.

        name: what the network calls these points, None if it was not asked. against: (m,) nats that it said against the
        present names before, negative for them. crossed: may fingers have been exchanged?
        """
        points, present = points_m[rows], _inverse_rows(track.point, rows)
        carried = np.where(track.carried, present, NO_POINT)
        firm = np.where(track.young, NO_POINT, carried)
        search = self._searches[track.performer]
        proposals = [present, carried, firm, assign(track.expected_m(), points, track.outlier_m)]
        proposals += _rivals(track, points, present)
        if crossed:
            proposals += search.exchanged(present)
        told, told_nats = present, np.zeros(len(present))
        if name is not None:
            odds = name.confidence / np.maximum(1.0 - name.confidence, 1e-9)
            told_nats = np.clip(np.log(np.maximum(odds, 1.0)), 0.0, MOST_TOLD_NATS)
            told = _inverse_rows(name.point, rows)
            told_nats = np.where(told == present, told_nats, np.maximum(told_nats + np.sign(told_nats) * against, 0.0))
            proposals += [told, np.where(carried != NO_POINT, carried, _without(told, carried))]
        poses = search.solve_all(track.predicted, points, proposals)
        before = track.pose.copy()
        place, back, contested = self._naming(track, points_m, rows)
        track.pose = before
        costs = np.empty(len(proposals))
        for i, (pose, point) in enumerate(zip(poses, proposals, strict=True)):
            costs[i] = _misfit(track, pose, points, point) + SURPRISE_SHARE * track.surprise(pose.theta_rad)
            fresh = np.flatnonzero((point != NO_POINT) & (point != firm))
            # That a marker was seen elsewhere is no word against a new name where this is what is in question.
            new = np.where((carried[fresh] == NO_POINT)[:, None], back[fresh], contested[fresh])
            costs[i] += new[np.arange(len(fresh)), point[fresh]].sum() - GHOST_NATS * len(fresh)
            if place is None:
                costs[i] += (GHOST_NATS + SEEN_NATS) * len(fresh)
            else:
                costs[i] += _placing(track, fresh, place[fresh, point[fresh]])
            # A point whose marker another one takes must be a ghost, if it is no other marker.
            costs[i] += GHOST_NATS * int(((firm != NO_POINT) & (point != NO_POINT) & ~np.isin(firm, point)).sum())
            costs[i] += _broken_nats((carried != NO_POINT) & (point != carried), track.young)
            costs[i] += told_nats[point != told].sum()
        best = int(np.argmin(costs))
        if costs[best] > costs[0] - BETTER_NATS:
            return False
        track.mend(poses[best], _rows(proposals[best], rows))
        track.solve(points_m)
        return True

    @staticmethod
    def _naming(
        track: HandTrack, points_m: FloatArray, rows: IntArray
    ) -> tuple[FloatArray | None, FloatArray, FloatArray]:
        """What a name costs that no id carries, (m, len(rows)) nats: for where the point is, None where too few ids
        tell where the hand is; for the marker's being seen anew; and the latter for one that another id is said to
        carry wrongly."""
        back, contested = (back_nats(track, rows, seen_elsewhere=seen) for seen in (True, False))
        ids_alone = np.where(track.carried & ~track.young, track.point, NO_POINT)
        if (ids_alone != NO_POINT).sum() < PLACED_BY:
            return None, np.zeros_like(back), np.zeros_like(back)
        place = place_nats(points_m[rows], *track.placed(points_m, ids_alone))
        # By now the hand expects young names where it was told they are: what it expected before counts too.
        young = np.flatnonzero(track.young & track.observed & np.isfinite(track.off_m[:, 0]))
        there_m = points_m[track.point[young]] - track.off_m[young]
        before = place_nats(points_m[rows], there_m, track.cov_m2[young], track.strayed_m2[young])
        own = np.arange(len(young)), np.searchsorted(rows, track.point[young])
        surprising = np.maximum(place[young], before)[own]
        place[young] = np.minimum(place[young], before)
        place[young[own[0]], own[1]] = surprising
        return place, back, contested


def _placing(track: HandTrack, fresh: IntArray, place: FloatArray) -> float:
    """What it costs that the markers `fresh` are where they are, (k,) nats each: of a digit the one that surprises most
    tells where it is; how far the others lie off it is counted by its pose."""
    digits = np.where(track.layout.joints[fresh] > 0, (track.layout.joints[fresh] - 1) // 3, -1)
    cost = float(place[digits < 0].sum())
    for digit in np.unique(digits[digits >= 0]):
        own = place[digits == digit]
        cost += float(own.max()) + (len(own) - 1) * exact_nats(track.std_at_best_m)
    return cost


def _misfit(track: HandTrack, pose: HandPose, points_m: FloatArray, point: IntArray) -> float:
    """Nats by which points lie off their markers."""
    seen = point != NO_POINT
    squared = np.square(track.seen_at(pose)[seen] - points_m[point[seen]]).sum(axis=1)
    off = squared / track.std_at_best_m**2
    return float(np.minimum(0.5 * off, MISFIT_NATS).sum())


def _broken_nats(broken: BoolArray, young: BoolArray) -> float:
    """What it costs that the ids of these markers (m,) are said to be others'."""
    firm = int((broken & ~young).sum())
    return (BROKEN_NATS + BROKEN_ID_NATS * firm if firm else 0.0) + YOUNG_ID_NATS * int((broken & young).sum())


def rival_m(track: HandTrack) -> FloatArray:
    """(m,) [m]: how near to the point of a young name another one has as good a claim to it."""
    near: FloatArray = np.where(track.provisional, RIVAL_M, np.maximum(REACH * track.std_m, LEAST_RIVAL_M))
    return near


def _rivals(track: HandTrack, points_m: FloatArray, present: IntArray) -> list[IntArray]:
    """The names with one young one given to the point nearest to its own that has none, for a few such markers."""
    spare = np.setdiff1d(np.arange(len(points_m)), present)
    young = np.flatnonzero(track.young & (present != NO_POINT))
    if len(spare) == 0 or len(young) == 0:
        return []
    gaps_m = np.linalg.norm(points_m[present[young]][:, None] - points_m[spare][None], axis=2)
    nearest, near_m = gaps_m.argmin(axis=1), rival_m(track)[young]
    found = []
    for i in np.argsort(gaps_m.min(axis=1), kind="stable")[:MOST_RIVALS]:
        if gaps_m[i, nearest[i]] < near_m[i]:
            point = present.copy()
            point[young[i]] = spare[nearest[i]]
            found.append(point)
    return found


def _without(point: IntArray, taken: IntArray) -> IntArray:
    """Names less those of points that have one already."""
    return np.where(np.isin(point, taken[taken != NO_POINT]), NO_POINT, point)


def _rows(point: IntArray, rows: IntArray) -> IntArray:
    """Indices into a cluster as indices into the frame."""
    return np.where(point == NO_POINT, NO_POINT, rows[point])


def _inverse_rows(point: IntArray, rows: IntArray) -> IntArray:
    """Indices into the frame as indices into sorted `rows`, which hold them all."""
    return np.where(point == NO_POINT, NO_POINT, np.searchsorted(rows, point))
