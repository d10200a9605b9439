"""The list of takes as keys and mouse move in it: by whole lines."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import QModelIndex, Qt
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QAbstractItemView, QHeaderView, QTableView

NAME_CHARACTERS = 16
"""Of a take's name have room always; other columns give way."""
_PADDING_PX = 14


class TakeList(QTableView):
    """A table in which one line is selected at a time. Home and End go to the first and the last line.

    name: the column that takes what room there is. give_way: those that are left out where it would have too little,
    the first of them first.
    """

    def __init__(self, name: int, give_way: Sequence[int]) -> None:
        super().__init__()
        self._name, self._give_way = name, give_way
        self._widths: dict[int, int] = {}
        self.setSelectionBehavior(QAbstractItemView.SelectionBehavior.SelectRows)
        self.setSelectionMode(QAbstractItemView.SelectionMode.SingleSelection)
        self.setTabKeyNavigation(False)  # Tab leaves the list, as it leaves every other field
        self.setShowGrid(False)
        self.setAlternatingRowColors(True)
        self.setWordWrap(False)
        self.setTextElideMode(Qt.TextElideMode.ElideMiddle)
        self.verticalHeader().hide()
        self.verticalHeader().setDefaultSectionSize(22)
        self.verticalHeader().setSectionResizeMode(QHeaderView.ResizeMode.Fixed)

    def resizeEvent(self, event: QResizeEvent) -> None:  # noqa: N802 (Qt's name)
        """Where there is little room it is for the names."""
        super().resizeEvent(event)
        room = self.viewport().width() - self._least_name_width()
        others = [column for column in range(self.model().columnCount()) if column not in (self._name, *self._give_way)]
        room -= sum(map(self.columnWidth, others))
        left_out = False
        for column in reversed(self._give_way):
            if not self.isColumnHidden(column):  # hidden ones have no width
                self._widths[column] = self.columnWidth(column)
            room -= self._widths[column]
            left_out = left_out or room < 0
            self.setColumnHidden(column, left_out)

    def _least_name_width(self) -> int:
        return NAME_CHARACTERS * self.fontMetrics().averageCharWidth() + _PADDING_PX

    def moveCursor(  # noqa: N802 (Qt's name)
        self, action: QAbstractItemView.CursorAction, modifiers: Qt.KeyboardModifier
    ) -> QModelIndex:
        """From where nothing is selected, every key goes to the first line. The focus alone goes nowhere."""
        actions, model = QAbstractItemView.CursorAction, self.model()
        if action in (actions.MoveNext, actions.MovePrevious):
            return QModelIndex()
        column = max(self.currentIndex().column(), 1)
        if action == actions.MoveHome or not self.selectionModel().hasSelection():
            return model.index(0, column)
        if action == actions.MoveEnd:
            return model.index(model.rowCount() - 1, column)
        return super().moveCursor(action, modifiers)
