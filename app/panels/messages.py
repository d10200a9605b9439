"""The messages panel: everything the application had to say, newest below, to be read and copied."""

from __future__ import annotations

from typing import Any

from PySide6.QtCore import QAbstractTableModel, QModelIndex, QPersistentModelIndex, Qt
from PySide6.QtGui import QColor, QGuiApplication, QKeySequence, QShortcut
from PySide6.QtWidgets import QAbstractItemView, QHeaderView, QMessageBox, QPushButton, QTableView

from app import theme
from app.lights import label
from app.notifications import Notification, Severity
from app.panels.panel import Panel, column, row
from app.worker import SessionWorker

COLUMNS = ("Time", "", "Message", "What to do")
WORDS = {Severity.INFO: "info", Severity.WARNING: "warning", Severity.PROBLEM: "problem"}
LIMIT = 2000


class MessageModel(QAbstractTableModel):
    """Notifications as rows. A repeat changes the count of its row."""

    def __init__(self) -> None:
        super().__init__()
        self.notes: list[Notification] = []

    def add(self, note: Notification) -> None:
        """Append, or update the row of the same number."""
        for i in range(len(self.notes) - 1, -1, -1):
            if self.notes[i].number == note.number:
                self.notes[i] = note
                self.dataChanged.emit(self.index(i, 0), self.index(i, len(COLUMNS) - 1))
                return
        if len(self.notes) >= LIMIT:
            self.beginRemoveRows(QModelIndex(), 0, 0)
            self.notes.pop(0)
            self.endRemoveRows()
        self.beginInsertRows(QModelIndex(), len(self.notes), len(self.notes))
        self.notes.append(note)
        self.endInsertRows()

    def clear(self) -> None:
        """No rows."""
        self.beginResetModel()
        self.notes = []
        self.endResetModel()

    def rowCount(self, parent: QModelIndex | QPersistentModelIndex = QModelIndex()) -> int:  # noqa: D102, N802, B008
        return 0 if parent.isValid() else len(self.notes)

    def columnCount(self, parent: QModelIndex | QPersistentModelIndex = QModelIndex()) -> int:  # noqa: D102, N802, B008
        return 0 if parent.isValid() else len(COLUMNS)

    def headerData(self, place: int, orientation: Qt.Orientation, role: int = 0) -> Any:  # noqa: D102, N802
        if orientation is Qt.Orientation.Horizontal and role == Qt.ItemDataRole.DisplayRole:
            return COLUMNS[place]
        return None

    def data(self, index: QModelIndex | QPersistentModelIndex, role: int = 0) -> Any:  # noqa: D102
        note = self.notes[index.row()]
        if role == Qt.ItemDataRole.DisplayRole:
            repeated = f"  (×{note.count})" if note.count > 1 else ""
            return (f"{note.time:%H:%M:%S}", WORDS[note.severity], note.text + repeated, note.action)[index.column()]
        if role == Qt.ItemDataRole.ForegroundRole:
            column_colours = (theme.FAINT, theme.SEVERITY_COLOURS[note.severity], theme.TEXT, theme.MUTED)
            return QColor(column_colours[index.column()])
        if role == Qt.ItemDataRole.ToolTipRole:
            return note.line + ("\n\nDouble-click for the details." if note.details else "")
        return None


class MessagesPanel(Panel):
    """A table of messages."""

    title, key = "Messages", "messages"

    def __init__(self, worker: SessionWorker) -> None:
        super().__init__()
        self._worker = worker
        self.unread = 0
        """Warnings and problems that came while nobody looked."""
        self.model = MessageModel()
        self.table = QTableView()
        self.table.setModel(self.model)
        self.table.setSelectionBehavior(QAbstractItemView.SelectionBehavior.SelectRows)
        self.table.setShowGrid(False)
        self.table.setWordWrap(True)
        self.table.verticalHeader().setVisible(False)
        self.table.verticalHeader().setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)
        header = self.table.horizontalHeader()
        header.setDefaultAlignment(Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter)
        header.setSectionResizeMode(0, QHeaderView.ResizeMode.ResizeToContents)
        header.setSectionResizeMode(1, QHeaderView.ResizeMode.ResizeToContents)
        header.setSectionResizeMode(2, QHeaderView.ResizeMode.Stretch)
        header.setSectionResizeMode(3, QHeaderView.ResizeMode.Stretch)
        self.table.doubleClicked.connect(lambda index: self.show_details(self.model.notes[index.row()]))
        copy, clear = QPushButton("Copy"), QPushButton("Clear")
        copy.setToolTip("Copy the selected messages, or all, with their details.")
        copy.clicked.connect(self.copy)
        clear.clicked.connect(self.clear)
        QShortcut(QKeySequence.StandardKey.Copy, self.table, self.copy, context=Qt.ShortcutContext.WidgetShortcut)
        self._empty = label("No messages.", "faint")
        layout = column(self, 8, 6)
        layout.addLayout(row(self._empty, None, copy, clear))
        layout.addWidget(self.table, 1)
        for note in worker.notifications.history:
            self._add(note)
        worker.notified.connect(self._add)

    def copy(self) -> None:
        """Put the selected messages, or all, on the clipboard."""
        chosen = sorted({index.row() for index in self.table.selectionModel().selectedRows()})
        notes = [self.model.notes[i] for i in chosen] or self.model.notes
        lines = [
            f"{note.time:%Y-%m-%d %H:%M:%S} {WORDS[note.severity]}: {note.line}"
            + (f" (×{note.count})" if note.count > 1 else "")
            + (f"\n{note.details}" if note.details else "")
            for note in notes
        ]
        QGuiApplication.clipboard().setText("\n".join(lines))

    def clear(self) -> None:
        """Forget the messages; the log file keeps them."""
        self._worker.notifications.clear()
        self.model.clear()
        self._show_unread(0)
        self._empty.setText("No messages.")

    def show_details(self, note: Notification) -> None:
        """The whole message, with its traceback behind a button."""
        box = QMessageBox(QMessageBox.Icon.NoIcon, "Message", note.text, QMessageBox.StandardButton.Close, self)
        box.setInformativeText(note.action)
        if note.details:
            box.setDetailedText(note.details)
        box.open()

    def set_in_sight(self, seen: bool) -> None:
        """Whoever looks has read them."""
        super().set_in_sight(seen)
        if seen:
            self._show_unread(0)

    def _show_unread(self, n: int) -> None:
        self.unread = n
        self.titled.emit(f"{self.title} ({n})" if n else self.title)

    def _add(self, note: Notification) -> None:
        follow = self.table.verticalScrollBar().value() >= self.table.verticalScrollBar().maximum() - 2
        self.model.add(note)
        self._empty.setText("")
        if note.count == 1 and note.severity is not Severity.INFO and not self.in_sight:
            self._show_unread(self.unread + 1)
        if follow:
            self.table.scrollToBottom()
