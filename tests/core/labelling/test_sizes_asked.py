"""Hands of other sizes than the template: what the network is asked, and what comes of it live."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import islice

import numpy as np
import pytest

from core.engine import Engine
from core.frames import NO_POINT, SIDES, HandState, IntArray
from core.hand.mirror import mirror_points
from core.hand.shape import HandShape
from core.labelling.asking import QUESTIONS, Asker
from core.labelling.network import LabelNetwork, shipped_network
from core.labelling.sizes import SIZES, named_unsized, size_of, sized, told_of
from core.motion.performer import Performer
from core.motion.stream import GHOST, LabelledFrame, MarkerStream
from core.profile import Profile, load_profile
from tests.some import some

PROFILE = load_profile("han19")
TEMPLATE_MM = 186.0
FRAMES = 24


def performer(size: float, profile: Profile = PROFILE, seed: int = 0) -> Performer:
    return Performer(replace(profile, scale=size), seed=seed)


def clouds(size: float) -> Iterator[tuple[np.ndarray, IntArray]]:
    """Points of right hands in motion with three markers hidden and a ghost, and each marker's point."""
    random, hands = np.random.default_rng(5), performer(size)
    for k in range(FRAMES):
        markers = hands.at(2.5 + 1.3 * k).markers_world_m["right"]
        shown = np.sort(random.permutation(len(markers))[3:])
        ghosts = random.uniform(markers.min(axis=0), markers.max(axis=0), (1, 3))
        order = random.permutation(len(shown) + 1)
        point = np.full(len(markers), NO_POINT)
        point[shown] = np.argsort(order)[: len(shown)]
        yield np.concatenate([markers[shown], ghosts])[order], point


def share_right(size: float, sizes_asked: bool) -> float:
    network, layout = shipped_network(), PROFILE.layout
    hands = [
        (
            named_unsized(network, points, layout, "right") if sizes_asked else network.name(points, layout, "right"),
            truth,
        )
        for points, truth in clouds(size)
    ]
    return float(np.mean([hand.point == truth for hand, truth in hands]))


@pytest.mark.parametrize("size", [0.71, 0.75, 1.0, 1.18, 1.33])
def test_hands_of_any_size_are_named_as_those_of_the_templates_size(size: float) -> None:
    usual = share_right(1.0, sizes_asked=False)
    assert usual > 0.99 and share_right(size, sizes_asked=True) > usual - 0.01


def test_the_network_alone_does_not_know_a_childs_hand() -> None:
    assert share_right(0.71, sizes_asked=False) < 0.9


def test_several_sizes_at_once_are_answered_as_one_after_the_other() -> None:
    points, _ = next(clouds(0.8))
    network = LabelNetwork()
    at_once = network.labels_at(SIZES, points, PROFILE.layout, "right")
    alone = [network.labels_at((size,), points, PROFILE.layout, "right")[0] for size in SIZES]
    network._batches = False  # as the file of an earlier version
    for labels, one, other in zip(
        at_once, alone, network.labels_at(SIZES, points, PROFILE.layout, "right"), strict=True
    ):
        np.testing.assert_allclose(labels.label, one.label, atol=1e-4)
        np.testing.assert_allclose(labels.point, one.point, atol=1e-4)
        np.testing.assert_array_equal(other.label, one.label)
    np.testing.assert_array_equal(
        network.labels_at((1.0,), points, PROFILE.layout)[0].label, network.labels(points, PROFILE.layout).label
    )


def test_a_hand_asked_at_its_size_is_the_same_hand_to_the_network() -> None:
    points, _ = next(clouds(1.0))
    centred = points - points.mean(axis=0)
    usual = shipped_network().labels(centred, PROFILE.layout, "right")
    (small,) = shipped_network().labels_at((0.7,), 0.7 * centred + (1.0, 2.0, 3.0), PROFILE.layout, "right")
    np.testing.assert_allclose(small.label, usual.label, atol=1e-3)


@pytest.mark.parametrize("size", [0.66, 0.8, 1.0, 1.3])
def test_size_and_side_are_told_and_the_mirror_tells_the_other_side(size: float) -> None:
    some = list(islice(clouds(size), 8))
    assert len(some) == 8
    for points, _ in some:
        found = sized(shipped_network(), points, PROFILE.layout)
        assert abs(np.log(found.size / size)) < 0.3 and found.right > 0.5
        other = sized(shipped_network(), mirror_points(points), PROFILE.layout)
        assert other.size == found.size and other.right == pytest.approx(1.0 - found.right, abs=1e-3)


def test_a_shape_of_another_size_is_told_as_one_of_the_templates_size() -> None:
    assert size_of(HandShape.generic()) == 1.0
    assert size_of(HandShape.uniform(0.75)) == pytest.approx(0.75)
    np.testing.assert_array_equal(told_of(PROFILE).positions_m, PROFILE.worn.positions_m)
    child = replace(PROFILE, shape=HandShape.uniform(0.75))
    np.testing.assert_allclose(told_of(child).positions_m, PROFILE.layout.positions_m, atol=1e-9)
    points, truth = next(clouds(0.75))
    asker = Asker([child, PROFILE])
    by_shape, by_scale = asker.name(0, points, 1.0), asker.name(1, points, 0.75)
    assert by_shape is not None and by_scale is not None
    np.testing.assert_array_equal(by_shape.point, by_scale.point)
    assert (by_shape.point == truth).mean() > 0.9


