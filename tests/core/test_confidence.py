"""One number from a standard deviation and an error."""

from __future__ import annotations

import numpy as np

from core.confidence import CONFIDENT_ERROR_M, confidence


def test_certain_at_nothing_a_third_at_eight_millimetres_and_squares_add() -> None:
    std, error = (
        np.array([0.0, CONFIDENT_ERROR_M, 0.0, 0.003, np.inf]),
        np.array([0.0, 0.0, CONFIDENT_ERROR_M, 0.004, 0]),
    )
    expected = [1.0, np.exp(-1.0), np.exp(-1.0), np.exp(-((0.005 / CONFIDENT_ERROR_M) ** 2)), 0.0]
    np.testing.assert_allclose(confidence(std, error), expected, rtol=1e-12)
