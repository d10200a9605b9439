"""The timeline as it is painted and dragged."""

from __future__ import annotations

import numpy as np
import pytest
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtGui import QColor, QMouseEvent, QWheelEvent
from PySide6.QtWidgets import QApplication

from app import theme
from app.review.analysis import analyse
from app.review.lane_list import GAP_PX as GAP
from app.review.lane_list import HAND_PX as LANE
from app.review.lane_list import MARKER_PX as MARKER_LANE
from app.review.player import Player
from app.review.timeline import GUTTER, RULER, Timeline
from core.takes.matching import match_solved
from core.takes.reader import open_take
from tests.app.takes import write_take

LEFT_Y = RULER + LANE // 2
RIGHT_Y = RULER + LANE + GAP + LANE // 2


@pytest.fixture
def timeline(tmp_path, qtbot):
    path = write_take(tmp_path, "a", 101, lost=range(20, 40), hidden=range(60, 80))
    with open_take(path) as take:
        matched = match_solved(take.raw.times_s, take.solved.times_s)
        analysis, marks, times_s = analyse(take.solved, matched, take.profile), take.marks, take.raw.times_s
    widget = Timeline(Player(times_s))
    qtbot.addWidget(widget)
    widget.resize(GUTTER + 12 + 500, 200)
    widget.show()
    widget.show_take(analysis, marks)
    widget.view_all()
    return widget


def colour(timeline, frame: float, y: int) -> str:
    x = round(timeline.x_of((frame + 0.5) / 100))
    return timeline.grab().toImage().pixelColor(x, y).name()


def test_lanes_show_where_each_hand_is_lost(timeline):
    assert colour(timeline, 30, LEFT_Y) == theme.PROBLEM
    assert colour(timeline, 30, RIGHT_Y) == colour(timeline, 5, LEFT_Y) != theme.PROBLEM


def test_marker_lanes_show_gaps_and_none_while_the_hand_is_lost(timeline):
    timeline.set_markers_shown(True)
    timeline.resize(timeline.width(), 250)
    y = RULER + LANE + GAP + 2 * (MARKER_LANE + GAP) + MARKER_LANE // 2
    gap, seen, lost = (colour(timeline, frame, y) for frame in (70, 50, 30))
    assert gap == "#d75a9a" and len({gap, seen, lost}) == 3
    assert "hidden: a gap" in timeline.text_at(timeline.x_of(0.705), y)
    assert "hand not tracked" in timeline.text_at(timeline.x_of(0.305), y)


def test_what_is_partly_a_guess_is_shaded_and_the_worst_of_a_pixel_wins(tmp_path, qtbot):
    path = write_take(tmp_path, "b", 101, lost=range(20, 40), hidden=range(60, 80), guessed=range(50, 90))
    with open_take(path) as take:
        analysis = analyse(take.solved, np.arange(101), take.profile)
        widget = Timeline(Player(take.raw.times_s))
    qtbot.addWidget(widget)
    widget.resize(GUTTER + 12 + 500, 250)
    widget.show()
    widget.show_take(analysis, ())
    widget.view_all()
    guess, sure, lost = (colour(widget, frame, LEFT_Y) for frame in (70, 10, 30))
    assert len({guess, sure, lost}) == 3 and lost == theme.PROBLEM
    assert colour(widget, 70, RIGHT_Y) == sure
    assert widget.text_at(widget.x_of(0.705), LEFT_Y) == (
        "Left hand: tracked, partly a guess, least sure: ring DIP ±30°, frame 70"
    )
    assert "tracked, least sure: wrist ±3°, frame 10" in widget.text_at(widget.x_of(0.105), LEFT_Y)
    widget.resize(GUTTER + 12 + 8, 250)
    assert colour(widget, 49, LEFT_Y) == guess
    widget.set_markers_shown(True)
    widget.resize(GUTTER + 12 + 500, 250)
    y = RULER + LANE + GAP + 2 * (MARKER_LANE + GAP) + MARKER_LANE // 2
    assert "hidden: a gap ±9 mm, frame 70" in widget.text_at(widget.x_of(0.705), y)


def test_zooming_keeps_the_moment_under_the_pointer(timeline):
    x = timeline.x_of(0.3)
    timeline.zoom(0.25, timeline.time_at(x))
    assert timeline.x_of(0.3) == pytest.approx(x)
    assert np.diff(timeline.view_s) == pytest.approx(0.25)
    # a single frame can be told from its neighbours now
    assert colour(timeline, 39, LEFT_Y) == theme.PROBLEM != colour(timeline, 40, LEFT_Y)
    timeline.zoom(1e6, 0.3)
    assert timeline.view_s == pytest.approx((0.0, 1.0))