def test_size_is_asked_once_a_cloud_for_both_hands_and_all_who_wear_the_same() -> None:
    points, rows = next(clouds(0.8))[0], np.arange(17)
    child = replace(PROFILE, shape=HandShape.uniform(0.8))
    asker = Asker([PROFILE, PROFILE, child, load_profile("qualisys13")])
    first = asker.sized(0, "right", points, rows)
    assert first is not None and first[1] > 0.9 and asker.left == QUESTIONS - 1
    assert asker.sized(1, "right", points, rows) == first
    assert asker.sized(0, "left", mirror_points(points), rows) == (first[0], pytest.approx(1.0 - first[1]))
    assert asker.left == QUESTIONS - 1
    asker.sized(3, "right", points, rows)
    assert asker.left == QUESTIONS - 2
    small = asker.sized(2, "right", points, rows)
    assert small is not None and small[0] == pytest.approx(first[0] / 0.8) and asker.left == QUESTIONS - 3
    asker.sized(0, "right", points, rows[1:])
    assert asker.left == 0
    assert asker.sized(0, "right", points, rows[2:]) is None and asker.name(0, points, 1.0) is None
    asker.next_frame({}, {})
    assert asker.left == QUESTIONS


class Live:
    """A hand of unknown size that comes into view in the midst of its motion."""

    def __init__(self, length_mm: float, rate_hz: float, sides=SIDES, hidden: float = 0.0, ghosts: float = 0.0) -> None:
        self.size = length_mm / TEMPLATE_MM
        self.profile = replace(PROFILE, sides=sides)
        source = performer(self.size, self.profile)
        self.stream = MarkerStream(source, rate_hz, hidden=hidden, ghosts=ghosts)
        self.markers = [tuple(label.split("_", 1)) for label in self.stream.labels]

    def frames(self, begin: int, count: int) -> list[LabelledFrame]:
        return list(islice(self.stream.labelled(), begin, begin + count))

    def wrong(self, seen: LabelledFrame, hand) -> int:
        """Points of a hand under other names than their own."""
        names = self.profile.layout.marker_names
        truth = [(name, seen.truth[point]) for name, point in zip(names, hand.point, strict=True) if point != NO_POINT]
        return sum(label == GHOST or self.markers[label] != (hand.side, name) for name, label in truth)


@pytest.mark.parametrize("rate_hz", [30.0, 120.0])
@pytest.mark.parametrize("length_mm", [132.0, 140.0, 220.0, 247.0])
def test_a_childs_and_a_very_large_hand_are_found_in_two_frames_and_measured_in_two_seconds(
    length_mm: float, rate_hz: float
) -> None:
    live = Live(length_mm, rate_hz)
    for begin_s in (2.6, 5.1):
        engine = Engine(replace(live.profile, scale=None))
        frames = live.frames(round(begin_s * rate_hz), round(2.0 * rate_hz))
        for k, seen in some(enumerate(frames)):
            hands = engine.step(seen.frame).hands
            if k >= 1:
                assert all(hand.state is HandState.TRACKED for hand in some(hands))
                assert sum(live.wrong(seen, hand) for hand in hands) == 0
        assert all(abs(hand.scale / live.size - 1.0) < 0.005 for hand in some(hands))


@pytest.mark.parametrize("side", SIDES)
def test_with_hidden_markers_and_ghosts_a_child_is_measured_too(side) -> None:
    live = Live(140.0, 60.0, (side,), hidden=0.2, ghosts=2.0)
    engine = Engine(replace(live.profile, scale=None))
    wrong = 0
    for seen in live.frames(160, 120):
        (hand,) = engine.step(seen.frame).hands
        wrong += live.wrong(seen, hand)
    assert hand.state is HandState.TRACKED and abs(hand.scale / live.size - 1.0) < 0.03
    assert wrong < 0.01 * 120 * 19


def test_the_same_frames_give_the_same_bits() -> None:
    live = Live(140.0, 60.0, hidden=0.2, ghosts=2.0)
    frames = live.frames(160, 20)
    assert len(frames) == 20
    one, other = Engine(replace(live.profile, scale=None)), Engine(replace(live.profile, scale=None))
    for seen in frames:
        hands = one.step(seen.frame).hands
        assert len(hands) == 2
        for a, b in zip(hands, other.step(seen.frame).hands, strict=True):
            np.testing.assert_array_equal(a.theta_rad, b.theta_rad)
            np.testing.assert_array_equal(a.point, b.point)
            assert a.scale == b.scale


def test_a_hand_is_found_beside_a_crowd_of_more_points_than_the_network_takes() -> None:
    live = Live(TEMPLATE_MM, 60.0, ("right",))
    crowd = np.random.default_rng(0).uniform(0.0, 0.3, (150, 3)) + (2.0, 1.0, 0.0)
    engine = Engine(replace(live.profile, scale=None))
    for k, seen in some(enumerate(live.frames(160, 4))):
        points = np.concatenate([crowd, seen.frame.points_m])
        ids = np.concatenate([10_000 + np.arange(150), seen.frame.ids])
        (hand,) = engine.step(replace(seen.frame, points_m=points, ids=ids)).hands
        assert k == 0 or hand.state is HandState.TRACKED
