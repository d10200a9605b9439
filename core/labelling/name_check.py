"""Can the names that came with a recording be right? Asked of the whole recording, before it is solved by them.

A hand bends to meet a wrong name, so that a frame by itself passes: two fingertips exchanged, or a left hand solved as
a right one, stay within 8 mm. Over many frames they do not pass: there the hand fits clearly better by other names, or
as the other hand, and what was given is said to be wrong. It is not put right here: nobody knows what else is.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from core.cast import Cast, cast_of, hands_of
from core.frames import NO_ID, NO_POINT, FloatArray, HandKey, HandState, IntArray, MarkerFrame, TrackedFrame
from core.kinematics.solver import HandPose
from core.labelling.given import Names, key_of
from core.labelling.name_moves import NameFits, Shot, cost_m2, enough
from core.labelling.network import network_at
from core.labelling.sizes import named_unsized, told_of
from core.labelling.validation import MAX_RMS_M
from core.profile import Profile

Kind = Literal["unit", "side", "names"]

N_SHOTS = 12
"""Frames spread over a recording by which its names are judged."""

EVERY_S, LEAST_SAMPLED, MOST_SAMPLED = 0.1, 100, 3_000
"""Steps in which stretches with wrong names are looked for, and how many at least and at most."""

MOST_RMS_M = 0.030
"""A frame that fits worse counts as this: one that is wrong for another reason shall not decide."""

CLEARLY, GAIN_M, MOSTLY = 0.6, 0.001, 0.75
"""Other names are right if the sum of squares falls to this share, the RMS by as much, and in so many of the frames."""

PER_STEP = 0.8
"""A step towards them must lower the sum of squares to this share."""

MOST_STEPS = 6
"""More names exchanged, and what is left says nothing."""

SIZES = (0.3, 3.0)
"""Named points so many times nearer or further apart than markers of a hand are in another unit. A fist halves them,
and hands differ by a third."""

AROUND_M = 0.06
"""A point so near to one of a hand's may be another of its own."""

WORSE, WORSE_M = 1.25, 0.0005
"""A stretch is looked into where it fits so much worse than the better part of the recording."""

LEAST_RUN, MOST_RUNS = 3, 20
"""Samples in a stretch, and stretches that are looked into, the longest first."""


@dataclass(frozen=True)
class NameFault:
    """What cannot be right about the names of one hand.

    kind: "unit": its points are too near or too far apart for a hand of any size. "side": they are those of the other
    hand. "names": markers have one another's names. markers: which of the layout. wanted: of each, the marker that its
    point must be. rows: first and last frame of a part of the recording, both included; None: all of it. rms_m: how
    well the hand fits by these names [m], better_m: and how it would [m]; of "unit", how far apart points and markers
    lie.
    """

    kind: Kind
    hand: HandKey
    markers: tuple[int, ...]
    wanted: tuple[int, ...]
    rows: tuple[int, int] | None
    rms_m: float
    better_m: float


@dataclass(frozen=True)
class _Explained:
    """shots: by other names or in the mirror. named: as Shot.renamed takes them."""

    shots: list[Shot]
    poses: list[HandPose]
    costs_m2: FloatArray
    named: IntArray
    mirrored: bool = False
    steps: int = 0

    @property
    def cost_m2(self) -> float:
        return float(self.costs_m2.sum())

    @property
    def counts(self) -> IntArray:
        """(k,) int64, points of each."""
        return np.array([int(shot.given.sum()) for shot in self.shots])


def check_names(
    frames: Sequence[MarkerFrame], rate_hz: float, profiles: Profile | Sequence[Profile], names: Names
) -> tuple[NameFault, ...]:
    """What is wrong with names that were given to the points of a whole recording, hand by hand."""
    cast = cast_of(profiles)
    found: list[NameFault] = []
    for key, ids in _by_hand(names).items():
        if key.side not in cast[key.performer].sides:
            continue
        points_m = _points(frames, ids, len(cast[key.performer].layout.marker_names))
        found += _check_hand(key, points_m * ((-1.0, 1.0, 1.0) if key.side == "left" else 1.0), rate_hz, cast)
    return tuple(found)


