"""Tracklets: runs of points, frame after frame, that are one physical marker beyond doubt.

A device that gives ids says so itself, as long as an id is seen in every frame. Without ids, a point goes on as the
one that is nearest to where its motion leads, if no other comes into question. Better one tracklet too many than one
that changes its marker: parts of a marker find together again by their names, a mixture never comes apart. So a
tracklet ends wherever it is in doubt, and is cut where it jumps.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from core.frames import NO_ID, BoolArray, FloatArray, IntArray, MarkerFrame
from core.gaps import present
from core.relabel.cloud import SHORTEST_STEP_S, Cloud, Column, clock_s, usable

MOST_SPEED_M_PER_S = 8.0
"""No fingertip is faster."""

MOST_ACCELERATION_M_PER_S2 = 150.0
"""Of a hand that claps; within one frame, noise of points (NOISE_M) on top."""

NOISE_M = 0.003

LINK_M = 0.015
"""Without ids: how far a point may be from where its motion leads, or, at its second frame, from where it was."""

APART = 2.0
"""Without ids: any other point must be so many times further off than the one that is linked."""


@dataclass
class _Before:
    """The points of the frame before: where, whose, and how they moved there."""

    points_m: FloatArray
    ids: IntArray
    tracklet: IntArray
    velocity: FloatArray  # [m/s], NaN at a tracklet's first point


class TrackletBuilder:
    """Frames in, in order; `cloud` is what came of them."""

    def __init__(self) -> None:
        self._before = _Before(np.empty((0, 3)), np.empty(0, np.int64), np.empty(0, np.int64), np.empty((0, 3)))
        self._last_s = float("nan")
        self._next = 0
        self._counts, self._times = Column(np.int64), Column(np.float64)
        self._tracklet, self._step, self._kink = Column(np.int32), Column(np.float32), Column(np.float32)

    def push(self, frame: MarkerFrame) -> None:
        """One more frame."""
        now_s = clock_s(frame.times)
        dt_s = now_s - self._last_s
        points, n = frame.points_m, len(frame.points_m)
        link = np.full(n, -1, dtype=np.int64)
        if dt_s > SHORTEST_STEP_S:
            link = self._links(frame, dt_s)
        old = link >= 0
        tracklet = np.empty(n, dtype=np.int64)
        tracklet[old] = self._before.tracklet[link[old]]
        fresh = int((~old).sum())
        tracklet[~old] = self._next + np.arange(fresh)
        self._next += fresh
        velocity = np.full((n, 3), np.nan)
        velocity[old] = (points[old] - self._before.points_m[link[old]]) / dt_s
        step = np.linalg.norm(velocity, axis=1) * dt_s
        kink = np.full(n, np.nan)
        change = np.linalg.norm(velocity[old] - self._before.velocity[link[old]], axis=1) * dt_s
        kink[old] = change / (NOISE_M + MOST_ACCELERATION_M_PER_S2 * dt_s * dt_s)
        self._before = _Before(points, frame.ids, tracklet, velocity)
        self._last_s = now_s
        self._counts.extend(np.array([n]))
        self._times.extend(np.array([now_s]))
        self._tracklet.extend(tracklet)
        self._step.extend(step)
        self._kink.extend(kink)

    def cloud(self) -> Cloud:
        """Every point of the frames so far."""
        first = np.concatenate([[0], np.cumsum(self._counts.whole())]).astype(np.int64)
        return Cloud(first, self._tracklet.whole(), self._step.whole(), self._kink.whole(), self._times.whole())

    def _links(self, frame: MarkerFrame, dt_s: float) -> IntArray:
        """(n,) int64, for each point the one of the frame before that it goes on from, -1 for none."""
        before, points = self._before, frame.points_m
        link = np.full(len(points), -1, dtype=np.int64)
        row_of_id = {id_: row for row, id_ in enumerate(before.ids.tolist()) if id_ != NO_ID}
        ids = frame.ids.tolist()
        if row_of_id:
            twice = len(set(ids)) < len(ids) or len(row_of_id) < len(before.ids)
            for row, id_ in enumerate(ids):
                link[row] = row_of_id.get(id_, -1)
            if twice:  # an id that two points carry says nothing
                link[_repeated(frame.ids)] = -1
                link[np.isin(link, np.flatnonzero(_repeated(before.ids)))] = -1
            there = link >= 0
            gone = np.linalg.norm(points[there] - before.points_m[link[there]], axis=1)
            fast = ~(gone <= MOST_SPEED_M_PER_S * dt_s + NOISE_M)  # so is what is not finite
            link[np.flatnonzero(there)[fast]] = -1
        loose = (frame.ids == NO_ID) & usable(frame)
        if loose.any():
            self._link_near(link, points, loose, dt_s)
        return link

    def _link_near(self, link: IntArray, points_m: FloatArray, loose: BoolArray, dt_s: float) -> None:
        """Writes the links of points without ids."""
        before = self._before
        rows = np.flatnonzero(loose)
        others = np.flatnonzero((before.ids == NO_ID) & present(before.points_m))
        if len(others) == 0:
            return
        led = before.points_m[others] + np.nan_to_num(before.velocity[others]) * dt_s
        distance = np.linalg.norm(points_m[rows][:, None] - led[None], axis=2)
        nearest, back = distance.argmin(axis=1), distance.argmin(axis=0)
        here = np.arange(len(rows))
        best = distance[here, nearest]
        good = (back[nearest] == here) & (best < LINK_M)
        good &= (_second(distance, 1) > APART * best) & (_second(distance, 0)[nearest] > APART * best)
        link[rows[good]] = others[nearest[good]]


def cut(cloud: Cloud, named: tuple[NDArray[np.int16], NDArray[np.int16]]) -> Cloud:
    """The same points with tracklets cut where they change their marker.

    They do where they jump, against the velocity before and after; and where two passes, `named` (n_points,) int16
    each, below 0 for no name, agree on one name before and on another after: at the longest step in between.
    """
    order = np.argsort(cloud.tracklet, kind="stable")  # within a tracklet by frame
    tracklet = cloud.tracklet[order]
    begins = np.concatenate([[True], tracklet[1:] != tracklet[:-1]])[: len(order)]
    kink = cloud.kink[order]
    after = np.concatenate([kink[1:], [np.nan]])[: len(order)]
    after[np.concatenate([begins[1:], [True]])[: len(order)]] = np.nan
    step = cloud.step_m[order]
    known = ~(np.isnan(kink) & np.isnan(after))
    jump = ~begins & known & ~(kink <= 1.0) & ~(after <= 1.0)
    begins |= jump
    forward, backward = named[0][order], named[1][order]
    agreed = np.flatnonzero((forward == backward) & (forward >= 0))
    run = np.cumsum(begins)
    changes = np.flatnonzero((run[agreed[1:]] == run[agreed[:-1]]) & (forward[agreed[1:]] != forward[agreed[:-1]]))
    for change in changes.tolist():
        low, high = int(agreed[change]) + 1, int(agreed[change + 1]) + 1
        begins[low + int(np.argmax(step[low:high]))] = True
    numbers = np.empty(len(order), dtype=np.int32)
    numbers[order] = np.cumsum(begins) - 1
    return Cloud(cloud.first, numbers, cloud.step_m, cloud.kink, cloud.time_s)


def _repeated(ids: IntArray) -> BoolArray:
    """(n,) bool, ids that more than one point carries."""
    _, inverse, counts = np.unique(ids, return_inverse=True, return_counts=True)
    repeated: BoolArray = (counts[inverse] > 1) & (ids != NO_ID)
    return repeated


def _second(distance: FloatArray, axis: int) -> FloatArray:
    """The second least along an axis, infinite where there is one value alone."""
    if distance.shape[axis] < 2:
        return np.full(distance.shape[1 - axis], np.inf)
    second: FloatArray = np.take(np.partition(distance, 1, axis=axis), 1, axis=axis)
    return second
