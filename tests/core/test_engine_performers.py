"""One engine, two people: whose hand is whose."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import islice

import numpy as np
import pytest

from core.engine import Engine
from core.frames import NO_POINT, HandFrame, HandState, IntArray
from core.hand.sizes import SIZES
from core.kinematics.solver import HandPose
from core.labelling.finder import _Match
from core.motion.company import Company
from core.motion.performer import Performer
from core.motion.stream import MarkerStream
from core.profile import Profile, load_profile
from tests.some import some

RATE_HZ = 60.0
ALONE = 25
"""Frames in which only one person is there."""

HAN19 = load_profile("han19")


def owner(hand: HandFrame, truth: IntArray, labels: tuple[str, ...]) -> str:
    """'2_left', whose points a hand holds, all but a ghost."""
    names = [labels[truth[point]].rsplit("_", 1)[0] for point in hand.point[hand.observed] if truth[point] >= 0]
    (name,) = set(names)
    return name


def owners(
    cast: tuple[Profile, ...], seed: int, n: int, present: Callable[[int, str], bool] = lambda i, label: True
) -> list[dict[tuple[int, str], str]]:
    """For every frame whose points each tracked hand holds. present: is a marker there in frame i?"""
    company = Company([Performer(profile, 10 * seed + i) for i, profile in enumerate(cast)])
    stream = MarkerStream(company, RATE_HZ, seed, hidden=0.03)
    engine, found = Engine(cast), []
    for i, sent in enumerate(islice(stream.labelled(), n)):
        keep = np.array([present(i, stream.labels[truth]) for truth in sent.truth])
        frame = replace(
            sent.frame,
            points_m=sent.frame.points_m[keep],
            ids=sent.frame.ids[keep],
            residuals_m=sent.frame.residuals_m[keep],
        )
        hands = [hand for hand in engine.step(frame).hands if hand.state is HandState.TRACKED]
        found.append({hand.key: owner(hand, sent.truth[keep], stream.labels) for hand in hands})
    return found


BOTH = {(performer, side): f"{performer + 1}_{side}" for performer in (0, 1) for side in ("left", "right")}


def test_hands_of_other_sizes_are_their_owners() -> None:
    cast = tuple(replace(HAN19, shape=SIZES[size], scale=1.0) for size in ("S", "XL"))
    assert all(frame == BOTH for frame in some(owners(cast, 1, 40)[10:]))


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_nobody_gets_a_hand_of_a_childs_and_one_of_an_adults_size(seed: int) -> None:
    """The same gloves, sizes unknown: whose hands they are cannot be known, but that two are one person's can."""
    truly = [replace(HAN19, scale=size) for size in (0.75, 1.18)]
    company = Company([Performer(profile, 10 * seed + i) for i, profile in enumerate(truly)])
    stream, engine = MarkerStream(company, RATE_HZ, seed, hidden=0.03), Engine((HAN19, HAN19))
    for sent in islice(stream.labelled(), 90):
        solved = engine.step(sent.frame)
    found = {hand.key: owner(hand, sent.truth, stream.labels) for hand in solved.hands}
    assert {name[0] for key, name in found.items() if key.performer == 0} in ({"1"}, {"2"})
    assert len(found) == len(set(found.values())) == 4


@pytest.mark.parametrize("second, waits", [("han19", True), ("alexanderson13", False)])
def test_a_hand_of_another_size_waits_for_its_owner_only_where_there_may_be_one(second: str, waits: bool) -> None:
    """Who wears something else cannot take it, and then a size that was found wrong must not keep a hand away."""
    engine = Engine((HAN19, load_profile(second)))
    pose = HandPose.at_rest(19)
    pose.scale = 1.4
    match = _Match(pose, np.full(19, NO_POINT), 0.0, 1.0, np.ones(19))
    assert engine.finder._anothers(0, match, engine._tracks, {0: 1.0}) is waits
    assert not engine.finder._anothers(0, match, engine._tracks, {0: 1.4 / 1.1})
    assert not engine.finder._anothers(0, match, engine._tracks, {})


@pytest.mark.parametrize("first", ["1", "2"])
def test_of_people_whose_profiles_are_alike_the_first_to_come_is_the_first(first: str) -> None:
    """Both hands of a person go together, and stay when the other comes."""
    found = owners((HAN19, HAN19), 2, 2 * ALONE, lambda i, label: i >= ALONE or label.startswith(first))
    second = {"1": "2", "2": "1"}[first]
    assert found[ALONE - 1] == {(0, "left"): f"{first}_left", (0, "right"): f"{first}_right"}
    assert found[-1] == {**found[ALONE - 1], (1, "left"): f"{second}_left", (1, "right"): f"{second}_right"}
