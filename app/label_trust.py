"""How far the labels of a hand can be trusted: the measures and limits that panels, plots and the 3D view share."""

from __future__ import annotations

import numpy as np

from core.frames import FloatArray, HandFrame
from devices.device import Level

DOUBTED = 0.9
"""A label less certain than this is doubted."""

WRONG = 0.5
"""A label less certain than this is more likely wrong than right."""


def trust(hand: HandFrame) -> tuple[float, float]:
    """Mean and least of the hand's label confidences, 0..1; NaN where none is known."""
    known = hand.label_confidence[np.isfinite(hand.label_confidence)]
    return (float(known.mean()), float(known.min())) if len(known) else (float("nan"), float("nan"))


def trust_level(confidence: float) -> Level:
    """Good from DOUBTED on, a problem below WRONG; idle where it is not known."""
    if np.isnan(confidence):
        return Level.IDLE
    return Level.GOOD if confidence >= DOUBTED else Level.WARNING if confidence >= WRONG else Level.PROBLEM


def worst_label(label_confidence: FloatArray, marker_names: tuple[str, ...]) -> str:
    """'RingTip 61 %', the marker whose label is least certain; '' if none is known."""
    if not np.isfinite(label_confidence).any():
        return ""
    worst = int(np.nanargmin(label_confidence))
    return f"{marker_names[worst]} {percent(label_confidence[worst])}"


def percent(share: float) -> str:
    """'61 %', and '>99 %' rather than a certainty that nobody has."""
    return ">99 %" if share > 0.995 else f"{100 * share:.0f} %"
