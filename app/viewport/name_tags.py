"""Names beside markers and props, and the words for what is under the pointer."""

from __future__ import annotations

from collections.abc import Hashable, Sequence

import numpy as np
from PySide6.QtCore import QPointF, QRect, QRectF, Qt
from PySide6.QtGui import QColor, QFont, QFontMetricsF, QPainter, QPaintEvent, QPen, QPixmap
from PySide6.QtWidgets import QWidget

from app import theme
from app.viewport.overlay import Overlay, font
from app.viewport.tag_places import TagPlaces
from app.viewport.tags import Tag
from core.frames import FloatArray

PLATE = QColor(14, 17, 21, 205)
_TEXT_PX = 10
_HEIGHT = 14.0
_BAR = 3.0
_MARGIN = 3.0
_LEADER_FROM_PX = 12.0
"""A name so far from its marker is tied to it by a line."""

_CACHED = 1024


class NameTags(Overlay):
    """Names on plates, none over another, each with the colour of its marker."""

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self._places = TagPlaces()
        self._plates: dict[tuple[str, str, str, float], QPixmap] = {}
        self._metrics = QFontMetricsF(font(_TEXT_PX))
        self._widths: dict[str, float] = {}
        self._tags: list[Tag] = []
        self._anchors = self._corners = self._sizes = np.empty((0, 2))
        self._painted = QRect()

    @property
    def names(self) -> tuple[str, ...]:
        """What is on the screen."""
        return tuple(tag.text for tag in self._tags) if not self.isHidden() else ()

    @property
    def boxes(self) -> dict[Hashable, QRectF]:
        """Where each name is, by its key."""
        each = zip(self._tags, self._corners.tolist(), self._sizes.tolist(), strict=True)
        return {tag.key: QRectF(*corner, *size) for tag, corner, size in each}

    def show_tags(self, tags: Sequence[Tag], points_px: FloatArray, radius_px: float) -> None:
        """All there are. points_px: (k, 2), markers on this widget that names should not cover, of this radius."""
        self._tags = list(tags)
        self._anchors = np.array([tag.anchor_px for tag in tags]).reshape(-1, 2)
        centres_px = np.array([tag.centre_px for tag in tags]).reshape(-1, 2)
        self._sizes = np.array([(self._width(tag.text), _HEIGHT) for tag in tags]).reshape(-1, 2)
        keys, room = [tag.key for tag in tags], (float(self.width()), float(self.height()))
        self._corners = self._places.place(keys, self._anchors, self._sizes, centres_px, room, points_px, radius_px)
        covered = self._covered()
        self.update(covered.united(self._painted))
        self._painted = covered

    def _width(self, text: str) -> float:
        if text not in self._widths:
            self._widths[text] = np.ceil(self._metrics.horizontalAdvance(text)) + _BAR + 2 * _MARGIN
        return self._widths[text]

    def _covered(self) -> QRect:
        """All names and lines."""
        if not self._tags:
            return QRect()
        low = np.minimum(self._corners, self._anchors).min(axis=0) - 2
        high = np.maximum(self._corners + self._sizes, self._anchors).max(axis=0) + 2
        return QRectF(QPointF(*low.tolist()), QPointF(*high.tolist())).toAlignedRect()

    def _plate(self, tag: Tag, width: float) -> QPixmap:
        """Text takes long to draw: each name is drawn once."""
        ratio = self.devicePixelRatioF()
        key = (tag.text, tag.bar, tag.ink, ratio)
        plate = self._plates.get(key)
        if plate is None:
            if len(self._plates) >= _CACHED:
                self._plates.clear()
            plate = self._plates[key] = _paint_plate(tag, width, ratio)
        return plate

    def paintEvent(self, event: QPaintEvent) -> None:  # noqa: N802 (Qt's name)
        """Lines first, then the plates."""
        painter = self._painter()
        near = np.clip(self._anchors, self._corners, self._corners + self._sizes)
        away = np.linalg.norm(near - self._anchors, axis=1) > _LEADER_FROM_PX
        for i in np.flatnonzero(away):
            color = QColor(self._tags[i].bar)
            color.setAlpha(170)
            painter.setPen(QPen(color, 1))
            painter.drawLine(QPointF(*self._anchors[i].tolist()), QPointF(*near[i].tolist()))
        for tag, corner, size in zip(self._tags, self._corners.tolist(), self._sizes[:, 0].tolist(), strict=True):
            painter.drawPixmap(QPointF(round(corner[0]), round(corner[1])), self._plate(tag, size))


def _paint_plate(tag: Tag, width: float, ratio: float) -> QPixmap:
    plate = QPixmap(round(width * ratio), round(_HEIGHT * ratio))
    plate.setDevicePixelRatio(ratio)
    plate.fill(Qt.GlobalColor.transparent)
    painter = QPainter(plate)
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(PLATE)
    painter.drawRoundedRect(QRectF(0, 0, width, _HEIGHT), 2.5, 2.5)
    painter.setBrush(QColor(tag.bar))
    painter.drawRoundedRect(QRectF(0, 0, _BAR, _HEIGHT), 1.5, 1.5)
    painter.setFont(font(_TEXT_PX))
    painter.setPen(QColor(tag.ink))
    text = QRectF(_BAR + _MARGIN, 0, width, _HEIGHT)
    painter.drawText(text, Qt.AlignmentFlag.AlignVCenter | Qt.AlignmentFlag.AlignLeft, tag.text)
    painter.end()
    return plate


class HoverTag(Overlay):
    """What is under the pointer, in words, at once and as it changes."""

    _PADDING = 6
    _GAP = 14

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self._text = ""
        self.hide()

    @property
    def text(self) -> str:
        """What it says, empty if nothing is under the pointer."""
        return self._text if not self.isHidden() else ""

    def show_words(self, text: str, x: float, y: float) -> None:
        """text: empty for nothing. x, y: the marker, in the parent's pixels."""
        self.setVisible(bool(text))
        if not text:
            return
        if text != self._text:
            self._text = text
            self.update()
        box = QFontMetricsF(self._font()).boundingRect(QRectF(0, 0, 400, 200), 0, text)
        self.resize(round(box.width()) + 2 * self._PADDING, round(box.height()) + 2 * self._PADDING)
        room = self.parentWidget().rect()
        left, above = x + self._GAP, y - self._GAP - self.height()
        if left + self.width() > room.width():
            left = x - self._GAP - self.width()
        if above < 0:
            above = y + self._GAP
        self.move(round(left), round(above))
        self.raise_()

    @staticmethod
    def _font() -> QFont:
        return font(theme.BASE_PX)

    def paintEvent(self, event: QPaintEvent) -> None:  # noqa: N802 (Qt's name)
        """Words on a plate."""
        painter = self._painter()
        painter.setPen(QPen(QColor(theme.STRONG_LINE), 1))
        painter.setBrush(QColor(theme.RAISED))
        painter.drawRoundedRect(QRectF(self.rect()).adjusted(0.5, 0.5, -0.5, -0.5), 4, 4)
        painter.setFont(self._font())
        painter.setPen(QColor(theme.TEXT))
        painter.drawText(QRectF(self.rect()), Qt.AlignmentFlag.AlignCenter, self._text)
