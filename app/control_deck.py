"""The control deck above everything: live or review, which take, record, how long, and how the hands are."""

from __future__ import annotations

from PySide6.QtCore import QEvent, Qt, Signal
from PySide6.QtGui import QAction
from PySide6.QtWidgets import QButtonGroup, QFrame, QGridLayout, QHBoxLayout, QLabel, QPushButton, QVBoxLayout

from app import theme
from app.clock import clock
from app.disk_wait import Opening
from app.hand_words import hand_titles, performer_titles, shortened
from app.lights import Light, elided, label, set_property
from app.live_numbers import LiveFrame
from app.live_streams import Incoming, ended_device, gravest, incoming, solved_one
from app.panels.panel import clear, row
from app.recording_words import recording_words
from app.session import SessionNumbers
from app.take_plan import TakePlan
from app.take_summary import TakeSummary
from app.why_lost import state_in
from app.worker import SessionWorker
from core.cast import hands_of
from core.frames import HandKey
from core.printable import printable
from devices.device import Level

WAITING = "Waiting for the disk…"

LONGEST_NAME = 14
"""Characters of a performer's name above everything."""
LONGEST_TAKE = 28
"""Characters of a take's name before how it ended."""
NAME_SHARE, TIMES_SHARE, LIGHTS_SHARE = 4, 4, 5
"""Of the room beside the buttons; the width of the window alone says where everything is."""


class RecordButton(QPushButton):
    """Triggers the record action and shows its state."""

    not_able = Signal()
    """It was clicked while nothing can be recorded."""

    def __init__(self, action: QAction) -> None:
        super().__init__("Record")
        self.setObjectName("record")
        self._action = action
        self.clicked.connect(action.trigger)
        action.changed.connect(self._follow)
        self.set_recording(False)
        self._follow()

    def set_recording(self, recording: bool) -> None:
        """Show that a take is being written, or that one can be."""
        self._recording = recording
        self.set_waiting(False)
        self.setIcon(theme.icon("stop" if recording else "record"))
        set_property(self, "recording", recording)

    def set_waiting(self, waiting: bool) -> None:
        """Show that a take is to begin and its disk has not answered yet."""
        text = "Waiting…" if waiting else "Stop" if self._recording else "Record"
        if text != self.text():
            self.setText(text)

    def event(self, event: QEvent) -> bool:
        """A click on it is answered also while it is locked."""
        if event.type() == QEvent.Type.MouseButtonPress and not self.isEnabled():
            self.not_able.emit()
            return True
        return super().event(event)

    def _follow(self) -> None:
        self.setEnabled(self._action.isEnabled())
        self.setToolTip(self._action.toolTip())


