"""The best names for all tracklets together: no marker has two points in a frame, no tracklet two names.

Every tracklet gains something by every name it may carry; the sum of gains is to be greatest. A tracklet whose best
name no other wants at the same time takes it: that can only help. What is left falls into small groups that have
nothing to do with each other, and each is solved exactly as an integer program.
"""

from __future__ import annotations

import heapq
from collections import defaultdict

import numpy as np
from scipy.optimize import Bounds, LinearConstraint, milp
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from core.frames import BoolArray, FloatArray, IntArray
from core.relabel.names import NOBODY

MOST_AT_ONCE = 1500
"""Pairs of tracklet and name in one integer program. A larger group is solved from both ends of time in parts."""


def best_names(begin: IntArray, end: IntArray, gain: FloatArray, fixed: IntArray | None = None) -> IntArray:
    """(t,) int64, the name of each tracklet, NOBODY for none.

    begin, end: (t,) first and last frame of each. gain: (t, n_names) float64, finite; a name that gains nothing above
    0 is not given. fixed: (t,) names that are settled, NOBODY where they are not; two that are settled on one name
    must not overlap.
    """
    name = np.full(len(begin), NOBODY, dtype=np.int64) if fixed is None else fixed.astype(np.int64)
    wanted: BoolArray = np.asarray(gain > 0.0)
    wanted[name != NOBODY] = False
    for k in range(gain.shape[1]):
        candidates = np.flatnonzero(wanted[:, k])
        taken = np.flatnonzero(name == k)
        wanted[candidates[_overlapping(begin, end, candidates, taken)], k] = False
    rivals = _rivals(begin, end, wanted)
    open_: BoolArray = np.asarray(wanted.any(axis=1))
    _settle(name, gain, wanted, open_, rivals, begin, end)
    rest = np.flatnonzero(open_)
    if len(rest):
        for group in _groups(rest, rivals, wanted):
            _solve_group(group, begin, end, gain, wanted, name)
    return name


def _overlapping(begin: IntArray, end: IntArray, some: IntArray, others: IntArray) -> IntArray:
    """Indices into `some` of tracklets that share a frame with any of `others`, which do not overlap each other."""
    if len(some) == 0 or len(others) == 0:
        return np.empty(0, dtype=np.int64)
    order = others[np.argsort(begin[others], kind="stable")]
    before = np.searchsorted(begin[order], end[some], side="right") - 1  # the last that begins by our end
    hit = (before >= 0) & (end[order[np.maximum(before, 0)]] >= begin[some])
    return np.flatnonzero(hit)


def _rivals(begin: IntArray, end: IntArray, wanted: BoolArray) -> dict[tuple[int, int], set[int]]:
    """For each (tracklet, name) that is wanted: the tracklets that want the same name at the same time."""
    rivals: dict[tuple[int, int], set[int]] = {}
    for k in range(wanted.shape[1]):
        rows = np.flatnonzero(wanted[:, k])
        active: list[tuple[int, int]] = []
        for t in rows[np.argsort(begin[rows], kind="stable")].tolist():
            while active and active[0][0] < begin[t]:
                heapq.heappop(active)
            rivals[t, k] = {other for _, other in active}
            for _, other in active:
                rivals[other, k].add(t)
            heapq.heappush(active, (int(end[t]), t))
    return rivals


def _settle(
    name: IntArray, gain: FloatArray, wanted: BoolArray, open_: BoolArray,
    rivals: dict[tuple[int, int], set[int]], begin: IntArray, end: IntArray,
) -> None:  # fmt: skip
    """Give their best name to all tracklets whose best name nobody else wants, until there is none such."""
    waiting = np.flatnonzero(open_).tolist()
    while waiting:
        t = waiting.pop()
        if not open_[t]:
            continue
        names = np.flatnonzero(wanted[t])
        if len(names) == 0:
            open_[t] = False
            continue
        best = int(names[np.argmax(gain[t, names])])
        if any(open_[other] and wanted[other, best] for other in rivals[t, best]):
            continue
        name[t] = best
        open_[t] = False
        for k in names.tolist():
            waiting += [other for other in rivals[t, k] if open_[other]]


