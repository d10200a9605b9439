"""The take browser: a folder of takes as a list that stays fast at thousands."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from datetime import datetime
from functools import cache
from pathlib import Path
from typing import Any

from PySide6.QtCore import (
    QAbstractTableModel,
    QFileSystemWatcher,
    QItemSelectionModel,
    QModelIndex,
    QPersistentModelIndex,
    QPoint,
    QSortFilterProxyModel,
    Qt,
    QTimer,
    QUrl,
    Signal,
)
from PySide6.QtGui import QColor, QDesktopServices, QIcon, QPixmap
from PySide6.QtWidgets import (
    QApplication,
    QFileDialog,
    QHeaderView,
    QLineEdit,
    QMenu,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from app import theme
from app.clock import clock
from app.lights import Light, label
from app.panels.panel import keep_room, row
from app.review.job import Job, Report
from app.review.take_list import TakeList
from app.review.take_row import TakeRow, read_row, take_files, unread_row
from app.take_plan import default_folder
from app.texts import on_button
from core.printable import printable
from core.takes.take import LOOKED_BACK
from devices.device import Level

COLUMNS = ("", "Name", "When", "Length", "Frames", "Hands", "Rating")
_GIVE_WAY = ("Frames", "Rating", "Hands", "Length")
"""Where names have too little room; the length says nearly what the frames say."""
_NUMBERS = (3, 4)
FOLDER_WIDTH = 180
"""Of the folder's name, so that a long one does not widen the browser [px]."""
SORT_ROLE = Qt.ItemDataRole.UserRole
ROW_ROLE = Qt.ItemDataRole.UserRole + 1
RECOVER_TIP = "Write all that is readable of this take as a sealed take beside it."
SETTLE_MS = 150
"""The line must stay chosen for so long before its take is opened: a held arrow key passes over a hundred."""
Index = QModelIndex | QPersistentModelIndex


class TakeTable(QAbstractTableModel):
    """The rows. A file that is not read yet has its name only."""

    def __init__(self) -> None:
        super().__init__()
        self.rows: list[TakeRow] = []

    def set_rows(self, rows: list[TakeRow]) -> None:
        """Other takes."""
        self.beginResetModel()
        self.rows = rows
        self.endResetModel()

    def update_row(self, row: TakeRow) -> None:
        """One file was read; it is added if it is new."""
        for i, old in enumerate(self.rows):
            if old.path == row.path:
                self.rows[i] = row
                self.dataChanged.emit(self.index(i, 0), self.index(i, len(COLUMNS) - 1))
                return
        self.beginInsertRows(QModelIndex(), len(self.rows), len(self.rows))
        self.rows.append(row)
        self.endInsertRows()

    def rowCount(self, parent: Index = QModelIndex()) -> int:  # noqa: B008, D102, N802
        return 0 if parent.isValid() else len(self.rows)

    def columnCount(self, parent: Index = QModelIndex()) -> int:  # noqa: B008, D102, N802
        return 0 if parent.isValid() else len(COLUMNS)

    def headerData(self, section: int, orientation: Qt.Orientation, role: int = 0) -> Any:  # noqa: D102, N802
        if orientation == Qt.Orientation.Horizontal and role == Qt.ItemDataRole.DisplayRole:
            return COLUMNS[section]
        if orientation == Qt.Orientation.Horizontal and role == Qt.ItemDataRole.TextAlignmentRole:
            return _alignment(section)
        return None

    def data(self, index: Index, role: int = 0) -> Any:  # noqa: D102
        take, column = self.rows[index.row()], index.column()
        if role == Qt.ItemDataRole.DisplayRole:
            return _text(take, column)
        if role == SORT_ROLE:
            return _sort_key(take, column)
        if role == ROW_ROLE:
            return take
        if role == Qt.ItemDataRole.DecorationRole and column == 0:
            return _light(take.level)
        if role == Qt.ItemDataRole.ForegroundRole:
            return QColor(theme.TEXT if column == 1 and take.readable else theme.MUTED)
        if role == Qt.ItemDataRole.ToolTipRole and column == 2:
            return take.created.astimezone().strftime("%A %d %B %Y, %H:%M:%S")
        if role == Qt.ItemDataRole.ToolTipRole:
            back = [LOOKED_BACK] if take.looked_back else []
            return "\n".join([printable(take.path), *back, *take.problems])
        if role == Qt.ItemDataRole.TextAlignmentRole:
            return _alignment(column)
        return None


