"""The plots panel: fit and one joint angle of each hand over the last seconds."""

from __future__ import annotations

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import Qt
from PySide6.QtGui import QColor, QPen
from PySide6.QtWidgets import QComboBox, QHBoxLayout, QWidget

from app import theme
from app.lights import label
from app.panels.panel import Panel, column, row
from app.pose_words import angle_title
from app.worker import SessionWorker
from core.frames import SIDES
from core.hand.skeleton import DIGIT_DOF_NAMES, N_ROOT_DOFS
from devices.stream import host_clock

SPAN_S = 10.0
HEAD_HEIGHT = 26
MAX_POINTS = 800
"""Points drawn per curve: more than the pixels of a plot cost time and show nothing."""
_COLOURS = (theme.LEFT_HAND, theme.RIGHT_HAND)


class PlotsPanel(Panel):
    """Rolling curves, drawn ten times a second while they can be seen."""

    title, key = "Plots", "plots"

    def __init__(self, worker: SessionWorker) -> None:
        super().__init__()
        self._worker = worker
        self.angle = QComboBox()
        self.angle.setToolTip(
            "The joint angle drawn for both hands, dotted with one standard deviation above and below."
        )
        for name in DIGIT_DOF_NAMES:
            self.angle.addItem(angle_title(name))
        self.angle.setCurrentIndex(DIGIT_DOF_NAMES.index("index_pip_flexion"))

        self._rms, self._rms_curves = _plot("mm", (0.0, 8.0))
        self._angles, self._angle_curves = _plot("°", None)
        self._bounds = [[self._angles.plot(pen=bound_pen(colour)) for _ in range(2)] for colour in _COLOURS]
        self._rms.setXLink(self._angles)
        limit = pg.InfiniteLine(8.0, angle=0, pen=pg.mkPen(theme.PROBLEM, width=1, style=Qt.PenStyle.DashLine))
        limit.setToolTip("Over 8 mm RMS a fit is no pose.")
        self._rms.addItem(limit)

        sides = QHBoxLayout()
        sides.setSpacing(10)
        for title, chooser, plot in (
            ("Fit, RMS [mm]", None, self._rms),
            ("Joint angle [°]", self.angle, self._angles),
        ):
            half = column(margin=0, spacing=4)
            head = row(label(title, "section"), *((chooser,) if chooser else ()), None)
            if chooser is None:
                head.addWidget(_legend("left", theme.LEFT_HAND))
                head.addWidget(_legend("right", theme.RIGHT_HAND))
            strip = QWidget()
            strip.setFixedHeight(HEAD_HEIGHT)
            strip.setLayout(head)
            half.addWidget(strip)
            half.addWidget(plot, 1)
            holder = QWidget()
            holder.setLayout(half)
            sides.addWidget(holder, 1)
        column(self, 8).addLayout(sides)
        worker.numbers.connect(self._refresh)

    def curve(self, what: str, side: str) -> tuple[np.ndarray, np.ndarray]:
        """What is drawn: x [s] and y of "rms" [mm], "angle", "lower bound" or "upper bound" [°] of a side."""
        i = SIDES.index(side)  # type: ignore[arg-type]
        low, high = self._bounds[i]
        curves = {"rms": self._rms_curves[i], "angle": self._angle_curves[i], "lower bound": low, "upper bound": high}
        x, y = curves[what].getData()
        return (np.empty(0), np.empty(0)) if x is None else (x, y)

    def _refresh(self) -> None:
        if not self.isVisible():
            return
        view = self._worker.session.trail.view(SPAN_S)
        step = max(1, len(view.times_s) // MAX_POINTS)
        x = (view.times_s - host_clock())[::step]
        dof = N_ROOT_DOFS + self.angle.currentIndex()
        for side in range(2):
            self._rms_curves[side].setData(x, view.rms_m[::step, side] * 1000, connect="finite")
            angle, error = (np.degrees(values[::step, side, dof]) for values in (view.theta_rad, view.theta_std))
            self._angle_curves[side].setData(x, angle, connect="finite")
            known = bool(np.isfinite(error).any())
            for sign, curve in zip((-1, 1), self._bounds[side], strict=True):
                curve.setData(*((x, angle + sign * error) if known else ([], [])), connect="finite")


class _SecondsAxis(pg.AxisItem):
    """Ticks with their unit."""

    def tickStrings(self, values: list[float], scale: float, spacing: float) -> list[str]:  # noqa: N802
        return [f"{value:g} s" for value in values]


def _plot(unit: str, span: tuple[float, float] | None) -> tuple[pg.PlotWidget, list[pg.PlotDataItem]]:
    plot = pg.PlotWidget(background=theme.GROUND, axisItems={"bottom": _SecondsAxis("bottom")})
    plot.setMenuEnabled(False)
    plot.setMouseEnabled(x=False, y=span is None)
    plot.hideButtons()
    plot.showGrid(x=True, y=True, alpha=0.12)
    plot.setXRange(-SPAN_S, 0, padding=0.01)
    if span is not None:
        plot.setYRange(*span, padding=0.05)
    for name in ("left", "bottom"):
        axis = plot.getAxis(name)
        axis.setPen(theme.STRONG_LINE)
        axis.setTextPen(theme.FAINT)
        axis.setStyle(tickLength=-4)
    plot.getAxis("left").setWidth(34)
    plot.getAxis("bottom").setHeight(20)
    plot.setToolTip(f"[{unit}] over the last {SPAN_S:g} seconds.")
    return plot, [plot.plot(pen=pg.mkPen(colour, width=1)) for colour in _COLOURS]


def bound_pen(colour: str) -> QPen:
    """For one standard deviation above and below a curve of this colour."""
    faint = QColor(colour)
    faint.setAlpha(110)
    return pg.mkPen(faint, width=1, style=Qt.PenStyle.DotLine)


def _legend(text: str, colour: str) -> QWidget:
    made = label(f'<span style="color:{colour}">━</span>&nbsp;{text}', "small")
    made.setTextFormat(Qt.TextFormat.RichText)
    return made
