"""The timeline of a take: hands tracked and lost, gaps of markers, marks, in and out, and the playhead."""

from __future__ import annotations

import math

from PySide6.QtCore import QEvent, QPointF, QRect, QRectF, QSize, Qt, Signal
from PySide6.QtGui import (
    QColor,
    QFont,
    QFontMetrics,
    QHelpEvent,
    QImage,
    QMouseEvent,
    QPainter,
    QPaintEvent,
    QPen,
    QPolygonF,
    QWheelEvent,
)
from PySide6.QtWidgets import QScrollBar, QSizePolicy, QToolTip, QWidget

from app import theme
from app.review.analysis import Analysis
from app.review.lane_list import GAP_PX, HAND_PX, MARKER_PX, Lane, LaneList
from app.review.lanes import clock, tick_step
from app.review.player import Player
from core.takes.holes import NO_HOLES, hole_words, seconds_text
from core.takes.take import Mark

GUTTER = 184
RULER = 24
TALLEST = 250
"""Lanes beyond this height scroll."""
_HANDLE = 6
_SHORTEST_SPAN_S = 0.05


class Timeline(QWidget):
    """Scrub with the left button, zoom with the wheel, move with Shift+wheel or the middle button; over the names
    the wheel scrolls the lanes.

    The triangles of the ruler are the in and out points; double-click shows the whole take.
    """

    view_changed = Signal(float, float)
    mark_clicked = Signal(int)
    range_dragged = Signal(str, int, int)
    """The handle ("in" or "out") that was dragged, and in and out as they were before."""

    def __init__(self, player: Player, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._player = player
        self._analysis: Analysis | None = None
        self._marks: tuple[Mark, ...] = ()
        self._markers_shown = False
        self._from_s, self._to_s = 0.0, 1.0
        self._lanes = LaneList()
        self._expected = 2
        self._picture: QImage | None = None
        self._share = 0.0
        self._painted_range: tuple[int, int, int] | None = None
        self._painted_x = 0.0
        self._dragging = ""
        self._range_before = (0, 0)
        self._pan_from: tuple[float, float, float] | None = None
        self._scroll = QScrollBar(Qt.Orientation.Vertical, self)
        self._scroll.setSingleStep(MARKER_PX + GAP_PX)
        self._scroll.valueChanged.connect(lambda _: self.update())
        self._scroll.hide()
        self.setMouseTracking(True)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.setAccessibleName("Timeline")
        player.subscribe(self._player_changed)

    def _player_changed(self) -> None:
        """Only the strips where the playhead was and is, if nothing else changed."""
        player = self._player
        state = (player.in_frame, player.out_frame, player.n_frames)
        if state != self._painted_range:
            self._painted_range = state
            self.update()
        else:
            self.update(self._strip(self._painted_x))
            self.update(self._strip(self.x_of(player.time_s)))

    @staticmethod
    def _strip(x: float) -> QRect:
        return QRect(math.floor(x) - 5, 0, 11, 10_000)

    # what is shown

    def show_take(self, analysis: Analysis | None, marks: tuple[Mark, ...], hands: int = 2) -> None:
        """Another take, or what became known of it; analysis None while it is being read.

        hands: how many there will be, so that nothing below moves when they are known.
        """
        self._analysis, self._marks, self._expected = analysis, marks, hands
        self._lanes = LaneList(self._analysis, self._markers_shown)
        self._arrange()

    def show_progress(self, share: float) -> None:
        """How much of the take is read, 0..1."""
        self._share = share
        if self._analysis is None:
            self.update()

    def show_marks(self, marks: tuple[Mark, ...]) -> None:
        """Other marks on the same take."""
        self._marks = marks
        self.update()

    def set_markers_shown(self, shown: bool) -> None:
        """One lane per marker, with its gaps, or only one per hand."""
        self._markers_shown = shown
        self._lanes = LaneList(self._analysis, self._markers_shown)
        self._arrange()

    @property
    def view_s(self) -> tuple[float, float]:
        """From and to [s]."""
        return self._from_s, self._to_s

    def view_all(self) -> None:
        """The whole take."""
        self.set_view(self._player.start_s, self._player.end_s)

    def set_view(self, from_s: float, to_s: float) -> None:
        """Show this part, kept within the take."""
        start_s, end_s = self._player.start_s, max(self._player.end_s, self._player.start_s + _SHORTEST_SPAN_S)
        span_s = min(max(to_s - from_s, _SHORTEST_SPAN_S), end_s - start_s)
        from_s = min(max(from_s, start_s), end_s - span_s)
        if (from_s, from_s + span_s) != (self._from_s, self._to_s):
            self._from_s, self._to_s = from_s, from_s + span_s
            self._picture = None
            self.update()
            self.view_changed.emit(self._from_s, self._to_s)

    def zoom(self, factor: float, about_s: float) -> None:
        """Show `factor` times as much, `about_s` [s] staying where it is."""
        self.set_view(about_s + (self._from_s - about_s) * factor, about_s + (self._to_s - about_s) * factor)

    def x_of(self, time_s: float) -> float:
        """Where a time [s] is in the widget."""
        return GUTTER + (time_s - self._from_s) / (self._to_s - self._from_s) * self._lane_width()

    def time_at(self, x: float) -> float:
        """The time [s] of a place in the widget."""
        return self._from_s + (x - GUTTER) / self._lane_width() * (self._to_s - self._from_s)

    def sizeHint(self) -> QSize:  # noqa: N802 (Qt's name)
        """Room for every lane."""
        return QSize(400, self._height())

    def minimumSizeHint(self) -> QSize:  # noqa: N802 (Qt's name)
        """Room for every lane."""
        return QSize(GUTTER + 100, self._height())

    def _height(self) -> int:
        return min(RULER + self._lanes_height(), TALLEST)

    def _lanes_height(self) -> int:
        return (self._lanes.height or self._expected * (HAND_PX + GAP_PX)) + 8

    def _arrange(self) -> None:
        """Other lanes, or another size."""
        self._picture = None
        room = self.height() - RULER
        self._scroll.setVisible(self._lanes_height() > TALLEST - RULER)
        self._scroll.setRange(0, max(self._lanes_height() - room, 0) if self._scroll.isVisibleTo(self) else 0)
        self._scroll.setPageStep(max(room, 1))
        self._scroll.setGeometry(self.width() - 10, RULER, 9, max(room, 1))
        self.updateGeometry()
        self.update()

    def _lane_width(self) -> float:
        return max(self.width() - GUTTER - 12, 1)

    # painting

    def paintEvent(self, event: QPaintEvent) -> None:  # noqa: N802 (Qt's name)
        """Lanes from their picture; ruler, marks, range and playhead anew."""
        painter = QPainter(self)
        painter.fillRect(self.rect(), QColor(theme.PANEL))
        if self._player.n_frames:
            self._paint_ruler(painter)
        if self._analysis is not None and self._analysis.n_frames:
            self._paint_lanes(painter)
        elif self._player.n_frames:
            painter.setPen(QColor(theme.MUTED))
            lane = QRectF(GUTTER, RULER, self._lane_width(), 30)
            painter.drawText(lane, Qt.AlignmentFlag.AlignVCenter, f"Reading the take… {self._share:.0%}")
        if self._player.n_frames:
            self._paint_holes(painter)
            self._paint_range(painter)
            self._paint_marks(painter)
            self._paint_playhead(painter)
        if self.hasFocus():
            painter.setPen(QColor(theme.FOCUS))
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.drawRect(self.rect().adjusted(0, 0, -1, -1))

    def _paint_ruler(self, painter: QPainter) -> None:
        painter.setFont(_font(10))
        step_s, decimals = tick_step(self._to_s - self._from_s, self._lane_width())
        for i in range(math.ceil(self._from_s / step_s), math.floor(self._to_s / step_s) + 1):
            x = self.x_of(i * step_s)
            painter.setPen(QColor(theme.LINE))
            painter.drawLine(QPointF(x, RULER - 5), QPointF(x, self.height()))
            painter.setPen(QColor(theme.MUTED))
            words = clock(i * step_s, decimals)
            half = painter.fontMetrics().horizontalAdvance(words) / 2 + 1
            middle = min(x, self.width() - half)  # the last one whole
            painter.drawText(QRectF(middle - half, 2, 2 * half, RULER - 8), Qt.AlignmentFlag.AlignCenter, words)

    def _paint_lanes(self, painter: QPainter) -> None:
        if self._picture is None:
            width = int(self._lane_width())
            self._picture = self._lanes.picture(self._player.times_s, self._from_s, self._to_s, width)
        painter.setClipRect(QRectF(0, RULER, self.width(), self.height() - RULER))
        for i, lane in enumerate(self._lanes.lanes):
            y = RULER - self._scroll.value() + lane.y
            area = QRectF(GUTTER, y, self._lane_width(), lane.height)
            painter.drawImage(area, self._picture, QRectF(0, i, self._picture.width(), 1))
            indent = 10 if lane.marker < 0 else 20
            beside = QRectF(indent, y, GUTTER - 10 - indent, lane.height)
            font = _font(11 if lane.marker < 0 else 9)
            painter.setFont(font)
            painter.setPen(QColor(theme.MUTED))
            painter.drawText(beside, Qt.AlignmentFlag.AlignVCenter | Qt.AlignmentFlag.AlignRight, lane.figure)
            if lane.marker < 0:
                painter.fillRect(QRectF(2, y + 2, 3, lane.height - 4), QColor(lane.colour))
            painter.setPen(QColor(theme.TEXT if lane.marker < 0 else theme.MUTED))
            painter.drawText(beside, Qt.AlignmentFlag.AlignVCenter, shown_name(lane, font))
        painter.setClipping(False)

    def _paint_holes(self, painter: QPainter) -> None:
        """Red on the ruler where there are no frames, so that one of a pixel is seen too."""
        if self._analysis is None:
            return
        holes = self._analysis.holes
        painter.setClipRect(QRectF(GUTTER, 0, self._lane_width(), self.height()))
        painter.setFont(_font(10))
        for i in range(len(holes)):
            x, end = self.x_of(float(holes.from_s[i])), self.x_of(float(holes.to_s[i]))
            painter.fillRect(QRectF(x, RULER - 4, max(end - x, 2.0), 3), QColor(theme.PROBLEM))
            left, right = max(x, float(GUTTER)), min(end, self.width() - 12.0)
            words = f"no frames for {seconds_text(float(holes.to_s[i] - holes.from_s[i]))}"
            if right - left > painter.fontMetrics().horizontalAdvance(words) + 12:
                painter.setPen(QColor(theme.PROBLEM))
                room = QRectF(left, RULER, right - left, max(self.height() - RULER - 6, 1))
                painter.drawText(room, Qt.AlignmentFlag.AlignCenter, words)
        painter.setClipping(False)

    def _paint_range(self, painter: QPainter) -> None:
        player = self._player
        x_in, x_out = (self.x_of(float(player.times_s[f])) for f in (player.in_frame, player.out_frame))
        painter.setClipRect(QRectF(GUTTER - _HANDLE, 0, self._lane_width() + 2 * _HANDLE, self.height()))
        if player.ranged:
            shade = QColor(theme.GROUND)
            shade.setAlpha(170)
            painter.fillRect(QRectF(GUTTER, RULER, max(x_in - GUTTER, 0), self.height()), shade)
            painter.fillRect(QRectF(x_out, RULER, max(self.width() - x_out, 0), self.height()), shade)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(QColor(theme.REVIEW))
        for x, way in ((x_in, 1), (x_out, -1)):
            top = RULER - 9
            painter.drawPolygon(QPolygonF([QPointF(x, top), QPointF(x, RULER), QPointF(x - way * _HANDLE, top)]))
        painter.setRenderHint(QPainter.RenderHint.Antialiasing, False)
        painter.setClipping(False)

    def _paint_marks(self, painter: QPainter) -> None:
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        for mark in self._marks:
            x = self.x_of(mark.time_s)
            if GUTTER <= x <= self.width():
                faint = QColor(theme.MARK)
                faint.setAlpha(130)
                painter.setPen(QPen(faint, 1))
                painter.drawLine(QPointF(x, RULER - 8), QPointF(x, self.height() - 4))
                painter.setPen(Qt.PenStyle.NoPen)
                painter.setBrush(QColor(theme.MARK))
                painter.drawPolygon(
                    QPolygonF([QPointF(x, RULER - 16), QPointF(x + 8, RULER - 12.5), QPointF(x, RULER - 9)])
                )
        painter.setRenderHint(QPainter.RenderHint.Antialiasing, False)

    def _paint_playhead(self, painter: QPainter) -> None:
        x = self._painted_x = self.x_of(self._player.time_s)
        if GUTTER - 1 <= x <= self.width():
            painter.setPen(QPen(QColor(theme.TEXT), 1))
            painter.drawLine(QPointF(x, 0), QPointF(x, self.height()))
            painter.setBrush(QColor(theme.TEXT))
            painter.drawRect(QRectF(x - 3, 0, 6, 5))

    # mouse

    def mousePressEvent(self, event: QMouseEvent) -> None:  # noqa: N802 (Qt's name)
        """Begin to scrub, to drag in or out, or to move the view."""
        if not self._player.n_frames:
            return
        x, y = event.position().x(), event.position().y()
        if event.button() == Qt.MouseButton.MiddleButton:
            self._pan_from = (x, self._from_s, self._to_s)
        elif event.button() == Qt.MouseButton.LeftButton:
            self._dragging = self._handle_at(x, y) or "playhead"
            self._range_before = self._player.in_frame, self._player.out_frame
            if self._dragging == "playhead":
                mark = self._mark_at(x, y)
                if mark is not None:
                    self.mark_clicked.emit(mark)
                    x = self.x_of(self._marks[mark].time_s)
                self._player.pause()
                self._player.seek_time(self.time_at(x))

    def mouseMoveEvent(self, event: QMouseEvent) -> None:  # noqa: N802 (Qt's name)
        """Scrub, drag or move."""
        x, y = event.position().x(), event.position().y()
        player = self._player
        if self._pan_from is not None:
            x0, from_s, to_s = self._pan_from
            shift_s = (x0 - x) / self._lane_width() * (to_s - from_s)
            self.set_view(from_s + shift_s, to_s + shift_s)
        elif self._dragging == "playhead":
            player.seek_time(self.time_at(x))
        elif self._dragging == "in":
            player.set_range(min(player.frame_at(self.time_at(x)), player.out_frame), player.out_frame)
        elif self._dragging == "out":
            player.set_range(player.in_frame, max(player.frame_at(self.time_at(x)), player.in_frame))
        else:
            shape = Qt.CursorShape.SplitHCursor if self._handle_at(x, y) else Qt.CursorShape.ArrowCursor
            self.setCursor(shape)

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:  # noqa: N802 (Qt's name)
        """End of a drag."""
        dragged, self._dragging, self._pan_from = self._dragging, "", None
        if dragged in ("in", "out"):
            self.range_dragged.emit(dragged, *self._range_before)

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:  # noqa: N802 (Qt's name)
        """The whole take."""
        self.view_all()

    def wheelEvent(self, event: QWheelEvent) -> None:  # noqa: N802 (Qt's name)
        """Zoom about the pointer; with Shift move along."""
        angle = event.angleDelta().y() or event.angleDelta().x()
        if event.position().x() < GUTTER and self._scroll.isVisible():
            self._scroll.setValue(self._scroll.value() - angle // 4)
        elif event.modifiers() & Qt.KeyboardModifier.ShiftModifier:
            shift_s = -angle / 1200 * (self._to_s - self._from_s)
            self.set_view(self._from_s + shift_s, self._to_s + shift_s)
        else:
            self.zoom(0.9985**angle, self.time_at(max(event.position().x(), GUTTER)))
        event.accept()

    def resizeEvent(self, event: QEvent) -> None:  # noqa: N802 (Qt's name)
        """The lanes have another number of pixels."""
        self._arrange()

    def event(self, event: QEvent) -> bool:
        """What is under the pointer, as a tooltip."""
        if event.type() == QEvent.Type.ToolTip and isinstance(event, QHelpEvent):
            text = self.text_at(event.pos().x(), event.pos().y())
            if text:
                QToolTip.showText(event.globalPos(), text, self)
            else:
                QToolTip.hideText()
            return True
        return super().event(event)

    def text_at(self, x: float, y: float) -> str:
        """What is at a place of the widget, in words."""
        if not self._player.n_frames:
            return ""
        handle, mark = self._handle_at(x, y), self._mark_at(x, y)
        if handle:
            frame = self._player.in_frame if handle == "in" else self._player.out_frame
            return f"{handle.capitalize()} point: frame {frame}, {clock(float(self._player.times_s[frame]), 3)}"
        if mark is not None:
            return f"{self._marks[mark].text or 'Mark'}, {clock(self._marks[mark].time_s, 3)}"
        lane = self._lanes.at(y - RULER + self._scroll.value()) if y >= RULER else None
        if lane is not None and x < GUTTER:
            return self._lanes.title(lane)
        holes = self._analysis.holes if self._analysis is not None else NO_HOLES
        hole = holes.at(self.time_at(x)) if x >= GUTTER else None
        if hole is not None:
            return hole_words(holes, hole)
        return self._lanes.describe(lane, self._player.frame_at(self.time_at(x))) if lane is not None else ""

    def _handle_at(self, x: float, y: float) -> str:
        if not self._player.n_frames or not RULER - 12 <= y <= RULER + 2:
            return ""
        times_s = self._player.times_s
        if -_HANDLE - 2 <= x - self.x_of(float(times_s[self._player.in_frame])) <= 2:
            return "in"
        return "out" if -2 <= x - self.x_of(float(times_s[self._player.out_frame])) <= _HANDLE + 2 else ""

    def _mark_at(self, x: float, y: float) -> int | None:
        if y > RULER - 6:
            return None
        near = [i for i, mark in enumerate(self._marks) if -2 <= x - self.x_of(mark.time_s) <= 9]
        return near[0] if near else None


def shown_name(lane: Lane, font: QFont) -> str:
    """The name of a lane in the room that its figure leaves; the tooltip says it whole."""
    metrics = QFontMetrics(font)
    room = GUTTER - 10 - (10 if lane.marker < 0 else 20) - metrics.horizontalAdvance(lane.figure) - 6
    return metrics.elidedText(lane.name, Qt.TextElideMode.ElideMiddle, room)


def _font(pixels: int) -> QFont:
    font = QFont()
    font.setPixelSize(pixels)
    return font
