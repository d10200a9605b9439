"""Recordings of other programs, on their way into review: by the menu, by dropping them on the window."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QMimeData, Qt, QTimer
from PySide6.QtGui import QCursor
from PySide6.QtWidgets import QMenu

from core.takes.take import EXTENSION

if TYPE_CHECKING:
    from app.main_window import MainWindow
    from app.review.importing import Importing


class ImportDesk:
    """What a window does with recordings until review has them, and what it shows of an import that runs."""

    def __init__(self, window: MainWindow) -> None:
        self._window = window

    @property
    def importing(self) -> Importing | None:
        """What imports recordings, None if there was no review."""
        return self._window.importing

    @property
    def words(self) -> str:
        """How far the import is that runs; "" if none does."""
        return self.importing.words if self.importing is not None else ""

    def ask(self, paths: Sequence[Path] = ()) -> None:
        """Ask for recordings and whose hands are in them; they become takes and open in review."""
        window = self._window
        window.keys.leave_fields()
        if window.worker.session.recording:
            window.worker.notifications.warning(
                "A take is being recorded, and what is imported opens in review.", "Import when it has ended.", "Import"
            )
            return
        if not paths:  # the room stays as it is until there is something to import
            from app.review.import_dialog import choose_recordings

            paths = choose_recordings(window, window.settings, window.plan.folder)
        if not paths:
            return
        window.show_review(True)
        if self.importing is not None:
            self.importing.ask(paths)

    def take_up(self, data: QMimeData) -> None:
        """What was dropped: a take opens, other recordings are imported. Done once the other program has let go of its
        files, for a dialog follows."""
        paths = dropped(data)
        takes = [path for path in paths if path.suffix.lower() == EXTENSION]
        if takes:
            QTimer.singleShot(0, self._window, lambda: self._window.review_take(takes[0]))
        elif paths:
            QTimer.singleShot(0, self._window, lambda: self.ask(paths))

    def offer(self) -> None:
        """What can be done with the import that runs, also from Live and while a take is recorded."""
        window = self._window
        menu = QMenu(window)
        menu.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        menu.addAction("Show in review", lambda: window.show_review(True)).setEnabled(window.review_action.isEnabled())
        menu.addAction("Cancel the import", lambda: self.importing.cancel() if self.importing is not None else None)
        menu.popup(QCursor.pos())


def dropped(data: QMimeData) -> list[Path]:
    """The files of this machine among what is dragged."""
    return [path for path in (Path(url.toLocalFile()) for url in data.urls() if url.isLocalFile()) if path.is_file()]
