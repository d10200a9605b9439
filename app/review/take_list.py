"""The list of takes as keys and mouse move in it: by whole lines."""

from __future__ import annotations

from PySide6.QtCore import QModelIndex, Qt
from PySide6.QtWidgets import QAbstractItemView, QHeaderView, QTableView


class TakeList(QTableView):
    """A table in which one line is selected at a time. Home and End go to the first and the last line."""

    def __init__(self) -> None:
        super().__init__()
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
