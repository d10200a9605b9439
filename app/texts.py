"""Texts of any length: none of them makes the window wider. What has no room is in the tooltip, whole."""

from __future__ import annotations

import re

from PySide6.QtCore import QEvent, QRect, QSize, Qt, Signal
from PySide6.QtGui import QGuiApplication, QKeyEvent, QKeySequence, QMouseEvent, QPainter, QPaintEvent, QResizeEvent
from PySide6.QtWidgets import QComboBox, QLabel, QStyle, QStyleOption

from core.printable import MOST_OF_TEXT, printable, printable_lines, shortened

MOST_ON_BUTTON = 80
LEAST_PX = 24
BREAK = "\u200b"
"""A place where a line may end, of no width."""
_LONG_WORD = re.compile(r"\S{13,}")
_PIECE = 8
"""Characters of a long word that stay together."""
_COMBO_CHARACTERS = 8


class ElidedLabel(QLabel):
    """One line that gives way: what has no room ends in an ellipsis, and the tooltip begins with the whole text."""

    clicked = Signal()

    def __init__(self, text: str = "", mode: Qt.TextElideMode = Qt.TextElideMode.ElideRight) -> None:
        super().__init__()
        self._mode, self._tip = mode, ""
        self.setTextFormat(Qt.TextFormat.PlainText)
        self.setText(text)

    @property
    def shown(self) -> str:
        """What stands there, with its ellipsis."""
        return self.fontMetrics().elidedText(self.text(), self._mode, self._room().width())

    @property
    def elided(self) -> bool:
        """Whether some of the text is missing."""
        return self.shown != self.text()

    def setText(self, text: str) -> None:  # noqa: N802 (Qt's name)
        """Say something else; a newline is a blank here."""
        line = printable(" ".join(text.splitlines()), MOST_OF_TEXT)
        if line != self.text():
            super().setText(line)
            self._tell()

    def setToolTip(self, tip: str) -> None:  # noqa: N802 (Qt's name)
        """What there is to say beside the text itself."""
        tip = shown(tip)
        if tip != self._tip:
            self._tip = tip
            self._tell()

    def minimumSizeHint(self) -> QSize:  # noqa: N802 (Qt's name)
        """Hardly any width."""
        hint = super().minimumSizeHint()
        return QSize(min(LEAST_PX, hint.width()), hint.height())

    def resizeEvent(self, event: QResizeEvent) -> None:  # noqa: N802 (Qt's name)
        """More or less of it is seen."""
        super().resizeEvent(event)
        self._tell()

    def changeEvent(self, event: QEvent) -> None:  # noqa: N802 (Qt's name)
        """Another font takes another room."""
        super().changeEvent(event)
        if event.type() in (QEvent.Type.FontChange, QEvent.Type.StyleChange):
            self._tell()

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:  # noqa: N802 (Qt's name)
        """A click, for whoever listens."""
        super().mouseReleaseEvent(event)
        if event.button() == Qt.MouseButton.LeftButton and self.rect().contains(event.position().toPoint()):
            self.clicked.emit()

    def paintEvent(self, event: QPaintEvent) -> None:  # noqa: N802 (Qt's name)
        """As the style sheet says, in the room there is."""
        painter, option = QPainter(self), QStyleOption()
        option.initFrom(self)
        self.style().drawPrimitive(QStyle.PrimitiveElement.PE_Widget, option, painter, self)
        self.style().drawItemText(
            painter, self._room(), int(self.alignment()), self.palette(), self.isEnabled(), self.shown,
            self.foregroundRole(),
        )  # fmt: skip

    def _room(self) -> QRect:
        margin = self.margin()
        return self.contentsRect().adjusted(margin, margin, -margin, -margin)

    def _tell(self) -> None:
        whole = self.text() if self.elided else ""
        super().setToolTip("\n".join(filter(None, (whole, self._tip))))


class WrappedLabel(QLabel):
    """Lines as many as needed. Long words, such as paths, are broken rather than let the window grow.

    lines: what is always kept free, so that nothing below moves when the text grows to it.
    """

    def __init__(self, text: str = "", lines: int = 0) -> None:
        super().__init__()
        self._text, self._lines = "", lines
        self.setWordWrap(True)
        if lines:
            self.setAlignment(Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignTop)
        self.setText(text)

    def text(self) -> str:
        """What was said, without the places where it may be broken."""
        return self._text

    def setText(self, text: str) -> None:  # noqa: N802 (Qt's name)
        """Say something else."""
        text = shown(text)
        if text != self._text:
            self._text = text
            super().setText(breakable(text))

    def minimumSizeHint(self) -> QSize:  # noqa: N802 (Qt's name)
        """Room for the lines kept free."""
        hint = super().minimumSizeHint()
        return QSize(hint.width(), max(hint.height(), self._kept()))

    def sizeHint(self) -> QSize:  # noqa: N802 (Qt's name)
        """Room for the lines kept free."""
        hint = super().sizeHint()
        return QSize(hint.width(), max(hint.height(), self._kept()))

    def heightForWidth(self, width: int) -> int:  # noqa: N802 (Qt's name)
        """Room for the lines kept free."""
        return max(super().heightForWidth(width), self._kept())

    def keyPressEvent(self, event: QKeyEvent) -> None:  # noqa: N802 (Qt's name)
        """What is copied can be pasted: a path has no breaks in it."""
        if event.matches(QKeySequence.StandardKey.Copy) and self.hasSelectedText():
            QGuiApplication.clipboard().setText(self.selectedText().replace(BREAK, ""))
        else:
            super().keyPressEvent(event)

    def _kept(self) -> int:
        return self._lines * self.fontMetrics().lineSpacing()


def shown(text: str) -> str:
    """A text of some lines for the screen, whatever it quotes: nothing in it acts, and it has an end."""
    return shortened(printable_lines(text))


def on_button(text: str) -> str:
    """A name on a button or in a menu, where a single & would underline the letter after it, and which is as wide as
    its longest entry."""
    return printable(text, MOST_ON_BUTTON).replace("&", "&&")


def window_title(text: str) -> str:
    """A name in the title of a window, where [*] would stand for unsaved changes."""
    return printable(text).replace("[*]", "[*][*]")


def breakable(text: str) -> str:
    """The same to the eye, with places where lines may end in long words."""
    return _LONG_WORD.sub(lambda word: BREAK.join(_pieces(word.group())), text)


def _pieces(word: str) -> list[str]:
    return [word[i : i + _PIECE] for i in range(0, len(word), _PIECE)]


def give_way(combo: QComboBox) -> QComboBox:
    """A combo whose entries, however long, do not make it wider; the tooltip of an entry is its text."""
    combo.setSizeAdjustPolicy(QComboBox.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon)
    combo.setMinimumContentsLength(_COMBO_CHARACTERS)
    combo.view().setTextElideMode(Qt.TextElideMode.ElideMiddle)
    return combo
