"""Where a prop is in every frame, and which points are its own (Schröder 2017, "Fully automatic tracking").

A prop that was seen a moment ago is followed by the ids of its points and by nearness; one that is not is searched
among all points by the triangles that its markers make. Chance makes such triangles too: what is found must stay rigid
for some frames before it counts, the longer the fewer markers speak for it.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from core.frames import NO_ID, NO_POINT, BoolArray, FloatArray, IntArray, PropFrame
from core.props import kernels
from core.props.prop import LEAST_MARKERS, Prop

ID_GATE_M = 0.100
"""A point with a known id further from its expected place has been given another's id."""

GATE_M = 0.025
"""How far from its expected place a marker without a known id may be."""

FINE_RATIO, FINE_GATE_M = 5.0, (0.002, 0.005)
"""No point further from its marker, in usual residuals, is one of the prop; within these bounds."""

LIMIT_M, PROOF_LIMIT_M = 0.003, 0.0015
"""Largest root mean square residual of a prop that is known, and of one that is new."""

FEW_RATIO, FEW_LIMIT_M = 6.0, (0.0004, 0.0015)
"""Largest residual where just three of more markers are seen, in usual residuals; within these bounds."""

SIDE_TOLERANCE_M = 0.002
LEAST_FOUND = 4
"""Three points congruent to three markers are found in any hand: a prop with more is not taken up from so few."""

PROOF_FRAMES = {3: 12, 4: 6}
PROOF_FRAMES_MORE = 3
NEAR_PROOF_FRAMES, NEAR_PROOF_FRAMES_MORE = {3: 5}, 2
"""Frames for which what was found must stay rigid, by the number of its markers; fewer near where the prop was lost."""

NEAR_S = 0.5
"""So long after a loss a prop is where it was, or its points still bear their ids."""

SEARCH_EVERY = 4
"""Frames from search to search for what has been away for longer."""

MOST_POINTS = 200
"""Points among which a search is worth its time."""

MOST_TRIANGLES = 60
PULL = 1e-2
"""Weight of a hidden marker's expected place: it decides only what the seen ones leave open."""

MAX_STEP_S = 0.1
USUAL_RMS_M, USUAL_BLEND = 0.0005, 0.02
_TURN_COST, _HOME_COST = 0.3, 0.05
"""What half a turn from the last pose, and from how a prop lay when it was defined, costs in points: enough that noise
does not decide between sides that look the same, too little to overrule what is seen."""


