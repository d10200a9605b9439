"""Two hands in one cloud: labels of one frame by how near the hands are to each other."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from app.label_bench.clouds import MARGIN, MOST_GHOSTS, MOST_HIDDEN, Users
from app.tracking_bench.scene import person
from core.frames import NO_POINT, FloatArray, IntArray
from core.markers.layout import MarkerLayout
from core.motion.performer import PERIOD_S, Performer

GAPS_M = (0.01, 0.02, 0.04, 0.08)
"""Between the nearest markers of two hands put beside each other; markers stand 5 to 10 mm above skin."""
NEAR_M = (0.0, 0.02, 0.04, 0.08)
"""Of the performer's hands, which touch, fold and interlace: at least so far apart, and less than the next."""


@dataclass(frozen=True)
class TwoHands:
    """points_m: (n, 3) [m] in random order. point: (2, m), the true index of each marker of the left and the right
    hand, NO_POINT if it is hidden. gap_m: between their nearest markers [m], hidden or not."""

    points_m: FloatArray
    point: IntArray
    gap_m: float


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
    """Hands that meet, of a performer each in turn, at any time."""
    performers = [Performer(person(seed, layout.name), seed, "hands") for seed in seeds]
    for number in range(count):
        markers = performers[number % len(performers)].at(random.uniform(0.0, PERIOD_S)).markers_world_m
        yield _clouded(random, markers["left"], markers["right"])


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
