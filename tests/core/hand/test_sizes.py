"""The glove sizes meet their standard and are human."""

from __future__ import annotations

import numpy as np
import pytest

from core.hand.measures import HandMeasures, measure
from core.hand.model import template
from core.hand.shape import HandShape, shaped_hand
from core.hand.sizes import GLOVE_MM, SIZES
from resources.hand.build_sizes import build
from tests.some import some


def measured(shape: HandShape) -> HandMeasures:
    return measure(shaped_hand(template(), shape))


def test_every_size_meets_the_standard() -> None:
    assert tuple(SIZES) == ("XS", "S", "M", "L", "XL") == tuple(GLOVE_MM)
    for name, shape in SIZES.items():
        taken = measured(shape)
        np.testing.assert_allclose([taken.length * 1e3, taken.circumference * 1e3], GLOVE_MM[name], atol=0.01)


def test_sizes_grow_in_everything() -> None:
    ratios = np.stack([shape.ratios for shape in SIZES.values()])
    assert (np.diff(ratios, axis=0) > 0.0).all()


@pytest.mark.parametrize("name", GLOVE_MM)
def test_proportions_are_human(name: str) -> None:
    """Palm to hand and middle finger to hand as in every survey of adults, digits in their order of length."""
    taken = measured(SIZES[name])
    assert 0.56 < taken.palm_length / taken.length < 0.63
    assert 0.38 < taken.digit_lengths[2] / taken.length < 0.45
    assert np.argsort(taken.digit_lengths).tolist() == [0, 4, 1, 3, 2]
    assert 0.28 < taken.digit_girths[1] / taken.circumference < 0.32


def test_the_file_is_what_its_script_writes() -> None:
    for name, ratios in some(build().items()):
        np.testing.assert_allclose(SIZES[name].ratios, list(ratios.values()), atol=2e-6)
