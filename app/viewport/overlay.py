"""What lies over the 3D scene and is drawn by Qt: axes, the message of an empty view, and what every overlay is."""

from __future__ import annotations

import math

import numpy as np
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QFont, QPainter, QPaintEvent, QPen, QRegion, QResizeEvent
from PySide6.QtWidgets import QWidget

from app import theme
from app.viewport import colours
from app.viewport.camera import OrbitCamera
from core.printable import MOST_OF_TEXT, printable

TEXT = QColor(theme.TEXT)
DIM_TEXT = QColor(theme.MUTED)
PANEL = QColor(16, 19, 23, 190)
PLATE = QColor(24, 28, 33)


def font(pixels: int) -> QFont:
    """The application's font in a size."""
    made = QFont()
    made.setPixelSize(pixels)
    return made


class Overlay(QWidget):
    """Paints over the canvas and lets the mouse through."""

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)

    def _painter(self) -> QPainter:
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        return painter


class AxesGizmo(Overlay):
    """The world's directions as the camera sees them, on a plate: what lies behind, such as the axes at the world's
    origin, does not run into them."""

    SIZE = 76

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self.resize(self.SIZE, self.SIZE)
        self._rotation = np.eye(3)

    def show_camera(self, camera: OrbitCamera) -> None:
        """Turn with the camera."""
        rotation = camera.view()[:3, :3]
        if not np.array_equal(rotation, self._rotation):
            self._rotation = rotation
            self.update()

    def paintEvent(self, event: QPaintEvent) -> None:  # noqa: N802 (Qt's name)
        """Three arms with their letters, the farthest first."""
        painter = self._painter()
        font = QFont(self.font())
        font.setPixelSize(10)
        font.setBold(True)
        painter.setFont(font)
        center = self.SIZE / 2
        painter.setPen(QPen(QColor(theme.LINE), 1))
        painter.setBrush(PLATE)
        painter.drawEllipse(QPointF(center, center), center - 1, center - 1)
        for axis in sorted(range(3), key=lambda i: self._rotation[2, i]):
            x, y = self._rotation[0, axis] * 24, -self._rotation[1, axis] * 24
            color = QColor(colours.AXIS_CODES[axis])
            painter.setPen(QPen(color, 2))
            painter.drawLine(QPointF(center, center), QPointF(center + x, center + y))
            reach = math.hypot(x, y)
            if reach > 4:
                tip = QPointF(center + x * (1 + 8 / reach), center + y * (1 + 8 / reach))
                painter.drawText(QRectF(tip.x() - 8, tip.y() - 8, 16, 16), Qt.AlignmentFlag.AlignCenter, "XYZ"[axis])


class FocusRing(Overlay):
    """Around the view while the keyboard acts on it."""

    WIDTH = 2

    def resizeEvent(self, event: QResizeEvent) -> None:  # noqa: N802 (Qt's name)
        """Nothing but the ring is drawn again with the scene."""
        inner = self.rect().adjusted(self.WIDTH, self.WIDTH, -self.WIDTH, -self.WIDTH)
        self.setMask(QRegion(self.rect()) - QRegion(inner))

    def paintEvent(self, event: QPaintEvent) -> None:  # noqa: N802 (Qt's name)
        """In the colour of every ring."""
        QPainter(self).fillRect(self.rect(), QColor(theme.FOCUS))


class Message(Overlay):
    """What to do when there is nothing to see."""

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self._title, self._detail = "", ""

    @property
    def text(self) -> str:
        """What it says."""
        return f"{self._title}\n{self._detail}".strip()

    def say(self, title: str, detail: str) -> None:
        """Change what it says."""
        title, detail = printable(title), printable(detail, MOST_OF_TEXT)
        if (title, detail) != (self._title, self._detail):
            self._title, self._detail = title, detail
            self.update()

    def paintEvent(self, event: QPaintEvent) -> None:  # noqa: N802 (Qt's name)
        """Title and detail in the middle."""
        painter = self._painter()
        font = QFont(self.font())
        font.setPixelSize(16)
        painter.setFont(font)
        painter.setPen(TEXT)
        middle = self.height() / 2
        width = min(self.width() - 40, 460)
        left = (self.width() - width) / 2
        flags = Qt.AlignmentFlag.AlignHCenter | Qt.TextFlag.TextWordWrap
        painter.drawText(QRectF(left, middle - 34, width, 26), flags, self._title)
        font.setPixelSize(12)
        painter.setFont(font)
        painter.setPen(DIM_TEXT)
        painter.drawText(QRectF(left, middle, width, 80), flags, self._detail)
