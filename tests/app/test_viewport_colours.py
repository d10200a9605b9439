"""Colours and shapes of the scene, and its legend: what each eye can tell apart."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from PySide6.QtGui import QColor

from app import theme
from app.review.analysis import Cell
from app.review.lane_list import _COLOURS as LANES
from app.review.lanes import GUESSED
from app.viewport import colours
from app.viewport.legend import Legend, legend_rows
from app.viewport.marker_states import GHOST_RADIUS_M, MarkerState, marker_view
from app.viewport.points_visual import MARKER_RADIUS_M
from core.frames import HandState
from core.hand.skeleton import DIGITS
from tests.app.drawn import pixels, show
from tests.app.hand_frames import hand_frame, profile, sample
from tests.app.test_props_shown import BOX, with_box

# Machado, Oliveira, Fernandes (2009), a physiologically-based model for simulation of color vision deficiency, at
# severity 1: linear RGB as it looks without L, M or S cones.
EYES = {
    "normal": np.eye(3),
    "no L cones": np.array(
        [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]]
    ),
    "no M cones": np.array(
        [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]]
    ),
    "no S cones": np.array(
        [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]]
    ),
}


def oklab(codes, eye: np.ndarray) -> np.ndarray:
    """(n, 3) Oklab (Ottosson 2020) of colours as an eye sees them."""
    srgb = np.array([colours.rgb(code) for code in codes])
    linear = np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)
    seen = np.clip(linear @ eye.T, 0.0, 1.0)
    to_lms = np.array(
        [
            [0.4122214708, 0.5363325363, 0.0514459929],
            [0.2119034982, 0.6806995451, 0.1073969566],
            [0.0883024619, 0.2817188376, 0.6299787005],
        ]
    )
    to_lab = np.array(
        [
            [0.2104542553, 0.7936177850, -0.0040720468],
            [1.9779984951, -2.4285922050, 0.4505937099],
            [0.0259040371, 0.7827717662, -0.8086757660],
        ]
    )
    return np.cbrt(seen @ to_lms.T) @ to_lab.T


@pytest.mark.parametrize("eye", EYES)
def test_every_eye_tells_digits_apart_from_each_other_and_from_states(eye):
    digits = oklab(colours.DIGIT_CODES, EYES[eye])
    states = oklab(list(colours.STATE_CODES.values()), EYES[eye])
    apart = np.linalg.norm(digits[:, None] - digits[None], axis=2)
    assert apart[~np.eye(6, dtype=bool)].min() > 0.15
    assert min(apart[i, i + 1] for i in range(4)) > 0.25, "neighbours most of all"
    assert np.linalg.norm(digits[:, None] - states[None], axis=2).min() > 0.10
    skin = oklab(["#a9bccf", "#dab4c4", "#14171b"], EYES[eye])
    assert np.linalg.norm(digits[:, None] - skin[None], axis=2).min() > 0.10


def apart(one: str, other: str, eye: str) -> float:
    """Distance of two colours as an eye sees them."""
    a, b = oklab([one, other], EYES[eye])
    return float(np.linalg.norm(a - b))


LEVELS = (theme.GOOD, theme.WARNING, theme.PROBLEM)
HANDS = [pair[side] for pair in theme.PERFORMER_COLOURS for side in ("left", "right")]


@pytest.mark.parametrize("eye", EYES)
def test_every_eye_tells_hands_apart_from_each_other_and_from_good_warning_and_problem(eye):
    for hand in HANDS:
        assert min(apart(hand, level, eye) for level in LEVELS) > 0.09, hand
    assert min(apart(one, other, eye) for one, other in combinations(HANDS, 2)) > 0.075
    left, right = HANDS[:2]
    assert apart(left, right, eye) > 0.15
    assert min(apart(hand, theme.REVIEW, eye) for hand in (left, right)) > 0.10
    assert apart(right, theme.WARNING, eye) > 0.2 and apart(right, theme.PROBLEM, eye) > 0.12


@pytest.mark.parametrize("eye", EYES)
def test_no_eye_takes_a_guess_for_a_warning(eye):
    guesses = [theme.GUESS, colours.STATE_CODES[MarkerState.PREDICTED], colours.GUESS_CODE, LANES[GUESSED]]
    for code in guesses:
        assert apart(code, theme.WARNING, eye) > 0.15 and apart(code, theme.PROBLEM, eye) > 0.12, code
    lane = LANES[GUESSED]
    others = [LANES[cell] for cell in LANES if cell != GUESSED]
    assert min(apart(lane, other, eye) for other in others) > 0.10, "told apart from all that a lane shows"
    for what in (Cell.SEARCHING, GUESSED):
        assert apart(LANES[what], theme.WARNING, eye) > 0.15


def test_no_colour_of_a_hand_is_close_to_red_amber_or_green_by_name():
    for hand in HANDS:
        hue = QColor(hand).hue()
        assert not any(abs((hue - bad + 180) % 360 - 180) < 18 for bad in (0, QColor(theme.WARNING).hue())), hand


def filled(viewport, point_m, at) -> bool:
    """Is the scene bright there? at: in radii of a ball, right and down of the point."""
    viewport.camera.target_m, viewport.camera.distance_m = np.asarray(point_m), 0.10
    viewport.view_front()
    radius_px = MARKER_RADIUS_M * viewport.camera.pixels_per_metre(0.10, viewport.height())
    x, y, _ = viewport.points_on_screen(np.asarray(point_m)[None])[0]
    return bool(pixels(viewport)[round(y + at[1] * radius_px), round(x + at[0] * radius_px)].max() > 120)


def test_each_kind_of_point_has_its_shape(viewport, qtbot):
    viewport.set_surface_shown(False)
    hand = hand_frame("right")
    ghost = hand.markers_world_m[9] + (0.0, 0.9 * GHOST_RADIUS_M, 0.0)
    other = hand.markers_world_m[9] + (0.0, 0.3, 0.0)
    frame, tracked = with_box()
    show(viewport, qtbot, frame, tracked)
    on_box = tracked.props[0].markers_world_m[0]
    places = (0.0, 0.0), (0.6, 0.6), (0.75, 0.0), (0.0, -0.75), (0.8, -0.8)
    boxed = [filled(viewport, on_box, at) for at in places]
    show(viewport, qtbot, *sample(hand, extra_m=[ghost, other], sequence=1))
    drawn = {
        name: [filled(viewport, point, at) for at in places]
        for name, point in (("ghost", ghost), ("other", other), ("marker", hand.markers_world_m[16]))
    }
    assert boxed == [True, True, True, True, True], "a square"
    assert drawn["ghost"] == [True, True, False, False, True], "a cross"
    assert drawn["other"] == [True, False, True, True, False], "a diamond"
    assert drawn["marker"] == [True, True, True, True, False], "a ball"


def test_the_legend_has_every_digit_in_its_colour():
    left, right = hand_frame("left", hidden=(0, 1)), hand_frame("right")
    frame, tracked = sample(left, right, extra_m=[(0.0, 2.0, 0.0)])
    layout = profile().layout
    view = marker_view(frame, tracked, layout)
    by_digit = {words: (count, code) for words, count, code, _ in legend_rows(view, tracked, True)}
    of = [(joint - 1) // 3 if joint else -1 for joint in layout.joints]
    for digit, name in ((-1, "palm"), *enumerate(DIGITS)):
        seen = 2 * of.count(digit) - sum(of[k] == digit for k in (0, 1))
        assert by_digit[name.capitalize()] == (f"{seen} / {2 * of.count(digit)}", colours.DIGIT_CODES[digit])
    assert by_digit["Predicted"][0] == "2" and by_digit["Unlabelled"][0] == "1" and "Labelled" not in by_digit
    assert list(by_digit)[2:8] == [*(name.capitalize() for name in DIGITS), "Palm"]


@pytest.mark.parametrize("performers", [(), ("Ben B", "Anna"), ("Performer 1", "Performer 2")])
def test_the_legend_elides_no_words_that_have_room(viewport, qtbot, performers):
    """Whichever row is the widest."""
    hands = [hand_frame("right", state=HandState.SEARCHING), hand_frame("left")]
    frame, tracked = sample(*hands)
    legend = Legend(viewport)
    legend.show_view(marker_view(frame, tracked, profile().layout), tracked, True, performers)
    assert legend.shown == tuple(
        row[0] for row in legend_rows(marker_view(frame, tracked, profile().layout), tracked, True, performers)
    )
    long = ("A performer with a name as long as they come", "Anna")
    legend.show_view(marker_view(frame, tracked, profile().layout), tracked, True, long)
    assert "…" in legend.shown[0] and legend.shown[0].endswith("right") and legend.width() == 240


def test_the_legend_counts_props_apart(viewport, qtbot):
    worn = replace(profile(), props=(BOX,))
    with qtbot.waitSignal(viewport.drawn):
        viewport.show_frame(*with_box(), worn)
    legend = viewport.findChild(Legend)
    assert legend.text.splitlines() == [
        "Right hand tracked", "Labelled 19", "Predicted 0", "Unlabelled 0", "Ghost 0", "On props 3 / 4",
    ]  # fmt: skip
    view = marker_view(*with_box(), profile().layout)
    colors = colours.marker_colors(view, by_digit=False)
    on_box = np.flatnonzero(view.props == 0)
    seen = view.states[on_box] == MarkerState.LABELLED
    assert (colors[on_box[seen], :3] == colours.rgb(colours.PROP_CODE)).all()
    assert (colors[on_box[~seen]] == colours.STATE_COLORS[MarkerState.PREDICTED]).all()
