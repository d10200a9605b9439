"""The job that runs: what, how far, and cancel."""

from __future__ import annotations

from PySide6.QtCore import QTimer
from PySide6.QtWidgets import QProgressBar, QPushButton, QWidget

from app.lights import label
from app.panels.panel import row
from app.review.job import Job

_PATIENCE_MS = 250


class JobBar(QWidget):
    """One job at a time; shown only if it takes longer than a moment."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.job: Job | None = None
        self._text = label("", "small")
        self._text.setMinimumWidth(220)
        self._bar = QProgressBar()
        self._bar.setRange(0, 1000)
        self._bar.setTextVisible(False)
        self._cancel = QPushButton("Cancel")
        self._cancel.clicked.connect(self.cancel)
        line = row(self._text, self._bar, self._cancel)
        line.setStretch(1, 1)
        line.setContentsMargins(12, 4, 12, 4)
        self.setLayout(line)
        self._patience = QTimer(self, singleShot=True, interval=_PATIENCE_MS)
        self._patience.timeout.connect(self.show)
        self.hide()

    def run(self, job: Job) -> None:
        """Begin a job, when none runs."""
        self.job = job
        job.progressed.connect(self._progressed)
        for signal in (job.succeeded, job.failed):
            signal.connect(lambda _: self._ended(job))
        job.cancelled.connect(lambda: self._ended(job))
        self._text.setText(job.title)
        self._bar.setValue(0)
        self._cancel.setEnabled(True)
        self._patience.start()
        job.start()

    def cancel(self) -> None:
        """Ask the job to stop."""
        if self.job is not None:
            self._cancel.setEnabled(False)
            self._text.setText(f"{self.job.title}: cancelling…")
            self.job.cancel()

    def end(self, wait: bool = False) -> None:
        """Drop the job that runs."""
        job, self.job = self.job, None
        if job is not None:
            for signal in (job.succeeded, job.failed, job.cancelled, job.progressed):
                signal.disconnect()
            job.cancel()
            if wait:
                job.join()
        self._patience.stop()
        self.hide()

    def _progressed(self, share: float, text: str) -> None:
        self._bar.setValue(round(1000 * share))
        if self._cancel.isEnabled():
            self._text.setText(text or (self.job.title if self.job else ""))

    def _ended(self, job: Job) -> None:
        if job is self.job:
            self.job = None
            self._patience.stop()
            self.hide()
