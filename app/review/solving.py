"""Solutions of the open take: made anew, chosen and saved."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from PySide6.QtCore import QObject, Signal
from PySide6.QtWidgets import QWidget

from app.review import document as work
from app.review.document import ReviewDocument, Solved
from app.review.leaving import SAVING, SOLVING
from app.review.solve_dialog import SolveDialog
from app.settings import WHOLE_TAKE_LABELS, Settings
from app.undo import UndoStack
from app.worker import SessionWorker
from core.cast import with_profile
from core.profile import Profile

Run = Callable[..., None]
"""Runs a job of the room: title, task, what to do with its result, what to do if there is none."""


class Solving(QObject):
    """A solution that was made or chosen can be undone until its take is closed."""

    shown = Signal()
    """The take is shown with another solution."""
    saved = Signal()
    """A solution is a take of its own now."""

    def __init__(
        self,
        room: QWidget,
        worker: SessionWorker,
        settings: Settings,
        undo: UndoStack,
        document: Callable[[], ReviewDocument | None],
        run: Run,
    ) -> None:
        super().__init__(room)
        self._room, self._worker, self._settings, self._undo = room, worker, settings, undo
        self._document, self._run = document, run

    def ask(self) -> None:
        """Ask with which profile, and solve."""
        document = self._document()
        if document is None:
            return
        recorded = document.recorded.cast if document.recorded is not None else None
        whole = self._settings.get(WHOLE_TAKE_LABELS, True)
        dialog = SolveDialog(recorded, self._worker.session.profiles, self._room, whole)
        if dialog.exec():
            self._settings.set(WHOLE_TAKE_LABELS, dialog.whole.isChecked())
            self.solve_with(dialog.profiles)

    def solve_with(self, profiles: Profile | Sequence[Profile]) -> None:
        """Solve the take anew, its points named as was chosen last; the solution is shown when it is done, and the
        recorded one stays."""
        document = self._document()
        if document is not None:
            path, live_labels = document.path, not self._settings.get(WHOLE_TAKE_LABELS, True)
            self._run(
                SOLVING,
                lambda report: work.solve_again(path, profiles, report, live_labels),
                lambda solved: self._solved(document, solved),
            )

    def solve_with_first(self, profile: Profile) -> None:
        """Solve anew with another profile of the first performer, the others as shown."""
        document = self._document()
        if document is not None and document.solved is not None:
            self.solve_with(with_profile(document.solved.cast, 0, profile))

    def choose(self, solved: Solved) -> None:
        """Show and export another solution of the take."""
        document = self._document()
        if document is not None and document.solved is not solved:
            before = document.solved
            text = f"choice of a solution of {document.info.name}"
            self._undo.change(
                text, lambda: self._show(document, solved), lambda: self._show(document, before), of=document
            )

    def save_shown(self) -> None:
        """Write the solution shown as a new take beside this one."""
        document = self._document()
        if document is not None and document.solved is not None:
            self.save(document.solved)

    def save(self, solved: Solved, told: Callable[[bool], None] = lambda saved: None) -> None:
        """Write a solution as a new take beside this one. told: called at the end with whether it is saved."""
        document = self._document()
        if document is None:
            told(False)
            return
        path, marks = document.path_of(solved), document.marks
        target = work.free_name(document.path)
        info = replace(document.info, name=target.stem)

        def done(written: Path) -> None:
            document.saved(solved, written)
            self._worker.notifications.info(f"The solution was saved as {written.name}.", source="Review")
            self.saved.emit()
            told(True)

        self._run(
            SAVING, lambda report: work.save_solved(path, target, info, marks, report), done, lambda: told(False)
        )  # fmt: skip

    def _solved(self, document: ReviewDocument, solved: Solved) -> None:
        if self._document() is not document:
            return
        before, after = document.solved, document.own(solved)

        def do() -> None:
            document.solutions.append(after)
            self._show(document, after)

        def undo() -> None:
            document.solutions.remove(after)
            self._show(document, before)

        self._undo.change(f"solving {document.info.name} again", do, undo, of=document)

    def _show(self, document: ReviewDocument, solved: Solved | None) -> None:
        document.solved, document.analysis = solved, None
        self.shown.emit()
