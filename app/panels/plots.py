"""The plots panel: fit, certainty of the labels and one joint angle of each hand over the last seconds."""

from __future__ import annotations

from dataclasses import dataclass
from html import escape

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import Qt
from PySide6.QtGui import QColor, QPen
from PySide6.QtWidgets import QComboBox, QHBoxLayout, QLabel, QWidget

from app import theme
from app.editing import leave_wheel_to_panel
from app.hand_words import performer_titles, side_title
from app.label_trust import DOUBTED, WRONG
from app.lights import elided, label
from app.panels.axes import ValueAxis
from app.panels.panel import Panel, clear, column, row
from app.pose_words import angle_tip, angle_title
from app.texts import give_way
from app.worker import SessionWorker
from core.cast import hands_of
from core.frames import HandKey, Side
from core.hand.skeleton import DIGIT_DOF_NAMES, N_ROOT_DOFS
from devices.common.clock import host_clock

TRUST_TIP = (
    "How sure it is that markers carry their own names [%]: mean over the hand's markers; dotted, the least sure one."
    f"\nDashed: below {100 * DOUBTED:.0f} % a label is doubted, below {100 * WRONG:.0f} % it is rather wrong."
)
SPAN_S = 10.0
PAUSE_S = 0.25
"""Without poses for so long, curves are broken [s]."""
HEAD_HEIGHT = 26
LEAST_SPAN = {"mm": 2.0, "%": 20.0, "°": 20.0}
"""Of what a plot shows, so that noise is not drawn as motion."""
MAX_POINTS = 800
"""Points drawn per curve: more than the pixels of a plot cost time and show nothing."""