def _alignment(column: int) -> int:
    side = Qt.AlignmentFlag.AlignRight if column in _NUMBERS else Qt.AlignmentFlag.AlignLeft
    return int(side | Qt.AlignmentFlag.AlignVCenter)


@cache
def _light(level: Level) -> QIcon:
    light = Light(9)
    light.set_level(level)
    picture = QPixmap(light.size())
    picture.fill(Qt.GlobalColor.transparent)
    light.render(picture, renderFlags=QWidget.RenderFlag.DrawChildren)
    shown = QIcon(picture)
    shown.addPixmap(picture, QIcon.Mode.Selected)
    return shown


def _text(take: TakeRow, column: int) -> str:
    if column == 0:
        return ""
    if column == 1:
        return take.name
    if column == 2:
        return _when(take.created.astimezone())
    if not take.readable or take.level is Level.IDLE:
        return "" if column > 3 else "–"
    return ("", "", "", clock(take.duration_s), str(take.frames), take.hands, take.rating)[column]


def _when(created: datetime) -> str:
    """Short, for the names need the room; the tooltip says it all."""
    now = datetime.now(created.tzinfo)
    if created.date() == now.date():
        return created.strftime("%H:%M")
    return created.strftime("%d %b" if created.year == now.year else "%b %Y")


def _sort_key(take: TakeRow, column: int) -> Any:
    severity = list(Level).index(take.level)
    keys = (
        severity, take.name.casefold(), take.created.timestamp(), take.duration_s, take.frames, take.hands, take.rating,
    )  # fmt: skip
    return keys[column]


