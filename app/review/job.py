"""Long work beside the window: one thread per job, with progress and cancel."""

from __future__ import annotations

import contextlib
import logging
import threading
from collections.abc import Callable
from typing import Any

from PySide6.QtCore import QObject, Qt, Signal, Slot

log = logging.getLogger("phalanx")


class Report:
    """How work tells of itself, from its own thread."""

    def __init__(self, told: Callable[[str, object], None], stop: threading.Event) -> None:
        self._told, self._stop = told, stop

    def __call__(self, share: float, text: str = "") -> bool:
        """Share done (0..1) and what is being done; False when the work shall stop."""
        if self._stop.is_set():
            return False
        self._told("progressed", (share, text))
        return True

    @property
    def stopped(self) -> bool:
        """The work shall stop."""
        return self._stop.is_set()

    def give(self, part: object) -> None:
        """A part of the result, before the rest."""
        self._told("given", part)


class Job(QObject):
    """Runs `work(report)` once. Exactly one of succeeded, failed and cancelled follows, on the window's thread.

    The work may end early when `report` returns False, by returning or by raising.
    """

    progressed = Signal(float, str)
    given = Signal(object)
    succeeded = Signal(object)
    failed = Signal(object)
    cancelled = Signal()
    _told = Signal(str, object)

    def __init__(self, title: str, work: Callable[[Report], Any], parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.title = title
        self._work = work
        self._told.connect(self._tell, Qt.ConnectionType.QueuedConnection)
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name=f"phalanx-{title.lower()}", daemon=True)

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def cancel(self) -> None:
        """Ask the work to stop at its next report."""
        self._stop.set()

    def join(self, timeout_s: float | None = None) -> bool:
        """Wait for the thread to end; True if it has."""
        self._thread.join(timeout_s)
        return not self._thread.is_alive()

    @property
    def running(self) -> bool:
        """Whether the thread is at work."""
        return self._thread.is_alive()

    def _run(self) -> None:
        try:
            outcome, value = "succeeded", self._work(Report(self._told.emit, self._stop))
        except Exception as error:
            outcome, value = "failed", error
            if self._stop.is_set():
                log.info("%s cancelled (%s)", self.title, error)
        with contextlib.suppress(RuntimeError):  # Qt's word for a window that has gone: nobody is left to tell
            self._told.emit("cancelled" if self._stop.is_set() else outcome, value)

    @Slot(str, object)
    def _tell(self, what: str, value: Any) -> None:
        if what == "progressed":
            self.progressed.emit(*value)
            return
        if what == "given":
            self.given.emit(value)
            return
        if what == "cancelled":
            self.cancelled.emit()
        else:
            getattr(self, what).emit(value)
        self.deleteLater()  # with all that waited for it, which may hold much
