"""What lies over the 3D scene and is drawn by Qt: legend, axes, the message of an empty view."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from PySide6.QtCore import QPointF, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QFont, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QWidget

from app import theme
from app.viewport import colours
from app.viewport.camera import OrbitCamera
from app.viewport.marker_states import MarkerState, tracked_hands
from core.frames import TrackedFrame
from core.hand.certainty import guesses

TEXT = QColor(theme.TEXT)
DIM_TEXT = QColor(theme.MUTED)
PANEL = QColor(16, 19, 23, 190)

_STATE_WORDS = {
    MarkerState.LABELLED: "Labelled",
    MarkerState.PREDICTED: "Predicted",
    MarkerState.UNLABELLED: "Unlabelled",
    MarkerState.GHOST: "Ghost",
}


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


_Swatch = Literal["ball", "ring", "glass"]


def _paint_swatch(painter: QPainter, at: QPointF, color: QColor, swatch: _Swatch) -> None:
    if swatch == "ball":
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(color)
        painter.drawEllipse(at, 3.6, 3.6)
    elif swatch == "ring":
        painter.setPen(QPen(color, 1.6))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.drawEllipse(at, 3.6, 3.6)
    else:  # the end of a finger
        painter.setPen(QPen(color, 1.0))
        painter.setBrush(QColor(color.red(), color.green(), color.blue(), 80))
        painter.drawRoundedRect(QRectF(at.x() - 5.5, at.y() - 3.5, 11, 7), 3.5, 3.5)


class Legend(Overlay):
    """How many markers are in each state, and how each hand does."""

    _ROW = 18
    _WIDTH = 150

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self._rows: tuple[tuple[str, str, str, _Swatch], ...] = ()
        self.setAccessibleName("Legend")

    @property
    def text(self) -> str:
        """What it says, one line per row."""
        return "\n".join(f"{words} {count}".strip() for words, count, _, _ in self._rows)

    def show_counts(self, counts: tuple[int, ...], tracked: TrackedFrame | None, by_digit: bool) -> None:
        """counts: one per MarkerState."""
        rows = []
        for hand in tracked.hands if tracked is not None else ():
            rows.append(
                (f"{hand.side.capitalize()} hand", hand.state.value, colours.HAND_STATE_CODES[hand.state], "ball")
            )
        stds = [hand.theta_std for hand in tracked_hands(tracked) if np.isfinite(hand.theta_std).any()]
        n_guesses = int(guesses(np.array(stds)).sum()) if stds else None
        for state, count in zip(MarkerState, counts, strict=True):
            own = state in (MarkerState.LABELLED, MarkerState.PREDICTED)
            code = colours.PROP_CODE if by_digit and own else colours.STATE_CODES[state]
            rows.append((_STATE_WORDS[state], str(count), code, "ring" if state is MarkerState.PREDICTED else "ball"))
            if state is MarkerState.PREDICTED and n_guesses is not None:
                rows.append(("Guessed joints", str(n_guesses), colours.GUESS_CODE, "glass"))
        if tuple(rows) != self._rows:
            self._rows = tuple(rows)
            self.resize(self.sizeHint())
            self.update()

    def sizeHint(self) -> QSize:  # noqa: N802 (Qt's name)
        """Room for every row."""
        return QSize(self._WIDTH, self._ROW * len(self._rows) + 12)

    def paintEvent(self, event: QPaintEvent) -> None:  # noqa: N802 (Qt's name)
        """One row per state: swatch, words, count."""
        painter = self._painter()
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(PANEL)
        painter.drawRoundedRect(QRectF(self.rect()), 5, 5)
        font = QFont(self.font())
        font.setPixelSize(11)
        painter.setFont(font)
        for i, (words, count, code, swatch) in enumerate(self._rows):
            row = QRectF(0, 6 + i * self._ROW, self.width(), self._ROW)
            _paint_swatch(painter, QPointF(15, row.center().y()), QColor(code), swatch)
            painter.setPen(TEXT)
            painter.drawText(row.adjusted(27, 0, 0, 0), Qt.AlignmentFlag.AlignVCenter, words)
            painter.drawText(
                row.adjusted(0, 0, -10, 0), Qt.AlignmentFlag.AlignVCenter | Qt.AlignmentFlag.AlignRight, count
            )


class AxesGizmo(Overlay):
    """The world's directions as the camera sees them."""

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
        for axis in sorted(range(3), key=lambda i: self._rotation[2, i]):
            x, y = self._rotation[0, axis] * 24, -self._rotation[1, axis] * 24
            color = QColor(colours.AXIS_CODES[axis])
            painter.setPen(QPen(color, 2))
            painter.drawLine(QPointF(center, center), QPointF(center + x, center + y))
            reach = math.hypot(x, y)
            if reach > 4:
                tip = QPointF(center + x * (1 + 8 / reach), center + y * (1 + 8 / reach))
                painter.drawText(QRectF(tip.x() - 8, tip.y() - 8, 16, 16), Qt.AlignmentFlag.AlignCenter, "XYZ"[axis])


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
