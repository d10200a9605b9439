"""A take that was imported opens by itself, unless somebody is at work on another one."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtWidgets import QApplication, QLineEdit, QPlainTextEdit

from app.worker import SessionWorker

if TYPE_CHECKING:
    from app.review.review import Review


class Arrival:
    """Knows where the operator was in review when the import began."""

    def __init__(self, room: Review, worker: SessionWorker) -> None:
        self._room, self._worker = room, worker
        self._before: object = None

    def expect(self) -> None:
        """An import begins."""
        self._before = self._place()

    def open(self, path: Path) -> bool:
        """Open the take unless another one was touched since; whether it is opened."""
        room = self._room
        room.browser.refresh()
        if self._worker.session.recording or not room.idle() or not room.leaving.free:
            return False
        if room.document is not None and self._place() != self._before:
            return False
        room.open_take(path)
        return True

    def _place(self) -> object:
        """Where an operator is in the room: another one means that something was touched."""
        room = self._room
        typing = isinstance(QApplication.focusWidget(), QLineEdit | QPlainTextEdit)
        return (room.browser.chosen, room.player.frame, room.player.playing, typing, room.undo.index())