class ControlDeck(QFrame):
    """One row; nothing in it moves when numbers change."""

    review_chosen = Signal(bool)

    def __init__(self, worker: SessionWorker, plan: TakePlan, record: QAction) -> None:
        super().__init__()
        self.setObjectName("deck")
        self.setFixedHeight(58)
        self._worker, self._plan = worker, plan
        self._latest: LiveFrame | None = None
        self._recording = self._waiting = False

        self.live, self.review = QPushButton("Live"), QPushButton("Review")
        modes = QButtonGroup(self)
        for button, name, tip in (
            (self.live, "live", "Receive, solve and record (Ctrl+1)."),
            (self.review, "review", "Look at takes, mend and export them (Ctrl+2)."),
        ):
            button.setObjectName(name)
            button.setCheckable(True)
            button.setProperty("segment", True)
            button.setToolTip(tip)
            modes.addButton(button)
        self.live.setChecked(True)
        self.review.toggled.connect(self.review_chosen)

        self.caption = label("Next take", "section")
        self.take = elided("", "take", Qt.TextElideMode.ElideMiddle)
        self.record = RecordButton(record)
        self.record.setMinimumWidth(112)
        self.elapsed = label("00:00.0", "number")
        self.elapsed.setMinimumWidth(self.elapsed.fontMetrics().horizontalAdvance("00:00.0") * 2)
        self.frames = elided("", "small")
        self.refusal = label("", "small", wrap=True)
        set_property(self.refusal, "level", "problem")
        self.refusal.hide()

        self.device_light = Light(10)
        self.device = elided("No device", "muted", Qt.TextElideMode.ElideMiddle)
        self.device.setAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
        self.hand_lights: dict[HandKey, Light] = {}
        self.hand_names: dict[HandKey, QLabel] = {}

        name = QVBoxLayout()
        name.setSpacing(0)
        name.addWidget(self.caption)
        name.addWidget(self.take)
        self._hands = row()
        below = row(self.frames)  # a line has the room up to the hands
        below.setStretch(0, 1)
        below.addStretch()
        below.addSpacing(16)
        below.addLayout(self._hands)
        self._figures = QGridLayout()
        self._figures.setHorizontalSpacing(16)
        self._figures.setVerticalSpacing(0)
        self._figures.setColumnStretch(0, TIMES_SHARE)
        self._figures.setColumnStretch(1, LIGHTS_SHARE)
        self._figures.addWidget(self.elapsed, 0, 0)
        self._figures.addWidget(self.refusal, 0, 0, 2, 1)
        self._figures.addLayout(row(None, self.device_light, self.device), 0, 1)
        self._figures.addLayout(below, 1, 0, 1, 2)

        layout = QHBoxLayout(self)
        layout.setContentsMargins(12, 6, 14, 6)
        layout.setSpacing(0)
        layout.addWidget(self.live)
        layout.addWidget(self.review)
        layout.addSpacing(26)
        layout.addLayout(name, NAME_SHARE)
        layout.addSpacing(18)
        layout.addWidget(self.record)
        layout.addSpacing(16)
        layout.addLayout(self._figures, TIMES_SHARE + LIGHTS_SHARE)
        for button in (self.live, self.review, self.record):
            button.setFixedHeight(34)
            button.setFocusPolicy(Qt.FocusPolicy.NoFocus)

        plan.changed.connect(self._show_take)
        worker.recording_changed.connect(self.set_recording)
        worker.take_finished.connect(self.show_summary)
        worker.frame.connect(self._take)
        worker.numbers.connect(self._refresh)
        worker.profile_changed.connect(lambda _: self._list_hands())
        for changed in (worker.solving_changed, worker.profile_changed):
            changed.connect(self._forget)
        self._list_hands()
        self._show_take()

    def _list_hands(self) -> None:
        """A light for every hand; of several performers after their names."""
        clear(self._hands)
        self.hand_lights, self.hand_names = {}, {}
        cast = self._worker.session.profiles
        several, names = len(cast) > 1, performer_titles(cast)
        for key in hands_of(cast):
            begins = several and key.side == cast[key.performer].sides[0]
            if self.hand_lights:
                self._hands.addSpacing(18 if begins else 8)
            if begins:
                who = elided(shortened(names[key.performer], LONGEST_NAME), "muted")
                who.setToolTip(names[key.performer])
                self._hands.addWidget(who)
            self.hand_lights[key] = Light(10)
            self.hand_names[key] = label(key.side[0].upper() if several else f"{key.side.capitalize()} hand", "muted")
            self._hands.addWidget(self.hand_lights[key])
            self._hands.addWidget(self.hand_names[key])
        self._figures.setColumnMinimumWidth(1, self._hands.minimumSize().width())

    def set_recording(self, recording: bool) -> None:
        """Turn to recording, or back."""
        if recording:
            self.frames.setText("")
        self._recording = recording
        self.record.set_recording(recording)
        self._show_caption()
        self.review.setEnabled(not recording)
        self._show_take()

    def show_refusal(self, text: str) -> None:
        """Why nothing is recorded and what to do, at the button in place of the last take's figures; "" for none."""
        if text != self.refusal.text():
            self.refusal.setText(text)
            self.refusal.setToolTip(text)
            self.refusal.setVisible(bool(text))
            self.elapsed.setVisible(not text)
            self.frames.setVisible(not text)

    def show_summary(self, summary: TakeSummary) -> None:
        """How the last take ended, until the next one begins."""
        if self._recording:
            return
        verdict = summary.verdict
        self.elapsed.setText(clock(summary.duration_s))
        saved = "" if verdict.level is Level.PROBLEM else " saved"
        ended = f"{saved}: {verdict.headline}"
        self.frames.setText(f"{shortened(summary.name, LONGEST_TAKE)}{ended}")
        self.frames.setToolTip("\n".join((f"{summary.name}{ended}", *verdict.texts, summary.line)))
        set_property(self.frames, "level", verdict.level.value)

    def _show_waiting(self, opening: Opening | None) -> None:
        """A take that is to begin waits for its disk, or does no longer."""
        waiting = opening is not None
        self.record.set_waiting(waiting)
        if opening is not None:
            self.caption.setText(WAITING)
            set_property(self.caption, "level", "problem" if opening.stalled else "warning")
        elif self._waiting:
            self.frames.setText("")
            self.frames.setToolTip("")
            self._show_caption()
        self._waiting = waiting

    def _show_caption(self) -> None:
        self.caption.setText("Recording" if self._recording else "Next take")
        set_property(self.caption, "level", "recording" if self._recording else "")

    def _show_take(self) -> None:
        if self._recording and self._worker.session.recording_name:
            self.take.setText(self._worker.session.recording_name)
            return
        preview = self._plan.preview()
        self.take.setText(preview.name or preview.instead)
        self.take.setToolTip(preview.problem or "Change it in the Recorder panel.")
        set_property(self.take, "level", "problem" if preview.problem else "")

    def _take(self, frame: LiveFrame) -> None:
        self._latest = frame

    def _forget(self) -> None:
        """What was solved for other performers, or came from elsewhere, is shown no more."""
        self._latest = None

    def _refresh(self, numbers: SessionNumbers) -> None:
        recording = numbers.recording
        streams = incoming(self._worker.session)
        self._show_waiting(numbers.opening)
        if recording is not None:
            self.elapsed.setText(clock(recording.elapsed_s))
            words = recording_words(recording, {one.key for one in streams if one.ended})
            self.frames.setText(words.text)
            self.frames.setToolTip(words.tip)
            set_property(self.frames, "level", words.level)
        elif numbers.opening is not None:
            self.elapsed.setText(clock(0.0))
            self.frames.setText(f"No take has begun: no answer for {numbers.opening.seconds:.0f} s")
            self.frames.setToolTip(f"The disk of {printable(numbers.opening.folder)} does not answer. Check it.")
            set_property(self.frames, "level", "problem" if numbers.opening.stalled else "warning")
        elif numbers.sealing:
            take = numbers.sealing[0]
            stalled = f"the disk has not answered for {take.stalled_s:.0f} s"
            name, how = shortened(take.name, LONGEST_TAKE), stalled if take.stalled_s else f"{take.part:.0%}"
            self.frames.setText(f"{take.doing} {name}: {how}")
            set_property(self.frames, "level", "problem" if take.stalled_s else "")
        self._show_devices(streams)
        solved = solved_one(streams)
        flowing = solved is not None and solved.health.rate_hz > 0
        latest = self._latest if flowing else None
        hands = {hand.key: hand for hand in latest.solved.hands} if latest is not None else {}
        several, titles = len(self._worker.session.profiles) > 1, hand_titles(self._worker.session.profiles)
        for key, light in self.hand_lights.items():
            level, words = Level.IDLE, "No data for this hand."
            if latest is not None and key in hands:
                missed_s = self._worker.missing.seconds(key, latest.solved)
                level, words = state_in(hands[key], latest.raw, latest.solved, missed_s)
            words = f"{titles[key]}: {words}" if several and key in titles else words
            light.set_level(level)
            light.setToolTip(words)
            self.hand_names[key].setToolTip(words)

    def _show_devices(self, streams: list[Incoming]) -> None:
        """The gravest light; in words the stream that is solved, before it one that is in trouble."""
        if not streams:
            ended = ended_device(self._worker.session)
            if ended is None:
                self.device_light.set_level(Level.IDLE)
                self.device.setText("No device connected")
                self.device.setToolTip("Connect one in the Devices panel.")
                return
            health = ended.health()
            self.device_light.set_level(health.level)
            self.device.setText(f"{ended.title}: played to its end")
            self.device.setToolTip(health.reason)
            return
        worst = gravest(streams)
        troubled = worst.health.level is Level.PROBLEM or worst.ended
        shown = worst if troubled else solved_one(streams) or streams[0]
        words = shown.state
        if len(streams) > 1:
            words += f" · {len(streams) - 1} more"
        self.device_light.set_level(worst.health.level)
        self.device.setText(words)
        self.device.setToolTip("\n".join(one.reason for one in streams) if len(streams) > 1 else shown.health.reason)
