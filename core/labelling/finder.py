"""Looks for hands among the points that no tracked hand explains (Han 2018, 4.2 and 4.4).

Free points are clustered; for clusters and missing hands the network names the markers, and each set of names is fitted
by inverse kinematics. What counts is how well the hand then explains the points, and how far the network agrees; hands
are dealt to clusters so that the whole is best. Left or right is told by the same means: asked for the wrong side, the
network names nothing. Where it does not know its way about, as with few markers, the layout in typical postures is laid
onto the cluster from all directions, a part of them in each frame.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from core.frames import NO_POINT, BoolArray, FloatArray, HandKey, HandState, IntArray
from core.kinematics.solver import HandPose
from core.labelling.asking import Asker
from core.labelling.clusters import SPARE_POINTS
from core.labelling.clusters import groups as groups_of
from core.labelling.in_turn import LEAST_TURNS, Share, in_turn
from core.labelling.network import MOST_POINTS, NamedHand
from core.labelling.search import GATES_M, Hypothesis, TemplateSearch
from core.labelling.validation import MAX_RMS_M
from core.track import HandTrack

LEAST_SHARE = 0.6
"""Share of a layout's markers that must be seen for a hand to be recognised."""

NEAR_M = 0.30
"""So far from where it was lost a hand may be back a moment later."""

AROUND_M = 0.030
"""A free point so near to a marker is left unexplained if it is no marker of the hand."""

AGREED = 0.8
"""Share of a hand's names that the network must give too for the hand to be taken up at once."""

DISAGREEMENT = 0.5
"""What a name costs that the network is sure is another, in markers without a point."""

HISTORY = 1.0
"""What a hand that was lost nearby has ahead of one that was never there, in markers without a point."""

OTHER_SIDE = 0.1
"""A cloud that is less likely a hand of this side is not fitted to it before every other has been tried."""

SURE_COST = 3.0
"""A hand that leaves so many markers without a point is not taken up before every other has been tried there."""

SAME_SIZE = 1.15
"""The two hands of a person differ by less; while sizes are found, fits of 13 markers or more are this near."""

ALIKE = 1.5
"""Two hands of one performer whose costs for the same points differ by less are not told apart in one frame;"""

ALIKE_FRAMES = 6
"""after so many, the better one is taken."""


@dataclass(frozen=True)
class _Match:
    """A missing hand on some points. point: (m,) rows in the frame. agreed: share of names that the network gives."""

    pose: HandPose
    point: IntArray
    cost: float
    agreed: float
    confidence: FloatArray


