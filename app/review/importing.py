"""Recordings of other programs become takes: chosen, solved beside the window, opened."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from PySide6.QtCore import QObject, Qt
from PySide6.QtWidgets import QWidget

from app.notifications import NotificationCentre
from app.review import document as work
from app.review.import_dialog import ImportDialog
from app.review.job import Report
from app.review.solving import Run
from app.settings import WHOLE_TAKE_LABELS, Settings
from app.take_plan import TakePlan
from core.cast import Cast
from core.errors import CancelledError, PhalanxError
from core.profile import Profile

IMPORTING = "Importing"
SOURCE = "Import"


class Importing(QObject):
    """Each recording is a take as soon as it is solved; one that cannot be read does not stop the others."""

    def __init__(
        self,
        room: QWidget,
        plan: TakePlan,
        settings: Settings,
        notifications: NotificationCentre,
        profiles: Callable[[], Sequence[Profile]],
        run: Run,
        made: Callable[[Path], object],
    ) -> None:
        """made: called with the last take that was made, when all are."""
        super().__init__(room)
        self._room, self._plan, self._settings, self._notifications = room, plan, settings, notifications
        self._profiles, self._run, self._made = profiles, run, made
        self.dialog: ImportDialog | None = None

    def ask(self, paths: Sequence[Path] = ()) -> None:
        """Ask for recordings and performers, and import."""
        if self.dialog is not None:
            self.dialog.set_files(paths or self.dialog.paths)
            return
        whole = self._settings.get(WHOLE_TAKE_LABELS, True)
        dialog = ImportDialog(paths, self._profiles(), self._plan.folder, self._room, whole)
        if not paths and not dialog.choose_files():
            dialog.deleteLater()
            return
        dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        dialog.accepted.connect(self._asked)
        dialog.finished.connect(lambda _: setattr(self, "dialog", None))
        self.dialog = dialog
        dialog.open()

    def _asked(self) -> None:
        dialog = self.dialog
        if dialog is not None:
            self._settings.set(WHOLE_TAKE_LABELS, dialog.whole.isChecked())
            self.import_files(dialog.paths, dialog.profiles)

    def import_files(self, paths: Sequence[Path], cast: Cast) -> None:
        """Import these, with these performers; points named as was chosen last."""
        folder, live_labels = self._plan.folder, not self._settings.get(WHOLE_TAKE_LABELS, True)
        self._run(
            IMPORTING,
            lambda report: self._import(paths, folder, cast, live_labels, report),
            lambda made: self._made(made[-1]) if made else None,
        )

    def _import(self, paths: Sequence[Path], folder: Path, cast: Cast, live_labels: bool, report: Report) -> list[Path]:
        """In the thread of the job; messages may come from any."""
        made: list[Path] = []
        for i, path in enumerate(paths):
            part = _Part(report, i, len(paths))
            try:
                target, told = work.import_recording(path, folder, cast, live_labels, part)
            except CancelledError:
                raise
            except PhalanxError as error:
                self._notifications.error(error, SOURCE)
                continue
            made.append(target)
            self._tell(path, target, told)
        return made

    def _tell(self, path: Path, target: Path, told: dict[str, Any]) -> None:
        for text in told["warnings"]:
            self._notifications.warning(f"{path.name}: {text}", source=SOURCE)
        names = "its labels are used" if told["labels_given"] else "its points were named anew"
        self._notifications.info(
            f"{path.name} was imported as {target.name}: {told['frames']:,} frames, {names}.", source=SOURCE
        )


class _Part(Report):
    """The report of one of several recordings."""

    def __init__(self, whole: Report, index: int, count: int) -> None:
        self._whole, self._index, self._count = whole, index, count

    def __call__(self, share: float, text: str = "") -> bool:
        """As a Report."""
        if self._count > 1:
            text = f"{self._index + 1} of {self._count}: {text}"
        return self._whole((self._index + share) / self._count, text)

    @property
    def stopped(self) -> bool:
        """As a Report."""
        return self._whole.stopped
