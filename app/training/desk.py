"""Training and the network in use, for the window."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from PySide6.QtWidgets import QWidget

from app.notifications import NotificationCentre
from app.settings import Settings
from app.training.dialog import TrainingDialog
from app.undo import UndoStack
from app.worker import SessionWorker
from core.errors import PhalanxError
from core.labelling.network import network_at
from core.profile import Profile


def runnable(profile: Profile, notifications: NotificationCentre) -> Profile:
    """The profile, with the network of Phalanx where its own cannot be run any more; that is told."""
    try:
        network_at(profile.network)
    except PhalanxError as error:
        notifications.error(error, "Training", "Opening the network of the last time")
        return replace(profile, network=None)
    return profile


class TrainingDesk:
    """Opens the dialog, and gives the network that it made to the profile in use."""

    def __init__(
        self, worker: SessionWorker, undo: UndoStack, settings: Settings, folder: Callable[[], Path], parent: QWidget
    ) -> None:
        """folder: where takes go; networks go beside them."""
        self._worker, self._undo, self._settings, self._folder, self._parent = worker, undo, settings, folder, parent
        self.dialog: TrainingDialog | None = None

    @property
    def training(self) -> bool:
        """Whether a network is being trained."""
        return self.dialog is not None and self.dialog.training

    def open(self) -> None:
        """The dialog, as it was left."""
        if self.dialog is None:
            folder = self._folder() / "networks"
            self.dialog = TrainingDialog(lambda: self._worker.session.profile, folder, self._settings, self._parent)
            self.dialog.use_asked.connect(self.use)
            self.dialog.told.connect(self._tell)
            self._worker.profile_changed.connect(lambda _: self.dialog and self.dialog.show_used())
        self.dialog.open_again()

    def use(self, path: Path | None) -> bool:
        """Let the profile in use have its points named by this network, None: the one of Phalanx; as one step that can
        be undone. What is no network is told, and False."""
        before = self._worker.session.profile
        try:
            network_at(None if path is None else str(path))
        except PhalanxError as error:
            self._worker.notifications.error(error, "Training")
            return False
        after = replace(before, network=None if path is None else str(path.absolute()))
        self._undo.change(
            f"name points by {path.name}" if path is not None else "name points by the network of Phalanx",
            lambda: self._worker.set_profile(after),
            lambda: self._worker.set_profile(before),
        )
        return self._worker.session.profile is after

    def stop(self) -> None:
        """The application ends."""
        if self.dialog is not None:
            self.dialog.end()

    def _tell(self, what: str, action: str, good: bool) -> None:
        notes = self._worker.notifications
        (notes.info if good else notes.problem)(what, action, "Training")