class HandFinder:
    """Finds the hands of all performers."""

    def __init__(self, searches: Sequence[TemplateSearch], asker: Asker) -> None:
        """searches: one per performer."""
        self._searches = searches
        self._asker = asker
        self.reset()

    def reset(self) -> None:
        """Forget what was tried before."""
        self._asked = 0  # pairs of a hand and a group, since a hand was last found
        self._parts: dict[HandKey, int] = {}  # of a search by postures, done
        self._best: dict[HandKey, _Match] = {}  # that it has found so far
        self._alike = 0  # frames since two hands were first alike

    def skip(self, frames: int) -> None:
        """So many frames went by unseen: two hands that were alike have been so for longer."""
        if self._alike:
            self._alike += frames

    def keep(self, hands: Mapping[HandKey, HandKey]) -> None:
        """Go on looking for these hands where the search for them stands."""
        self._parts = {hands[key]: part for key, part in self._parts.items() if key in hands}
        self._best = {hands[key]: match for key, match in self._best.items() if key in hands}

    def find(self, points_m: Sequence[FloatArray], ids: IntArray, free: IntArray, tracks: Sequence[HandTrack]) -> None:
        """Begin every track whose hand is found."""
        n_markers = max(len(track.point) for track in tracks)
        groups = [free[group] for group in groups_of(points_m[0][free], n_markers) if len(group) <= MOST_POINTS]
        if not groups:
            self._asked = 0
            self._parts.clear()
            self._best.clear()
            for track, points in zip(tracks, points_m, strict=True):
                track.why = _why_nothing(track, points[free])
            return
        matches: dict[tuple[int, int], _Match] = {}
        searched, asked, n_pairs = False, 0, len(groups) * len(tracks)
        for i, g in self._pairs(points_m, groups, tracks):
            track, points = tracks[i], points_m[i]
            scale = track.known_scale or self._asker.found.get(track.performer)
            if scale is None:
                size = self._asker.sized(track.performer, track.side, points, groups[g])
                if size is None:
                    break
                scale, own = size
                if self._asked < n_pairs and own < OTHER_SIDE:
                    asked += 1
                    continue
            other = _other_hand(i, tracks)
            if other is not None and len(groups[g]) > len(track.point) + SPARE_POINTS:
                shares = self._shares((i, other), points_m, groups[g], scale, track.performer)
                if shares is None:
                    break
                name = shares[0].among_all
                found, beside = self._by_both((i, other), points_m, groups[g], free, shares, tracks)
                if beside is not None and _better(beside, matches.get((other, g))):
                    matches[other, g] = beside
            else:
                one = self._asker.name(track.performer, points[groups[g]], scale)
                if one is None:
                    break
                name, found = one, self._by_network(track, points, groups[g], free, one)
            asked += 1
            if (found is None or found.agreed < AGREED) and not searched:
                searched = True
                found = self._by_postures(track, points, groups[g], free, name)
            if found is not None and _better(found, matches.get((i, g))):
                matches[i, g] = found
        self._asked += asked
        if self._asked < n_pairs:
            matches = {pair: match for pair, match in matches.items() if match.cost <= SURE_COST}
        self._deal(matches, groups, ids, tracks)

    def _pairs(
        self, points_m: Sequence[FloatArray], groups: Sequence[IntArray], tracks: Sequence[HandTrack]
    ) -> list[tuple[int, int]]:
        """Which hand to look for where: first those lost nearby, then all in turn."""
        pairs = [(i, g) for g in range(len(groups)) for i in range(len(tracks))]
        shift = self._asked % len(pairs)
        pairs = pairs[shift:] + pairs[:shift]
        return sorted(pairs, key=lambda pair: not _near(tracks[pair[0]], points_m[pair[0]][groups[pair[1]]]))

    def _shares(
        self, pair: tuple[int, int], points_m: Sequence[FloatArray], group: IntArray, scale: float, performer: int
    ) -> tuple[Share, Share] | None:
        """What the network gives each of a performer's hands of one group; None where too few questions are left."""
        if self._asker.left < LEAST_TURNS:
            return None
        return in_turn(
            lambda hand, rows: self._asker.name(performer, points_m[pair[hand]][group[rows]], scale), len(group)
        )

    def _by_both(
        self,
        pair: tuple[int, int],
        points_m: Sequence[FloatArray],
        group: IntArray,
        free: IntArray,
        shares: tuple[Share, Share],
        tracks: Sequence[HandTrack],
    ) -> tuple[_Match | None, _Match | None]:
        """Both hands in one group, each on what the other one left of it."""
        one, other = (
            self._by_network(
                tracks[i], points_m[i], group[share.rows],
                np.setdiff1d(free, group[beside.named], assume_unique=True), share.name,
            )
            for i, share, beside in zip(pair, shares, reversed(shares), strict=True)
        )  # fmt: skip
        return one, other

    def _by_network(
        self, track: HandTrack, points_m: FloatArray, rows: IntArray, free: IntArray, name: NamedHand
    ) -> _Match | None:
        search = self._searches[track.performer]
        found = search.fit_named(points_m[rows], name.point, track.known_scale)
        if _near(track, points_m[rows]):
            again = search.find_near(points_m[rows], track.pose)
            found += [again] if again is not None else []
        return self._best_match(track, points_m, rows, free, name, found)

    def _by_postures(
        self, track: HandTrack, points_m: FloatArray, rows: IntArray, free: IntArray, name: NamedHand
    ) -> _Match | None:
        """The next part of a search from nothing, and what the parts before it found, on the present points."""
        search, part = self._searches[track.performer], self._parts.get(track.key, 0)
        found = [search.find(points_m[rows], track.known_scale, part)]
        if track.key in self._best:
            found.append(search.refined(self._best[track.key].pose, points_m[rows], track.known_scale))
        best = self._best_match(track, points_m, rows, free, name, [one for one in found if one is not None])
        self._parts[track.key] = part + 1
        if best is not None:
            self._best[track.key] = best
        return best

    @staticmethod
    def _best_match(
        track: HandTrack,
        points_m: FloatArray,
        rows: IntArray,
        free: IntArray,
        name: NamedHand,
        found: Sequence[Hypothesis],
    ) -> _Match | None:
        matches = []
        for one in found:
            if one.pose.rms_m > MAX_RMS_M or one.n_labelled < LEAST_SHARE * len(track.point):
                continue
            point = np.where(one.point == NO_POINT, NO_POINT, rows[one.point])
            same = one.point == name.point
            cost = _unexplained(one.pose, point, points_m, free)
            cost += DISAGREEMENT * float(name.confidence[~same].sum())
            cost -= HISTORY * _near(track, points_m[rows])
            sure = np.where(same, name.confidence, 0.5 * (1.0 - name.confidence))
            matches.append(_Match(one.pose, point, cost, float(same.mean()), sure))
        return min(matches, key=lambda match: match.cost, default=None)

    def _deal(
        self,
        matches: dict[tuple[int, int], _Match],
        groups: Sequence[IntArray],
        ids: IntArray,
        tracks: Sequence[HandTrack],
    ) -> None:
        """Take up hands so that all together cost least; what is most certain takes its points first."""
        for i, track in enumerate(tracks):
            tried = any(pair[0] == i for pair in matches)
            done = self._parts.get(track.key, 0) >= self._searches[track.performer].n_parts
            track.why = "out of shape" if done and not tried else "searching"
        ready = {pair: match for pair, match in matches.items() if self._ready(tracks[pair[0]], match)}
        if self._two_alike(ready, tracks):
            return
        nothing = 1e6
        costs = np.full((len(tracks), len(groups)), nothing)
        for (i, g), match in ready.items():
            costs[i, g] = match.cost
        dealt = {(int(i), int(g)) for i, g in zip(*linear_sum_assignment(costs), strict=True) if costs[i, g] < nothing}
        taken: set[int] = set()
        sizes = dict(self._asker.about)
        # What is most certain takes its points first; after that, what is left in a group may be another hand.
        for i, g in sorted(ready, key=lambda pair: (pair not in dealt, ready[pair].cost, pair)):
            match = ready[i, g]
            claimed = set(match.point[match.point != NO_POINT].tolist())
            if tracks[i].tracked or claimed & taken or self._anothers(i, match, tracks, sizes):
                continue
            sizes.setdefault(tracks[i].performer, match.pose.scale)
            taken |= claimed
            tracks[i].begin(match.pose, match.point, ids)
            tracks[i].label_confidence[:] = match.confidence
            self._asked = 0
            self._parts.pop(tracks[i].key, None)
            self._best.pop(tracks[i].key, None)

    def _anothers(self, i: int, match: _Match, tracks: Sequence[HandTrack], sizes: Mapping[int, float]) -> bool:
        """Is it rather the hand of somebody who wears the same, for this performer's other hand is of another size?
        sizes: by performer."""
        track, size = tracks[i], sizes.get(tracks[i].performer)
        if size is None or not track.free_scale or _apart(match.pose.scale, size) < SAME_SIZE:
            return False
        return any(
            other.side == track.side
            and not other.tracked
            and other.free_scale
            and (other.performer not in sizes or _apart(match.pose.scale, sizes[other.performer]) < SAME_SIZE)
            for other in tracks
            if other.performer != track.performer and self._asker.alike(track.performer, other.performer)
        )

    def _ready(self, track: HandTrack, match: _Match) -> bool:
        """Does the network agree, or is there nothing better?"""
        return match.agreed >= AGREED or self._parts.get(track.key, 0) >= self._searches[track.performer].n_parts

    def _two_alike(self, ready: dict[tuple[int, int], _Match], tracks: Sequence[HandTrack]) -> bool:
        """Would two hands of one performer explain the same points equally well, and may that still be waited out?"""
        alike = [
            (i, j)
            for (i, g), one in ready.items()
            for (j, h), other in ready.items()
            if i < j
            and g == h
            and tracks[i].performer == tracks[j].performer
            and abs(one.cost - other.cost) < ALIKE
            and _same_points(one, other)
        ]
        self._alike = self._alike + 1 if alike else 0
        if not 0 < self._alike <= ALIKE_FRAMES:
            self._alike = 0
            return False
        for i in {i for pair in alike for i in pair}:
            tracks[i].why = "two hands alike"
        return True


