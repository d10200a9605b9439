"""Fit, certainty of the labels and one joint angle over a whole take, under its timeline."""

from __future__ import annotations

import time

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QComboBox, QVBoxLayout, QWidget

from app import theme
from app.editing import leave_wheel_to_panel
from app.lights import label
from app.panels.axes import LEFT_PX, ValueAxis
from app.panels.panel import row
from app.panels.plots import LEAST_SPAN, TRUST_TIP, bound_pen, trust_lines, worst_pen
from app.pose_words import angle_tip, angle_title
from app.review.analysis import Analysis, Cell
from app.review.player import Player
from app.review.timeline import GUTTER
from app.texts import give_way
from core.frames import FloatArray, HandKey, Side
from core.hand.skeleton import DIGIT_DOF_NAMES, N_ROOT_DOFS

LIMIT_MM = 8.0
_HEAD_PERIOD_S = 0.1
"""A playhead that crosses the curves makes them be drawn again."""


class TakePlots(QWidget):
    """Three plots that share the timeline's view; a click moves the playhead."""

    view_changed = Signal(float, float)

    def __init__(self, player: Player, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._player = player
        self._times_s: FloatArray = np.empty(0)
        self._analysis: Analysis | None = None
        self._following = False
        self._moved_s = 0.0
        self.angle = leave_wheel_to_panel(give_way(QComboBox()))
        self.angle.setToolTip(angle_tip(()))
        self.angle.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        for name in DIGIT_DOF_NAMES:
            self.angle.addItem(angle_title(name))
        self.angle.setCurrentIndex(DIGIT_DOF_NAMES.index("index_pip_flexion"))
        self.angle.currentIndexChanged.connect(lambda _: self._draw_angle())

        self._rms, self._labels, self._angles = _plot("mm"), _plot("%"), _plot("°")
        self._labels.setYRange(0, 100, padding=0.05)
        self._labels.setToolTip(TRUST_TIP)
        for line in trust_lines():
            self._labels.addItem(line)
        self._labels.setXLink(self._rms)
        self._rms.setYRange(0, LIMIT_MM, padding=0.05)
        self._rms.addItem(
            pg.InfiniteLine(LIMIT_MM, angle=0, pen=pg.mkPen(theme.PROBLEM, width=1, style=Qt.PenStyle.DashLine))
        )
        self._angles.setXLink(self._rms)
        self._heads = []
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 4, 12, 4)
        layout.setSpacing(4)
        for head, plot in (
            (label("Fit, RMS [mm]", "section"), self._rms),
            (label("Labels [%]", "section"), self._labels),
            (self.angle, self._angles),
        ):
            gutter = QWidget()
            gutter.setFixedWidth(GUTTER - LEFT_PX)
            line = row(plot, spacing=0)
            gutter_column = QVBoxLayout(gutter)
            gutter_column.setContentsMargins(8, 2, 4, 0)
            gutter_column.addWidget(head, 0, Qt.AlignmentFlag.AlignTop)
            line.insertWidget(0, gutter)
            layout.addLayout(line, 1)
            playhead = pg.InfiniteLine(0.0, angle=90, pen=pg.mkPen(theme.TEXT, width=1))
            plot.addItem(playhead)
            plot.scene().sigMouseClicked.connect(lambda event, plot=plot: self._clicked(event, plot))
            self._heads.append(playhead)
        self.angle.setFixedWidth(GUTTER - LEFT_PX - 12)
        self._curves: dict[pg.PlotWidget, dict[HandKey, pg.PlotDataItem]] = {
            plot: {} for plot in (self._rms, self._labels, self._angles)
        }
        self._worst: dict[HandKey, pg.PlotDataItem] = {}
        self._bounds: dict[tuple[HandKey, int], pg.PlotDataItem] = {}
        self._list_hands((HandKey(0, "left"), HandKey(0, "right")))
        self._rms.getViewBox().sigXRangeChanged.connect(self._range_changed)
        player.subscribe(self._move)

    def show_take(self, times_s: FloatArray, analysis: Analysis | None) -> None:
        """times_s: (n,) [s] of the frames of `analysis`; None while it is being read."""
        self._times_s, self._analysis = times_s, analysis
        if analysis is not None:
            self._list_hands(analysis.hands)
            self.angle.setToolTip(angle_tip(analysis.cast))
        for key, curve in self._curves[self._rms].items():
            i = analysis.hands.index(key) if analysis is not None else None
            rms_mm = np.empty(0) if i is None or analysis is None else analysis.rms_m[i] * 1000.0
            curve.setData(*self._broken(rms_mm), connect="finite")
            known = i is not None and analysis is not None and np.isfinite(analysis.trust[i]).any()
            percents = analysis.trust[i] * 100.0 if known and analysis is not None else np.empty((0, 2))
            for k, drawn in enumerate((self._curves[self._labels][key], self._worst[key])):
                drawn.setData(*self._broken(percents[:, k]), connect="finite")
        self._draw_angle()

    def _list_hands(self, hands: tuple[HandKey, ...]) -> None:
        """A curve in each plot for each of these hands."""
        if tuple(self._curves[self._rms]) == hands:
            return
        for plot, curves in self._curves.items():
            for curve in curves.values():
                plot.removeItem(curve)
        for curve in self._bounds.values():
            self._angles.removeItem(curve)
        for curve in self._worst.values():
            self._labels.removeItem(curve)
        self._curves = {
            plot: {key: plot.plot(pen=pg.mkPen(theme.hand_colour(key), width=1)) for key in hands}
            for plot in self._curves
        }
        self._bounds = {
            (key, sign): self._angles.plot(pen=bound_pen(theme.hand_colour(key))) for key in hands for sign in (-1, 1)
        }
        self._worst = {key: self._labels.plot(pen=worst_pen(theme.hand_colour(key))) for key in hands}
        plain = (curve for curves in self._curves.values() for curve in curves.values())
        for curve in (*plain, *self._bounds.values(), *self._worst.values()):
            curve.setDownsampling(auto=True, method="peak")
            curve.setClipToView(True)

    def curve(self, what: str, side: Side, performer: int = 0) -> tuple[FloatArray, FloatArray]:
        """What is drawn of a hand: x [s] and y of "rms" [mm], "angle", "lower bound" or "upper bound" [°], "labels" or
        "worst label" [%].
        """
        key = HandKey(performer, side)
        x, y = {
            "rms": self._curves[self._rms].get(key),
            "angle": self._curves[self._angles].get(key),
            "lower bound": self._bounds.get((key, -1)),
            "upper bound": self._bounds.get((key, 1)),
            "labels": self._curves[self._labels].get(key),
            "worst label": self._worst.get(key),
        }[what].getOriginalDataset()
        return (np.empty(0), np.empty(0)) if x is None else (x, y)

    @property
    def dof(self) -> int:
        """Index into DOF_NAMES of the angle drawn."""
        return N_ROOT_DOFS + self.angle.currentIndex()

    def set_view(self, from_s: float, to_s: float) -> None:
        """Show the part of the take that the timeline shows."""
        self._following = True
        self._rms.setXRange(from_s, to_s, padding=0)
        self._following = False

    def _draw_angle(self) -> None:
        analysis = self._analysis
        for key, curve in self._curves[self._angles].items():
            i = analysis.hands.index(key) if analysis is not None else None
            degrees = error = np.empty(0)
            if i is not None and analysis is not None:
                degrees, error = (
                    np.degrees(values[i, :, self.dof]) for values in (analysis.theta_rad, analysis.theta_std)
                )
            curve.setData(*self._broken(degrees), connect="finite")
            for sign in (-1, 1):
                bound = degrees + sign * error if np.isfinite(error).any() else np.empty(0)
                self._bounds[key, sign].setData(*self._broken(bound), connect="finite")

    def _broken(self, values: FloatArray) -> tuple[FloatArray, FloatArray]:
        """x [s] and y of a curve over the frames, broken where there are none, but not at those left out by choice."""
        times_s, analysis = self._times_s[: len(values)], self._analysis
        if analysis is not None and analysis.left_out and len(values):
            solved = (analysis.states != Cell.UNSOLVED).any(axis=0)
            times_s, values = times_s[solved], values[solved]
        if analysis is None or not len(analysis.holes) or not len(values):
            return times_s, values
        at = np.searchsorted(np.maximum.accumulate(times_s), analysis.holes.from_s)
        return np.insert(times_s, at, analysis.holes.from_s), np.insert(values, at, np.nan)

    def _move(self) -> None:
        now_s = time.monotonic()
        if self.isVisible() and (not self._player.playing or now_s - self._moved_s > _HEAD_PERIOD_S):
            self._moved_s = now_s
            for head in self._heads:
                head.setValue(self._player.time_s)

    def _clicked(self, event: object, plot: pg.PlotWidget) -> None:
        position = plot.getViewBox().mapSceneToView(event.scenePos())  # type: ignore[attr-defined]
        self._player.pause()
        self._player.seek_time(position.x())

    def _range_changed(self, view: object, span: tuple[float, float]) -> None:
        if not self._following:
            self.view_changed.emit(*span)


def _plot(unit: str) -> pg.PlotWidget:
    plot = pg.PlotWidget(background=theme.GROUND, axisItems={"left": ValueAxis("left", unit)})
    plot.setFocusPolicy(Qt.FocusPolicy.NoFocus)
    plot.setMenuEnabled(False)
    plot.setMouseEnabled(x=True, y=False)
    plot.hideButtons()
    plot.showGrid(x=True, y=True, alpha=0.12)
    plot.setMinimumHeight(44)
    plot.getAxis("bottom").setStyle(showValues=False, tickLength=0)
    plot.getAxis("bottom").setHeight(2)
    plot.getAxis("bottom").setPen(theme.STRONG_LINE)
    plot.setLimits(minYRange=LEAST_SPAN[unit])
    plot.plotItem.layout.setContentsMargins(0, 6, 0, 4)
    return plot
