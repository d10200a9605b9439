"""The legend of the 3D view: every shape and colour in it, and how many there are."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal

import numpy as np
from PySide6.QtCore import QPointF, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QFontMetricsF, QPainter, QPaintEvent, QPen, QPolygonF
from PySide6.QtWidgets import QWidget

from app.hand_words import side_title
from app.viewport import colours
from app.viewport.marker_states import NO_DIGIT, MarkerState, MarkerView, tracked_hands
from app.viewport.overlay import PANEL, TEXT, Overlay, font
from core.frames import TrackedFrame
from core.hand.certainty import guesses
from core.hand.skeleton import DIGITS

_Swatch = Literal["ball", "ring", "glass", "square", "diamond", "cross"]
_Row = tuple[str, str, str, _Swatch]
"""Words, count, colour, shape."""

_STATE_WORDS: dict[MarkerState, tuple[str, _Swatch]] = {
    MarkerState.LABELLED: ("Labelled", "ball"),
    MarkerState.PREDICTED: ("Predicted", "ring"),
    MarkerState.UNLABELLED: ("Unlabelled", "diamond"),
    MarkerState.GHOST: ("Ghost", "cross"),
}
_ANY_DIGIT = "#dfe4ea"


def legend_rows(
    view: MarkerView, tracked: TrackedFrame | None, by_digit: bool, performers: Sequence[str] = ()
) -> tuple[_Row, ...]:
    """Hands, digits if they have colours, states, props. performers: their names where there are several."""
    rows: list[_Row] = [
        (
            side_title(performers, hand.key) + ("" if performers else " hand"),
            hand.state.value,
            colours.HAND_STATE_CODES[hand.state],
            "ball",
        )
        for hand in (tracked.hands if tracked is not None else ())
    ]
    on_hands = view.hands >= 0
    if by_digit:
        for digit, words in ((NO_DIGIT, "Palm"), *enumerate(DIGITS)):
            of_it = on_hands & (view.digits == digit)
            seen = int((view.states[of_it] == MarkerState.LABELLED).sum())
            rows.append((words.capitalize(), f"{seen} / {int(of_it.sum())}", colours.DIGIT_CODES[digit], "ball"))
        rows.append(rows.pop(-len(DIGITS) - 1))  # the palm comes last
    stds = [hand.theta_std for hand in tracked_hands(tracked) if np.isfinite(hand.theta_std).any()]
    for state, (words, swatch) in _STATE_WORDS.items():
        of_hands = state in (MarkerState.LABELLED, MarkerState.PREDICTED)
        if by_digit and state is MarkerState.LABELLED:
            continue
        count = int(((view.states == state) & (view.props < 0)).sum())
        rows.append((words, str(count), _ANY_DIGIT if by_digit and of_hands else colours.STATE_CODES[state], swatch))
        if state is MarkerState.PREDICTED and stds:
            rows.append(("Guessed joints", str(int(guesses(np.array(stds)).sum())), colours.GUESS_CODE, "glass"))
    on_props = view.props >= 0
    if on_props.any():
        seen = int((view.states[on_props] == MarkerState.LABELLED).sum())
        rows.append(("On props", f"{seen} / {int(on_props.sum())}", colours.PROP_CODE, "square"))
    return tuple(rows)


class Legend(Overlay):
    """How many markers are in each state, and how each hand does."""

    _ROW = 18
    _WIDTH, _WIDEST = 150, 240
    _BEFORE, _BETWEEN, _BEHIND = 27, 12, 10
    """Beside the words and the count of a row."""

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self._rows: tuple[_Row, ...] = ()
        self.setAccessibleName("Legend")

    @property
    def text(self) -> str:
        """What it says, one line per row."""
        return "\n".join(f"{words} {count}".strip() for words, count, _, _ in self._rows)

    def show_view(
        self, view: MarkerView, tracked: TrackedFrame | None, by_digit: bool, performers: Sequence[str] = ()
    ) -> None:
        """The markers shown."""
        rows = legend_rows(view, tracked, by_digit, performers)
        if rows != self._rows:
            self._rows = rows
            self.resize(self.sizeHint())
            self.update()

    def sizeHint(self) -> QSize:  # noqa: N802 (Qt's name)
        """Room for every row."""
        metrics = QFontMetricsF(font(11))
        widths = [metrics.horizontalAdvance(words) + self._beside(metrics, count) for words, count, _, _ in self._rows]
        return QSize(min(max(self._WIDTH, *map(math.ceil, widths), 0), self._WIDEST), self._ROW * len(self._rows) + 12)

    @property
    def shown(self) -> tuple[str, ...]:
        """The words of each row as they are painted: those of long names are elided."""
        metrics = QFontMetricsF(font(11))
        return tuple(
            metrics.elidedText(words, Qt.TextElideMode.ElideMiddle, self.width() - self._beside(metrics, count))
            for words, count, _, _ in self._rows
        )

    def _beside(self, metrics: QFontMetricsF, count: str) -> float:
        """Width of all that is no words in a row of this count [px]."""
        return self._BEFORE + self._BETWEEN + metrics.horizontalAdvance(count) + self._BEHIND

    def paintEvent(self, event: QPaintEvent) -> None:  # noqa: N802 (Qt's name)
        """One row per state: swatch, words, count."""
        painter = self._painter()
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(PANEL)
        painter.drawRoundedRect(QRectF(self.rect()), 5, 5)
        painter.setFont(font(11))
        for i, (words, (_, count, code, swatch)) in enumerate(zip(self.shown, self._rows, strict=True)):
            row = QRectF(0, 6 + i * self._ROW, self.width(), self._ROW)
            _paint_swatch(painter, QPointF(15, row.center().y()), QColor(code), swatch)
            painter.setPen(TEXT)
            painter.drawText(row.adjusted(self._BEFORE, 0, 0, 0), Qt.AlignmentFlag.AlignVCenter, words)
            painter.drawText(
                row.adjusted(0, 0, -self._BEHIND, 0), Qt.AlignmentFlag.AlignVCenter | Qt.AlignmentFlag.AlignRight, count
            )


def _paint_swatch(painter: QPainter, at: QPointF, color: QColor, swatch: _Swatch) -> None:
    """As the scene draws it."""
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(color)
    if swatch == "ball":
        painter.drawEllipse(at, 3.6, 3.6)
    elif swatch == "square":
        painter.drawRect(QRectF(at.x() - 3, at.y() - 3, 6, 6))
    elif swatch == "diamond":
        painter.drawPolygon(QPolygonF([at + QPointF(x, y) for x, y in ((-4, 0), (0, -4), (4, 0), (0, 4))]))
    elif swatch == "cross":
        painter.setPen(QPen(color, 1.8))
        painter.drawLine(at + QPointF(-3, -3), at + QPointF(3, 3))
        painter.drawLine(at + QPointF(-3, 3), at + QPointF(3, -3))
    elif swatch == "ring":
        painter.setPen(QPen(color, 1.6))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.drawEllipse(at, 3.6, 3.6)
    else:  # the end of a finger
        painter.setPen(QPen(color, 1.0))
        painter.setBrush(QColor(color.red(), color.green(), color.blue(), 80))
        painter.drawRoundedRect(QRectF(at.x() - 5.5, at.y() - 3.5, 11, 7), 3.5, 3.5)
