"""The light: a dot whose colour is a state, and fields that pair it with words."""

from __future__ import annotations

from PySide6.QtCore import QRectF, QSize, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent
from PySide6.QtWidgets import QGridLayout, QHBoxLayout, QLabel, QWidget

from app import theme
from app.texts import ElidedLabel, WrappedLabel
from devices.device import Level


class Light(QWidget):
    """A dot in the colour of a level. Shapes differ too, for eyes that do not tell red from green."""

    def __init__(self, diameter: int = 10, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._diameter = diameter
        self._level = Level.IDLE
        self.setFixedSize(self.sizeHint())

    def sizeHint(self) -> QSize:  # noqa: D102, N802
        return QSize(self._diameter + 4, self._diameter + 4)

    @property
    def level(self) -> Level:
        """What it shows."""
        return self._level

    def set_level(self, level: Level) -> None:
        """Show another level."""
        if level is not self._level:
            self._level = level
            self.setAccessibleName(level.value)
            self.update()

    def paintEvent(self, event: QPaintEvent) -> None:  # noqa: D102, N802
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        colour = QColor(theme.LEVEL_COLOURS[self._level])
        box = QRectF(2, 2, self._diameter, self._diameter)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(colour)
        if self._level is Level.PROBLEM:
            painter.drawRoundedRect(box, 2, 2)
        elif self._level is Level.WARNING:
            middle = box.center()
            painter.translate(middle)
            painter.rotate(45)
            half = self._diameter * 0.38
            painter.drawRoundedRect(QRectF(-half, -half, 2 * half, 2 * half), 1, 1)
        elif self._level is Level.IDLE:
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.setPen(colour)
            painter.drawEllipse(box.adjusted(1, 1, -1, -1))
        else:
            painter.drawEllipse(box)


class StatusField(QWidget):
    """Light, name and value on one line, as in the status strip."""

    def __init__(self, name: str, widest: str, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.light = Light(8)
        self.name = QLabel(name)
        self.name.setProperty("role", "muted")
        self.value = elided("–")
        self.value.setMinimumWidth(self.value.fontMetrics().horizontalAdvance(widest))
        row = QHBoxLayout(self)
        row.setContentsMargins(8, 0, 8, 0)
        row.setSpacing(5)
        for widget in (self.light, self.name, self.value):
            row.addWidget(widget)

    def show_state(self, level: Level, value: str, tip: str) -> None:
        """What it is, and in the tooltip why and what to do."""
        self.light.set_level(level)
        if self.value.text() != value:
            self.value.setText(value)
        if self.toolTip() != tip:
            self.setToolTip(tip)
            self.value.setToolTip(tip)


class ShareBar(QWidget):
    """A share as a bar with its text. Not a QProgressBar: that one repaints at once at every value, and so waits
    for the display ten times a second per bar."""

    def __init__(self) -> None:
        super().__init__()
        self.setFixedHeight(15)
        self._share, self._text = 0.0, ""

    @property
    def text(self) -> str:
        """What stands in the bar."""
        return self._text

    def show_share(self, share: float, text: str) -> None:
        """share: 0 to 1, cut beyond."""
        share = min(max(share, 0.0), 1.0)
        if (share, text) != (self._share, self._text):
            self._share, self._text = share, text
            self.update()

    def paintEvent(self, event: QPaintEvent) -> None:  # noqa: D102, N802
        painter = QPainter(self)
        painter.fillRect(self.rect(), QColor(theme.GROUND))
        filled = self.rect().adjusted(1, 1, -1, -1)
        filled.setWidth(round(filled.width() * self._share))
        painter.fillRect(filled, QColor(theme.BAR))
        painter.setPen(QColor(theme.TEXT))
        painter.drawText(self.rect(), Qt.AlignmentFlag.AlignCenter, self._text)


def label(text: str = "", role: str = "", wrap: bool = False, lines: int = 0) -> QLabel:
    """A label in one of the roles of the theme, for words that Phalanx chooses. lines: kept free where it wraps."""
    made = WrappedLabel(text, lines) if wrap else QLabel(text)
    if role:
        made.setProperty("role", role)
    return made


def elided(text: str = "", role: str = "", mode: Qt.TextElideMode = Qt.TextElideMode.ElideRight) -> ElidedLabel:
    """A label in one of the roles of the theme, for one line of any length: names, files, what devices say."""
    made = ElidedLabel(text, mode)
    if role:
        made.setProperty("role", role)
    return made


def lines_of(widget: QWidget, wide: int) -> QGridLayout:
    """A grid for the short lines of a panel; its column `wide` takes the room that is left."""
    grid = QGridLayout(widget)
    grid.setContentsMargins(2, 0, 2, 0)
    grid.setHorizontalSpacing(8)
    grid.setVerticalSpacing(4)
    grid.setColumnStretch(wide, 1)
    return grid


def set_property(widget: QWidget, name: str, value: object) -> None:
    """Change a property that the style sheet looks at."""
    if widget.property(name) != value:
        widget.setProperty(name, value)
        widget.style().unpolish(widget)
        widget.style().polish(widget)
