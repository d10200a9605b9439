"""What one pass of the engine over a recording says of every point, and what that comes to for each tracklet."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from core.engine import Engine
from core.frames import HandKey, HandState, IntArray, MarkerFrame, Times, TrackedFrame
from core.relabel.cloud import Cloud
from core.relabel.names import NOBODY, UNKNOWN, Naming

NEAR_M = 0.040
"""A point without a name that is nearer to a hand's markers was looked at by that hand, and refused."""

FULL = 100
"""Weight of a vote without any doubt. Votes are whole numbers: sums do not depend on their order."""

_BLOCK = 1 << 20


@dataclass(frozen=True)
class Ballot:
    """name: (n_points,) int16, NOBODY or UNKNOWN. weight: (n_points,) uint8, at most FULL. scales: of each
    performer's hands, as it was found in the end, None if they were not."""

    name: NDArray[np.int16]
    weight: NDArray[np.uint8]
    scales: tuple[float | None, ...]


def mirrored(frame: MarkerFrame) -> MarkerFrame:
    """The frame in a world whose time runs backward."""
    times = frame.times
    return replace(frame, times=Times(-times.device_s, -times.host_s, -times.arrival_s))


def forward(frames: Sequence[MarkerFrame]) -> Iterator[tuple[int, MarkerFrame]]:
    """Every frame with its number."""
    return enumerate(frames)


def backward(frames: Sequence[MarkerFrame]) -> Iterator[tuple[int, MarkerFrame]]:
    """The same from the last to the first, in mirrored time."""
    for i in range(len(frames) - 1, -1, -1):
        yield i, mirrored(frames[i])


def ballot(order: Iterable[tuple[int, MarkerFrame]], engine: Engine, naming: Naming, cloud: Cloud) -> Ballot:
    """Run an engine over frames in some order."""
    n_points = int(cloud.first[-1])
    name, weight = np.full(n_points, UNKNOWN, dtype=np.int16), np.zeros(n_points, dtype=np.uint8)
    scales: dict[HandKey, float] = {}
    for i, frame in order:
        rows = cloud.rows(i)
        solved = engine.step(frame)
        name[rows], weight[rows] = _votes(solved, frame, naming)
        scales |= {hand.key: hand.scale for hand in solved.hands if hand.state is HandState.TRACKED}
    by_performer = [[scale for key, scale in scales.items() if key.performer == k] for k in range(len(engine.profiles))]
    return Ballot(name, weight, tuple(float(np.mean(own)) if own else None for own in by_performer))


def _votes(solved: TrackedFrame, frame: MarkerFrame, naming: Naming) -> tuple[IntArray, IntArray]:
    """Names and weights (n,) int64 of one frame."""
    names = naming.given(solved, len(frame.points_m))
    weights = np.full(len(names), FULL, dtype=np.int64)
    free = np.flatnonzero(names == NOBODY)
    near = np.zeros(len(free), dtype=np.bool_)
    for hand in solved.hands:
        if hand.state is not HandState.TRACKED:
            continue
        seen = np.flatnonzero(hand.observed)
        sure = hand.confidence[seen]
        label = hand.label_confidence[seen]
        sure = sure * np.where(np.isnan(label), 1.0, label)
        weights[hand.point[seen]] = np.rint(1 + (FULL - 1) * sure).astype(np.int64)
        if len(free):
            gaps = np.linalg.norm(frame.points_m[free][:, None] - hand.markers_world_m[None], axis=2)
            near |= gaps.min(axis=1) < NEAR_M
    for prop in solved.props:
        if prop.tracked:
            near |= np.isin(free, prop.point)
    names[free[~near]] = UNKNOWN
    return names, weights


def agreed(one: Ballot, other: Ballot, naming: Naming) -> Ballot:
    """`other` with hands of several performers called as `one` calls them: two people alike, each pass may begin with
    either. Hands of one side may change places, as a whole and for good, if more points then carry one name."""
    hands = list(naming.first)
    if len({key.performer for key in hands}) == 1:
        return other
    hand_of = np.concatenate([np.full(naming.n_markers(key), h) for h, key in enumerate(hands)])
    first = np.array([naming.first[key] for key in hands])
    alike = np.zeros((len(hands), len(hands)), dtype=np.int64)
    for begin in range(0, len(one.name), _BLOCK):
        a, b = one.name[begin : begin + _BLOCK], other.name[begin : begin + _BLOCK]
        both = (a >= 0) & (b >= 0)
        a, b = a[both], b[both]
        same = a - first[hand_of[a]] == b - first[hand_of[b]]
        np.add.at(alike, (hand_of[b[same]], hand_of[a[same]]), 1)
    fits = np.array([[a.side == b.side and naming.n_markers(a) == naming.n_markers(b) for b in hands] for a in hands])
    theirs, ours = linear_sum_assignment(np.where(fits, 2 * alike + np.eye(len(hands), dtype=np.int64), -1), True)
    shift = np.zeros(len(hands), dtype=np.int64)
    shift[theirs] = first[ours] - first[theirs]
    name = other.name.copy()
    named = name >= 0
    name[named] += shift[hand_of[name[named]]].astype(np.int16)
    return replace(other, name=name)


def counted(cloud: Cloud, ballots: Sequence[Ballot], naming: Naming) -> IntArray:
    """(n_tracklets, n_names + 1) int64, the sum of weights for every name, in the last column for none."""
    width = naming.n_names + 1
    votes = np.zeros(cloud.n_tracklets * width, dtype=np.int64)
    for one in ballots:
        for begin in range(0, len(one.name), _BLOCK):
            rows = slice(begin, begin + _BLOCK)
            said = one.name[rows] != UNKNOWN
            column = one.name[rows][said].astype(np.int64)
            column[column == NOBODY] = width - 1
            np.add.at(votes, cloud.tracklet[rows][said].astype(np.int64) * width + column, one.weight[rows][said])
    return votes.reshape(-1, width)