def _groups(rest: IntArray, rivals: dict[tuple[int, int], set[int]], wanted: BoolArray) -> list[IntArray]:
    """Tracklets that hang together by names they all want."""
    place = {int(t): i for i, t in enumerate(rest)}
    pairs = [
        (place[t], place[other])
        for t in rest.tolist()
        for k in np.flatnonzero(wanted[t]).tolist()
        for other in rivals[t, k]
        if other in place
    ]
    if not pairs:
        return [rest[[i]] for i in range(len(rest))]
    row, column = np.array(pairs).T
    graph = coo_array((np.ones(len(row)), (row, column)), shape=(len(rest), len(rest)))
    count, label = connected_components(graph, directed=False)
    by_label = np.argsort(label, kind="stable")
    return [rest[part] for part in np.split(by_label, np.searchsorted(label[by_label], np.arange(1, count)))]


def _solve_group(
    group: IntArray, begin: IntArray, end: IntArray, gain: FloatArray, wanted: BoolArray, name: IntArray
) -> None:
    """Writes the names of a group. One that is too large is solved in parts, each bound by those before."""
    # An order that does not know which way time runs: the same program, and the same answer, in both directions.
    order = np.lexsort([*gain[group].T[::-1], end[group] - begin[group]])
    group = group[order]
    while len(group):
        size = np.cumsum(wanted[group].sum(axis=1))
        part = group
        if size[-1] > MOST_AT_ONCE:
            in_time = group[np.argsort(begin[group], kind="stable")]
            part = in_time[: max(int(np.searchsorted(np.cumsum(wanted[in_time].sum(axis=1)), MOST_AT_ONCE)), 1)]
        name[part] = _program(part, begin, end, gain, wanted)
        group = group[~np.isin(group, part)]
        for k in np.unique(name[part][name[part] != NOBODY]).tolist():
            taken = part[name[part] == k]
            wanted[group[_overlapping(begin, end, group, taken)], k] = False


def _program(group: IntArray, begin: IntArray, end: IntArray, gain: FloatArray, wanted: BoolArray) -> IntArray:
    """The best names of a group, by an integer program."""
    member, column = np.nonzero(wanted[group])
    if len(member) == 0:
        return np.full(len(group), NOBODY, dtype=np.int64)
    limits: set[tuple[int, ...]] = set()
    for i in range(len(group)):
        own = np.flatnonzero(member == i)
        if len(own) > 1:
            limits.add(tuple(own.tolist()))
    for k in np.unique(column).tolist():
        variables = np.flatnonzero(column == k)
        limits |= _crowds(begin[group[member[variables]]], end[group[member[variables]]], variables)
    chosen = np.ones(len(member), dtype=np.bool_)
    if limits:
        rows = sorted(limits)
        counts = [len(row) for row in rows]
        matrix = coo_array(
            (np.ones(sum(counts)), (np.repeat(np.arange(len(rows)), counts), np.concatenate(rows))),
            shape=(len(rows), len(member)),
        )
        found = milp(
            -gain[group[member], column],
            constraints=LinearConstraint(matrix.tocsr(), -np.inf, 1.0),
            integrality=np.ones(len(member), dtype=np.int64),
            bounds=Bounds(0.0, 1.0),
            options={"mip_rel_gap": 0.0},
        )
        if found.x is None:  # it always has a solution: no name for anybody
            raise RuntimeError(f"names of {len(group)} tracklets: {found.message}")
        chosen = found.x > 0.5
    names = np.full(len(group), NOBODY, dtype=np.int64)
    names[member[chosen]] = column[chosen]
    return names


def _crowds(begin: IntArray, end: IntArray, variables: IntArray) -> set[tuple[int, ...]]:
    """The largest sets of tracklets that all share a frame, of two or more, as sorted tuples of their variables."""
    events: dict[int, tuple[list[int], list[int]]] = defaultdict(lambda: ([], []))
    for b, e, v in zip(begin.tolist(), end.tolist(), variables.tolist(), strict=True):
        events[2 * b][0].append(v)
        events[2 * e + 1][1].append(v)
    crowds: set[tuple[int, ...]] = set()
    active: set[int] = set()
    grown = False
    for time in sorted(events):
        come, go = events[time]
        if go:
            if grown and len(active) > 1:
                crowds.add(tuple(sorted(active)))
            active -= set(go)
            grown = False
        if come:
            active |= set(come)
            grown = True
    return crowds
