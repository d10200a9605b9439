"""Undo: every change an operator makes is one step on one stack."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtGui import QUndoCommand, QUndoStack

from app.notifications import NotificationCentre


class Change(QUndoCommand):
    """A change with its way back.

    do: makes it. undo: takes it back. If either raises, the operator is told and the step is dropped.
    key: changes of the same key that follow one another are one step (typing into a field).
    """

    def __init__(
        self,
        text: str,
        do: Callable[[], object],
        undo: Callable[[], object],
        notifications: NotificationCentre,
        key: str = "",
    ) -> None:
        super().__init__(text)
        self._do, self._undo, self._notifications, self._key = do, undo, notifications, key

    def redo(self) -> None:  # noqa: D102
        self._run(self._do)

    def undo(self) -> None:  # noqa: D102
        self._run(self._undo)

    def id(self) -> int:  # noqa: D102
        return hash(self._key) & 0x7FFFFFFF if self._key else -1

    def mergeWith(self, other: QUndoCommand) -> bool:  # noqa: D102, N802
        if not isinstance(other, Change) or other._key != self._key:
            return False
        self._do = other._do
        return True

    def _run(self, step: Callable[[], object]) -> None:
        try:
            step()
        except Exception as error:
            self.setObsolete(True)
            self._notifications.error(error, "Edit", self.text())


class UndoStack(QUndoStack):
    """The stack, with a shorter way to push."""

    def __init__(self, notifications: NotificationCentre) -> None:
        super().__init__()
        self._notifications = notifications
        self.setUndoLimit(200)

    def change(self, text: str, do: Callable[[], object], undo: Callable[[], object], key: str = "") -> None:
        """Do something that can be undone. `text` completes the menu's "Undo …"."""
        self.push(Change(text, do, undo, self._notifications, key))
