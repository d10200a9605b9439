"""Measures of a hand: those of the template's card, and they follow size and shape as a tape would."""

from __future__ import annotations

from dataclasses import astuple, replace

import numpy as np
import pytest
import trimesh
from scipy.spatial import ConvexHull

from core.hand.measures import CREASE, HandMeasures, measure
from core.hand.model import HandModel, template
from core.hand.shape import FIRST_GIRTH, SHAPE_NAMES, HandShape, shaped_hand
from core.hand.skeleton import DIGITS

TEMPLATE_MM = HandMeasures(
    length=185.6,
    palm_length=111.2,
    breadth=82.3,
    circumference=191.8,
    digit_lengths=np.asarray([46.2, 66.0, 74.5, 71.7, 57.4]),
    digit_girths=np.asarray([54.9, 56.6, 56.3, 52.7, 44.2]),
)
"""What resources/hand/CARD.md says."""


def flat(measures: HandMeasures) -> np.ndarray:
    return np.hstack(astuple(measures))


def shaped(**ratios: float) -> HandModel:
    values = np.ones(len(SHAPE_NAMES))
    for name, ratio in ratios.items():
        values[SHAPE_NAMES.index(name)] = ratio
    return shaped_hand(template(), HandShape(values))


def test_template_measures_what_its_card_says() -> None:
    np.testing.assert_allclose(flat(measure(template())) * 1e3, flat(TEMPLATE_MM), atol=0.06)


@pytest.mark.parametrize("scale", [0.7, 1.3])
def test_every_measure_is_a_length(scale: float) -> None:
    np.testing.assert_allclose(flat(measure(template().scaled(scale))), scale * flat(measure(template())), rtol=1e-9)


def test_lengths_add_up() -> None:
    hand, taken = template(), measure(template())
    middle = hand.skeleton.joint_positions_m[[7, 8, 9]]
    phalanges = np.linalg.norm(np.diff([*middle, hand.skeleton.tip_positions_m[2]], axis=0), axis=1)
    assert taken.digit_lengths[2] == pytest.approx(phalanges.sum() - CREASE * phalanges[0], abs=1e-9)
    assert taken.palm_length + taken.digit_lengths[2] == pytest.approx(taken.length, abs=1e-4)


def test_breadth_and_circumference_agree_with_an_independent_section() -> None:
    """trimesh cuts the whole surface; what is left without the thumb is as broad and as far around as our tape says."""
    hand, taken = template(), measure(template())
    index, pinky = hand.skeleton.joint_positions_m[[4, 13]]
    across = (pinky - index) * (1.0, 0.0, 1.0)
    across /= np.linalg.norm(across)
    surface = trimesh.Trimesh(hand.vertices_m, hand.faces, process=False)
    ends = trimesh.intersections.mesh_plane(surface, np.cross(across, (0.0, 1.0, 0.0)), index).reshape(-1, 3)
    along = (ends - index) @ across
    palm = np.stack([along, ends[:, 1]], axis=1)[along > -0.02]  # the thumb lies further out
    assert np.ptp(palm[:, 0]) == pytest.approx(taken.breadth, abs=1e-6)
    assert ConvexHull(palm).area == pytest.approx(taken.circumference, abs=1e-6)


def test_a_digits_girth_follows_its_ratio_alone() -> None:
    before = measure(template())
    for d, digit in enumerate(DIGITS):
        after = measure(shaped(**{f"{digit}_girth": 1.2}))
        assert after.digit_girths[d] == pytest.approx(1.2 * before.digit_girths[d], rel=1e-3)
        others = np.delete(np.arange(5), d)
        np.testing.assert_allclose(after.digit_girths[others], before.digit_girths[others], rtol=1e-6)
        np.testing.assert_allclose(after.digit_lengths, before.digit_lengths, rtol=1e-9)
    assert SHAPE_NAMES[FIRST_GIRTH] == "thumb_girth"


def test_palm_ratios_move_palm_measures() -> None:
    before = measure(template())
    long_palm = measure(shaped(palm_length=1.1))
    assert long_palm.length - before.length == pytest.approx(0.1 * 0.0934, abs=2e-4)
    np.testing.assert_allclose(long_palm.digit_lengths, before.digit_lengths, rtol=1e-9)
    wide = measure(shaped(palm_width=1.1))
    assert wide.breadth == pytest.approx(1.1 * before.breadth, rel=0.03)
    assert wide.length == before.length


def test_longer_phalanges_lengthen_digit_and_hand() -> None:
    before, after = measure(template()), measure(shaped(middle_middle=1.2, index_distal=1.1))
    assert after.digit_lengths[2] - before.digit_lengths[2] == pytest.approx(0.2 * 0.0263, abs=2e-5)
    assert after.digit_lengths[1] - before.digit_lengths[1] == pytest.approx(0.1 * 0.0197, abs=2e-5)
    assert after.length - before.length == pytest.approx(0.2 * 0.0263, abs=2e-5)
    np.testing.assert_allclose(
        flat(replace(after, length=0.0, digit_lengths=np.zeros(5))),
        flat(replace(before, length=0.0, digit_lengths=np.zeros(5))),
        rtol=1e-3,
    )
