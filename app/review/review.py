"""The review room: choose a take, look at it, judge it, solve it again, export it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from PySide6.QtCore import Qt, QTimer
from PySide6.QtGui import QAction, QHideEvent, QKeySequence
from PySide6.QtWidgets import (
    QFrame,
    QSplitter,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from app import theme
from app.panels.panel import column
from app.props.desk import PropDesk
from app.props.picking import ReviewPicking
from app.review import document as work
from app.review.analysis import Analysis
from app.review.arrival import Arrival
from app.review.browser import TakeBrowser
from app.review.document import ReviewDocument, Solved
from app.review.export_dialog import ExportDialog
from app.review.importing import IMPORTING, Importing
from app.review.inspector import Inspector
from app.review.job import Job, Report
from app.review.job_bar import JobBar
from app.review.leaving import Leaving
from app.review.moment import Moment
from app.review.outcome import Outcome
from app.review.player import Player
from app.review.range_steps import RangeSteps
from app.review.reading import Reading
from app.review.showing import Showing
from app.review.solution_box import SolutionBox
from app.review.solving import Solving
from app.review.take_plots import TakePlots
from app.review.take_words import TakeWords
from app.review.timeline import Timeline
from app.review.transport import Transport
from app.settings import Settings
from app.take_plan import TakePlan
from app.undo import UndoStack
from app.viewport.viewport import Viewport
from app.worker import SessionWorker
from core.cast import hands_of
from core.errors import PhalanxError
from core.takes.reader import Take

EMPTY_TITLE = "No take open"
EMPTY_DETAIL = "Choose one in the list on the left, or open a file with Ctrl+O."
GONE_DETAIL = "Its file was moved or deleted. Choose another take in the list."
WAIT_MS = 50
PATIENCE_MS = 250
"""A take that opens within this time takes the place of the one before it without an empty view between them [ms]."""


class Review(QWidget):
    """Binds player, document and jobs to the widgets. Everything that works does so elsewhere."""

    def __init__(
        self,
        worker: SessionWorker,
        plan: TakePlan,
        settings: Settings | None = None,
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self._worker = worker
        self.undo = UndoStack(worker.notifications)
        """Of what is done in this room."""
        self._settings = settings or Settings(None)
        self.player = Player()
        self.document: ReviewDocument | None = None
        self._dialog: ExportDialog | None = None
        self.reading = Reading(worker.notifications, self)
        self.viewport = Viewport()
        self.viewport.show_empty(EMPTY_TITLE, EMPTY_DETAIL)
        self.browser = TakeBrowser(plan.folder)
        self.inspector = Inspector()
        self.solutions = SolutionBox()
        self.timeline = Timeline(self.player)
        self.plots = TakePlots(self.player)
        self.jobs, self.opening = JobBar(self.viewport, 0), JobBar(self.viewport, 1)
        self.solving = Solving(self, worker, self._settings, self.undo, lambda: self.document, self._run)
        self.outcome = Outcome(self.viewport)
        self.arrival = Arrival(self, worker)
        self.importing = Importing(
            self, plan, self._settings, worker.notifications, lambda: worker.session.profiles, self._run,
            self.arrival.open, self.jobs, self.outcome,
        )  # fmt: skip
        self.leaving = Leaving(self, self.jobs, lambda: self.document, self.solving.save)
        ranges = RangeSteps(self.player, self.undo, self._in_hand)
        self.timeline.range_dragged.connect(ranges.dragged)
        self.transport = Transport(self.player, ranges, self)
        self.words = TakeWords(self.undo, worker.notifications, self._in_hand, self._reading)
        self.moment = Moment(self.player, self.plots, self._analysis, self.inspector.show_moment)
        self.showing = Showing(self.player, self.viewport, self._readable, worker.notifications, self)
        self.picking = ReviewPicking(self.viewport, PropDesk(worker, self.undo), self.player, self._readable)
        self.picking.solve_asked.connect(self.solving.solve_with_first)
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
        self.solutions.chosen.connect(self.solving.choose)
        self.solutions.solve.clicked.connect(self.solving.ask)
        self.solutions.save.clicked.connect(self.solving.save_shown)
        self.solutions.export.clicked.connect(self.export_take)
        for keys, do in (
            ("M", lambda: self.words.add_mark(self.player.time_s)),
            ("Ctrl+E", self.export_take),
            ("PgDown", lambda: self.browser.step(1)),
            ("PgUp", lambda: self.browser.step(-1)),
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
        for widget in (self.transport, self.timeline):
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
        self._curtain = QTimer(self, singleShot=True, interval=PATIENCE_MS)
        self._curtain.timeout.connect(lambda: self._say("Opening…", ""))
        self.browser.moved.connect(self._coming)
        self.browser.opened.connect(self.open_take)
        self.browser.refreshed.connect(self._look_at_file)
        self.browser.files_read.connect(self._files_read)
        self.browser.recover_asked.connect(self.recover)
        self.importing.began.connect(self.arrival.expect)
        self.importing.one_made.connect(self.browser.refresh, Qt.ConnectionType.QueuedConnection)
        self.outcome.opened.connect(self.open_take)
        self.reading.progressed.connect(self.timeline.show_progress)
        self.reading.done.connect(self._analysed)
        self.solving.shown.connect(self._solution_shown)
        self.solving.saved.connect(self._solution_saved)
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
        """Show a take, and select it. Why it cannot be read stands in the middle then."""
        path = self.browser.listed(path)
        if self.document is not None and self.document.path == path:
            self._stay()
        elif self.opening.job is not None and self.browser.chosen == path:
            return
        else:
            self._leave_for(f"{path.stem} is opened", lambda: self._open(path))

    def _leave_for(self, what: str, then: Callable[[], None]) -> None:
        """Do what closes the take that is open, unless the operator stays with it."""
        if self.leaving.free:
            then()
        else:
            self._stay()
            self.leaving.ask(what, then)

    def _coming(self, path: Path) -> None:
        """Another take is being selected: from now on nothing can be said of the one that is still shown."""
        self.opening.end()
        self.player.pause()
        self.inspector.finish_typing()
        self.inspector.show_coming(path.stem)
        self.solutions.show_take(None)

    def _stay(self) -> None:
        """The take that is open is the selected one, whatever was asked for."""
        if self.document is not None:
            self.inspector.finish_typing()
            self.browser.select(self.document.path)
            self._show_facts()

    def _open(self, path: Path) -> None:
        self._close(path)
        self._curtain.start()
        job = Job("Opening", lambda report: ReviewDocument(path, report), self)
        job.succeeded.connect(self._opened)
        job.failed.connect(lambda error: self._refused(path, error))
        job.cancelled.connect(lambda: self._close(None, f"{path.stem} was not opened", EMPTY_DETAIL))
        self.opening.run(job)

    def _opened(self, document: ReviewDocument) -> None:
        self._curtain.stop()
        document.info, document.marks = self.words.unsaved(document.path) or (document.info, document.marks)
        self.document = document
        self.player.load(document.times_s, document.span_s)
        self.viewport.view_fit_next()
        self._show_document()
        self.timeline.view_all()
        self.reading.start(self.document)

    def _refused(self, path: Path, error: Exception) -> None:
        """It stays selected, for what the list and the middle say of it."""
        if not isinstance(error, (PhalanxError, OSError)):
            self._worker.notifications.error(error, "Review", f"Opening {path.name}")
        self._say(f"{path.name} cannot be read", str(error) or type(error).__name__)

    def _close(self, coming: Path | None, title: str = "", detail: str = "") -> None:
        """Nothing is open any more, and `coming` is selected. The view keeps its picture if nothing is to be said."""
        self.inspector.finish_typing()
        self.opening.end()
        self.reading.stop()
        document, self.document = self.document, None
        if document is not None:
            self.undo.drop(document)
            document.close()
        self.browser.select(coming)
        self.showing.forget()
        self.picking.picker.clear()
        self.player.load(self.player.times_s[:0])
        self.solutions.show_take(None)
        self.timeline.show_take(None, ())
        self.plots.show_take(self.player.times_s, None)
        self.inspector.clear()
        if coming is not None:
            self.inspector.show_coming(coming.stem)
        if title:
            self._say(title, detail)

    def _say(self, title: str, detail: str) -> None:
        """In the middle, where no take is."""
        self._curtain.stop()
        self.viewport.show_frame(None, None, None)
        self.viewport.show_empty(title, detail)

    def _look_at_file(self) -> None:
        """The folder has changed: the take that is open may be another file now, or none."""
        document, chosen = self.document, self.browser.chosen
        if document is None:
            if chosen is not None and self.idle() and not chosen.exists():
                self._close(None, f"{chosen.stem} is not there any more", GONE_DETAIL)
        elif self._in_hand() is not None and document.file_gone:
            if not self.leaving.free or not self.idle():
                self._worker.notifications.warning(
                    f"{document.path.name} was moved, deleted or replaced while it is open.",
                    "What is shown is the file as it was. Save what you need as a take.",
                    "Review",
                )
            elif document.path.exists():
                self._open(document.path)
            else:
                self._close(None, f"{document.path.stem} is not there any more", GONE_DETAIL)

    def _files_read(self, paths: list[Path]) -> None:
        """A take that could not be read may be readable now."""
        if self.document is None and self.idle() and self.browser.chosen in paths:
            self._open(self.browser.chosen)

    def _show_document(self) -> None:
        document = self.document
        if document is None:
            return
        self._show_facts()
        cast = document.solved.cast if document.solved is not None else ()
        self.timeline.show_take(document.analysis, document.marks, len(hands_of(cast)) or 2)
        self.plots.show_take(document.times_s, document.analysis)
        if not document.n_frames and document.n_beside:
            self._say("No stream of this take was solved", "What it holds is said beside; there are no hands to show.")
        elif not document.n_frames:
            self._say("This take holds no frames", "Its recording ended before the first one.")
        self.showing.show()
        self.markers.setEnabled(True)

    def _show_facts(self) -> None:
        document = self._in_hand()
        if document is not None:
            self.inspector.show_take(document)
            if document.analysis is not None:
                self.inspector.show_analysis(document.analysis)
            self.solutions.show_take(document)
            self.moment.refresh()

    def _analysis(self) -> Analysis | None:
        document = self._in_hand()
        return document.analysis if document is not None else None

    def _in_hand(self) -> ReviewDocument | None:
        """The take that is open and selected. While another one is about to be opened nothing is said of this one."""
        document = self.document
        return document if document is not None and document.path == self.browser.chosen else None

    def _readable(self) -> ReviewDocument | None:
        """The open take, unless its file is being replaced."""
        document = self.document
        return None if document is None or self.words.in_progress == document.path else document

    # Jobs.

    def _reading(self) -> bool:
        """Whether anything reads the file of a take, so that it should not be replaced now. An import reads none."""
        asking = self._dialog is not None or self.picking.reading
        jobs = [bar.job for bar in (self.jobs, self.opening) if bar.job is not None]
        return self.reading.running or asking or any(job.title != IMPORTING for job in jobs)

    def idle(self) -> bool:
        """Whether nobody is at work on takes, and no dialog is open on one."""
        return all(bar.job is None for bar in (self.jobs, self.opening)) and not (self._dialog or self.picking.reading)

    def _run(
        self, title: str, task: Callable[[Report], Any], done: Callable[[Any], None],
        not_done: Callable[[], None] = lambda: None,
    ) -> None:  # fmt: skip
        if self.jobs.job is not None:
            self._worker.notifications.warning(f"{self.jobs.job.title} is not done yet.", "Wait for it, or cancel it.")
            not_done()
            return
        if self.words.in_progress is not None:
            QTimer.singleShot(WAIT_MS, self, lambda: self._run(title, task, done, not_done))
            return
        job = Job(title, task, self)
        self.jobs.run(job)  # is told first that it ended: what is done then may be the next job
        job.succeeded.connect(done)
        job.failed.connect(lambda error: self._worker.notifications.error(error, "Review", title))
        for signal in (job.failed, job.cancelled):
            signal.connect(lambda *_: not_done())

    def _analysed(self, solved: Solved, analysis: Any) -> None:
        document = self.document
        if document is not None and document.solved is solved and analysis is not None:
            document.analysis = analysis
            self.timeline.show_take(analysis, document.marks)
            self.plots.show_take(document.times_s, analysis)
            if self._in_hand() is not None:
                self.inspector.show_analysis(analysis)
            self.moment.refresh()

    def _solution_shown(self) -> None:
        self.showing.forget()
        self._show_document()
        self.reading.start(self.document)

    def _solution_saved(self) -> None:
        self.solutions.show_take(self._in_hand())
        self.browser.refresh()

    def recover(self, path: Path) -> None:
        """Make a take whole: seal it, or write what is readable beside it."""
        self._leave_for(f"{path.stem} is recovered", lambda: self._recover(path))

    def _recover(self, path: Path) -> None:
        def done(written: Path) -> None:
            self._worker.notifications.info(f"{written.name} is whole now.", source="Review")
            self.browser.refresh()
            self.browser.reread(written)
            if self.browser.chosen == path:
                self._open(written)

        def not_done() -> None:
            if self.document is None and self.browser.chosen == path:
                self._open(path)

        if self.jobs.job is None:
            self._close(path, f"Recovering {path.stem}…")
        self._run("Recovering", lambda report: work.rescue(path, report), done, not_done)

    def export_take(self) -> None:
        """The export dialog."""
        document = self._in_hand()
        if document is None or self._dialog is not None:
            return
        self.player.pause()
        self._dialog = ExportDialog(document, self.player, self._settings, self)
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
            if self._in_hand() is not None:
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
                self._close(path)
                self._refused(path, error)
        elif take is not None:
            take.close()
        self.browser.reread(path)
        self.showing.show()

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
        self.leaving.stop()
        if self._dialog is not None:
            self._dialog.stop()
        self.picking.stop()
        self.reading.stop(wait=True)
        self.importing.stop()
        self.opening.end(wait=True)
        self.jobs.end(wait=True)
        self.browser.close_jobs()
        if self.document is not None:
            self.document.close()
        self.words.finish()
