"""The prior of hand shape reproduces the surveys that it is made from, and fights no hand that performs."""

from __future__ import annotations

import numpy as np
import pytest

from core.hand.anthropometry import ADULT_SIZE_STD, shape_prior
from core.hand.measures import measure
from core.hand.model import template
from core.hand.shape import N_SHAPE, SHAPE_NAMES, HandShape, shaped_hand

# Greiner 1991, mean and SD [mm], men and women counted alike.
LENGTH = (193.8, 9.8), (180.5, 9.7)
BREADTH = (90.4, 4.2), (79.4, 3.8)
CIRCUMFERENCE = (213.8, 9.7), (186.2, 8.6)


def adults(sexes: tuple[tuple[float, float], ...]) -> tuple[float, float]:
    """Mean [mm] and standard deviation of the logarithm of both sexes together."""
    means, stds = np.asarray(sexes).T
    within, between = (stds / means) ** 2, np.log(means)
    return float(means.mean()), float(np.sqrt(within.mean() + between.var()))


def log_measures(log_ratios: np.ndarray) -> np.ndarray:
    """(3,) log of length, breadth and circumference [mm] of a hand."""
    taken = measure(shaped_hand(template(), HandShape(np.exp(log_ratios))))
    return np.log(np.asarray([taken.length, taken.breadth, taken.circumference]) * 1e3)


def measured_jacobian(at: np.ndarray) -> np.ndarray:
    """(3, 23) derivatives of `log_measures`, central differences."""
    step = 1e-4
    return np.stack(
        [(log_measures(at + step * e) - log_measures(at - step * e)) / (2 * step) for e in np.eye(N_SHAPE)], axis=1
    )


def test_covariance_is_symmetric_of_full_rank_and_of_human_spread() -> None:
    prior = shape_prior()
    assert np.array_equal(prior.covariance_log, prior.covariance_log.T)
    assert np.linalg.eigvalsh(prior.covariance_log).min() > 1e-4
    std = np.sqrt(np.diag(prior.covariance_log))
    assert std.min() > 0.10
    assert std.max() < 0.14
    assert np.abs(prior.mean_log).max() < 0.08


def test_mean_is_the_adult_mean() -> None:
    expected = [adults(sexes)[0] for sexes in (LENGTH, BREADTH, CIRCUMFERENCE)]
    np.testing.assert_allclose(np.exp(log_measures(shape_prior().mean_log)), expected, rtol=0.005)


def test_adult_spread_and_correlation_are_those_of_the_survey() -> None:
    prior = shape_prior(ADULT_SIZE_STD)
    jacobian = measured_jacobian(prior.mean_log)
    covariance = jacobian @ prior.covariance_log @ jacobian.T
    std = np.sqrt(np.diag(covariance))
    np.testing.assert_allclose(std, [adults(sexes)[1] for sexes in (LENGTH, BREADTH, CIRCUMFERENCE)], rtol=0.1)
    correlation = covariance / np.outer(std, std)
    assert 0.6 < correlation[0, 1] < 0.8  # length and breadth, both sexes together
    assert correlation[1, 2] > 0.95


def test_palms_from_62_to_97_mm_lie_within_three_deviations() -> None:
    prior, i = shape_prior(), SHAPE_NAMES.index("palm_width")
    for palm_mm in (62.0, 64.0, 77.0, 97.0):
        ratio = palm_mm / (measure(template()).breadth * 1e3)
        assert abs(np.log(ratio) - prior.mean_log[i]) < 3.0 * np.sqrt(prior.covariance_log[i, i])


@pytest.mark.parametrize(("age", "length_mm"), [(10, 150.0), (8, 140.0)])
def test_childrens_hands_are_possible(age: int, length_mm: float) -> None:
    prior = shape_prior()
    small = np.full(N_SHAPE, np.log(length_mm / (measure(template()).length * 1e3)))
    away = small - prior.mean_log
    squared = float(away @ np.linalg.solve(prior.covariance_log, away))
    assert squared < 23.0, age  # the expected squared distance of a random hand


def test_given_meets_the_condition_and_is_the_most_likely() -> None:
    prior, rng = shape_prior(), np.random.default_rng(0)
    jacobian, values = rng.normal(size=(2, N_SHAPE)), np.asarray([0.3, -0.2])
    likely = prior.given(jacobian, values)
    np.testing.assert_allclose(jacobian @ likely, values, atol=1e-12)
    gradient = np.linalg.solve(prior.covariance_log, likely - prior.mean_log)
    null = np.linalg.svd(jacobian)[2][2:]  # directions that keep the condition
    np.testing.assert_allclose(null @ gradient, 0.0, atol=1e-9)
