"""The props of the profile in the tracking panel: how each is followed, and what can be done with it."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import QPoint
from PySide6.QtWidgets import QFileDialog, QInputDialog, QMenu, QToolButton, QWidget

from app.lights import label
from app.panels.panel import column, row, section
from app.panels.prop_lines import PropLines
from app.props.desk import PropDesk
from app.props.shape_dialog import ShapeDialog
from core.frames import PropFrame
from core.props.prop import Prop

EMPTY = "None. In the 3D view, Shift+click or Ctrl+drag points that are no hand's, then make them a prop."
_FILES = "Props (*.json);;All files (*)"


class PropsBox(QWidget):
    """A heading with what adds a prop from a file, a line per prop with its menu, and what to do without any."""

    def __init__(self, desk: PropDesk) -> None:
        super().__init__()
        self.desk = desk
        self.open = QToolButton(text="Add…")
        self.open.setToolTip("Add a prop from a file.")
        self.open.clicked.connect(self._open)
        self.lines = PropLines()
        self.lines.menu_asked.connect(self._menu)
        self.empty = label(EMPTY, "faint", wrap=True)
        layout = column(self, 0, 4)
        layout.addLayout(row(section("Props"), None, self.open))
        layout.addWidget(self.lines)
        layout.addWidget(self.empty)
        self.show_props((), None)

    def show_props(self, props: tuple[Prop, ...], seen: tuple[PropFrame, ...] | None) -> None:
        """props: of the profile. seen: of the latest frame, None if there are no frames."""
        self.lines.show_props(props, seen)
        self.lines.setVisible(bool(props))
        self.empty.setVisible(not props)

    def menu(self, name: str) -> QMenu:
        """What can be done with a prop."""
        menu = QMenu(self)
        menu.addAction("Rename…", lambda: self._rename(name))
        menu.addAction("Shape…", lambda: self._shape(name))
        menu.addAction("Save as a file…", lambda: self._save(name))
        menu.addSeparator()
        menu.addAction("Remove", lambda: self.desk.remove(name))
        menu.setEnabled(not self.desk.worker.session.recording)
        return menu

    def _menu(self, name: str, place: QPoint) -> None:
        menu = self.menu(name)
        menu.exec(place)
        menu.deleteLater()

    def _rename(self, name: str) -> None:
        new, given = QInputDialog.getText(self, "Rename a prop", "Name:", text=name)
        if given:
            self.desk.rename(name, new)

    def _shape(self, name: str) -> None:
        prop = next((prop for prop in self.desk.props if prop.name == name), None)
        if prop is None:
            return
        dialog = ShapeDialog(prop, self)
        if dialog.exec() and dialog.prop is not None:
            self.desk.replace(name, dialog.prop)
        dialog.deleteLater()

    def _open(self) -> None:
        path, _ = QFileDialog.getOpenFileName(self, "Add a prop", "", _FILES)
        if path:
            self.desk.open(Path(path))

    def _save(self, name: str) -> None:
        path, _ = QFileDialog.getSaveFileName(self, "Save a prop", f"{name}.json", _FILES)
        if path:
            self.desk.save(name, Path(path))