class PropTracker:
    """Follows one prop.

    transform_world: (4, 4) float64 [m], the last pose known. tracked: it is that of the present frame. point: (m,)
    int64, row of each marker's point. rms_m: distance of those points from the markers [m], NaN if not tracked.
    """

    def __init__(self, prop: Prop) -> None:
        self.prop = prop
        self._markers = np.ascontiguousarray(prop.markers_m, dtype=np.float64)
        self._triangles = _triangles(self._markers)
        home = np.eye(4)
        home[:3, :3] = np.eye(3) if prop.home is None else prop.home
        self._home = home, 0.0 if prop.home is None else _HOME_COST
        self.reset()

    def reset(self) -> None:
        """Search anew."""
        m = len(self._markers)
        self.transform_world = np.eye(4)
        self.tracked = False
        self.point = np.full(m, NO_POINT, dtype=np.int64)
        self.rms_m = float("nan")
        self._pose, self._before, self._trial = np.eye(4), np.eye(4), np.eye(4)
        self._ids = np.full(m, NO_ID, dtype=np.int64)
        self._proof_left = -1  # frames until what is followed counts; -1: nothing is
        self._moving = False  # the last two frames tell a velocity
        self._away_s = np.inf
        self._search_in = 0  # frames
        self._usual_rms_m = USUAL_RMS_M

    def skip(self, frames: int) -> None:
        """So many frames went by unseen. What is still rigid after them was so in them, but one look more is due."""
        if self._proof_left > 0:
            self._proof_left = max(self._proof_left - frames, 1)
        self._search_in = max(self._search_in - frames, 0)

    def pass_over(self, ids: frozenset[int]) -> None:
        """A frame went by of which only the ids of its points are looked at: one that has gone is nobody's."""
        self.skip(1)
        for marker, own in enumerate(self._ids.tolist()):
            if own not in ids:
                self._ids[marker] = NO_ID

    @property
    def known(self) -> bool:
        """Was it ever tracked?"""
        return bool(np.isfinite(self._away_s))

    def frame(self, points_m: FloatArray, rows: IntArray) -> PropFrame:
        """The public record. points_m: (n, 3) as in `step`; rows: (n,) int64, their places in the device's frame."""
        point = np.full(len(self.point), NO_POINT, dtype=np.int64)
        seen = self.point != NO_POINT
        point[seen] = rows[self.point[seen]]
        markers_m = self.prop.placed_m(self.transform_world)
        markers_m[seen] = points_m[self.point[seen]]
        return PropFrame(self.prop.name, self.transform_world, self.tracked, point, self.rms_m, markers_m)

    def step(self, points_m: FloatArray, ids: IntArray, free: BoolArray, dt_s: float) -> None:
        """Look at one frame: points_m (n, 3) float64 [m], finite; ids (n,); free (n,), points nobody has taken."""
        self.point[:] = NO_POINT
        found = self._follow(points_m, ids, free, dt_s) if self._proof_left >= 0 else np.inf
        followed = bool(np.isfinite(found))
        if not followed:
            was_tracked, self.tracked = self.tracked, False
            self._proof_left = -1
            self._away_s = 0.0 if was_tracked else self._away_s + (dt_s if dt_s > 0.0 else 0.0)  # NaN is not
            found = self._find_again(points_m, ids, free)
        if np.isfinite(found):
            self._take(found, ids, followed)
        if not self.tracked:
            self.rms_m = float("nan")
            self._keep_ids(ids, free)

    def _follow(self, points_m: FloatArray, ids: IntArray, free: BoolArray, dt_s: float) -> float:
        """The residual [m] of the prop where its motion leads."""
        expected = self._pose
        if self._moving and 0.0 < dt_s <= MAX_STEP_S:
            expected = expected.copy()
            expected[:3, :3] = self._pose[:3, :3] @ self._before[:3, :3].T @ self._pose[:3, :3]
            expected[:3, 3] += self._pose[:3, 3] - self._before[:3, 3]
        return self._fitted(points_m, ids, free, expected, LIMIT_M if self.tracked else PROOF_LIMIT_M)

    def _fitted(
        self, points_m: FloatArray, ids: IntArray, free: BoolArray, expected: FloatArray, limit_m: float
    ) -> float:
        fine_m = min(max(FINE_RATIO * self._usual_rms_m, FINE_GATE_M[0]), FINE_GATE_M[1])
        few_m = min(max(FEW_RATIO * self._usual_rms_m, FEW_LIMIT_M[0]), FEW_LIMIT_M[1])
        return float(
            kernels.follow(
                self._markers, points_m, ids, free, self._ids, expected, ID_GATE_M, GATE_M, fine_m, limit_m, few_m,
                PULL, self._trial, self.point,
            )
        )  # fmt: skip

    @property
    def _n_seen(self) -> int:
        return int((self.point != NO_POINT).sum())

    def _find_again(self, points_m: FloatArray, ids: IntArray, free: BoolArray) -> float:
        """The residual [m] of the prop near where it was lost, or anywhere."""
        near = self._away_s < NEAR_S
        due = self._search_in == 0
        self._search_in = (SEARCH_EVERY if due else self._search_in) - 1
        if near:
            rms_m = self._fitted(points_m, ids, free, self.transform_world, PROOF_LIMIT_M)
            if np.isfinite(rms_m):
                self._proof_left = NEAR_PROOF_FRAMES.get(self._n_seen, NEAR_PROOF_FRAMES_MORE)
                return rms_m
        elif not due:
            return np.inf
        rows = np.flatnonzero(free)
        least = min(LEAST_FOUND, len(self._markers))
        if not least <= len(rows) <= MOST_POINTS:
            return np.inf
        last, turn_cost = self._home if not self.known else (self.transform_world, _TURN_COST)
        rms_m = float(
            kernels.find(
                self._markers, self._triangles, points_m, rows, SIDE_TOLERANCE_M, PROOF_LIMIT_M, least, last, turn_cost,
                self._trial, self.point,
            )
        )  # fmt: skip
        if np.isfinite(rms_m):
            self._proof_left = PROOF_FRAMES.get(self._n_seen, PROOF_FRAMES_MORE)
        return rms_m

    def _take(self, rms_m: float, ids: IntArray, followed: bool) -> None:
        """Take up what the present frame shows, once it is proven."""
        self._moving = followed
        self._before, self._pose, self._trial = self._pose, self._trial, self._before
        seen = self.point != NO_POINT
        self._ids[seen] = ids[self.point[seen]]
        self._ids[~seen] = NO_ID
        if self._proof_left > 0:
            self._proof_left -= 1
        if self._proof_left > 0:
            return
        self.tracked, self.rms_m, self._away_s, self._search_in = True, rms_m, 0.0, 0
        self._usual_rms_m += USUAL_BLEND * (rms_m - self._usual_rms_m)
        self.transform_world = self._pose.copy()

    def _keep_ids(self, ids: IntArray, free: BoolArray) -> None:
        """What was the prop's a moment ago and still bears its id is nobody else's, though too little for a pose."""
        near = self._away_s < NEAR_S
        if near and self._proof_left >= 0:
            return
        self.point[:] = NO_POINT
        if not near:
            return
        for k, known in enumerate(self._ids.tolist()):
            rows = np.flatnonzero((ids == known) & free)
            if known != NO_ID and len(rows) == 1:
                self.point[k] = rows.item()
            else:
                self._ids[k] = NO_ID


