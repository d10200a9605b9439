"""What an operator says of takes (rating, notes, marks): every change can be undone, and is in the file soon after."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from PySide6.QtCore import QObject, QTimer, Signal

from app.notifications import NotificationCentre
from app.review.document import save_info
from app.review.job import Job
from app.undo import UndoStack
from core.errors import PhalanxError
from core.takes.take import Mark, TakeInfo

SAVE_DELAY_MS = 1500
Words = tuple[TakeInfo, tuple[Mark, ...]]


class TakeWords(QObject):
    """Changes wait a moment for the next one, then a job writes them; never while another job reads the take."""

    changed = Signal(Path)
    """A take has other words; `unsaved` has them."""
    saving = Signal(Path)
    """The file of a take is about to be replaced: whoever has it open closes it now."""
    saved = Signal(Path)
    """It may be opened again."""

    def __init__(self, undo: UndoStack, notifications: NotificationCentre, busy: Callable[[], bool]) -> None:
        """busy: whether somebody reads files of takes now."""
        super().__init__()
        self._undo, self._notifications, self._busy = undo, notifications, busy
        self._job: Job | None = None
        self._unsaved: dict[Path, Words] = {}
        self.in_progress: Path | None = None
        self._soon = QTimer(self, singleShot=True, interval=SAVE_DELAY_MS)
        self._soon.timeout.connect(self._save)

    def unsaved(self, path: Path) -> Words | None:
        """The words of a take that are not in its file yet."""
        return self._unsaved.get(path)

    def change(self, path: Path, what: str, before: Words, after: Words) -> None:
        """One step of the undo stack; `what` names it in the menu."""
        if after != before:
            name = before[0].name
            self._undo.change(f"{what} of {name}", lambda: self._put(path, after), lambda: self._put(path, before))

    def _put(self, path: Path, words: Words) -> None:
        self._unsaved[path] = words
        self.changed.emit(path)
        self._soon.start()

    def _save(self) -> None:
        if not self._unsaved or self.in_progress is not None:
            return
        if self._busy():
            self._soon.start()
            return
        path = next(iter(self._unsaved))
        info, marks = words = self._unsaved[path]
        self.in_progress = path
        self.saving.emit(path)
        job = Job("Saving", lambda report: save_info(path, info, marks, report), self)
        job.succeeded.connect(lambda _: self._ended(path, words))
        job.failed.connect(lambda error: self._failed(path, words, error))
        self._job = job
        job.start()

    def _failed(self, path: Path, words: Words, error: Exception) -> None:
        self._notifications.error(error, "Review", f"Saving the notes of {path.name}")
        self._ended(path, words)

    def _ended(self, path: Path, words: Words) -> None:
        if self._unsaved.get(path) is words:
            del self._unsaved[path]
        self.in_progress = None
        self.saved.emit(path)
        if self._unsaved:
            self._soon.start()

    def finish(self) -> None:
        """Write what is not written yet. Waits. Whoever has a take open has closed it."""
        self._soon.stop()
        if self.in_progress is not None and self._job is not None:
            self._job.join()
        for path, (info, marks) in self._unsaved.items():
            try:
                save_info(path, info, marks, lambda share, text="": True)
            except PhalanxError as error:
                self._notifications.error(error, "Review", f"Saving the notes of {path.name}")
        self._unsaved.clear()
