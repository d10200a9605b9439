"""Record, wherever it is pressed: the next take begins or the one that runs ends, or it is said why not."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from PySide6.QtGui import QAction, QKeySequence, QShortcut
from PySide6.QtWidgets import QMessageBox, QWidget

from app import shortcuts
from app.live_streams import Incoming, incoming, stream_title
from app.take_plan import TakePlan
from app.worker import SessionWorker
from core.errors import PhalanxError
from core.words import listed
from devices.device import Level


class Refusing(Protocol):
    """Where Record can be pressed."""

    def show_refusal(self, text: str) -> None:
        """Say why nothing is recorded; "" for nothing."""


def _wrong(one: Incoming) -> str:
    """What is to be known of it before a take begins."""
    if one.receiver.opening:
        return f"{one.title}: it is still being connected, and would not be in the take."
    if one.receiver.failed:
        return f"{one.title} is not connected and would not be in the take."
    return one.reason


class RecordControl:
    """Begins and ends takes for a window.

    places: where it is said why not. before: done before a take begins or ends. live: turns to the live room.
    """

    def __init__(
        self,
        window: QWidget,
        worker: SessionWorker,
        plan: TakePlan,
        action: QAction,
        places: Callable[[], tuple[Refusing, ...]],
        before: Callable[[], None],
        live: Callable[[], None],
    ) -> None:
        self._window, self._worker, self._plan, self._action = window, worker, plan, action
        self._places, self._before, self._live = places, before, live
        self._not_able_said = self._nothing_came = False
        self._locked = QShortcut(QKeySequence(shortcuts.RECORD), window, self.say_not_able)
        action.changed.connect(lambda: self._locked.setEnabled(not action.isEnabled()))

    def toggle(self) -> None:
        """Begin the next take, or end the one that runs."""
        self._before()
        self.say_refusal(None)
        if self._worker.session.recording:
            self._action.setEnabled(False)
            self._worker.stop_recording()
            return
        self._live()
        session, plan = self._worker.session, self._plan
        try:
            name, path = plan.next()
            if not session.streams:
                raise PhalanxError("No device is connected, so there is nothing to record.", "Connect a device first.")
            if not self._ready():
                return
            info = session.take_info(name, performer=plan.performer, notes=plan.notes.strip(), shot=plan.shot)
        except PhalanxError as error:
            self._worker.notifications.error(error, "Recorder")
            self.say_refusal(error)
            return
        self._action.setEnabled(False)
        self._worker.start_recording(path, info, plan.next)

    def look_back(self) -> None:
        """Save what just happened, while a take runs as well as while none does. Notes are for the take that runs, or
        the next: this one has none."""
        self._before()
        self.say_refusal(None)
        session, plan = self._worker.session, self._plan
        try:
            name, path = plan.next()
        except PhalanxError as error:
            self._worker.notifications.error(error, "Recorder")
            self.say_refusal(error)
            return
        info = session.take_info(name, performer=plan.performer, shot=plan.shot)
        plan.reserve(name)

        def refused(error: Exception) -> None:
            plan.take_finished(name, kept=False)
            self.say_refusal(error)
            self._nothing_came = not self._frames_come

        self._worker.save_look_back(path, info, plan.next, refused)

    @property
    def what(self) -> str:
        """What the next take will hold, as a line of its own; "" where that is the one stream that is solved."""
        session = self._worker.session
        streams = [(stream_title(one.info, one.receiver), one.key == session.solving) for one in session.streams]
        if all(solved for _, solved in streams):
            return ""
        named = listed([f"{title} (solved)" if solved else title for title, solved in streams])
        return f"\nThe take will hold {named}."

    def _ready(self) -> bool:
        """Whether every stream is as it should be, or it is to be recorded as it is."""
        streams = incoming(self._worker.session)
        wrong = [one for one in streams if one.health.level is Level.PROBLEM or one.receiver.opening]
        if not wrong:
            return True
        if len(streams) == 1:
            title, lacks = "No frames are coming", "Until frames come the take has none, and says so."
            lines = [wrong[0].health.reason]
        else:
            title, lacks = "Not every device is ready", "The take says what it lacks."
            lines = [_wrong(one) for one in wrong]
        answer = QMessageBox.warning(
            self._window,
            title,
            "\n".join([*lines, "", f"Record anyway? {lacks}"]),
            QMessageBox.StandardButton.Yes | QMessageBox.StandardButton.Cancel,
            QMessageBox.StandardButton.Cancel,
        )
        return answer == QMessageBox.StandardButton.Yes

    def say_refusal(self, error: Exception | None) -> None:
        """Where Record was pressed; the messages have it besides."""
        self._not_able_said = self._nothing_came = False
        text = str(error) if isinstance(error, PhalanxError) else f"Recording failed: {error}." if error else ""
        for place in self._places():
            place.show_refusal(text)

    def say_not_able(self) -> None:
        """Record was pressed while it is locked. Once it is not any more this has been said for long enough."""
        reason = self._why_not_able()
        if reason is not None:
            self.say_refusal(reason)
            self._not_able_said = True

    def _why_not_able(self) -> PhalanxError | None:
        session = self._worker.session
        if session.recording:
            return None
        if not session.ready:
            return PhalanxError("The solver is not ready to record yet.", "It is being prepared: wait some seconds.")
        if session.opening is not None:
            return PhalanxError("Waiting for the disk of the take folder.", "Recording begins when it answers.")
        if not session.streams:
            opening = next((one for one in session.receivers if one.active), None)
            if opening is None:
                return PhalanxError("No device is connected: nothing to record.", "Connect one in the Devices panel.")
            return PhalanxError(f"{opening.title} is not connected yet.", "Wait until its light is no longer amber.")
        return None

    def say_able(self) -> None:
        """Record is not locked any more: that it was has been said for long enough, and once frames come that nothing
        had."""
        if self._not_able_said or (self._nothing_came and self._frames_come):
            self.say_refusal(None)

    @property
    def _frames_come(self) -> bool:
        return any(one.received for one in self._worker.session.streams)
