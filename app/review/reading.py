"""The take that is open is read through once, for its lanes, curves and shares."""

from __future__ import annotations

from PySide6.QtCore import QObject, Signal

from app.notifications import NotificationCentre
from app.review import document as work
from app.review.document import ReviewDocument
from app.review.job import Job


class Reading(QObject):
    """At most one runs; the next ends it."""

    progressed = Signal(float)
    """The share done, 0..1."""

    done = Signal(object, object)
    """The solution (Solved), and its analysis (Analysis or None)."""

    def __init__(self, notifications: NotificationCentre, parent: QObject) -> None:
        super().__init__(parent)
        self._notifications = notifications
        self._job: Job | None = None

    @property
    def running(self) -> bool:
        """Whether a file is being read."""
        return self._job is not None and self._job.running

    def start(self, document: ReviewDocument | None) -> None:
        """Read the solution that is shown of a take, if there is anything to read."""
        self.stop()
        if document is None or document.solved is None or not document.n_frames:
            return
        solved, path = document.solved, document.path_of(document.solved)
        job = Job("Reading the take", lambda report: work.read_analysis(path, solved, report), self)
        job.progressed.connect(lambda share, _: self.progressed.emit(share))
        job.succeeded.connect(lambda analysis: self.done.emit(solved, analysis))
        job.failed.connect(lambda error: self._notifications.error(error, "Review", job.title))
        self._job = job
        job.start()

    def stop(self, wait: bool = False) -> None:
        """End what is read. wait: until it has ended."""
        job, self._job = self._job, None
        if job is not None:
            job.cancel()
            if wait:
                job.join()
