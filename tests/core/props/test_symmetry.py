from __future__ import annotations

import numpy as np
import pytest

from core.props.prop import Prop
from core.props.rigid import aligned, moved
from core.props.symmetry import alike, symmetry_words
from core.props.tracker import PropTracker
from tests.core.props.things import BALL, PEN, SQUARE, apart, path, pose

TRIANGLE = Prop("triangle", 0.05 * np.array([[0.0, 0, 1], [0.3, 0, 0], [-0.3, 0, 0]]))


def test_a_square_has_the_eight_turns_of_a_square() -> None:
    orders = alike(SQUARE.markers_m)
    assert len(orders) == 7 and len(set(orders)) == 7
    for order in orders:
        there = SQUARE.markers_m[list(order)]
        np.testing.assert_allclose(moved(SQUARE.markers_m, aligned(SQUARE.markers_m, there)), there, atol=1e-12)


@pytest.mark.parametrize(("prop", "others"), [(PEN, 0), (TRIANGLE, 1), (BALL, 5)], ids=lambda value: str(value)[:4])
def test_how_many_sides_look_the_same(prop: Prop, others: int) -> None:
    assert len(alike(prop.markers_m)) == others
    turned = prop.placed_m(pose(np.random.default_rng(4)))
    assert len(alike(turned)) == others
    words = symmetry_words(prop.markers_m)
    assert words == "" if not others else ("two sides" if others == 1 else f"{others + 1} sides") in words


def test_what_is_alike_within_noise_counts_and_what_is_not_does_not() -> None:
    for shift_m, others in ((0.0008, 1), (0.010, 0)):
        markers = TRIANGLE.markers_m.copy()
        markers[1, 0] += shift_m
        assert len(alike(markers)) == others


@pytest.mark.parametrize("order", [(0, 1, 2, 3), (2, 3, 0, 1), (1, 0, 3, 2)])
def test_the_first_side_of_a_symmetric_prop_is_the_one_on_which_it_lay_when_it_was_defined(order) -> None:
    """Whichever points come first, and whatever noise says."""
    lay = path(0.4)
    random = np.random.default_rng(sum(order) + order[0])
    for begun_s in (0.35, 0.5):
        tracker = PropTracker(Prop(SQUARE.name, SQUARE.markers_m, SQUARE.model, lay[:3, :3]))
        truth = path(begun_s)
        points = SQUARE.placed_m(truth)[list(order)]
        for _ in range(8):
            tracker.step(points + random.normal(0.0, 2e-4, (4, 3)), np.arange(4), np.ones(4, dtype=bool), 1 / 120)
        assert tracker.tracked and apart(tracker.transform_world, truth)[1] < np.radians(3.0)


def test_home_does_not_overrule_what_is_seen() -> None:
    truth = pose(np.random.default_rng(2))
    away = truth[:3, :3] @ np.diag([-1.0, -1.0, 1.0])
    tracker = PropTracker(Prop(PEN.name, PEN.markers_m, PEN.model, away))
    for _ in range(8):
        tracker.step(PEN.placed_m(truth), np.arange(5), np.ones(5, dtype=bool), 1 / 120)
    assert tracker.tracked and apart(tracker.transform_world, truth)[1] < 1e-6
