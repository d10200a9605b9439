"""How large the hands of one performer in use are, as a list to choose from."""

from __future__ import annotations

from dataclasses import replace

from PySide6.QtCore import Qt, QTimer
from PySide6.QtWidgets import QComboBox

from app.editing import leave_wheel_to_panel, list_open
from app.hand_size import CALIBRATED, FROM_MOTION, SIZE_NAMES, hand_size, hand_words, size_title, size_words, sized
from app.texts import give_way
from app.undo import UndoStack
from app.worker import SessionWorker
from core.profile import Profile


class HandSizeChooser(QComboBox):
    """Follows the profile in use and changes it; locked while recording."""

    def __init__(self, worker: SessionWorker, undo: UndoStack, performer: int = 0) -> None:
        super().__init__()
        self._worker, self._undo, self._performer = worker, undo, performer
        leave_wheel_to_panel(give_way(self))
        self._calibrated: Profile | None = None  # the last profile in use that had a hand of its own
        self.activated.connect(lambda index: self.choose(self.itemData(index)))
        worker.profile_changed.connect(self._show_profile)
        worker.recording_changed.connect(self.setDisabled)
        self._show_profile()

    def choose(self, name: str) -> None:
        """Give the hands a size, as one step that can be undone. name: of SIZE_NAMES, or CALIBRATED."""
        before = self._worker.session.profiles[self._performer]
        if name == hand_size(before):
            return
        if name == CALIBRATED and self._calibrated is not None:
            own = self._calibrated
            after = replace(before, shape=own.shape, scale=own.scale, neutral=own.neutral, calibrated=own.calibrated)
        else:
            after = sized(before, name)
        self._undo.change(
            f"hand size: {name}",
            lambda: self._worker.set_profile(after, self._performer),
            lambda: self._worker.set_profile(before, self._performer),
        )
        self._show_profile()

    def hidePopup(self) -> None:  # noqa: D102, N802
        super().hidePopup()
        QTimer.singleShot(0, self, self._show_profile)  # the choice made in it comes first

    def _show_profile(self, _: object = None) -> None:
        cast = self._worker.session.profiles
        if self._performer >= len(cast) or list_open(self):  # gone, as this will be; or somebody is choosing
            return
        profile = cast[self._performer]
        present = hand_size(profile)
        if present == CALIBRATED:
            self._calibrated = profile
        own = self._calibrated is not None and self._calibrated.layout is profile.layout
        self.blockSignals(True)
        self.clear()
        for name in (*SIZE_NAMES, CALIBRATED) if own else SIZE_NAMES:
            self.addItem(size_title(name), name)
            self.setItemData(self.count() - 1, size_words(name), Qt.ItemDataRole.ToolTipRole)
        self.setCurrentIndex(self.findData(present))
        starts = "starts from" if present == FROM_MOTION else "is"
        trial = "Its neutral trial is of this hand: at another size angles are as tracked.\n" if profile.neutral else ""
        self.setToolTip(
            f"How large the hands are. In use: {present}. The hand {starts} {hand_words(profile)}.\n"
            f"{trial}A size or a calibrated hand is kept as it is. Locked while recording."
        )
        self.blockSignals(False)
