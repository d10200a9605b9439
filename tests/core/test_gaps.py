"""What is a point and what is none, counted and in words."""

from __future__ import annotations

import numpy as np
import pytest

from core.gaps import Gaps, gaps_of, open_gaps, present

POINTS = np.array(
    [[0.1, 0, 0], [0, 0, 0], [np.nan, 1, 1], [1000, -1000, 0], [0, 1000.1, 0], [np.inf, 0, 0], [-0.0, 0, -0.0]]
)


def test_every_kind_is_counted_once_and_nothing_is_changed() -> None:
    points = POINTS.copy()
    assert gaps_of(points) == Gaps(absent=1, zero=2, far=2)
    np.testing.assert_array_equal(points, POINTS)
    assert present(points).tolist() == [True, False, False, True, False, False, False]


def test_what_is_opened_is_nan_altogether() -> None:
    points = POINTS[None].copy()
    assert open_gaps(points) == gaps_of(POINTS)
    np.testing.assert_array_equal(np.isnan(points[0]).all(axis=1), ~present(POINTS))
    np.testing.assert_array_equal(points[0][present(POINTS)], POINTS[present(POINTS)])


def test_what_should_not_be_there_is_not_missed() -> None:
    used = np.array([[True, True, False, True, True, True, True]])
    assert open_gaps(POINTS[None].copy(), used) == Gaps(absent=0, zero=2, far=2)


@pytest.mark.parametrize(
    ("gaps", "words"),
    [
        (Gaps(), "no gaps"),
        (Gaps(absent=1), "1 gap"),
        (Gaps(far=1), "1 gap beyond 1000 m"),
        (Gaps(zero=1200), "1,200 gaps at 0 0 0"),
        (Gaps(absent=10_440, zero=12, far=3), "10,455 gaps (12 at 0 0 0, 3 beyond 1000 m)"),
        (Gaps(absent=1, far=3), "4 gaps (3 beyond 1000 m)"),
    ],
)
def test_in_words(gaps: Gaps, words: str) -> None:
    assert gaps.words == words


def test_figures_of_two_parts() -> None:
    both = Gaps(1, 2, 3) + Gaps(4, 5, 6)
    assert both.figures(79) == {"total": 21, "absent": 5, "zero": 7, "far": 9, "share": 0.21}
    assert Gaps().figures(0)["share"] == 0.0
