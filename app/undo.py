"""Undo: every change an operator makes is one step on the stack of the room it is made in."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtGui import QUndoCommand, QUndoStack

from app.notifications import NotificationCentre
from app.texts import on_button


class Change(QUndoCommand):
    """A change with its way back.

    do: makes it. undo: takes it back. If either raises, the operator is told and the step is dropped.
    key: changes of the same key that follow one another are one step (typing into a field). of: what the step goes
    with, None if it may always be taken back.
    """

    def __init__(
        self,
        text: str,
        do: Callable[[], object],
        undo: Callable[[], object],
        notifications: NotificationCentre,
        key: str = "",
        of: object = None,
        done: bool = False,
    ) -> None:
        """done: it was made before and is only put on a stack, neither made nor taken back until `settle`."""
        super().__init__(on_button(text))
        self._text, self._do, self._undo, self._notifications, self._key = text, do, undo, notifications, key
        self.of, self._done = of, done

    def redo(self) -> None:  # noqa: D102
        self._run(self._do)

    def undo(self) -> None:  # noqa: D102
        self._run(self._undo)

    def again(self) -> Change:
        """The same step, for a stack that is put together anew."""
        return Change(self._text, self._do, self._undo, self._notifications, self._key, self.of, done=True)

    def settle(self) -> None:
        """It is on its stack."""
        self._done = False

    def id(self) -> int:  # noqa: D102
        return hash(self._key) & 0x7FFFFFFF if self._key else -1

    def mergeWith(self, other: QUndoCommand) -> bool:  # noqa: D102, N802
        if not isinstance(other, Change) or other._key != self._key or self._done:
            return False
        self._do = other._do
        return True

    def _run(self, step: Callable[[], object]) -> None:
        if self._done:
            return
        try:
            step()
        except Exception as error:
            self.setObsolete(True)
            self._notifications.error(error, "Edit", self._text)


class UndoStack(QUndoStack):
    """The stack, with a shorter way to push."""

    def __init__(self, notifications: NotificationCentre) -> None:
        super().__init__()
        self._notifications = notifications
        self.setUndoLimit(200)

    def change(
        self, text: str, do: Callable[[], object], undo: Callable[[], object], key: str = "", of: object = None
    ) -> None:
        """Do something that can be undone. `text` completes the menu's "Undo …"."""
        self.push(Change(text, do, undo, self._notifications, key, of))

    def drop(self, of: object) -> None:
        """Forget the steps of something that is gone; the others stay, done or undone as they were."""
        steps = [step for step in map(self.command, range(self.count())) if isinstance(step, Change)]
        if not any(step.of is of for step in steps):
            return
        done = sum(step.of is not of for step in steps[: self.index()])
        kept = [step.again() for step in steps if step.of is not of]
        del steps
        self.clear()
        for step in kept:
            self.push(step)
        self.setIndex(done)
        for step in kept:
            step.settle()