def check_sides(
    frames: Sequence[MarkerFrame], solved: Sequence[TrackedFrame], profiles: Profile | Sequence[Profile]
) -> tuple[NameFault, ...]:
    """Hands whose points were named here and are those of the other one, which the profiles do not look for: a hand
    bends far enough to be taken for its mirror image. frames: as they were solved."""
    cast, found = cast_of(profiles), []
    for k, key in enumerate(hands_of(cast)):
        if len(cast[key.performer].sides) > 1:
            continue  # left and right were both tried
        fits, flip = NameFits(cast[key.performer]), (-1.0, 1.0, 1.0) if key.side == "left" else (1.0, 1.0, 1.0)
        own, other = [], []
        for row in _spread([i for i, tracked in enumerate(solved) if tracked.hands[k].state is HandState.TRACKED]):
            hand, points_m = solved[row].hands[k], frames[row].points_m * flip
            own_m = np.full((len(hand.point), 3), np.nan)
            own_m[hand.observed] = points_m[hand.point[hand.observed]]
            near_m = np.linalg.norm(points_m[:, None] - own_m[hand.observed], axis=2).min(axis=1)
            anew = _named_anew(cast[key.performer], Shot(points_m[near_m < AROUND_M]).mirrored)
            if enough(Shot(own_m)) and enough(anew):
                own.append(Shot(own_m))
                other.append(anew)
        if own:
            as_solved, mirrored = _as_named(fits, own), replace(_as_named(fits, other), mirrored=True)
            if _clearly(as_solved, mirrored):
                given = tuple(np.flatnonzero(np.any([shot.given for shot in own], axis=0)).tolist())
                found.append(_fault("side", key, given, mirrored.named, None, as_solved, mirrored))
    return tuple(found)


def believed(
    frames: Sequence[MarkerFrame], names: Names, faults: Sequence[NameFault]
) -> tuple[list[MarkerFrame], Names]:
    """The frames and the names less those that cannot be right: of a part of the recording its points lose their ids,
    of all of it there are no such names."""
    ids_of = _by_hand(names)
    kept, gone = dict(names), list(frames)
    for fault in faults:
        ids = [ids_of[fault.hand][marker] for marker in fault.markers if marker in ids_of[fault.hand]]
        if fault.rows is None:
            kept = {identity: name for identity, name in kept.items() if identity not in ids}
            continue
        for row in range(fault.rows[0], fault.rows[1] + 1):
            frame = gone[row]
            gone[row] = replace(frame, ids=np.where(np.isin(frame.ids, ids), NO_ID, frame.ids))
    return gone, kept


def _by_hand(names: Names) -> dict[HandKey, dict[int, int]]:
    """Of each hand: marker to id."""
    found: dict[HandKey, dict[int, int]] = {}
    for identity, (hand, marker) in names.items():
        found.setdefault(key_of(hand), {})[marker] = identity
    return found


def _points(frames: Sequence[MarkerFrame], ids: Mapping[int, int], n_markers: int) -> FloatArray:
    """(t, m, 3) float64 [m], by marker, NaN for none."""
    marker_of = {identity: marker for marker, identity in ids.items()}
    points_m = np.full((len(frames), n_markers, 3), np.nan)
    for row, frame in enumerate(frames):
        for point_m, identity in zip(frame.points_m, frame.ids.tolist(), strict=True):
            if identity in marker_of:
                points_m[row, marker_of[identity]] = point_m
    return points_m


def _check_hand(key: HandKey, points_m: FloatArray, rate_hz: float, cast: Cast) -> list[NameFault]:
    rows = _full(points_m)
    if not len(rows):
        return []
    shots = [Shot(points_m[row]) for row in _spread(rows.tolist())]
    given = tuple(np.flatnonzero((~np.isnan(points_m[:, :, 0])).any(axis=0)).tolist())
    apart_m, usual_m = _spreads(shots, cast[key.performer])
    if not SIZES[0] < apart_m / usual_m < SIZES[1]:
        return [NameFault("unit", key, given, given, None, apart_m, usual_m)]
    fits = NameFits(cast[key.performer])
    own = _as_named(fits, shots)
    best = _best(fits, own)
    if best is own:
        return _parts(key, fits, points_m, rows, rate_hz)
    if best.mirrored:
        return [_fault("side", key, given, best.named, None, own, best)]
    moved = np.flatnonzero(best.named != np.arange(len(best.named)))
    rest = len(given) - len(moved)
    named = given if rest < 2 * len(moved) else tuple(moved.tolist())  # more is wrong than can be told right
    return [_fault("names", key, named, best.named, None, own, best)]


