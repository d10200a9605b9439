"""How well what all frames share is known: a hand's measures and where its markers sit, as one Gaussian."""

from __future__ import annotations

import base64
import binascii
from dataclasses import dataclass
from typing import Any

import numpy as np

from core.errors import FormatError
from core.frames import FloatArray
from core.hand.shape import N_SHAPE, SHAPE_NAMES
from core.untrusted.values import is_number, shown

LARGEST_LOG, LARGEST_M = 1.0, 0.1
"""No deviation of a log ratio, or of a marker's place [m], is larger: more than any hand or layout is off."""

_ROUND_OFF = 1e-5
"""Of a correlation: what rounding to 16 bits may take from it, so that the rest stays positive."""


@dataclass(frozen=True)
class FixedCovariance:
    """Covariance of the 23 log ratios of the shape, then of the displacement x, y, z of every marker on the template.

    std: (n,) float64 [1, m], standard deviations, n = 23 + 3 m. factor: (n, n) float64, lower triangular: with its rows
    made of length 1 the correlation is factor @ factor.T, positive whatever rounding does to the factor. Both hold what
    a profile file holds, to the bit: `of` rounds.
    """

    std: FloatArray
    factor: FloatArray

    @classmethod
    def of(cls, covariance: FloatArray) -> FixedCovariance:
        """covariance: (n, n) float64, symmetric, positive semidefinite."""
        std = np.maximum(np.sqrt(np.diag(covariance)), 1e-9)
        correlation = covariance / np.outer(std, std) + _ROUND_OFF * np.eye(len(std))
        factor = np.linalg.cholesky(0.5 * (correlation + correlation.T))
        return cls(np.asarray([float(f"{value:.4g}") for value in std]), factor.astype("<f2").astype(np.float64))

    @property
    def matrix(self) -> FloatArray:
        """(n, n) float64."""
        # Rows of length 1, which 16 bits miss by a little.
        root = (self.std / np.linalg.norm(self.factor, axis=1))[:, None] * self.factor
        matrix: FloatArray = root @ root.T
        return matrix

    def to_dict(self, marker_names: tuple[str, ...]) -> dict[str, Any]:
        """The JSON form: deviations by name, and the correlations' factor, its lower triangle row by row as 16 bit
        floats (little endian) in base64."""
        places, lower = self.std[N_SHAPE:].reshape(-1, 3), self.factor[np.tril_indices(len(self.std))]
        return {
            "measures_std": dict(zip(SHAPE_NAMES, self.std[:N_SHAPE].tolist(), strict=True)),
            "markers_std_m": {name: place.tolist() for name, place in zip(marker_names, places, strict=True)},
            "correlation": base64.b64encode(lower.astype("<f2").tobytes()).decode(),
        }

    @classmethod
    def from_dict(cls, data: dict[str, Any], marker_names: tuple[str, ...], source: str) -> FixedCovariance:
        """Raises FormatError naming `source` and what does not fit the layout's markers."""
        measures, places = data.get("measures_std"), data.get("markers_std_m")
        mend = "Calibrate again with phalanx calibrate hand."
        if not isinstance(measures, dict) or set(measures) != set(SHAPE_NAMES):
            raise FormatError(f"{source}: measures_std must name every measure of the hand once.", mend)
        if not isinstance(places, dict) or set(places) != set(marker_names):
            raise FormatError(f"{source}: markers_std_m must name every marker of the layout once.", mend)
        values = [measures[name] for name in SHAPE_NAMES]
        largest = [LARGEST_LOG] * N_SHAPE
        for name in marker_names:
            if not isinstance(places[name], list) or len(places[name]) != 3:
                raise FormatError(f"{source}: deviation of {name} {shown(places[name])}.", "Three numbers [m]. " + mend)
            values += places[name]
            largest += [LARGEST_M] * 3
        for value, most in zip(values, largest, strict=True):
            if not is_number(value) or not 0.0 < value <= most:
                raise FormatError(f"{source}: deviation {shown(value)}.", f"More than 0, at most {most:g}. " + mend)
        return cls(np.asarray(values, dtype=np.float64), _factor(data.get("correlation"), len(values), source, mend))


def _factor(text: Any, n: int, source: str, mend: str) -> FloatArray:
    """(n, n) of its JSON form. Raises FormatError."""
    count = n * (n + 1) // 2
    if not isinstance(text, str) or len(text) != 4 * ((2 * count + 2) // 3):
        length = len(text) if isinstance(text, str) else 0
        raise FormatError(f"{source}: {length} characters of correlations do not fit {n} deviations.", mend)
    try:
        entries = np.frombuffer(base64.b64decode(text, validate=True), dtype="<f2")
    except (ValueError, binascii.Error) as error:
        raise FormatError(f"{source}: its correlations cannot be read ({error}).", mend) from error
    factor = np.zeros((n, n))
    if len(entries) == count:
        factor[np.tril_indices(n)] = entries
    lengths = np.linalg.norm(factor, axis=1)
    if not (np.isfinite(factor).all() and (np.diag(factor) > 0.0).all() and (abs(lengths - 1.0) < 0.01).all()):
        raise FormatError(f"{source}: its correlations are those of nothing.", mend)
    return factor
