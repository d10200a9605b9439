"""Training and the network in use, for the window."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from PySide6.QtWidgets import QWidget

from app.settings import Settings
from app.training.dialog import TrainingDialog
from app.undo import UndoStack
from app.worker import SessionWorker


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

    def use(self, path: Path | None) -> None:
        """Let the profile in use have its points named by this network, None: the one of Phalanx; as one step that can
        be undone, once it is loaded. What is no network is told."""
        network = None if path is None else str(path.absolute())

        def change() -> None:
            before = self._worker.session.profile
            after = replace(before, network=network)
            self._undo.change(
                f"name points by {path.name}" if path is not None else "name points by the network of Phalanx",
                lambda: self._worker.set_profile(after),
                lambda: self._worker.set_profile(before),
            )

        self._worker.with_networks([replace(self._worker.session.profile, network=network)], change, fresh=True)

    def stop(self) -> None:
        """The application ends."""
        if self.dialog is not None:
            self.dialog.end()

    def _tell(self, what: str, action: str, good: bool) -> None:
        notes = self._worker.notifications
        (notes.info if good else notes.problem)(what, action, "Training")
