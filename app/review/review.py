"""The review room: choose a take, look at it, judge it, solve it again, export it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from PySide6.QtCore import Qt, QTimer
from PySide6.QtGui import QAction, QHideEvent, QKeySequence
from PySide6.QtWidgets import QFrame, QSplitter, QToolButton, QVBoxLayout, QWidget

from app import theme
from app.panels.panel import column
from app.props.desk import PropDesk
from app.props.picking import ReviewPicking
from app.review import document as work
from app.review.analysis import Analysis
from app.review.browser import TakeBrowser
from app.review.document import ReviewDocument, Solved
from app.review.export_dialog import ExportDialog
from app.review.inspector import Inspector
from app.review.job import Job, Report
from app.review.job_bar import JobBar
from app.review.moment import Moment
from app.review.player import Player
from app.review.showing import Showing
from app.review.solution_box import SolutionBox
from app.review.solve_dialog import SolveDialog
from app.review.take_plots import TakePlots
from app.review.take_words import TakeWords
from app.review.timeline import Timeline
from app.review.transport import Transport
from app.settings import WHOLE_TAKE_LABELS, Settings
from app.take_plan import TakePlan
from app.undo import UndoStack
from app.viewport.viewport import Viewport
from app.worker import SessionWorker
from core.cast import with_profile
from core.errors import PhalanxError
from core.profile import Profile
from core.takes.reader import Take

EMPTY_TITLE = "No take open"
EMPTY_DETAIL = "Choose one in the list on the left, or open a file with Ctrl+O."
WAIT_MS = 50
SOLVING = "Solving"


class Review(QWidget):
    """Binds player, document and jobs to the widgets. Everything that works does so elsewhere."""

    def __init__(
        self,
        worker: SessionWorker,
        undo: UndoStack,
        plan: TakePlan,
        settings: Settings | None = None,
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self._worker, self._undo = worker, undo
        self._settings = settings or Settings(None)
        self.player = Player()
        self.document: ReviewDocument | None = None
        self._dialog: ExportDialog | None = None
        self._reader: Job | None = None
        self.viewport = Viewport()
        self.viewport.show_empty(EMPTY_TITLE, EMPTY_DETAIL)
        self.browser = TakeBrowser(plan.folder)
        self.inspector = Inspector()
        self.solutions = SolutionBox()
        self.timeline = Timeline(self.player)
        self.plots = TakePlots(self.player)
        self.jobs, self.opening = JobBar(), JobBar()
        self.transport = Transport(self.player, self)
        self.words = TakeWords(undo, worker.notifications, lambda: self.document, self._reading)
        self.moment = Moment(self.player, self.plots, self._analysis, self.inspector.show_moment)
        self.showing = Showing(self.player, self.viewport, self._readable, worker.notifications, self)
        self.picking = ReviewPicking(self.viewport, PropDesk(worker, undo), self.player, self._readable)
        self.picking.solve_asked.connect(self._solve_with_first)
        self._make_tools()
        self._arrange()
        self.setFocusPolicy(Qt.FocusPolicy.ClickFocus)  # of a click on a button that takes none: it leaves the notes
        self._connect(plan)

    # What there is.

    def _make_tools(self) -> None:
        self.markers = QToolButton(text="Markers", checkable=True)
        self.markers.setToolTip("One lane per marker, with its gaps.")
        self.markers.toggled.connect(self.timeline.set_markers_shown)
        self.transport.add_at_end(self.markers)
        self.solutions.chosen.connect(self._use)
        self.solutions.solve.clicked.connect(self.solve_again)
        self.solutions.save.clicked.connect(self.save_solution)
        self.solutions.export.clicked.connect(self.export_take)
        for keys, do in (
            ("M", lambda: self.words.add_mark(self.player.time_s)),
            ("Ctrl+E", self.export_take),
            ("PgDown", lambda: self._neighbour(1)),
            ("PgUp", lambda: self._neighbour(-1)),
        ):
            self._key(keys, do)

    def _key(self, keys: str, do: Callable[[], object]) -> None:
        action = QAction(self)
        action.setShortcut(QKeySequence(keys))
        action.setShortcutContext(Qt.ShortcutContext.WidgetWithChildrenShortcut)
        action.triggered.connect(lambda _=False: do())
        self.addAction(action)

    def _arrange(self) -> None:
        bottom = QWidget()
        bottom.setObjectName("panelBody")
        bottom_layout = QVBoxLayout(bottom)
        bottom_layout.setContentsMargins(0, 0, 0, 0)
        bottom_layout.setSpacing(0)
        for widget in (self.transport, self.opening, self.jobs, self.timeline):
            bottom_layout.addWidget(widget)
        bottom_layout.addWidget(self.plots, 1)
        self._middle = QSplitter(Qt.Orientation.Vertical)
        self._middle.addWidget(self.viewport)
        self._middle.addWidget(bottom)
        self._middle.setSizes([540, 320])
        self._middle.setStretchFactor(0, 1)
        self._middle.setCollapsible(0, False)
        whole = QSplitter(Qt.Orientation.Horizontal)
        # What is done with the take stays in sight, however much there is to say of it.
        right = QWidget()
        right.setObjectName("panelBody")
        right_layout = column(right, 0, 0)
        right_layout.addWidget(self.inspector, 1)
        right_layout.addWidget(self.solutions)
        for widget in (self.browser, self._middle, right):
            widget.setAttribute(Qt.WidgetAttribute.WA_StyledBackground)
            whole.addWidget(widget)
        self.browser.setMinimumWidth(300)
        right.setMinimumWidth(250)
        whole.setSizes([470, 860, 270])
        whole.setStretchFactor(1, 1)
        self.browser.setObjectName("panel")
        rule = QFrame()
        rule.setFixedHeight(2)
        rule.setStyleSheet(f"background: {theme.REVIEW};")
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(0)
        layout.addWidget(rule)
        layout.addWidget(whole, 1)

    def _connect(self, plan: TakePlan) -> None:
        self.browser.opened.connect(self.open_take)
        self.browser.recover_asked.connect(self.recover)
        self.timeline.view_changed.connect(self.plots.set_view)
        self.timeline.mark_clicked.connect(self.inspector.marks.setCurrentRow)
        self.plots.view_changed.connect(self.timeline.set_view)
        self.words.changed.connect(self._words_changed)
        self.words.saving.connect(self._words_saving)
        self.words.saved.connect(self._words_saved)
        self.inspector.rating_asked.connect(self.words.rate)
        self.inspector.notes_asked.connect(self.words.write_notes)
        self.inspector.mark_asked.connect(self.words.name_mark)
        self.inspector.mark_removed.connect(self.words.remove_mark)
        self.inspector.mark_chosen.connect(self._go_to_mark)
        self._worker.take_finished.connect(lambda _: self.browser.refresh())
        plan.changed.connect(lambda: plan.folder == self.browser.folder or self.browser.set_folder(plan.folder))

    # Opening.

    def open_take(self, path: Path) -> None:
        """Show a take. What cannot be opened is told, and what was open stays."""
        if self.document is not None and self.document.path == path:
            self.opening.end()
            return
        if self.jobs.job is not None and self.jobs.job.title == SOLVING:
            self._worker.notifications.warning(f"{self.jobs.job.title} is not done yet.", "Wait for it, or cancel it.")
            return
        self.inspector.finish_typing()
        self.opening.end()
        job = Job("Opening", lambda report: ReviewDocument(path, report), self)
        job.succeeded.connect(self._opened)
        job.failed.connect(lambda error: self._worker.notifications.error(error, "Review", f"Opening {path.name}"))
        self.opening.run(job)

    def _opened(self, document: ReviewDocument) -> None:
        path = document.path
        self.inspector.finish_typing()  # of the take that was open meanwhile; what one types on is not of this one
        if self.inspector.notes.hasFocus():
            self.viewport.setFocus()
        document.info, document.marks = self.words.unsaved(path) or (document.info, document.marks)
        if self.document is not None:
            self.document.close()
        self.document = document
        self.solutions.show_take(document)
        self.showing.forget()
        self.picking.picker.clear()
        self.player.load(document.times_s)
        self.viewport.view_fit_next()
        self._show_document()
        self.timeline.view_all()
        self.browser.select(path)
        self._analyse()

    def _show_document(self) -> None:
        document = self.document
        if document is None:
            return
        self.inspector.show_take(document)
        self.timeline.show_take(document.analysis, document.marks)
        self.plots.show_take(document.times_s, document.analysis)
        self.moment.refresh()
        if not document.n_frames:
            self.viewport.show_empty("This take holds no frames", "Its recording ended before the first one.")
        self.showing.show()
        self.solutions.show_choice(document)
        self.markers.setEnabled(True)

    def _analysis(self) -> Analysis | None:
        return self.document.analysis if self.document is not None else None

    def _readable(self) -> ReviewDocument | None:
        """The open take, unless its file is being replaced."""
        document = self.document
        return None if document is None or self.words.in_progress == document.path else document

    def _neighbour(self, step: int) -> None:
        path = self.browser.neighbour(step)
        if path is not None:
            self.open_take(path)

    # Jobs.

    def _reading(self) -> bool:
        """Whether anything reads the file of a take, so that it should not be replaced now."""
        reading = self._reader is not None and self._reader.running
        asking = self._dialog is not None or self.picking.reading
        return reading or asking or any(bar.job is not None for bar in (self.jobs, self.opening))

    def _run(self, title: str, task: Callable[[Report], Any], done: Callable[[Any], None]) -> None:
        if self.jobs.job is not None:
            self._worker.notifications.warning(f"{self.jobs.job.title} is not done yet.", "Wait for it, or cancel it.")
            return
        if self.words.in_progress is not None:
            QTimer.singleShot(WAIT_MS, self, lambda: self._run(title, task, done))
            return
        job = Job(title, task, self)
        job.succeeded.connect(done)
        job.failed.connect(lambda error: self._worker.notifications.error(error, "Review", title))
        self.jobs.run(job)

    def _stop_reading(self, wait: bool = False) -> None:
        if self._reader is not None:
            self._reader.cancel()
            if wait:
                self._reader.join()
            self._reader = None

    def _analyse(self) -> None:
        self._stop_reading()
        document = self.document
        if document is None or document.solved is None or not document.n_frames:
            return
        solved = document.solved
        path = document.path_of(solved)
        job = Job("Reading the take", lambda report: work.read_analysis(path, solved, report), self)
        job.progressed.connect(lambda share, _: self.timeline.show_progress(share))
        job.succeeded.connect(lambda analysis: self._analysed(solved, analysis))
        job.failed.connect(lambda error: self._worker.notifications.error(error, "Review", job.title))
        self._reader = job
        job.start()

    def _analysed(self, solved: Solved, analysis: Any) -> None:
        document = self.document
        if document is not None and document.solved is solved and analysis is not None:
            document.analysis = analysis
            self.timeline.show_take(analysis, document.marks)
            self.plots.show_take(document.times_s, analysis)
            self.inspector.show_analysis(analysis)
            self.moment.refresh()

    def solve_again(self) -> None:
        """Ask with which profile, and solve."""
        document = self.document
        if document is None:
            return
        recorded = document.recorded.cast if document.recorded is not None else None
        whole = self._settings.get(WHOLE_TAKE_LABELS, True)
        dialog = SolveDialog(recorded, self._worker.session.profiles, self, whole)
        if dialog.exec():
            self._settings.set(WHOLE_TAKE_LABELS, dialog.whole.isChecked())
            self.solve_with(dialog.profiles)

    def solve_with(self, profiles: Profile | Sequence[Profile]) -> None:
        """Solve the take anew, its points named as was chosen last; the solution is shown when it is done, and the
        recorded one stays."""
        if self.document is not None:
            path, live_labels = self.document.path, not self._settings.get(WHOLE_TAKE_LABELS, True)
            self._run(SOLVING, lambda report: work.solve_again(path, profiles, report, live_labels), self._solved)

    def _solve_with_first(self, profile: Profile) -> None:
        """Solve anew with another profile of the first performer, the others as shown."""
        if self.document is not None and self.document.solved is not None:
            self.solve_with(with_profile(self.document.solved.cast, 0, profile))

    def _solved(self, solved: Solved) -> None:
        solved = self.solutions.add(solved)
        if self.document is not None:
            self.document.add(solved)
            self._use(solved)

    def _use(self, solved: Solved) -> None:
        if self.document is not None and self.document.solved is not solved:
            self.document.solved, self.document.analysis = solved, None
            self.showing.forget()
            self._show_document()
            self._analyse()

    def save_solution(self) -> None:
        """Write the solution shown as a new take beside this one."""
        document = self.document
        if document is None or document.solved is None:
            return
        path, marks = document.path_of(document.solved), document.marks
        target = work.free_name(document.path)
        info = replace(document.info, name=target.stem)

        def done(written: Path) -> None:
            self._worker.notifications.info(f"The solution was saved as {written.name}.", source="Review")
            self.browser.refresh()

        self._run("Saving", lambda report: work.save_solved(path, target, info, marks, report), done)

    def recover(self, path: Path) -> None:
        """Make a take whole: seal it, or write what is readable beside it."""

        def done(written: Path) -> None:
            self._worker.notifications.info(f"{written.name} is whole now.", source="Review")
            self.browser.refresh()
            self.browser.reread(written)
            self.open_take(written)

        if self.document is not None and self.document.path == path and self.jobs.job is None:
            self.document.close()
            self.document = None
            self._clear()
        self._run("Recovering", lambda report: work.rescue(path, report), done)

    def export_take(self) -> None:
        """The export dialog."""
        if self.document is None or self._dialog is not None:
            return
        self.player.pause()
        self._dialog = ExportDialog(self.document, self.player, self._settings, self)
        self._dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        self._dialog.finished.connect(self._dialog_closed)
        self._dialog.open()

    def _dialog_closed(self) -> None:
        self._dialog = None

    def _go_to_mark(self, index: int) -> None:
        if self.document is not None and 0 <= index < len(self.document.marks):
            self.player.pause()
            self.player.seek_time(self.document.marks[index].time_s)

    def _words_changed(self, path: Path) -> None:
        words = self.words.unsaved(path)
        if self.document is not None and self.document.path == path and words is not None:
            self.document.info, self.document.marks = words
            self.inspector.show_words(self.document)
            self.timeline.show_marks(self.document.marks)

    def _words_saving(self, path: Path) -> None:
        if self.document is not None and self.document.path == path:
            self.player.pause()
            self.document.release()

    def _words_saved(self, path: Path, take: Take | None) -> None:
        if self.document is not None and self.document.path == path:
            try:
                self.document.reopen(take)
            except (PhalanxError, OSError) as error:
                self._worker.notifications.error(error, "Review", f"Opening {path.name}")
                self.document = None
                self._clear()
        elif take is not None:
            take.close()
        self.browser.reread(path)
        self.showing.show()

    def _clear(self) -> None:
        self.solutions.show_take(None)
        self.player.load(self.player.times_s[:0])
        self.inspector.clear()
        self.timeline.show_take(None, ())
        self.plots.show_take(self.player.times_s, None)
        self.viewport.show_frame(None, None, None)
        self.viewport.show_empty(EMPTY_TITLE, EMPTY_DETAIL)

    # The end.

    def hideEvent(self, event: QHideEvent) -> None:  # noqa: N802 (Qt's name)
        """Back to live: nothing plays unseen, and what was typed is saved."""
        super().hideEvent(event)
        self.player.pause()
        self.inspector.finish_typing()

    def finish(self) -> None:
        """End every job and write what is not written yet. Waits."""
        self.player.pause()
        self.inspector.finish_typing()
        if self._dialog is not None:
            self._dialog.stop()
        self.picking.stop()
        self._stop_reading(wait=True)
        self.opening.end(wait=True)
        self.jobs.end(wait=True)
        self.browser.close_jobs()
        if self.document is not None:
            self.document.close()
        self.words.finish()
