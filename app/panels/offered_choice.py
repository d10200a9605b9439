"""A list of what can be chosen now, as the serial ports that are plugged in."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from PySide6.QtCore import Signal
from PySide6.QtGui import QShowEvent
from PySide6.QtWidgets import QComboBox


class OfferedChoice(QComboBox):
    """Asks what there is whenever it is shown or opened. What was chosen and is not there now stays chosen.

    offered: what there is now.
    """

    looked = Signal()
    """It has asked, or shows another choice."""

    def __init__(self, offered: Callable[[], Sequence[str]]) -> None:
        super().__init__()
        self._offered = offered
        self._there: tuple[str, ...] = ()
        self.currentTextChanged.connect(self.looked)

    @property
    def missing(self) -> bool:
        """Whether something is chosen that was not there when it last asked."""
        return bool(self.currentText()) and self.currentText() not in self._there

    def look(self) -> None:
        """Ask what there is."""
        self._there = tuple(self._offered())
        self._fill(self.currentText())

    def setCurrentText(self, text: str) -> None:  # noqa: D102, N802
        if self.findText(text) < 0:
            self._fill(text)
        super().setCurrentText(text)

    def showEvent(self, event: QShowEvent) -> None:  # noqa: D102, N802
        self.look()
        super().showEvent(event)

    def showPopup(self) -> None:  # noqa: D102, N802
        self.look()
        super().showPopup()

    def _fill(self, chosen: str) -> None:
        """List what is there, with what is chosen; nobody has chosen anything by that."""
        blocked = self.blockSignals(True)
        self.clear()
        self.addItems(self._there if chosen in self._there else (chosen, *self._there))
        super().setCurrentText(chosen)
        self.blockSignals(blocked)
        self.looked.emit()
