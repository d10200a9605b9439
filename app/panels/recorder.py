"""The recorder panel: what the take is called, where it goes, how it runs, how it ended."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

from PySide6.QtCore import Qt, QUrl, Signal
from PySide6.QtGui import QAction, QDesktopServices
from PySide6.QtWidgets import (
    QFileDialog,
    QGridLayout,
    QLabel,
    QLineEdit,
    QPlainTextEdit,
    QPushButton,
    QStackedWidget,
    QToolButton,
    QWidget,
)

from app.clock import clock
from app.control_deck import WAITING, RecordButton
from app.disk_room import free_text
from app.disk_wait import Opening
from app.editing import Field
from app.lights import elided, label, set_property
from app.panels.hinted_list import HintedList
from app.panels.last_take import LastTake
from app.panels.look_back_button import LookBackButton
from app.panels.panel import Panel, column, row, scrolling, section
from app.session import SessionNumbers
from app.take_plan import TakePlan
from app.take_summary import RecordingNumbers, TakeSummary
from app.undo import UndoStack
from app.worker import SessionWorker
from core.errors import TakeError
from core.level import Level
from core.printable import printable
from core.takes.disk import duration_text
from core.takes.take import Mark
from core.takes.take_names import FIELDS

MARKS_PX, HEADING_PX = 48, 40
NEXT_NOTES, THESE_NOTES = "Notes for the next take", "Notes for this take"
TEMPLATE_HELP = "\n".join(
    ["What takes are called; numbers advance by themselves and nothing is ever overwritten.", ""]
    + [f"{{{field}}}: {meaning}" for field, meaning in FIELDS.items()]
)


class RecorderPanel(Panel):
    """Name, button, figures, marks, notes, and the last take."""

    title, key = "Recorder", "recorder"
    open_take = Signal(Path)

    def __init__(
        self, worker: SessionWorker, plan: TakePlan, undo: UndoStack, record: QAction, mark: QAction, look_back: QAction
    ) -> None:
        super().__init__()
        self._worker, self._plan, self._undo = worker, plan, undo
        self.name = elided("", "take", Qt.TextElideMode.ElideMiddle)
        self.name_problem = label("", "small", wrap=True, lines=2)
        set_property(self.name_problem, "level", "problem")
        self._heading = QStackedWidget()
        """The name, or in its place why there is none, why it is not recorded, or what is wrong with the file that is:
        nothing below moves when that is said."""
        self.refusal = label("", "small", wrap=True, lines=2)
        set_property(self.refusal, "level", "problem")
        self.trouble = label("", "small", wrap=True, lines=2)
        for shown in (self.name, self.name_problem, self.refusal, self.trouble):
            self._heading.addWidget(shown)
        self._heading.setFixedHeight(HEADING_PX)
        self.record = RecordButton(record)
        self.record.setMinimumHeight(34)
        self.mark = QPushButton("Mark")
        self.mark.setMinimumHeight(34)
        self.mark.clicked.connect(mark.trigger)
        mark.changed.connect(lambda: self.mark.setEnabled(mark.isEnabled()))
        self.mark.setEnabled(mark.isEnabled())
        self.mark.setToolTip("Remember this moment of the take (M).")

        self.look_back = LookBackButton(look_back)
        self.look_back.setMinimumHeight(34)

        self.figures: dict[str, QLabel] = {}
        grid = QGridLayout()
        grid.setHorizontalSpacing(8)
        grid.setVerticalSpacing(1)
        for i, (key, tip) in enumerate(
            (
                ("Time", "Since the take began."),
                ("Frames", "Received from the device and counted for this take."),
                ("Size", "Bytes of this take on disk."),
                ("Disk left", "How long the disk lasts at the present rate; free space while nothing is recorded."),
            )
        ):
            heading, value = label(key, "small"), elided("–")
            heading.setToolTip(tip)
            value.setToolTip(tip)
            grid.addWidget(heading, 0, i)
            grid.addWidget(value, 1, i)
            grid.setColumnStretch(i, 1)
            self.figures[key] = value

        self.template, self._template = self._field("template", plan.set_template, TEMPLATE_HELP)
        self.performer, self._performer = self._field("performer", plan.set_performer, "Fills {performer}.")
        self.shot, self._shot = self._field("shot", plan.set_shot, "Fills {shot}.")
        self.folder = QLineEdit(str(plan.folder))
        self._folder = Field(self.folder, self._choose_folder)
        self.browse, show = QToolButton(text="…"), QToolButton(text="Open")
        self.browse.setFixedWidth(28)
        self.browse.setProperty("small", True)
        self.browse.setToolTip("Choose the take folder.")
        self.browse.clicked.connect(self._browse)
        show.setToolTip("Show the take folder.")
        show.clicked.connect(self.show_folder)
        self.notes = QPlainTextEdit()
        self.notes.setTabChangesFocus(True)
        self.notes.setPlaceholderText(NEXT_NOTES)
        self.notes.setToolTip("Kept in the take, and shown with it in Review. The next take begins without.")
        self.notes.setFixedHeight(52)
        self._notes = Field(self.notes, self._notes_done)
        self._notes.typed.connect(plan.set_notes)
        self._notes_before, self._takes, self._recording = "", 0, False
        self._at_fault = ""

        fields = QGridLayout()
        fields.setHorizontalSpacing(8)
        fields.setVerticalSpacing(5)
        for i, (text, widget) in enumerate(
            (("Name", self.template), ("Performer", self.performer), ("Shot", self.shot), ("Notes", self.notes))
        ):
            fields.addWidget(label(text, "muted"), i, 0)
            fields.addWidget(widget, i, 1)
        fields.addWidget(label("Folder", "muted"), 4, 0)
        fields.addLayout(row(self.folder, self.browse, show, spacing=4), 4, 1)
        fields.setColumnStretch(1, 1)

        self.marks = HintedList("M marks a moment while a take is recorded.")
        self.marks.setFixedHeight(MARKS_PX)
        self.last = LastTake(self.open_take.emit, worker.session.give_up_finishing, worker.session.solve_no_more)

        body = QWidget()
        inside = column(body, 8)
        inside.addWidget(self._heading)
        buttons = row(self.record, self.mark, self.look_back)
        buttons.setStretch(0, 1)
        inside.addLayout(buttons)
        inside.addLayout(grid)
        inside.addLayout(fields)
        inside.addWidget(section("Marks of this take"))
        inside.addWidget(self.marks)
        inside.addWidget(self.last)
        inside.addStretch(1)
        column(self, 0, 0).addWidget(scrolling(body))

        plan.changed.connect(self._show_plan)
        plan.notes_changed.connect(self._show_notes)
        worker.recording_changed.connect(self._set_recording)
        worker.take_finished.connect(self._finished)
        worker.numbers.connect(self._refresh)
        self._show_plan()

    def add_mark(self, mark: Mark) -> None:
        """List one more mark."""
        self.marks.addItem(f"{clock(mark.time_s)}   {mark.text}".rstrip())
        self.marks.scrollToBottom()

    def _field(self, what: str, setter: Callable[[str], None], tip: str) -> tuple[QLineEdit, Field]:
        line = QLineEdit(getattr(self._plan, what))
        line.setToolTip(tip)

        def take(after: str) -> None:
            before = getattr(self._plan, what)
            self._undo.change(f"change {what}", lambda: setter(after), lambda: setter(before))

        field = Field(line, take)
        field.typed.connect(lambda text: self._plan.show_typed(what, text))
        return line, field

    def _notes_done(self, after: str) -> None:
        """They count from key to key; as a step to be undone they are done with when the field is left."""
        before, self._notes_before, take = self._notes_before, after, self._takes

        def put(text: str) -> None:
            if take == self._takes:  # what an ended take says is changed in Review
                self._notes_before = text
                self._plan.set_notes(text)

        self._undo.change("change notes", lambda: put(after), lambda: put(before))

    def _choose_folder(self, text: str) -> None:
        before, after = self._plan.folder, Path(text).expanduser()
        if not text:
            raise TakeError("Takes need a folder.", f"Name one, or press Esc to go back to {before}.")
        if after != before:
            self._undo.change(
                "change take folder", lambda: self._plan.set_folder(after), lambda: self._plan.set_folder(before)
            )

    def _browse(self) -> None:
        chosen = QFileDialog.getExistingDirectory(self, "Take folder", str(self._plan.folder))
        if chosen and Path(chosen) == self._plan.folder:  # after it was away
            self._plan.set_folder(self._plan.folder)
        elif chosen:
            self._choose_folder(chosen)

    def show_folder(self) -> None:
        """Open the take folder in the desktop's file manager."""
        try:
            self._plan.make_folder()
        except (OSError, TakeError) as error:
            self._worker.notifications.error(error, "Recorder", f"Opening {self._plan.folder}")
            return
        QDesktopServices.openUrl(QUrl.fromLocalFile(str(self._plan.folder)))

    def _show_plan(self) -> None:
        plan = self._plan
        for field, text in (
            (self._template, plan.template),
            (self._performer, plan.performer),
            (self._shot, plan.shot),
            (self._folder, str(plan.folder)),
        ):
            field.show(text)
        self.folder.setToolTip(f"Where takes are written: {printable(plan.folder)}")
        if self._recording:
            return
        preview = plan.preview()
        self.name.setText(preview.name or preview.instead)
        self.name_problem.setText(preview.problem)
        self.name_problem.setToolTip(preview.problem)
        self._show_heading()
        if preview.at_fault != self._at_fault:
            self._at_fault = preview.at_fault
            for field, widget in (("template", self.template), ("folder", self.folder)):
                set_property(widget, "wrong", field == preview.at_fault)

    def _show_notes(self) -> None:
        self._notes.show(self._plan.notes)
        if self._recording:
            self._worker.session.set_notes(self._plan.notes.strip())

    def show_refusal(self, text: str) -> None:
        """Why nothing is recorded and what to do, at the button; "" for none. A bad name is said above it already."""
        self.refusal.setText(text)
        self.refusal.setToolTip(text)
        self._show_heading()

    def _show_heading(self) -> None:
        refused, problem = self.refusal.text(), self.name_problem.text()
        shown = self.name_problem if problem else self.refusal if refused else self.name
        if self.trouble.text():
            shown = self.trouble
        self._heading.setCurrentWidget(shown)

    def _set_recording(self, recording: bool) -> None:
        ended, self._recording = self._recording and not recording, recording
        self.record.set_recording(recording)
        for widget in (self.template, self.performer, self.shot, self.folder, self.browse):
            widget.setEnabled(not recording)
        if recording:
            self.marks.clear()
            self.name.setText(self._worker.session.recording_name)
            self.name_problem.setText("")
            self._show_heading()
        if ended:  # an attempt that was refused ends no take, and its notes stay
            self._takes += 1
            self._notes_before = ""
            self._plan.set_notes("")
            self._notes.reset("")
        self.notes.setPlaceholderText(THESE_NOTES if recording else NEXT_NOTES)
        self.notes.viewport().update()  # Qt draws another placeholder only when it comes or goes
        self._show_notes()
        self._show_plan()

    def _finished(self, summary: TakeSummary) -> None:
        self.last.show_summary(summary)
        if not self._worker.session.recording:
            self.figures["Time"].setText(clock(summary.duration_s))
            self.figures["Frames"].setText(f"{summary.received:,}")
            self.figures["Size"].setText(f"{summary.bytes / 1e6:.1f} MB")
        self._plan.changed.emit()

    def _refresh(self, numbers: SessionNumbers) -> None:
        recording = numbers.recording
        self.record.set_waiting(numbers.opening is not None)
        self._show_trouble(recording, numbers.opening)
        self.last.show_finishing(numbers.sealing)
        back = self._worker.session.look_back
        self.look_back.show_kept(back.seconds, back.silent_s)
        if recording is None:
            free = self._worker.disk_free
            self.figures["Disk left"].setText(free_text(free) if free is not None else "–")
            return
        self.figures["Time"].setText(clock(recording.elapsed_s))
        self.figures["Frames"].setText(f"{recording.received:,}")
        self.figures["Size"].setText(f"{recording.bytes_written / 1e6:.1f} MB")
        left = recording.seconds_left
        self.figures["Disk left"].setText(
            duration_text(left) if math.isfinite(left) else free_text(recording.disk_free)
        )

    def _show_trouble(self, recording: RecordingNumbers | None, opening: Opening | None) -> None:
        text, place, level = "", "", Level.WARNING
        if recording is not None and recording.trouble:
            text, place, level = f"{recording.name}: {recording.trouble}.", str(recording.path), recording.level
        elif opening is not None:
            text, place = WAITING, str(opening.folder)
            if opening.stalled:
                level = Level.PROBLEM
                text = f"The disk of the take folder has not answered for {opening.seconds:.0f} s: no take has begun."
        set_property(self.trouble, "level", level.value)
        if text != self.trouble.text():
            self.trouble.setText(text)
            self.trouble.setToolTip(printable(place))
            self._show_heading()
