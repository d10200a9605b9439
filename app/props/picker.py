"""Picking points in a 3D view with the mouse: click, Shift+click, Ctrl+drag for a rubber band, Escape."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import QEvent, QObject, QPoint, QPointF, QRect, QRectF, Qt, QTimer, Signal
from PySide6.QtGui import QColor, QFont, QKeyEvent, QMouseEvent, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QWidget

from app import theme
from app.props.selection import PointSelection, pickable
from app.viewport.viewport import Viewport
from core.frames import FloatArray, MarkerFrame

REACH_PX = 12.0
STILL_PX = 4
"""A press that is let go within so many pixels was a click, not a turn of the camera."""

_RING_PX = 8.0


class PointPicker(QObject):
    """What is picked in one view. The view goes on turning and zooming as it does."""

    changed = Signal()
    """Other points are picked, or those picked are seen or not."""
    refused = Signal(str)
    """Why what was clicked cannot be picked."""

    def __init__(self, viewport: Viewport) -> None:
        super().__init__(viewport)
        self.viewport, self.selection = viewport, PointSelection()
        self._pressed: QPoint | None = None
        self._band: QRect | None = None
        self._seen: list[int] = []
        self._overlay = _PickOverlay(viewport)
        viewport.installEventFilter(self)
        viewport.drawn.connect(self._drawn)

    @property
    def frame(self) -> MarkerFrame | None:
        """The frame that is shown."""
        return self.viewport.shown[0]

    @property
    def rows(self) -> list[int]:
        """Rows of the picked points in the frame that is shown, -1 where one is not in it."""
        return self.selection.rows(self.frame)

    def clear(self) -> None:
        """Pick nothing."""
        self.selection.clear()
        self._tell()

    def pick_at(self, x: float, y: float, *, more: bool) -> None:
        """What a click does: the nearest point within reach alone, or one more or one less (more); beside all
        points, nothing is picked any more."""
        frame, tracked, _ = self.viewport.shown
        if frame is None:
            return
        screen = self.viewport.points_on_screen(frame.points_m)
        gaps_px = np.hypot(screen[:, 0] - x, screen[:, 1] - y)
        gaps_px[~((screen[:, 2] > 0.0) & np.isfinite(gaps_px))] = np.inf
        free = pickable(frame, tracked)
        near = free[gaps_px[free] <= REACH_PX]
        if len(near):
            row = int(near[gaps_px[near].argmin()])
            if more:
                self.selection.toggle(frame, row)
            else:
                self.selection.pick(frame, [row], more=False)
        elif len(gaps_px) and gaps_px.min() <= REACH_PX:
            self.refused.emit("That point is a marker of a hand.")
            return
        elif not more:
            self.selection.clear()
        self._tell()

    def pick_within(self, band: QRect, *, more: bool) -> None:
        """What a rubber band does: all free points in it, in place of what was picked or besides (more)."""
        frame, tracked, _ = self.viewport.shown
        if frame is None:
            return
        rows = pickable(frame, tracked)
        screen = self.viewport.points_on_screen(frame.points_m[rows])
        inside = (
            (screen[:, 2] > 0.0)
            & (np.abs(screen[:, 0] - band.center().x()) <= band.width() / 2)
            & (np.abs(screen[:, 1] - band.center().y()) <= band.height() / 2)
        )
        self.selection.pick(frame, rows[inside].tolist(), more=more)
        self._tell()

    def _tell(self) -> None:
        self._drawn()
        self.changed.emit()

    def _drawn(self) -> None:
        """The view shows another frame, or from elsewhere."""
        rows = self.rows
        frame = self.frame
        seen = [row >= 0 for row in rows]
        points_m = frame.points_m[[row for row in rows if row >= 0]] if frame is not None else np.empty((0, 3))
        self._overlay.show_picked(
            self.viewport.points_on_screen(points_m), [i + 1 for i, there in enumerate(seen) if there], self._band
        )
        if seen != self._seen:
            self._seen = seen
            QTimer.singleShot(0, self, self.changed.emit)  # not within the drawing

    # The mouse.

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:  # noqa: N802 (Qt's name)
        """Clicks are watched; a drag with Ctrl and Escape are taken."""
        kind = event.type()
        if isinstance(event, QMouseEvent):
            place = event.position().toPoint()
            if kind == QEvent.Type.MouseButtonPress and event.button() == Qt.MouseButton.LeftButton:
                self._pressed = place
                if event.modifiers() & Qt.KeyboardModifier.ControlModifier:
                    self._band = QRect(place, place)
                    return True
            elif kind == QEvent.Type.MouseMove and self._band is not None and self._pressed is not None:
                self._band = QRect(self._pressed, place).normalized()
                self._drawn()
                return True
            elif kind == QEvent.Type.MouseButtonRelease and self._pressed is not None:
                return self._released(place, event)
            return False
        escape = isinstance(event, QKeyEvent) and event.key() == Qt.Key.Key_Escape
        if kind == QEvent.Type.KeyPress and escape and len(self.selection):
            self.clear()
            return True
        return False

    def _released(self, place: QPoint, event: QMouseEvent) -> bool:
        pressed, band = self._pressed, self._band
        self._pressed = self._band = None
        assert pressed is not None
        more = bool(event.modifiers() & Qt.KeyboardModifier.ShiftModifier)
        still = (place - pressed).manhattanLength() <= STILL_PX
        if band is not None and not still:
            self.pick_within(band, more=more)
        elif still and event.button() == Qt.MouseButton.LeftButton:
            self.pick_at(place.x(), place.y(), more=more or band is not None)
        return band is not None


class _PickOverlay(QWidget):
    """A numbered ring about every picked point, and the rubber band."""

    def __init__(self, viewport: Viewport) -> None:
        super().__init__(viewport)
        self.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
        self._places: list[tuple[QPointF, str]] = []
        self._band: QRect | None = None
        self.hide()

    def show_picked(self, screen: FloatArray, numbers: list[int], band: QRect | None) -> None:
        """screen: (n, 3) as OrbitCamera.project returns it."""
        places = [
            (QPointF(x, y), str(number)) for (x, y, depth_m), number in zip(screen, numbers, strict=True) if depth_m > 0
        ]
        if (places, band) == (self._places, self._band):
            return
        self._places, self._band = places, band
        self.setVisible(bool(places) or band is not None)
        if self.size() != self.parentWidget().size():
            self.resize(self.parentWidget().size())
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:  # noqa: N802 (Qt's name)
        """Rings in the accent colour on a dark rim, to be seen on skin and on the background."""
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        font = QFont(self.font())
        font.setPixelSize(11)
        font.setBold(True)
        painter.setFont(font)
        accent, rim = QColor(theme.ACCENT), QColor(0, 0, 0, 170)
        for place, number in self._places:
            for colour, width in ((rim, 4.0), (accent, 2.0)):
                painter.setPen(QPen(colour, width))
                painter.setBrush(Qt.BrushStyle.NoBrush)
                painter.drawEllipse(place, _RING_PX, _RING_PX)
            at = place + QPointF(_RING_PX + 3, -_RING_PX + 2)
            painter.setPen(rim)
            painter.drawText(at + QPointF(1, 1), number)
            painter.setPen(accent)
            painter.drawText(at, number)
        if self._band is not None:
            painter.setPen(QPen(accent, 1.0, Qt.PenStyle.DashLine))
            painter.setBrush(QColor(accent.red(), accent.green(), accent.blue(), 36))
            painter.drawRect(QRectF(self._band))
