"""What an operator says of takes (rating, notes, marks): every change can be undone, and is in the file soon after."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from PySide6.QtCore import QObject, QTimer, Signal

from app.notifications import NotificationCentre
from app.review.document import ReviewDocument, save_and_open, save_info
from app.review.job import Job
from app.undo import UndoStack
from core.errors import PhalanxError
from core.takes.reader import Take
from core.takes.take import Mark, TakeInfo

SAVE_DELAY_MS = 1500
Words = tuple[TakeInfo, tuple[Mark, ...]]


class TakeWords(QObject):
    """Changes wait a moment for the next one, then a job writes them; never while another job reads the take."""

    changed = Signal(Path)
    """A take has other words; `unsaved` has them."""
    saving = Signal(Path)
    """The file of a take is about to be replaced: whoever has it open closes it now."""
    saved = Signal(Path, object)
    """It may be opened again; if it was written, it comes open (Take), else None."""

    def __init__(
        self,
        undo: UndoStack,
        notifications: NotificationCentre,
        document: Callable[[], ReviewDocument | None],
        busy: Callable[[], bool],
    ) -> None:
        """document: the take that is judged now. busy: whether somebody reads files of takes now."""
        super().__init__()
        self._undo, self._notifications, self._document, self._busy = undo, notifications, document, busy
        self._job: Job | None = None
        self._unsaved: dict[Path, Words] = {}
        self.in_progress: Path | None = None
        self._soon = QTimer(self, singleShot=True, interval=SAVE_DELAY_MS)
        self._soon.timeout.connect(self._save)

    def unsaved(self, path: Path) -> Words | None:
        """The words of a take that are not in its file yet."""
        return self._unsaved.get(path)

    def rate(self, rating: str) -> None:
        """Rate the take."""
        self._change("rating", lambda info, marks: (replace(info, rating=rating), marks))

    def write_notes(self, text: str) -> None:
        """Change the notes."""
        self._change("notes", lambda info, marks: (replace(info, notes=text), marks))

    def add_mark(self, time_s: float) -> None:
        """Mark a moment [s]."""
        mark = Mark(time_s)
        self._change("mark", lambda info, marks: (info, tuple(sorted((*marks, mark), key=lambda m: m.time_s))))

    def name_mark(self, index: int, text: str) -> None:
        """Name a mark."""
        self._change(
            "mark's name",
            lambda info, marks: (info, (*marks[:index], Mark(marks[index].time_s, text), *marks[index + 1 :])),
        )

    def remove_mark(self, index: int) -> None:
        """Remove a mark, if there is one of this index."""
        self._change(
            "removal of a mark",
            lambda info, marks: (info, tuple(mark for i, mark in enumerate(marks) if i != index)),
        )

    def _change(self, what: str, edit: Callable[[TakeInfo, tuple[Mark, ...]], Words]) -> None:
        document = self._document()
        if document is None:
            return
        path, before = document.path, (document.info, document.marks)
        after = edit(*before)
        if after != before:
            text = f"{what} of {document.info.name}"
            self._undo.change(text, lambda: self._put(path, after), lambda: self._put(path, before))

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
        job = Job("Saving", lambda report: save_and_open(path, info, marks, report), self)
        job.succeeded.connect(lambda take: self._ended(path, words, take))
        job.failed.connect(lambda error: self._failed(path, words, error))
        self._job = job
        job.start()

    def _failed(self, path: Path, words: Words, error: Exception) -> None:
        self._notifications.error(error, "Review", f"Saving the notes of {path.name}")
        self._ended(path, words, None)

    def _ended(self, path: Path, words: Words, take: Take | None) -> None:
        if self._unsaved.get(path) is words:
            del self._unsaved[path]
        self.in_progress = None
        self.saved.emit(path, take)
        if self._unsaved:
            self._soon.start()

    def finish(self) -> None:
        """Write what is not written yet. Waits. Whoever has a take open has closed it."""
        self._soon.stop()
        if self.in_progress is not None and self._job is not None:
            self._job.join()
        for path, (info, marks) in self._unsaved.items():
            try:
                save_info(path, info, marks)
            except PhalanxError as error:
                self._notifications.error(error, "Review", f"Saving the notes of {path.name}")
        self._unsaved.clear()
