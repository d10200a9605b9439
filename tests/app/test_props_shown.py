"""Props on the screen: what is drawn, what is named, what the panel says."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from app.panels.prop_lines import PropLines, prop_state
from app.viewport import hover
from app.viewport.marker_states import MarkerState, marker_view
from app.viewport.name_tags import NameTags
from core.frames import NO_POINT, PropFrame
from core.props.prop import Prop, PropModel
from devices.device import Level
from tests.app.drawn import pixel_at
from tests.app.hand_frames import hand_frame, profile, sample

BOX = Prop(
    "box", 0.05 * np.array([[1.0, 1, 1], [-1, 1, 1], [1, -1, 1], [1, 1, -1]]), PropModel("box", (0.08, 0.08, 0.08))
)
PLACE = np.eye(4)
PLACE[:3, 3] = [0.0, 1.3, 0.0]


def with_box(tracked: bool = True):
    """A right hand and a box of which the second marker is hidden."""
    seen = [0, 2, 3]
    frame, solved = sample(hand_frame("right"), extra_m=BOX.placed_m(PLACE)[seen])
    point = np.full(4, NO_POINT)
    point[seen] = 19 + np.arange(3)
    box = PropFrame("box", PLACE, tracked, point, 0.00021 if tracked else np.nan, BOX.placed_m(PLACE))
    return frame, replace(solved, props=(box,))


def test_points_of_a_prop_are_labelled() -> None:
    frame, solved = with_box()
    view = marker_view(frame, solved, profile().layout)
    assert view.counts().tolist() == [19 + 3, 1, 0, 0]
    on_box = np.flatnonzero(view.props == 0)
    np.testing.assert_array_equal(view.positions_m[on_box], BOX.placed_m(PLACE))
    np.testing.assert_array_equal(view.markers[on_box], [0, 1, 2, 3])
    assert (view.hands[on_box] == -1).all() and (view.props[view.hands >= 0] == -1).all()
    words = [hover.marker_words(view, int(i), solved, profile().layout) for i in on_box[:2]]
    assert words == ["box, marker 1: seen", "box, marker 2: hidden, predicted"]


def test_points_of_a_lost_prop_are_unlabelled() -> None:
    frame, solved = with_box(tracked=False)
    view = marker_view(frame, solved, profile().layout)
    assert view.counts()[MarkerState.UNLABELLED] == 3 and (view.props == -1).all()


def test_a_box_is_drawn_where_it_is_and_pale_when_lost(viewport, qtbot) -> None:
    worn = replace(profile(), props=(BOX,))
    viewport.camera.target_m, viewport.camera.distance_m = PLACE[:3, 3], 0.5
    shades = {}
    for tracked in (True, False):
        with qtbot.waitSignal(viewport.drawn):
            viewport.show_frame(*with_box(tracked), worn)
        viewport.camera.target_m, viewport.camera.distance_m = PLACE[:3, 3], 0.5
        viewport.view_front()
        shades[tracked] = pixel_at(viewport, PLACE[:3, 3] + [0.02, 0.0, 0.04])
        beside = pixel_at(viewport, PLACE[:3, 3] + [0.1, 0.0, 0.04])
        assert (shades[tracked] > beside + 20).all()
        assert viewport.findChild(NameTags).names == ("box" if tracked else "box (not seen)",)
    assert (shades[True] > shades[False] + 30).all()
    with qtbot.waitSignal(viewport.drawn):
        viewport.show_frame(*with_box(), profile())  # another profile: only axes are left
    assert (pixel_at(viewport, PLACE[:3, 3] + [0.02, -0.02, 0.04]) < shades[False]).all()


@pytest.mark.parametrize(
    ("tracked", "level", "words"),
    [(True, Level.GOOD, "3 / 4 markers · 0.21 mm"), (False, Level.PROBLEM, "lost · 3 / 4 markers")],
)
def test_a_line_per_prop(qtbot, tracked: bool, level: Level, words: str) -> None:
    (box,) = with_box(tracked)[1].props
    assert prop_state(box) == (level, words)
    lines = PropLines()
    qtbot.addWidget(lines)
    other = replace(BOX, name="pen")
    lines.show_props((BOX, other), (box,))
    assert lines.shown == {"box": words, "pen": "searching"}
    lines.show_props((other,), None)
    assert lines.shown == {"pen": "–"}
    lines.show_props((), ())
    assert lines.shown == {}
