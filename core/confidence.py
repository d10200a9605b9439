"""One number for how far a marker can be believed."""

from __future__ import annotations

import numpy as np

from core.frames import FloatArray

CONFIDENT_ERROR_M = 0.008
"""Error at which confidence has fallen to 1/e."""


def confidence(std_m: FloatArray, error_m: FloatArray) -> FloatArray:
    """(m,) float64 in 0..1: 1 is certain, 0.37 stands for an error of 8 mm, 0.02 for one of 16 mm.

    std_m: (m,) float64 [m], expected error of the model's marker. error_m: (m,) float64 [m], distance of the marker's
    point from where the model has it, 0 without a point. Their squares add up.
    """
    sure: FloatArray = np.exp(-(np.square(std_m) + np.square(error_m)) / CONFIDENT_ERROR_M**2)
    return sure
