"""Colours of the scene. What means something keeps its meaning: green good, amber a warning, red a problem, and pale
blue what is predicted or a guess, which is no warning."""

from __future__ import annotations

import numpy as np

from app import theme
from app.viewport.marker_states import MarkerState, MarkerView
from core.frames import FloatArray, HandKey, HandState, Side
from core.hand.skeleton import DIGITS


def rgb(code: str) -> tuple[float, float, float]:
    """'#rrggbb' to red, green, blue in 0..1."""
    return int(code[1:3], 16) / 255, int(code[3:5], 16) / 255, int(code[5:7], 16) / 255


BACKGROUND_TOP = rgb("#2a2f37")
BACKGROUND_BOTTOM = rgb("#14171b")
GRID = rgb("#8d98a8")

STATE_CODES = {
    MarkerState.LABELLED: theme.GOOD,
    MarkerState.PREDICTED: theme.GUESS,
    MarkerState.UNLABELLED: "#aab4c2",
    MarkerState.GHOST: theme.PROBLEM,
}
STATE_COLORS: FloatArray = np.array([(*rgb(STATE_CODES[state]), 1.0) for state in MarkerState])

HAND_STATE_CODES = {
    HandState.TRACKED: theme.GOOD,
    HandState.LOST: theme.PROBLEM,
    HandState.SEARCHING: theme.WARNING,
}

DIGIT_CODES = ("#bb1296", "#ddfd4c", "#670af9", "#67fffd", "#8984fa", "#7d6917")
"""Thumb to pinky, then the palm and back of the hand (index -1). Told apart from each other and from the colours of
states by normal eyes and by those without red, green or blue cones (Machado 2009); tests hold that."""
assert len(DIGIT_CODES) == len(DIGITS) + 1
DIGIT_COLORS: FloatArray = np.array([(*rgb(code), 1.0) for code in DIGIT_CODES])

HAND_COLORS: tuple[dict[Side, tuple[float, float, float]], ...] = (
    {"left": rgb("#a9bccf"), "right": rgb("#dab4c4")},
    {"left": rgb("#7fa0bd"), "right": rgb("#c8caa0")},
    {"left": rgb("#93d3c6"), "right": rgb("#dba3d4")},
)
"""Skin by performer, from the first again after the last: pale for one, so that markers stand out; for others the tint
of their curves in the plots."""

PROP_COLOR = rgb("#8f9bb0")
PROP_CODE = "#f4f6f8"
"""Markers and names of props."""
LOST_COLOR = rgb("#8b9096")
LOST_OPACITY = 0.30
GUESS_CODE = STATE_CODES[MarkerState.PREDICTED]
GUESS_COLOR, GUESS_OPACITY = rgb(GUESS_CODE), 0.15
"""Skin that is a guess is glass of the colour of a predicted marker. Its opacity is that of skin seen head-on."""
SKELETON = (*rgb("#f4f6f8"), 0.9)
AXIS_CODES = ("#d9646c", "#7fb069", "#5b8fd9")
AXIS_COLORS: FloatArray = np.array([(*rgb(code), 1.0) for code in AXIS_CODES])


def hand_color(hand: HandKey) -> tuple[float, float, float]:
    """Red, green, blue in 0..1 of the skin of a hand."""
    return HAND_COLORS[hand.performer % len(HAND_COLORS)][hand.side]


def marker_colors(view: MarkerView, by_digit: bool) -> FloatArray:
    """(n, 4) float64 in 0..1: of its digit or its state; a prop's marker that is seen has the props' own."""
    colors = STATE_COLORS[view.states]
    colors[(view.props >= 0) & (view.states == MarkerState.LABELLED)] = (*rgb(PROP_CODE), 1.0)
    if by_digit:
        of_hands = view.hands >= 0
        colors[of_hands] = DIGIT_COLORS[view.digits[of_hands]]
    return colors
