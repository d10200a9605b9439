"""A tape's measures give the hand that measures so, as likely as it can be; impossible ones are told."""

from __future__ import annotations

import numpy as np
import pytest

from core.errors import PhalanxError
from core.hand.anthropometry import shape_prior
from core.hand.measures import HandMeasures, measure
from core.hand.model import template
from core.hand.shape import HandShape, shaped_hand
from core.hand.tape import TAPES, shape_of_measures


def measured(shape: HandShape) -> HandMeasures:
    return measure(shaped_hand(template(), shape))


def test_four_tapes_are_met_and_the_rest_is_likely() -> None:
    wanted = {"length": 0.178, "palm_length": 0.104, "breadth": 0.077, "circumference": 0.184}
    shape = shape_of_measures(wanted)
    taken = measured(shape)
    np.testing.assert_allclose([getattr(taken, name) for name in TAPES], [wanted[name] for name in TAPES], atol=1e-6)
    prior = shape_prior()
    away = np.log(shape.ratios) - prior.mean_log
    assert away @ np.linalg.solve(prior.covariance_log, away) < 9.0


def test_what_the_mean_measures_gives_the_mean() -> None:
    prior = shape_prior()
    mean = HandShape(np.exp(prior.mean_log))
    shape = shape_of_measures({"length": measured(mean).length, "breadth": measured(mean).breadth})
    np.testing.assert_allclose(shape.ratios, mean.ratios, atol=1e-6)


@pytest.mark.parametrize(
    "impossible",
    [{"length": 182.0}, {"length": -0.1}, {"length": 0.18, "circumference": 0.5}, {"breadth": float("nan")}],
)
def test_no_such_hand(impossible: dict[str, float]) -> None:
    with pytest.raises(PhalanxError, match="No hand measures") as caught:
        shape_of_measures(impossible)
    assert f"{next(iter(impossible.values())) * 1e3:g} mm" in str(caught.value)
