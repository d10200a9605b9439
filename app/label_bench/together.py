"""Two hands in one cloud: labels of one frame by how near the hands are to each other."""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from app.commands.terminal import Progress
from app.label_bench.clouds import MARGIN, MOST_GHOSTS, MOST_HIDDEN, Users
from app.people import SIZES
from app.tracking_bench.scene import person
from core.engine import Engine
from core.frames import NO_POINT, SIDES, FloatArray, HandState, IntArray, MarkerFrame, Side, Times
from core.labelling.clusters import groups
from core.labelling.in_turn import in_turn
from core.labelling.network import NamedHand, named, network_at
from core.labelling.sizes import named_unsized, sized, told_of
from core.markers.layout import MarkerLayout
from core.motion.performer import PERIOD_S, Performer
from core.profile import Profile

GAPS_M = (0.01, 0.02, 0.04, 0.08)
"""Between the nearest markers of two hands put beside each other; markers stand 5 to 10 mm above skin."""
NEAR_M = (0.0, 0.02, 0.04, 0.08)
"""Of the performer's hands, which touch, fold and interlace: at least so far apart, and less than the next."""

WAYS = ("one question", "in turn", "by clusters", "engine, first", "engine")

WITHIN_FRAMES, RATE_HZ = 12, 120.0
"""So long the engine may look at the same points: a tenth of a second."""
SEEDS = range(600, 605)
"""Of the performers, one of each of SIZES; no other bench begins with them, and nothing was chosen on them."""


@dataclass(frozen=True)
class TwoHands:
    """points_m: (n, 3) [m] in random order. point: (2, m), the true index of each marker of the left and the right
    hand, NO_POINT if it is hidden. gap_m: between their nearest markers [m], hidden or not."""

    points_m: FloatArray
    point: IntArray
    gap_m: float


def measured(users: Users, layout: MarkerLayout, arguments: argparse.Namespace) -> dict[str, Any]:
    """Prints a table and returns its figures by row. users: all markers of each, in the order of the layout."""
    each = arguments.pairs
    print(
        f"\nTwo hands in one cloud, {len(layout.joints)} markers each, up to {MOST_HIDDEN} of each hidden, up to "
        f"{MOST_GHOSTS} ghosts beside each; {each} clouds a row, the layout alone known.\nBeside each other: hands of "
        "two frames of a user, turned anyhow. Meeting: the built-in performer's hands as they touch, fold and\n"
        f"interlace, five performers of {min(SIZES):g} to {max(SIZES):g} times the template. One question: asked for "
        "the left and the right hand among all points.\nBy clusters: and in each cluster; the answer with most names. "
        f"Engine: what it says after 1 frame, and after {WITHIN_FRAMES} frames of these\nsame points. [% of the labels "
        "of both hands]\n"
    )
    print("                                   clouds   one question   in turn   by clusters   engine, 1 frame   "
          f"{WITHIN_FRAMES} frames   both hands whole")  # fmt: skip
    path = None if arguments.network is None else str(arguments.network)
    profile = Profile("", layout, network=path)
    ways = _Ways(profile)
    rows: dict[str, list[TwoHands]] = {}
    for gap_m in GAPS_M:
        random = np.random.default_rng([arguments.seeds[0], round(1e3 * gap_m)])
        rows[f"beside each other, {1e3 * gap_m:.0f} mm"] = list(beside(random, users, gap_m, each))
    random = np.random.default_rng([arguments.seeds[0], 5])
    met = list(performed(random, SEEDS, layout, each * len(NEAR_M)))
    for least_m, most_m in zip(NEAR_M, (*NEAR_M[1:], np.inf), strict=True):
        name = f"meeting, {1e3 * least_m:.0f} mm " + ("or more" if most_m == np.inf else f"to {1e3 * most_m:.0f} mm")
        rows[name] = [cloud for cloud in met if least_m <= cloud.gap_m < most_m]
    figures: dict[str, Any] = {}
    for name, clouds in rows.items():
        progress = Progress(name)
        found = [ways.all_of(cloud) for cloud in clouds]
        progress.done()
        right = np.array([[(point == cloud.point).mean() for point in answers]
                          for cloud, answers in zip(clouds, found, strict=True)]).reshape(-1, len(WAYS))  # fmt: skip
        row = dict(zip(WAYS, right.mean(axis=0).tolist() if len(right) else [float("nan")] * len(WAYS), strict=True))
        figures[name] = {"clouds": len(clouds), **row, "whole": float((right[:, -1] == 1.0).mean())}
        print(
            f"  {name:31} {len(clouds):7}   {100 * row['one question']:12.2f}   "
            f"{100 * row['in turn']:7.2f}   {100 * row['by clusters']:11.2f}   "
            f"{100 * row['engine, first']:15.2f}   {100 * row['engine']:9.2f}   {100 * figures[name]['whole']:16.2f}"
        )
    return figures