class TakeBrowser(QWidget):
    """Choose a folder, filter, sort; what is selected is opened.

    chosen: the take that is selected, also while it is not in the list: filtered out, or of another folder.
    """

    moved = Signal(Path)
    """The operator selects another take: at once, while `chosen` is still the one before."""
    opened = Signal(Path)
    """The take that the operator has selected and stays at."""
    refreshed = Signal()
    """The folder was read again."""
    files_read = Signal(list)
    """These files (Path) were read, as they are new or have changed."""
    folder_changed = Signal(Path)
    recover_asked = Signal(Path)

    def __init__(self, folder: Path, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.folder = folder
        self.chosen: Path | None = None
        self._by_itself = False
        self._jobs: list[Job] = []
        self.table = TakeTable()
        self._shown = QSortFilterProxyModel()
        self._shown.setSourceModel(self.table)
        self._shown.setSortRole(SORT_ROLE)
        self._shown.setFilterKeyColumn(-1)
        self._shown.setFilterCaseSensitivity(Qt.CaseSensitivity.CaseInsensitive)

        self._folder_button = QToolButton()
        self._folder_button.clicked.connect(self.choose_folder)
        refresh = QToolButton(text="Refresh")
        refresh.setToolTip("Read the folder again.")
        refresh.clicked.connect(self.refresh)
        self.filter = QLineEdit(placeholderText="Filter by name, hands, rating", clearButtonEnabled=True)
        self.filter.textChanged.connect(self._filter)

        self.view = TakeList(COLUMNS.index("Name"), [COLUMNS.index(title) for title in _GIVE_WAY])
        self.view.setModel(self._shown)
        self.view.setSortingEnabled(True)
        self.view.sortByColumn(2, Qt.SortOrder.DescendingOrder)
        header = self.view.horizontalHeader()
        header.setHighlightSections(False)
        header.setMinimumSectionSize(20)
        for column, width in enumerate((24, 100, 64, 54, 56, 50, 56)):
            self.view.setColumnWidth(column, width)
        header.setSectionResizeMode(1, QHeaderView.ResizeMode.Stretch)
        self._settled = QTimer(self, singleShot=True, interval=SETTLE_MS)
        self._settled.timeout.connect(self._open)
        self.view.selectionModel().selectionChanged.connect(lambda: self._moved())
        self.view.activated.connect(lambda _: self._open())
        self.view.clicked.connect(lambda _: self._open())
        self.view.setContextMenuPolicy(Qt.ContextMenuPolicy.CustomContextMenu)
        self.view.customContextMenuRequested.connect(self._offer)

        self._empty = label("", "empty", wrap=True)
        self._why = label("", "small", wrap=True, lines=2)
        self._recover = QToolButton(text="Recover")
        self._recover.setToolTip(RECOVER_TIP)
        self._recover.clicked.connect(lambda: self.recover_asked.emit(self.chosen))
        layout = QVBoxLayout(self)
        layout.setContentsMargins(8, 8, 8, 8)
        layout.setSpacing(6)
        layout.addLayout(row(self._folder_button, None, refresh))
        layout.addWidget(self.filter)
        layout.addWidget(self._empty)
        layout.addWidget(self.view, 1)
        keep_room(self._recover)
        why = row(self._why, self._recover)
        why.setStretch(0, 1)
        layout.addLayout(why)

        self._watcher = QFileSystemWatcher(self)
        self._settle = QTimer(self, singleShot=True, interval=600)
        self._settle.timeout.connect(self.refresh)
        self._watcher.directoryChanged.connect(lambda: self._settle.start())
        self._explain()
        self.set_folder(folder)

    def set_folder(self, folder: Path) -> None:
        """Show the takes of another folder."""
        self.folder = folder
        name = printable(folder.name or folder)
        metrics = self._folder_button.fontMetrics()
        name = metrics.elidedText(name, Qt.TextElideMode.ElideMiddle, FOLDER_WIDTH)
        self._folder_button.setText(on_button(f"Folder: {name}…"))
        self._folder_button.setToolTip(f"{printable(folder)}\nChoose another folder of takes.")
        if self._watcher.directories():
            self._watcher.removePaths(self._watcher.directories())
        self._show_rows([])
        self.refresh()

    def _watch(self) -> None:
        """Hear of changes of the folder, once there is one."""
        if str(self.folder) not in self._watcher.directories() and self.folder.is_dir():
            self._watcher.addPath(str(self.folder))

    def choose_folder(self) -> None:
        """Ask for another folder."""
        chosen = QFileDialog.getExistingDirectory(self, "Folder of takes", str(self.folder))
        if chosen:
            self.set_folder(Path(chosen))
            self.folder_changed.emit(self.folder)

    def refresh(self) -> None:
        """Read the folder again; files that did not change are kept."""
        if any(job.running for job in self._jobs):
            self._settle.start()
            return
        self._watch()  # before it is listed, so that nothing comes between
        try:
            files = take_files(self.folder)
        except FileNotFoundError:
            self._show_rows([])
            self._say(_not_there(self.folder))
            return
        except OSError as error:
            self._show_rows([])
            self._say(
                f"The folder {printable(self.folder)} cannot be read ({error.strerror or error}). Choose another one."
            )
            return
        if not files:
            self._say(
                f"No takes in {printable(self.folder)} yet. Record one in Live (Ctrl+R), or choose another folder."
            )
        else:
            self._say("")
        known = {row.path: row for row in self.table.rows}
        new = [path for path in files if path not in known or _changed(path, known[path])]
        if new or set(known) - set(files):
            self._show_rows([known.get(path) or unread_row(path) for path in files])
        if new:
            self._read(new)
        self.refreshed.emit()

    def _read(self, paths: list[Path]) -> None:
        job = Job("Reading takes", lambda report: _read_rows(paths, report), self)
        job.given.connect(self._found)
        self._jobs = [job, *(known for known in self._jobs if known.running)]
        job.start()

    def close_jobs(self) -> None:
        """End reading, before the application ends."""
        self._settle.stop()
        self._watcher.blockSignals(True)
        for job in self._jobs:
            job.cancel()
        for job in self._jobs:
            job.join()

    def select(self, path: Path | None) -> None:
        """Make the line of a take the selected one, without opening it; none if the take is not in the list."""
        self._settled.stop()
        with self._silently():
            self.chosen = path

    def listed(self, path: Path) -> Path:
        """A file as the list spells it, if it is in the list."""
        for take in self.table.rows:
            if take.path.name == path.name and take.path != path and path.exists() and take.path.samefile(path):
                return take.path
        return path

    def reread(self, path: Path) -> None:
        """One take has changed."""
        self._read([path])

    def step(self, lines: int) -> None:
        """Select the take so many lines below, as sorted and filtered now; the first if none is selected."""
        selected = self._selected()
        index = self._shown.index(selected.row() + lines if selected.isValid() else 0, 1)
        if index.isValid():
            self.view.setCurrentIndex(index)

    def _found(self, rows: list[TakeRow]) -> None:
        with self._silently():
            for take in rows:
                if take.path.parent == self.folder:
                    self.table.update_row(take)
        self.files_read.emit([take.path for take in rows])

    def _show_rows(self, rows: list[TakeRow]) -> None:
        with self._silently():
            self.table.set_rows(rows)

    def _filter(self, text: str) -> None:
        with self._silently():
            self._shown.setFilterFixedString(text)

    # What is selected.

    @contextmanager
    def _silently(self) -> Iterator[None]:
        """The list changes by itself: the chosen take stays the selected one, no other takes its place."""
        self._by_itself = True
        try:
            yield
            model, index = self.view.selectionModel(), self._line_of(self.chosen)
            if not index.isValid():
                model.clear()
            elif not model.isSelected(index):
                flags = QItemSelectionModel.SelectionFlag
                model.setCurrentIndex(index, flags.ClearAndSelect | flags.Rows)
                self.view.scrollTo(index)
        finally:
            self._by_itself = False
        self._explain()

    def _line_of(self, path: Path | None) -> QModelIndex:
        found = next((i for i, take in enumerate(self.table.rows) if take.path == path), -1)
        return self._shown.mapFromSource(self.table.index(found, 1)) if found >= 0 else QModelIndex()

    def _selected(self) -> QModelIndex:
        rows = self.view.selectionModel().selectedRows(1)
        return rows[0] if rows else QModelIndex()

    def _moved(self) -> None:
        if self._by_itself:
            return
        self._settled.start()
        selected = self._selected()
        if selected.isValid() and selected.data(ROW_ROLE).path != self.chosen:
            path = selected.data(ROW_ROLE).path
            self.moved.emit(path)
            self.chosen = path
            self._explain()

    def _open(self) -> None:
        """Once nothing moves the line any more. A line cannot be deselected: what is open stays selected."""
        if QApplication.mouseButtons() != Qt.MouseButton.NoButton:
            self._settled.start()
            return
        self.select(self.chosen)
        if self.chosen is not None:
            self.opened.emit(self.chosen)

    def _offer(self, at: QPoint) -> None:
        """What can be done with the file of a line."""
        index = self.view.indexAt(at)
        if not index.isValid():
            return
        take: TakeRow = index.data(ROW_ROLE)
        menu = QMenu(self)
        menu.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        menu.addAction("Show in folder", lambda: QDesktopServices.openUrl(QUrl.fromLocalFile(str(take.path.parent))))
        menu.addAction("Copy path", lambda: QApplication.clipboard().setText(str(take.path)))
        if _mendable(take):
            menu.addAction("Recover", lambda: self.recover_asked.emit(take.path)).setToolTip(RECOVER_TIP)
        menu.popup(self.view.viewport().mapToGlobal(at))

    def _say(self, text: str) -> None:
        self._empty.setText(text)
        self._empty.setVisible(bool(text))
        self.view.setVisible(not text)

    def _explain(self) -> None:
        """What is wrong with the selected take, in words, and the way out. One that cannot be read is told of in the
        middle."""
        index = self._selected()
        take: TakeRow | None = index.data(ROW_ROLE) if index.isValid() else None
        self._why.setText(" ".join(take.problems) if take and take.readable else "")
        self._recover.setVisible(take is not None and _mendable(take))


def _not_there(folder: Path) -> str:
    """Before the first take; or its disk has gone."""
    if folder == default_folder() or folder.parent.is_dir():
        return f"No takes yet. Takes that you record are kept in {printable(folder)}."
    return f"The folder {printable(folder)} is not there. Connect its disk, or choose another one."


def _mendable(take: TakeRow) -> bool:
    return take.readable and (not take.sealed or take.damaged)


def _changed(path: Path, row: TakeRow) -> bool:
    try:
        stat = path.stat()
    except OSError:
        return True
    return (stat.st_size, stat.st_mtime) != (row.bytes, row.modified_s)


def _read_rows(paths: list[Path], report: Report) -> None:
    for i, path in enumerate(paths):
        if not report(i / len(paths), f"Reading {path.name}"):
            return
        report.give([read_row(path)])