def _named_anew(profile: Profile, cloud: Shot) -> Shot:
    """Points under the names that the labelling network gives them, taken as a right hand's; those that it has no names
    for have no part in it."""
    point = named_unsized(network_at(profile.network), cloud.points_m, told_of(profile), "right").point
    points_m = np.full((len(point), 3), np.nan)
    points_m[point != NO_POINT] = cloud.points_m[point[point != NO_POINT]]
    return Shot(points_m)


def _spread(rows: Sequence[int]) -> list[int]:
    """N_SHOTS of some rows, or all."""
    chosen = np.unique(np.linspace(0, len(rows) - 1, N_SHOTS).astype(int)) if len(rows) else ()
    return [rows[k] for k in chosen]


def _full(points_m: FloatArray) -> IntArray:
    """The frames with points enough."""
    counts = (~np.isnan(points_m[:, :, 0])).sum(axis=1)
    counted = counts[counts > 0]
    full = np.flatnonzero(counts >= max(0.6 * np.median(counted), 1)) if len(counted) else ()
    return np.array([row for row in full if enough(Shot(points_m[row]))], dtype=np.int64)


def _spreads(shots: Sequence[Shot], profile: Profile) -> tuple[float, float]:
    """How far apart the points of a frame lie, and their markers on the hand at rest [m]: medians of all pairs."""
    markers_m = profile.worn.positions_m
    ratios, usual = [], []
    for shot in shots:
        points, markers = shot.points_m[shot.given], markers_m[shot.given]
        pairs = np.triu_indices(len(points), 1)
        usual.append(np.median(np.linalg.norm((markers[:, None] - markers)[pairs], axis=1)))
        ratios.append(np.median(np.linalg.norm((points[:, None] - points)[pairs], axis=1)))
    return float(np.median(ratios)), float(np.median(usual))


def _as_named(fits: NameFits, shots: list[Shot], mirrored: bool = False) -> _Explained:
    shots = [shot.mirrored for shot in shots] if mirrored else shots
    poses = fits.poses(shots)
    return _Explained(shots, poses, _costs(shots, poses), np.arange(len(shots[0].given)), mirrored)


def _best(fits: NameFits, own: _Explained) -> _Explained:
    """What explains the points best; `own` unless something does so clearly."""
    other = _as_named(fits, own.shots, mirrored=True)
    sides = [other] if _clearly(own, other) else []
    moved = _moved(fits, own)
    found = [*sides, *([moved] if _clearly(own, moved) else [])]
    if not found:
        moved = _moved(fits, other)
        found = [moved] if _clearly(own, moved) else []
    return min(found, key=lambda one: one.cost_m2 * (1.0 + 0.1 * one.steps), default=own)


def _moved(fits: NameFits, start: _Explained) -> _Explained:
    """By the names that fit best, one exchange after the other."""
    best = start
    for _ in range(MOST_STEPS):
        named = fits.best_move(best.shots, best.poses)
        shots = [shot.renamed(named) for shot in best.shots]
        poses = fits.poses(shots)
        costs = _costs(shots, poses)
        if costs.sum() > PER_STEP * best.cost_m2:
            return best
        best = _Explained(shots, poses, costs, best.named[named], start.mirrored, best.steps + 1)
    return best


