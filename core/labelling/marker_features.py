"""What the labelling network is told of a layout: where each marker rides and where it is at rest."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from core.hand.skeleton import DIGITS
from core.markers.layout import MarkerLayout

UNIT_M = 0.05
N_FEATURES = 3 + 1 + len(DIGITS) + 3


def marker_features(layout: MarkerLayout) -> NDArray[np.float32]:
    """(m, 12) float32: position at rest [5 cm], on the performer's own hand where that is known, else on the template;
    then one-hot the part that carries the marker (palm or digit) and, on a digit, its bone from the palm."""
    features = np.zeros((len(layout.joints), N_FEATURES), dtype=np.float32)
    features[:, :3] = layout.positions_m / UNIT_M
    rows = np.arange(len(layout.joints))
    part = np.where(layout.joints == 0, 0, (layout.joints + 2) // 3)
    features[rows, 3 + part] = 1.0
    on_digit = part > 0
    bone = (layout.joints - 1) % 3
    features[rows[on_digit], 4 + len(DIGITS) + bone[on_digit]] = 1.0
    return features
