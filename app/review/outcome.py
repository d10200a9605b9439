"""How an import ended: stays over the 3D view until it is read."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from PySide6.QtCore import QEvent, QObject, Signal
from PySide6.QtWidgets import QFrame, QMessageBox, QPushButton, QWidget

from app.lights import label, set_property
from app.panels.panel import row
from app.texts import shown
from core.printable import printable

_WIDEST_PX, _MARGIN_PX = 560, 10
_LINES = 8
"""Reasons that are shown at once; the others are behind a button."""


class Outcome(QFrame):
    """Words, the reasons behind them, and the take to open; at the lower right, where it hides neither the job that
    runs nor the legend."""

    opened = Signal(Path)

    def __init__(self, over: QWidget) -> None:
        super().__init__(over)
        self.setObjectName("card")
        self.words = label("", wrap=True)
        self._reasons = ""
        self._path: Path | None = None
        self.open = QPushButton("Open")
        self.open.clicked.connect(self._open)
        self.why = QPushButton("Why…")
        self.why.clicked.connect(self._tell)
        self.close_button = QPushButton("Close")
        self.close_button.clicked.connect(self.hide)
        inside = row(self.words, self.why, self.open, self.close_button)
        inside.setStretch(0, 1)
        inside.setContentsMargins(12, 6, 8, 6)
        self.setLayout(inside)
        over.installEventFilter(self)
        self.box: QMessageBox | None = None
        self.hide()

    def say(self, words: str, reasons: str = "", path: Path | None = None) -> None:
        """reasons: a line each, what is to be looked into; "" if all is well. path: the take that can be opened."""
        self.words.setText(words)
        set_property(self.words, "level", "warning" if reasons else "")
        self._reasons, self._path = reasons, path
        self.setToolTip(shown(reasons))
        self.why.setVisible(bool(reasons))
        self.open.setVisible(path is not None)
        self.open.setToolTip(f"Open {printable(path.stem)}." if path is not None else "")
        self.show()
        self._place()
        self.raise_()

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:  # noqa: N802 (Qt's name)
        """As wide as there is room for."""
        if event.type() == QEvent.Type.Resize and not self.isHidden():
            self._place()
        return super().eventFilter(watched, event)

    def _place(self) -> None:
        over, layout = self.parentWidget(), self.layout()
        assert layout is not None
        layout.activate()
        width = min(over.width() - 2 * _MARGIN_PX, _WIDEST_PX)
        height = layout.totalHeightForWidth(width) if layout.hasHeightForWidth() else self.sizeHint().height()
        self.setGeometry(over.width() - _MARGIN_PX - width, over.height() - _MARGIN_PX - height, width, height)

    def _open(self) -> None:
        self.hide()
        if self._path is not None:
            self.opened.emit(self._path)

    def _tell(self) -> None:
        box = QMessageBox(
            QMessageBox.Icon.NoIcon, "Import", self.words.text(), QMessageBox.StandardButton.Close, self.parentWidget()
        )
        lines = self._reasons.splitlines()
        more = len(lines) - _LINES
        box.setInformativeText("\n\n".join(lines[:_LINES]) + (f"\n\nand {more} more." if more > 0 else ""))
        if more > 0:
            box.setDetailedText(self._reasons)
        self.box = box
        box.finished.connect(lambda _: self._told(box.deleteLater))
        box.open()

    def _told(self, then: Callable[[], None]) -> None:
        self.box = None
        then()