def test_the_wheel_zooms_and_with_shift_moves(timeline):
    def wheel(angle, modifiers=Qt.KeyboardModifier.NoModifier):
        at = QPointF(GUTTER + 250, LEFT_Y)
        event = QWheelEvent(
            at, timeline.mapToGlobal(at), QPoint(), QPoint(0, angle), Qt.MouseButton.NoButton, modifiers,
            Qt.ScrollPhase.NoScrollPhase, False,
        )  # fmt: skip
        QApplication.sendEvent(timeline, event)

    wheel(480)
    start, end = timeline.view_s
    assert end - start < 0.6
    wheel(-120, Qt.KeyboardModifier.ShiftModifier)
    assert timeline.view_s[0] > start


def test_dragging_scrubs(timeline, qtbot):
    player = timeline._player
    player.play()
    qtbot.mousePress(timeline, Qt.MouseButton.LeftButton, pos=QPoint(round(timeline.x_of(0.5)), LEFT_Y))
    assert (player.playing, player.frame) == (False, 50)
    drag(timeline, timeline.x_of(0.8), LEFT_Y)
    assert player.frame == 80
    qtbot.mouseRelease(timeline, Qt.MouseButton.LeftButton)
    drag(timeline, timeline.x_of(0.1), LEFT_Y, Qt.MouseButton.NoButton)
    assert player.frame == 80


def test_in_and_out_are_handles(timeline, qtbot):
    player = timeline._player
    for handle, time_s, to_s in (("in", 0.0, 0.2), ("out", 1.0, 0.7)):
        x = timeline.x_of(time_s) + (-3 if handle == "in" else 3)
        qtbot.mousePress(timeline, Qt.MouseButton.LeftButton, pos=QPoint(round(x), RULER - 4))
        drag(timeline, timeline.x_of(to_s), RULER - 4)
        qtbot.mouseRelease(timeline, Qt.MouseButton.LeftButton)
    assert (player.in_frame, player.out_frame, player.frame) == (20, 70, 0)
    assert QColor(colour(timeline, 10, RIGHT_Y)).lightness() < QColor(colour(timeline, 45, RIGHT_Y)).lightness()
    # neither handle passes the other
    player.set_range(50, 50)
    qtbot.mousePress(timeline, Qt.MouseButton.LeftButton, pos=QPoint(round(timeline.x_of(0.5)) - 3, RULER - 4))
    drag(timeline, timeline.x_of(0.9), RULER - 4)
    assert (player.in_frame, player.out_frame) == (50, 50)


def test_a_mark_is_a_place_to_go_to(timeline, qtbot):
    clicked = []
    timeline.mark_clicked.connect(clicked.append)
    at = QPoint(round(timeline.x_of(0.1)) + 3, RULER - 13)
    assert "clap" in timeline.text_at(at.x(), at.y())
    qtbot.mouseClick(timeline, Qt.MouseButton.LeftButton, pos=at)
    assert clicked == [0] and timeline._player.frame == 10


def test_it_says_what_is_where(timeline):
    assert timeline.text_at(timeline.x_of(0.305), LEFT_Y) == "Left hand: lost, frame 30"
    assert timeline.text_at(timeline.x_of(0.305), RIGHT_Y) == "Right hand: tracked, frame 30"
    assert timeline.text_at(timeline.x_of(0.0) - 3, RULER - 4).startswith("In point: frame 0")
    assert timeline.text_at(5, 150) == ""


def test_the_playhead_leaves_no_trace(timeline, qtbot):
    qtbot.waitExposed(timeline)
    before = timeline.grab().toImage()
    for frame in (10, 55, 90, 0):
        timeline._player.seek_frame(frame)
        QApplication.processEvents()
    assert timeline.grab().toImage() == before


def test_without_a_take_it_is_empty_and_quiet(qtbot):
    timeline = Timeline(Player())
    qtbot.addWidget(timeline)
    timeline.show()
    timeline.view_all()
    qtbot.mouseClick(timeline, Qt.MouseButton.LeftButton, pos=QPoint(GUTTER + 20, 30))
    assert timeline.text_at(GUTTER + 20, 30) == ""


def drag(timeline, x: float, y: float, buttons=Qt.MouseButton.LeftButton) -> None:
    at = QPointF(x, y)
    event = QMouseEvent(
        QMouseEvent.Type.MouseMove, at, timeline.mapToGlobal(at), Qt.MouseButton.NoButton, buttons,
        Qt.KeyboardModifier.NoModifier,
    )  # fmt: skip
    QApplication.sendEvent(timeline, event)
