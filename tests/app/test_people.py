"""The people of benchmarks: as large as is said, in turn by their seeds."""

from __future__ import annotations

import argparse

import numpy as np
import pytest

from app.people import SIZES, add_sizes, said, shape_of, size_of, sized
from app.tracking_bench.scene import person
from core.profile import load_profile


def arguments(*words: str) -> argparse.Namespace:
    parser = argparse.ArgumentParser()
    add_sizes(parser)
    return parser.parse_args(words)


def test_five_seeds_in_a_row_span_the_human_range() -> None:
    for first in (0, 7, 400):
        assert sorted(size_of(arguments(), seed) for seed in range(first, first + 5)) == sorted(SIZES)
    assert min(SIZES) == 0.75 and max(SIZES) == 1.25
    assert {size_of(arguments("--sizes", "1"), seed) for seed in range(9)} == {1.0}
    assert said(arguments(), [0, 1]) == "hands of 1, 0.75 times the template's size"


@pytest.mark.parametrize("size", SIZES)
def test_a_person_is_as_large_as_said_and_otherwise_the_same(size: float) -> None:
    drawn, made = person(4), person(4, size=size)
    assert made.shape.ratios.mean() == pytest.approx(size)
    ratios = made.shape.ratios / drawn.shape.ratios
    np.testing.assert_allclose(ratios, ratios[0])
    np.testing.assert_array_equal(made.layout.positions_m, drawn.layout.positions_m)
    assert shape_of(np.random.default_rng(1)).ratios.mean() == pytest.approx(1.0, abs=0.2)


def test_a_profile_that_says_its_size_is_believed() -> None:
    unknown = load_profile("han19")
    assert sized(unknown, 0.8).scale == 0.8
    assert sized(sized(unknown, 1.1), 0.8).scale == 1.1
