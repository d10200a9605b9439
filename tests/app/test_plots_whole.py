"""Numbers, names and legends of plots and lanes: none cut, none over another, at every height there is."""

from __future__ import annotations

from dataclasses import replace

import pyqtgraph as pg
import pytest
from PySide6.QtCore import QPoint, QRect, QRectF, Qt
from PySide6.QtGui import QFontMetrics, QImage, QPainter

from app.panels.axes import ValueAxis
from app.review.lane_list import Lane
from app.review.timeline import GUTTER, _font, shown_name
from core.profile import load_profile
from tests.app.stage import server
from tests.app.takes import write_take
from tests.app.test_window import Desk


@pytest.fixture
def desk(qtbot, tmp_path):
    made = Desk(qtbot, tmp_path / "takes")
    made.window.setWindowState(Qt.WindowState.WindowNoState)
    made.window.resize(1366, 768)
    qtbot.wait(50)
    yield made
    made.close()


def numbers(plot: pg.PlotWidget, side: str) -> dict[str, QRectF]:
    """What an axis draws, and where in the widget."""
    axis = plot.getAxis(side)
    assert isinstance(axis, ValueAxis)
    image = QImage(10, 10, QImage.Format.Format_RGB32)
    painter = QPainter(image)
    specs = axis.generateDrawSpecs(painter)
    painter.end()
    return {words: axis.mapRectToScene(rect) for rect, _, words in specs[2]} if specs is not None else {}


def check(plot: pg.PlotWidget, side: str) -> dict[str, QRectF]:
    shown = numbers(plot, side)
    whole = QRectF(plot.viewport().rect())
    for words, box in shown.items():
        assert whole.contains(box), (side, words, box, whole)
        for other, place in shown.items():
            assert other == words or not box.intersects(place), (side, words, other)
    return shown


def test_axes_of_the_live_plots_are_whole(desk):
    panel = desk.window.plots
    with server() as simulator:
        desk.connected(simulator)
        desk.until(lambda: len(panel.curve("angle", "left")[0]) > 20, "curves")
        for height in (210, 140, 300):
            desk.window.resizeDocks([desk.window.docks["plots"]], [height], Qt.Orientation.Vertical)
            desk.qtbot.wait(300)
            for plot in (panel._rms, panel._labels, panel._angles):
                assert len(check(plot, "left")) >= 2 and len(check(plot, "bottom")) >= 2
            assert {"0", "8"} <= set(numbers(panel._rms, "left"))
            assert {"0 s"} <= set(numbers(panel._rms, "bottom"))


def test_axes_of_the_takes_plots_are_whole_at_every_height(desk):
    folder = desk.window.plan.folder
    folder.mkdir(parents=True)
    desk.window.review_take(write_take(folder, "first", 101))
    room = desk.window._review
    desk.until(lambda: room.document is not None and room.document.analysis is not None, "the take")
    for bottom in (320, 500, 260):
        room._middle.setSizes([800 - bottom, bottom])
        for shown in (False, True):
            room.markers.setChecked(shown)
            desk.qtbot.wait(150)
            for plot in (room.plots._rms, room.plots._labels, room.plots._angles):
                assert len(check(plot, "left")) >= 2, (bottom, plot.height())
            assert {"0", "8"} <= set(numbers(room.plots._rms, "left")), room.plots._rms.height()


def test_the_legend_of_several_performers_is_whole_and_over_no_curve(desk):
    names = ("Anna Maria Lindqvist", "Ben", "Carla von Hohenberg")
    desk.worker.set_profiles(tuple(replace(load_profile("han19"), performer=name) for name in names))
    desk.qtbot.wait(200)
    panel = desk.window.plots
    plots = [QRect(plot.mapTo(panel, QPoint(0, 0)), plot.size()) for plot in (panel._rms, panel._labels, panel._angles)]
    assert max(plot.width() for plot in plots) - min(plot.width() for plot in plots) <= 2, "none gives way to names"
    boxes = []
    for entry in panel.legend_entries:
        box = QRect(entry.mapTo(panel, QPoint(0, 0)), entry.size())
        assert panel.rect().contains(box) and not any(box.intersects(other) for other in (*plots, *boxes))
        assert entry.width() >= entry.sizeHint().width(), entry.text()
        boxes.append(box)
    assert [entry.text() for entry in panel.legend_entries if not entry.accessibleName()] == list(names)
    assert "Carla von Hohenberg · right" in panel.legend_text


def test_the_name_of_a_lane_leaves_room_for_its_figure(qtbot):
    for marker, size, figure in ((-1, 11, "100.0 %"), (3, 9, "100.0 % gap")):
        lane = Lane(0, marker, 0, 16, "Anna Maria Lindqvist Featherstonehaugh · left", figure, "#ffffff")
        metrics = QFontMetrics(_font(size))
        name = shown_name(lane, _font(size))
        assert "…" in name and name.endswith("left")
        left = 10 if marker < 0 else 20
        assert left + metrics.horizontalAdvance(name) < GUTTER - 10 - metrics.horizontalAdvance(figure)
        assert shown_name(replace(lane, name="Left hand"), _font(size)) == "Left hand"
        assert metrics.tightBoundingRect("gpÅ").height() <= (16 if marker < 0 else 11), "no letter is cut"


def test_a_lanes_name_is_whole_in_its_tooltip(desk):
    folder = desk.window.plan.folder
    folder.mkdir(parents=True)
    desk.window.review_take(write_take(folder, "first", 101, lost=range(20, 40)))
    room = desk.window._review
    desk.until(lambda: room.document is not None and room.document.analysis is not None, "the take")
    assert room.timeline.text_at(20, 30) == "Left hand: tracked 80.2 % of the take"
    room.markers.setChecked(True)
    assert room.timeline.text_at(30, 52) == "Left hand, ThumbCMC: hidden 0.0 % of the time its hand is tracked"