class PlotsPanel(Panel):
    """Rolling curves, drawn ten times a second while they can be seen."""

    title, key = "Plots", "plots"

    def __init__(self, worker: SessionWorker) -> None:
        super().__init__()
        self._worker = worker
        self.angle = leave_wheel_to_panel(give_way(QComboBox()))
        for name in DIGIT_DOF_NAMES:
            self.angle.addItem(angle_title(name))
        self.angle.setCurrentIndex(DIGIT_DOF_NAMES.index("index_pip_flexion"))

        self._rms, self._angles = _plot("mm", (0.0, 8.0)), _plot("°", None)
        self._labels = _plot("%", (0.0, 100.0))
        self._curves: dict[HandKey, _HandCurves] = {}
        self._legend_strip = QWidget()
        self._legend = row(spacing=10)
        self._legend_strip.setLayout(self._legend)
        for plot in (self._rms, self._labels):
            plot.setXLink(self._angles)
        for line in trust_lines():
            self._labels.addItem(line)
        self._labels.setToolTip(TRUST_TIP)
        limit = pg.InfiniteLine(8.0, angle=0, pen=pg.mkPen(theme.PROBLEM, width=1, style=Qt.PenStyle.DashLine))
        limit.setToolTip("Over 8 mm RMS a fit is no pose.")
        self._rms.addItem(limit)

        sides = QHBoxLayout()
        sides.setSpacing(10)
        for title, chooser, plot in (
            ("Fit, RMS [mm]", None, self._rms),
            ("Labels, mean and worst [%]", None, self._labels),
            ("Joint angle [°]", self.angle, self._angles),
        ):
            half = column(margin=0, spacing=4)
            head = row(label(title, "section"), chooser)
            head.setStretch(1, 1)
            if plot is self._rms:
                self._first_head = head
            strip = QWidget()
            strip.setFixedHeight(HEAD_HEIGHT)
            strip.setLayout(head)
            half.addWidget(strip)
            half.addWidget(plot, 1)
            holder = QWidget()
            holder.setLayout(half)
            sides.addWidget(holder, 1)
        self._column = column(self, 8, 4)
        self._column.addLayout(sides, 1)
        worker.numbers.connect(self._refresh)
        worker.profile_changed.connect(lambda _: self._list_hands())
        self._list_hands()

    def curve(self, what: str, side: Side, performer: int = 0) -> tuple[np.ndarray, np.ndarray]:
        """What is drawn of a hand: x [s] and y of "rms" [mm], "angle", "lower bound" or "upper bound" [°], "labels" or
        "worst label" [%].
        """
        own = self._curves[HandKey(performer, side)]
        curves = {
            "rms": own.rms, "angle": own.angle, "lower bound": own.low, "upper bound": own.high,
            "labels": own.labels, "worst label": own.worst_label,
        }  # fmt: skip
        x, y = curves[what].getData()
        return (np.empty(0), np.empty(0)) if x is None else (x, y)

    @property
    def legend_text(self) -> str:
        """The hands told apart, as the legend names them."""
        return ", ".join(entry.accessibleName() for entry in self.legend_entries if entry.accessibleName())

    @property
    def legend_entries(self) -> list[QLabel]:
        """What stands there: of several performers the name of each, then a line in the colour of each hand."""
        widgets = (self._legend.itemAt(i).widget() for i in range(self._legend.count()))
        return [widget for widget in widgets if isinstance(widget, QLabel)]

    def _list_hands(self) -> None:
        """A curve in each plot for every hand of the profiles in use."""
        self._cast = cast = self._worker.session.profiles
        performers = performer_titles(cast)
        self.angle.setToolTip(angle_tip(cast))
        for curves in self._curves.values():
            self._rms.removeItem(curves.rms)
            for curve in (curves.labels, curves.worst_label):
                self._labels.removeItem(curve)
            for curve in (curves.angle, curves.low, curves.high):
                self._angles.removeItem(curve)
        clear(self._legend)
        self._curves = {}
        self._place_legend(bool(performers))
        for key in hands_of(cast):
            colour = theme.hand_colour(key)
            pen, bound = pg.mkPen(colour, width=1), bound_pen(colour)
            self._curves[key] = _HandCurves(
                self._rms.plot(pen=pen), self._angles.plot(pen=pen), self._angles.plot(pen=bound),
                self._angles.plot(pen=bound), self._labels.plot(pen=pen), self._labels.plot(pen=worst_pen(colour)),
            )  # fmt: skip
            if performers and key.side == cast[key.performer].sides[0]:
                self._legend.addWidget(elided(performers[key.performer], "small"))
            self._legend.addWidget(_legend(side_title(performers, key), key.side.capitalize(), colour))
        if performers:
            self._legend.addStretch(1)

    def _place_legend(self, several: bool) -> None:
        """Beside the first heading; for several performers on a line of its own, with room for their names."""
        for layout in (self._first_head, self._column):
            layout.removeWidget(self._legend_strip)
        if several:
            self._column.insertWidget(0, self._legend_strip)
        else:
            self._first_head.addWidget(self._legend_strip)

    def _refresh(self) -> None:
        if not self.isVisible():
            return
        view = self._worker.session.trail.view(SPAN_S)
        step = max(1, len(view.times_s) // MAX_POINTS)
        x = broken((view.times_s - host_clock())[::step])
        dof = N_ROOT_DOFS + self.angle.currentIndex()
        for i, key in enumerate(view.hands):
            curves = self._curves.get(key)
            if curves is None:  # other performers since; the curves follow
                continue
            curves.rms.setData(x, view.rms_m[::step, i] * 1000, connect="finite")
            for curve, share in ((curves.labels, view.trust[:, i, 0]), (curves.worst_label, view.trust[:, i, 1])):
                known = bool(np.isfinite(share).any())
                curve.setData(*((x, least_of(share, step) * 100) if known else ([], [])), connect="finite")
            theta, std = view.theta_rad[::step, i], view.theta_std[::step, i]
            if (neutral := self._cast[key.performer].neutral) is not None:
                theta, std = neutral.reported(key.side, theta, std)
            angle, error = np.degrees(theta[:, dof]), np.degrees(std[:, dof])
            curves.angle.setData(x, angle, connect="finite")
            known = bool(np.isfinite(error).any())
            for sign, curve in ((-1, curves.low), (1, curves.high)):
                curve.setData(*((x, angle + sign * error) if known else ([], [])), connect="finite")


@dataclass(frozen=True)
class _HandCurves:
    """What is drawn of one hand."""

    rms: pg.PlotDataItem
    angle: pg.PlotDataItem
    low: pg.PlotDataItem
    high: pg.PlotDataItem
    labels: pg.PlotDataItem
    worst_label: pg.PlotDataItem


def _plot(unit: str, span: tuple[float, float] | None) -> pg.PlotWidget:
    axes = {"left": ValueAxis("left", unit), "bottom": ValueAxis("bottom", behind=" s")}
    plot = pg.PlotWidget(background=theme.GROUND, axisItems=axes)
    plot.setFocusPolicy(Qt.FocusPolicy.NoFocus)
    plot.setMinimumHeight(64)
    plot.setMenuEnabled(False)
    plot.setMouseEnabled(x=False, y=span is None)
    plot.hideButtons()
    plot.showGrid(x=True, y=True, alpha=0.12)
    plot.setXRange(-SPAN_S, 0, padding=0.01)
    if span is not None:
        plot.setYRange(*span, padding=0.05)
    plot.setLimits(minYRange=LEAST_SPAN[unit])
    plot.getAxis("bottom").setHeight(20)
    plot.plotItem.layout.setContentsMargins(0, 7, 14, 0)
    plot.setToolTip(f"[{unit}] over the last {SPAN_S:g} seconds.")
    return plot


def broken(times_s: np.ndarray) -> np.ndarray:
    """(n,), the same with NaN behind each pause: no curve is drawn through time without poses."""
    return np.where(np.diff(times_s, prepend=times_s[:1]) > PAUSE_S, np.nan, times_s)


def least_of(values: np.ndarray, step: int) -> np.ndarray:
    """(ceil(n / step),) the least of every `step` values, NaN where none is known: a doubt of one frame is seen."""
    starts = np.arange(0, len(values), step)
    least = np.minimum.reduceat(np.where(np.isnan(values), np.inf, values), starts) if len(values) else values
    return np.where(np.isinf(least), np.nan, least)


def trust_lines() -> list[pg.InfiniteLine]:
    """Where labels are doubted, and where they are rather wrong."""
    return [
        pg.InfiniteLine(100 * share, angle=0, pen=pg.mkPen(colour, width=1, style=Qt.PenStyle.DashLine))
        for share, colour in ((DOUBTED, theme.WARNING), (WRONG, theme.PROBLEM))
    ]


def bound_pen(colour: str) -> QPen:
    """For one standard deviation above and below a curve of this colour."""
    faint = QColor(colour)
    faint.setAlpha(110)
    return pg.mkPen(faint, width=1, style=Qt.PenStyle.DotLine)


def worst_pen(colour: str) -> QPen:
    """For the least sure label of a hand of this colour."""
    return pg.mkPen(colour, width=1, style=Qt.PenStyle.DotLine)


def _legend(whose: str, text: str, colour: str) -> QLabel:
    made = label(f'<span style="color:{colour}">━</span>&nbsp;{escape(text)}', "small")
    made.setProperty("rich", True)
    made.setAccessibleName(whose)
    made.setToolTip(whose)
    return made
