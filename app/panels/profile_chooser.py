"""Whose hands one performer's are, and what they wear, as a list to choose from."""

from __future__ import annotations

from dataclasses import replace

from PySide6.QtCore import Qt, QTimer
from PySide6.QtWidgets import QComboBox, QFileDialog, QWidget

from app.editing import leave_wheel_to_panel, list_open
from app.texts import give_way
from app.undo import UndoStack
from app.worker import SessionWorker
from core.markers.layout import layout_names, load_layout
from core.profile import Profile, load_profile

OPEN = "Open profile…"
_FILES = "Profiles (*.json);;All files (*)"


def profile_title(profile: Profile) -> str:
    """'Anna · han19', without a name 'han19'."""
    return f"{profile.performer} · {profile.layout.name}" if profile.performer else profile.layout.name


def ask_for_profile(parent: QWidget) -> str:
    """The file chosen in a dialog, "" if none is."""
    path, _ = QFileDialog.getOpenFileName(parent, "Open profile", "", _FILES)
    return path


class ProfileChooser(QComboBox):
    """Follows the profile in use of one performer and changes it; locked while recording."""

    def __init__(self, worker: SessionWorker, undo: UndoStack, performer: int = 0) -> None:
        super().__init__()
        self._worker, self._undo, self._performer = worker, undo, performer
        self.setToolTip("Where the markers sit, and whose hands they are. Locked while recording.")
        leave_wheel_to_panel(give_way(self))
        self.activated.connect(self._chosen)
        worker.profile_changed.connect(self._list)
        worker.recording_changed.connect(self.setDisabled)
        self._list()

    def choose(self, name_or_path: str) -> None:
        """Solve for another profile, as one step that can be undone. What cannot be read is told.

        Among several performers a name stays where the new profile brings none.
        """
        cast = self._worker.session.profiles
        before = cast[self._performer]
        try:
            after = load_profile(name_or_path)
        except Exception as error:
            self._worker.notifications.error(error, "Tracking", "Opening the profile")
            self._list()
            return
        if len(cast) > 1 and not after.performer:
            after = replace(after, performer=before.performer)
        self._worker.with_networks(
            (after,),
            lambda: self._undo.change(
                f"use {profile_title(after)}",
                lambda: self._worker.set_profile(after, self._performer),
                lambda: self._worker.set_profile(before, self._performer),
            ),
        )
        self._list()

    def _chosen(self, index: int) -> None:
        if self.itemText(index) == OPEN:
            path = ask_for_profile(self)
            if path:
                self.choose(path)
            else:
                self._list()
        elif self.itemData(index) is not None:
            self.choose(self.itemData(index))

    def hidePopup(self) -> None:  # noqa: D102, N802
        super().hidePopup()
        QTimer.singleShot(0, self, self._list)  # the choice made in it comes first

    def _list(self, _: object = None) -> None:
        cast = self._worker.session.profiles
        if self._performer >= len(cast) or list_open(self):  # gone, as this will be; or somebody is choosing
            return
        present = profile_title(cast[self._performer])
        self.blockSignals(True)
        self.clear()
        for name in layout_names():
            self.addItem(name, name)
            layout = load_layout(name)
            tip = f"{len(layout.marker_names)} markers. {layout.description}"
            self.setItemData(self.count() - 1, tip, Qt.ItemDataRole.ToolTipRole)
        if self.findText(present) < 0:
            self.insertItem(0, present)
        self.insertSeparator(self.count())
        self.addItem(OPEN)
        self.setCurrentText(present)
        self.setToolTip(f"{present}\nWhere the markers sit, and whose hands they are. Locked while recording.")
        self.blockSignals(False)