class _Ways:
    """Ways to name both hands of a cloud, each (2, m): points of the left and the right hand."""

    def __init__(self, profile: Profile) -> None:
        self._network, self._told, self._engine = network_at(profile.network), told_of(profile), Engine(profile)
        self._markers = len(profile.layout.joints)

    def all_of(self, cloud: TwoHands) -> tuple[IntArray, ...]:
        """In the order of WAYS."""
        points_m = cloud.points_m
        whole = [np.arange(len(points_m))]
        return (
            self._named(points_m, whole),
            self._named_in_turn(points_m),
            self._named(points_m, groups(points_m, self._markers) or whole),
            *self._engine_says(points_m),
        )

    def _named(self, points_m: FloatArray, among: Sequence[IntArray]) -> IntArray:
        """Of each hand the answer with most names among some groups of the points."""
        hands = []
        for side in SIDES:
            answers = [(named_unsized(self._network, points_m[rows], self._told, side), rows) for rows in among]
            hand, rows = max(answers, key=lambda answer: _names(answer[0]))
            hands.append(np.where(hand.point == NO_POINT, NO_POINT, rows[hand.point]))
        return np.stack(hands)

    def _named_in_turn(self, points_m: FloatArray) -> IntArray:
        """Begun with either hand, the answers with most names."""
        size = sized(self._network, points_m, self._told).size

        def ask(side: Side, rows: IntArray) -> NamedHand:
            return named(self._network.labels_at((size,), points_m[rows], self._told, side)[0], side)

        starts = []
        for sides in (SIDES, SIDES[::-1]):
            shares = in_turn(lambda hand, rows, sides=sides: ask(sides[hand], rows), len(points_m))  # type: ignore[misc]
            assert shares is not None
            starts.append(dict(zip(sides, shares, strict=True)))
        best = max(starts, key=lambda start: sum(_names(share.name) for share in start.values()))
        return np.stack([best[side].point for side in SIDES])

    def _engine_says(self, points_m: FloatArray) -> tuple[IntArray, IntArray]:
        """After the first frame, and after WITHIN_FRAMES."""
        self._engine.reset()
        ids, said = np.arange(len(points_m)) + 1, []
        for number in range(WITHIN_FRAMES):
            time_s = number / RATE_HZ
            frame = MarkerFrame(
                number, Times(time_s, time_s, time_s), points_m, ids, np.full(len(points_m), np.nan)
            )  # fmt: skip
            point = np.full((2, self._markers), NO_POINT, dtype=np.int64)
            for hand in self._engine.step(frame).hands:
                if hand.state is HandState.TRACKED:
                    point[SIDES.index(hand.side)] = hand.point
            said.append(point)
        return said[0], said[-1]


def beside(random: np.random.Generator, users: Users, gap_m: float, count: int) -> Iterator[TwoHands]:
    """Hands of two frames of a user, each turned anyhow, so near that the nearest markers are `gap_m` apart."""
    for number in range(count):
        points, sides = users[number % len(users)]
        hands = []
        for side in (0, 1):
            own = points[random.choice(np.flatnonzero(sides == side))]
            hands.append((own - own.mean(axis=0)) @ Rotation.random(rng=random).as_matrix().T)
        way = random.normal(size=3)
        hands[1] = hands[1] + _touching(hands[0], hands[1], way / np.linalg.norm(way), gap_m)
        yield _clouded(random, hands[0], hands[1])


def performed(random: np.random.Generator, seeds: range, layout: MarkerLayout, count: int) -> Iterator[TwoHands]:
    """Hands that meet, of performers in turn, one of each of SIZES, at any time."""
    people = [person(seed, layout.name, size) for seed, size in zip(seeds, SIZES, strict=True)]
    performers = [Performer(one, seed, "hands") for one, seed in zip(people, seeds, strict=True)]
    for number in range(count):
        markers = performers[number % len(performers)].at(random.uniform(0.0, PERIOD_S)).markers_world_m
        yield _clouded(random, markers["left"], markers["right"])


def _names(hand: NamedHand) -> float:
    """How many markers have a point, each counted as surely as it has it: asked for a hand that is not there the
    network is sure that all are hidden."""
    return float(hand.confidence[hand.point != NO_POINT].sum())


def _touching(one: FloatArray, other: FloatArray, way: FloatArray, gap_m: float) -> FloatArray:
    """(3,) [m]: by how much the other goes along `way` (unit) to come to `gap_m` from outside."""
    apart = (other[:, None] - one[None]).reshape(-1, 3)
    along = apart @ way
    aside = np.square(apart).sum(axis=1) - along**2
    meets = aside < gap_m**2
    reach = -along[meets] + np.sqrt(gap_m**2 - aside[meets])
    shift: FloatArray = way * (reach.max() if len(reach) else -along[aside.argmin()])
    return shift


def _clouded(random: np.random.Generator, left: FloatArray, right: FloatArray) -> TwoHands:
    """Of each hand up to MOST_HIDDEN markers gone, and up to MOST_GHOSTS points in its box."""
    m, shown, points = len(left), [], []
    for hand in (left, right):
        hidden = random.permutation(m)[: int(random.integers(MOST_HIDDEN + 1))]
        shown.append(np.setdiff1d(np.arange(m), hidden))
        low, high = hand.min(axis=0), hand.max(axis=0)
        margin = MARGIN * (high - low)
        ghosts = random.uniform(low - margin, high + margin, (int(random.integers(MOST_GHOSTS + 1)), 3))
        points.append((hand[shown[-1]], ghosts))
    everything = np.concatenate([points[0][0], points[1][0], points[0][1], points[1][1]])
    order = random.permutation(len(everything))
    place = np.argsort(order)
    point = np.full((2, m), NO_POINT, dtype=np.int64)
    point[0, shown[0]] = place[: len(shown[0])]
    point[1, shown[1]] = place[len(shown[0]) : len(shown[0]) + len(shown[1])]
    gap_m = float(np.linalg.norm(left[:, None] - right[None], axis=2).min())
    return TwoHands(everything[order], point, gap_m)
