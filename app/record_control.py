"""Record, wherever it is pressed: the next take begins or the one that runs ends, or it is said why not."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from PySide6.QtGui import QAction, QKeySequence, QShortcut
from PySide6.QtWidgets import QMessageBox, QWidget

from app import shortcuts
from app.take_plan import TakePlan
from app.worker import SessionWorker
from core.errors import PhalanxError
from core.takes.take import TakeInfo
from devices.device import Level


class Refusing(Protocol):
    """Where Record can be pressed."""

    def show_refusal(self, text: str) -> None:
        """Say why nothing is recorded; "" for nothing."""


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
        self._not_able_said = False
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
        stream = self._worker.session.live_stream
        try:
            name, path = self._plan.next()
            if stream is None:
                raise PhalanxError("No device is connected, so there is nothing to record.", "Connect a device first.")
        except PhalanxError as error:
            self._worker.notifications.error(error, "Recorder")
            self.say_refusal(error)
            return
        description, health = stream.describe(), stream.health()
        info = TakeInfo(
            name=name,
            performer=self._plan.performer,
            rate_hz=description.rate_hz or health.rate_hz or float("nan"),
            device={"kind": stream.device_class.kind, "title": description.title, **description.details},
            notes=self._plan.notes.strip(),
            shot=self._plan.shot,
        )
        if health.level is Level.PROBLEM and not self._record_anyway(health.reason):
            return
        self._action.setEnabled(False)
        self._worker.start_recording(path, info, self._plan.next)

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

        self._worker.save_look_back(path, info, plan.next, refused)

    def _record_anyway(self, reason: str) -> bool:
        answer = QMessageBox.warning(
            self._window,
            "No frames are coming",
            f"{reason}\n\nRecord anyway? Until frames come the take has none, and says so.",
            QMessageBox.StandardButton.Yes | QMessageBox.StandardButton.Cancel,
            QMessageBox.StandardButton.Cancel,
        )
        return answer == QMessageBox.StandardButton.Yes

    def say_refusal(self, error: Exception | None) -> None:
        """Where Record was pressed; the messages have it besides."""
        self._not_able_said = False
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
        session, stream = self._worker.session, self._worker.session.live_stream
        if session.recording:
            return None
        if not session.ready:
            return PhalanxError("The solver is not ready to record yet.", "It is being prepared: wait some seconds.")
        if session.opening is not None:
            return PhalanxError("Waiting for the disk of the take folder.", "Recording begins when it answers.")
        if stream is None:
            return PhalanxError("No device is connected: nothing to record.", "Connect one in the Devices panel.")
        if not stream.streaming:
            return PhalanxError(f"{stream.title} is not connected yet.", "Wait until its light is no longer amber.")
        return None

    def say_able(self) -> None:
        """Record is not locked any more: that it was has been said for long enough."""
        if self._not_able_said:
            self.say_refusal(None)
