"""The job that runs: what, how far, and cancel."""

from __future__ import annotations

from PySide6.QtCore import QEvent, QObject, Qt, QTimer
from PySide6.QtWidgets import QFrame, QProgressBar, QPushButton, QWidget

from app.lights import elided
from app.panels.panel import row
from app.review.job import Job

_PATIENCE_MS = 250
_BAR_PX, _WIDEST_PX, _MARGIN_PX = 120, 620, 10


class JobBar(QFrame):
    """One job at a time; shown only if it takes longer than a moment.

    It lies over the 3D view, at its top left, so that nothing moves when it comes and goes. line: 0 is the topmost.
    """

    def __init__(self, over: QWidget, line: int = 0) -> None:
        super().__init__(over)
        self.setObjectName("card")
        self.setAttribute(Qt.WidgetAttribute.WA_StyledBackground)
        self.job: Job | None = None
        self._line = line
        self._text = elided("", "small", Qt.TextElideMode.ElideMiddle)
        self._bar = QProgressBar()
        self._bar.setRange(0, 1000)
        self._bar.setTextVisible(False)
        self._bar.setFixedWidth(_BAR_PX)
        self._cancel = QPushButton("Cancel")
        self._cancel.clicked.connect(self.cancel)
        inside = row(self._text, self._bar, self._cancel)
        inside.setStretch(0, 1)
        inside.setContentsMargins(12, 4, 8, 4)
        self.setLayout(inside)
        over.installEventFilter(self)
        self._patience = QTimer(self, singleShot=True, interval=_PATIENCE_MS)
        self._patience.timeout.connect(self._appear)
        self.hide()

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:  # noqa: N802 (Qt's name)
        """As wide as there is room for."""
        if event.type() == QEvent.Type.Resize and self.isVisible():
            self._place()
        return super().eventFilter(watched, event)

    def _appear(self) -> None:
        self._place()
        self.show()
        self.raise_()

    def _place(self) -> None:
        height = self.sizeHint().height()
        width = min(self.parentWidget().width() - 2 * _MARGIN_PX, _WIDEST_PX)
        self.setGeometry(_MARGIN_PX, _MARGIN_PX + self._line * (height + 6), width, height)

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