def _clearly(one: _Explained, other: _Explained) -> bool:
    """Whether the other is right, and not by chance."""
    before, after = (np.sqrt(np.median(each.costs_m2 / each.counts)) for each in (one, other))
    return bool(
        other.counts.sum() >= MOSTLY * one.counts.sum()
        and other.cost_m2 <= CLEARLY * one.cost_m2
        and before - after >= GAIN_M
        and after <= MAX_RMS_M
        and np.mean(other.costs_m2 < one.costs_m2) >= MOSTLY
    )


def _costs(shots: Sequence[Shot], poses: Sequence[HandPose]) -> FloatArray:
    """(k,) float64 [m^2], of each frame at most as if all its points were MOST_RMS_M off."""
    return np.array(
        [min(cost_m2(shot, pose), MOST_RMS_M**2 * shot.given.sum()) for shot, pose in zip(shots, poses, strict=True)]
    )


def _parts(key: HandKey, fits: NameFits, points_m: FloatArray, rows: IntArray, rate_hz: float) -> list[NameFault]:
    """Stretches of frames, of those in `rows`, in which other names fit clearly better."""
    step = max(1, min(round(EVERY_S * rate_hz), len(rows) // LEAST_SAMPLED), len(rows) // MOST_SAMPLED)
    sampled = rows[::step]
    shots = [Shot(points_m[row]) for row in sampled]
    poses = fits.poses(shots)
    rms_m = np.sqrt(_costs(shots, poses) / [shot.given.sum() for shot in shots])
    worse = rms_m > WORSE * np.percentile(rms_m, 25) + WORSE_M
    edges = np.flatnonzero(np.diff(np.concatenate([[False], _closed(worse), [False]])))
    runs = [(a, b) for a, b in zip(edges[0::2], edges[1::2], strict=True) if b - a >= LEAST_RUN]
    found = []
    for a, b in sorted(runs, key=lambda run: run[0] - run[1])[:MOST_RUNS]:
        chosen = np.unique(np.linspace(a, b - 1, N_SHOTS).astype(int))
        own = _Explained(
            [shots[k] for k in chosen], [poses[k] for k in chosen], np.zeros(0), np.arange(points_m.shape[1])
        )
        own = replace(own, costs_m2=_costs(own.shots, own.poses))
        best = _moved(fits, own)
        if _clearly(own, best):
            near = rows[(rows > sampled[max(a - 1, 0)] - step) & (rows < sampled[min(b, len(sampled) - 1)] + step)]
            first, last = _bounds(fits, points_m, near, best.named)
            moved = tuple(np.flatnonzero(best.named != np.arange(len(best.named))).tolist())
            found.append(_fault("names", key, moved, best.named, (first, last), own, best))
    return sorted(found, key=lambda fault: fault.rows or (0, 0))


def _closed(worse: FloatArray) -> FloatArray:
    """(k,) bool with single gaps closed."""
    padded = np.concatenate([[False], worse, [False]])
    closed: FloatArray = worse | (padded[:-2] & padded[2:])
    return closed


def _bounds(fits: NameFits, points_m: FloatArray, rows: IntArray, named: IntArray) -> tuple[int, int]:
    """The first and the last of the frames that fit better by other names. Looked for from both ends: a stretch may be
    most of a long recording."""
    return _first_better(fits, points_m, rows, named), _first_better(fits, points_m, rows[::-1], named)


def _first_better(fits: NameFits, points_m: FloatArray, rows: IntArray, named: IntArray) -> int:
    """The first of some rows that fits better by other names; the first of all where none does."""
    for row in rows:
        shot = Shot(points_m[row])
        before_m2, after_m2 = fits.costs_m2([shot, shot.renamed(named)])
        if after_m2 < CLEARLY * before_m2:
            return int(row)
    return int(rows[0])


def _fault(
    kind: Kind, key: HandKey, markers: tuple[int, ...], named: IntArray, rows: tuple[int, int] | None,
    own: _Explained, best: _Explained,
) -> NameFault:  # fmt: skip
    # Marker k should have the point called named[k]: what is called j is the marker whose name is j's place.
    place = np.argsort(named)
    before, after = (float(np.sqrt(np.median(each.costs_m2 / each.counts))) for each in (own, best))
    return NameFault(kind, key, markers, tuple(int(place[marker]) for marker in markers), rows, before, after)
