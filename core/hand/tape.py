"""The hand that a tape measures: what it leaves open is as likely as it can be under core.hand.anthropometry."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from core.errors import PhalanxError
from core.frames import FloatArray
from core.hand.anthropometry import shape_prior
from core.hand.measures import measure
from core.hand.model import template
from core.hand.shape import LARGEST, N_SHAPE, SMALLEST, HandShape, shaped_hand

TAPES = ("length", "palm_length", "breadth", "circumference")
"""What `shape_of_measures` takes, as core.hand.measures defines it."""

_ITERATIONS = 12
_TOLERANCE = 1e-7
_STEP = 1e-4


def shape_of_measures(measured_m: Mapping[str, float]) -> HandShape:
    """The most likely hand that measures so: Gauss-Newton on the logarithms, each step the prior's own answer.

    measured_m: [m] by name of TAPES, at least one. Raises PhalanxError where no human hand has these measures.
    """
    prior, names = shape_prior(), tuple(measured_m)
    wanted = np.log([max(measured_m[name], 1e-9) for name in names])

    def taken(log_ratios: FloatArray) -> FloatArray:
        measures = measure(shaped_hand(template(), HandShape(np.exp(log_ratios))))
        return np.log([getattr(measures, name) for name in names])

    log_ratios = prior.mean_log
    for _ in range(_ITERATIONS):
        here = taken(log_ratios)
        jacobian = np.stack([(taken(log_ratios + _STEP * unit) - here) / _STEP for unit in np.eye(N_SHAPE)], axis=1)
        before, log_ratios = log_ratios, prior.given(jacobian, wanted - here + jacobian @ log_ratios)
        if not SMALLEST <= np.exp(log_ratios.min()) <= np.exp(log_ratios.max()) <= LARGEST:
            break
        if np.abs(log_ratios - before).max() < _TOLERANCE:
            return HandShape(np.exp(log_ratios))
    told = ", ".join(f"{name.replace('_', ' ')} {measured_m[name] * 1e3:g} mm" for name in names)
    raise PhalanxError(
        f"No hand measures {told}.",
        "Adult hands are 150 to 220 mm long and 150 to 260 mm around the knuckles; check the numbers and their unit.",
    )
