"""Before a take is left: what would be lost with it is asked for, once."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from PySide6.QtCore import QObject, QTimer
from PySide6.QtWidgets import QAbstractButton, QApplication, QMessageBox, QPushButton, QWidget

from app.review.document import ReviewDocument, Solved
from app.review.job import Job
from app.review.job_bar import JobBar

SOLVING, SAVING = "Solving", "Saving"
"""Titles of the jobs whose work goes with the take."""


class Leaving(QObject):
    """Work on the open take that runs, and solutions of it that were not saved, hold those back who would leave it."""

    def __init__(
        self,
        room: QWidget,
        jobs: JobBar,
        document: Callable[[], ReviewDocument | None],
        save: Callable[[Solved, Callable[[bool], None]], None],
    ) -> None:
        """save: writes a solution as a take, and says at the end whether it is saved."""
        super().__init__(room)
        self._room, self._jobs, self._document, self._save = room, jobs, document, save
        self._then: Callable[[], object] | None = None
        self._what = ""
        self._given_up = self._waiting = False
        self.box: QMessageBox | None = None

    @property
    def free(self) -> bool:
        """Whether nothing would be lost now."""
        return self._given_up or (self._running() is None and not self._unsaved())

    def ask(self, what: str, then: Callable[[], object]) -> None:
        """Ask the operator, and do what is next unless he stays. what: 'first is opened', after 'before'."""
        self._what, self._then = what, then
        if self.box is None and not self._waiting:
            self._go_on()

    def stop(self) -> None:
        """The application ends, whatever the answer would be."""
        box, self.box = self.box, None
        if box is not None:
            box.blockSignals(True)
            box.close()

    def _go_on(self) -> None:
        job, unsaved = self._running(), self._unsaved()
        if job is not None and job.title == SAVING:
            self._waiting = True
            job.succeeded.connect(lambda _: self._waited(True, self._go_on))
            job.failed.connect(lambda _: self._waited(False, self._go_on))
            job.cancelled.connect(lambda: self._waited(False, self._go_on))
        elif job is not None:
            self._ask_to_stop()
        elif unsaved:
            self._ask_to_save(unsaved)
        else:
            self._leave()

    def _running(self) -> Job | None:
        job = self._jobs.job
        return job if job is not None and job.title in (SOLVING, SAVING) else None

    def _unsaved(self) -> list[Solved]:
        document = self._document()
        return document.unsaved if document is not None else []

    def _leave(self) -> None:
        then, self._then = self._then, None
        if then is not None:
            then()

    def _stay(self) -> None:
        self._then = None

    def _save_next(self) -> None:
        unsaved = self._unsaved()
        if unsaved:
            self._waiting = True
            self._save(unsaved[0], lambda saved: self._waited(saved, self._save_next))
        else:
            self._leave()

    def _waited(self, well: bool, go_on: Callable[[], None]) -> None:
        self._waiting = False
        if well:
            go_on()
        else:
            self._stay()

    # The questions.

    def _ask_to_stop(self) -> None:
        box = self._question("Solving is not done", f"{self._name()} is still being solved again.")
        box.setInformativeText(f"Stop that before {self._what}? What was solved so far is dropped.")
        stop = box.addButton("Stop solving", QMessageBox.ButtonRole.DestructiveRole)
        keep = box.addButton("Keep solving", QMessageBox.ButtonRole.RejectRole)
        box.setDefaultButton(keep)

        def answered(button: QAbstractButton | None) -> None:
            if button is not stop:
                self._stay()
                return
            job = self._running()
            if job is None:  # done while it was asked: there is a solution to save now
                self._go_on()
                return
            self._waiting = True
            for signal in (job.cancelled, job.succeeded, job.failed):
                signal.connect(lambda *_: self._waited(True, self._go_on))
            self._jobs.cancel()

        self._show(box, keep, answered)

    def _ask_to_save(self, unsaved: Sequence[Solved]) -> None:
        several = len(unsaved) > 1
        lines = [f"{solved.title} ({took(solved.took_s)} of solving)" for solved in unsaved]
        box = self._question(
            f"{len(unsaved)} solutions are not saved" if several else "A solution is not saved",
            f"{self._name()} was solved again, and the {'solutions are' if several else 'solution is'} not saved:\n"
            + "\n".join(lines),
        )
        box.setInformativeText(f"Save {'each' if several else 'it'} as a take of its own before {self._what}?")
        save = box.addButton("Save as takes" if several else "Save as a take", QMessageBox.ButtonRole.AcceptRole)
        discard = box.addButton("Discard", QMessageBox.ButtonRole.DestructiveRole)
        cancel = box.addButton("Cancel", QMessageBox.ButtonRole.RejectRole)
        box.setDefaultButton(save)

        def answered(button: QAbstractButton | None) -> None:
            if button is save:
                self._save_next()
            elif button is discard:
                self._given_up = True
                try:
                    self._leave()
                finally:
                    self._given_up = False
            else:
                self._stay()

        self._show(box, cancel, answered)

    def _name(self) -> str:
        document = self._document()
        return document.info.name if document is not None else "The take"

    def _question(self, title: str, text: str) -> QMessageBox:
        return QMessageBox(QMessageBox.Icon.Question, title, text, QMessageBox.StandardButton.NoButton, self._room)

    def _show(self, box: QMessageBox, stay: QPushButton, answered: Callable[[QAbstractButton | None], None]) -> None:
        menu = QApplication.activePopupWidget()
        if menu is not None:  # of the line that was clicked: nothing could be answered beside it
            menu.close()
        box.setEscapeButton(stay)
        self.box = box

        def finished() -> None:
            """What follows may close the window, and waits until the box is done with the click."""
            button, self.box = box.clickedButton(), None
            box.deleteLater()
            if button is None or button is stay:
                answered(button)
                return
            self._waiting = True
            QTimer.singleShot(0, self, lambda: go_on(button))

        def go_on(button: QAbstractButton | None) -> None:
            self._waiting = False
            answered(button)

        box.finished.connect(lambda _: finished())
        box.open()


def took(seconds: float) -> str:
    """A time of work in words: 'under a second', '42 s', '3 min 5 s'."""
    whole = round(seconds)
    if whole < 1:
        return "under a second"
    return f"{whole} s" if whole < 60 else f"{whole // 60} min {whole % 60} s"