class Props:
    """All props of a profile, the one with the most markers first."""

    def __init__(self, props: Sequence[Prop]) -> None:
        self.trackers: tuple[PropTracker, ...] = ()
        self.change(props)

    def change(self, props: Sequence[Prop]) -> None:
        """Follow other props. What has the same markers is followed on, also under another name."""
        old = list(self.trackers)
        trackers: list[PropTracker | None] = [None] * len(props)
        for may_follow in (_same_name, same_markers):  # of two alike each keeps its own
            for i, prop in enumerate(props):
                known = next((one for one in old if may_follow(one.prop, prop) and same_markers(one.prop, prop)), None)
                if trackers[i] is None and known is not None:
                    old.remove(known)
                    known.prop, trackers[i] = prop, known
        self.trackers = tuple(
            PropTracker(prop) if tracker is None else tracker for prop, tracker in zip(props, trackers, strict=True)
        )
        self._order = sorted(self.trackers, key=lambda tracker: -len(tracker.prop.markers_m))

    def reset(self) -> None:
        """Search all anew."""
        for tracker in self.trackers:
            tracker.reset()

    def skip(self, frames: int) -> None:
        """So many frames went by unseen."""
        for tracker in self.trackers:
            tracker.skip(frames)

    def pass_over(self, ids: frozenset[int]) -> None:
        """A frame went by of which only the ids of its points are looked at."""
        for tracker in self.trackers:
            tracker.pass_over(ids)

    def step(self, points_m: FloatArray, ids: IntArray, dt_s: float) -> BoolArray:
        """(n,) bool: points of the frame that belong to no prop. points_m (n, 3) float64 [m]; ids (n,)."""
        free = np.ones(len(ids), dtype=np.bool_)
        # What is tracked goes first: a search must not take its points.
        for tracker in sorted(self._order, key=lambda tracker: not tracker.tracked):
            tracker.step(points_m, ids, free, dt_s)
            free[tracker.point[tracker.point != NO_POINT]] = False
        return free

    def frames(self, points_m: FloatArray, rows: IntArray) -> tuple[PropFrame, ...]:
        """What is known of each in the present frame; of those that were ever tracked. points_m: (n, 3) as in `step`;
        rows: (n,) int64, their places in the device's frame."""
        return tuple(tracker.frame(points_m, rows) for tracker in self.trackers if tracker.known)


def same_markers(one: Prop, other: Prop) -> bool:
    """Are two props, whatever they are called and look like, the same to a tracker?"""
    home, its = (np.eye(0) if prop.home is None else prop.home for prop in (one, other))
    return np.array_equal(one.markers_m, other.markers_m) and np.array_equal(home, its)


def _same_name(one: Prop, other: Prop) -> bool:
    return one.name == other.name


def warm_up() -> None:
    """Compile the kernels that a tracker uses, or load them from the cache."""
    tracker = PropTracker(Prop("", np.eye(3)))
    for _ in range(2):
        tracker.step(np.eye(3), np.arange(3), np.ones(3, dtype=np.bool_), 0.01)


def _triangles(markers_m: FloatArray) -> IntArray:
    """(t, 3) int64, the widest first: small ones leave the pose open."""
    triangles = np.array(list(combinations(range(len(markers_m)), LEAST_MARKERS)), dtype=np.int64)
    a, b, c = markers_m[triangles[:, 0]], markers_m[triangles[:, 1]], markers_m[triangles[:, 2]]
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    return triangles[np.argsort(-areas, kind="stable")[:MOST_TRIANGLES]]