def _other_hand(i: int, tracks: Sequence[HandTrack]) -> int | None:
    """The performer's other hand, where that is looked for, too."""
    own = tracks[i].performer
    return next((j for j, track in enumerate(tracks) if j != i and track.performer == own), None)


def _better(match: _Match, known: _Match | None) -> bool:
    return known is None or match.cost < known.cost


def _apart(one: float, other: float) -> float:
    """How many times as large the larger is."""
    return max(one / other, other / one)


def _same_points(one: _Match, other: _Match) -> bool:
    """Do two hands claim mostly the same points?"""
    a, b = one.point[one.point != NO_POINT], other.point[other.point != NO_POINT]
    return bool(np.isin(a, b).sum() > 0.5 * min(len(a), len(b)))


def _near(track: HandTrack, points_m: FloatArray) -> bool:
    """Was the hand lost where these points are?"""
    if track.state is not HandState.LOST:
        return False
    apart = points_m.mean(axis=0) - track.pose.markers_world_m.mean(axis=0)
    return bool(np.linalg.norm(apart) < NEAR_M)


def _unexplained(pose: HandPose, point: IntArray, points_m: FloatArray, free: IntArray) -> float:
    """What a hand leaves open, in markers without a point: these, free points in its midst, and distances."""
    seen = point != NO_POINT
    off_m2 = np.square(pose.markers_world_m[seen] - points_m[point[seen]]).sum(axis=1)
    others = np.setdiff1d(free, point[seen], assume_unique=True)
    gaps_m2 = np.square(points_m[others][:, None] - pose.markers_world_m[None]).sum(axis=2)
    inside: BoolArray = (gaps_m2 < AROUND_M**2).any(axis=1)
    return float(np.minimum(off_m2 / GATES_M[-1] ** 2, 1.0).sum() + (~seen).sum() + inside.sum())


def _why_nothing(track: HandTrack, free_m: FloatArray) -> str:
    """One of WHY_LOST for a hand that has no cluster to be looked for in."""
    if track.state is HandState.LOST:
        near = np.linalg.norm(free_m - track.pose.markers_world_m.mean(axis=0), axis=1) < NEAR_M
        if not near.any():
            return "left the volume" if track.was_leaving else "no points"
    return "too few markers" if len(free_m) else "no points"
