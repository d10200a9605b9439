"""Which optical stream the hands are solved from, as a list to choose from."""

from __future__ import annotations

from PySide6.QtCore import QTimer, Signal
from PySide6.QtWidgets import QComboBox, QWidget

from app.editing import leave_wheel_to_panel, list_open
from app.lights import label
from app.live_streams import stream_title
from app.panels.panel import row
from app.texts import give_way
from app.undo import UndoStack
from app.worker import SessionWorker

TIP = (
    "Which optical stream the hands are solved from. Every connected stream is recorded, whichever is chosen.\n"
    "The first that is connected, until another is chosen. Locked while recording."
)


class SolvedStream(QWidget):
    """There only where there is a choice: several optical streams are armed. Locked while recording."""

    def __init__(self, worker: SessionWorker, undo: UndoStack) -> None:
        super().__init__()
        self._worker, self._undo = worker, undo
        self.choice = _Choice()
        self.choice.setToolTip(TIP)
        self.choice.activated.connect(lambda index: self.choose(self.choice.itemData(index)))
        self.choice.left.connect(self._list)
        name = label("Solved from", "muted")
        name.setToolTip(TIP)
        line = row(name, self.choice)
        line.setStretch(1, 1)
        self.setLayout(line)
        for changed in (worker.devices_changed, worker.solving_changed):
            changed.connect(lambda *_: self._list())
        worker.recording_changed.connect(self.choice.setDisabled)
        self._list()

    def choose(self, key: str) -> None:
        """Solve another stream, as one step that can be undone."""
        before = self._worker.session.solving
        if key != before:
            title = self.choice.itemText(self.choice.findData(key))
            self._undo.change(
                f"solve from {title}", lambda: self._worker.solve(key), lambda: self._worker.solve(before)
            )
        self._list()  # it may have been refused

    def _list(self) -> None:
        if list_open(self.choice):
            return
        session = self._worker.session
        optical = [one for one in session.streams if one.optical]
        self.choice.clear()
        for one in optical:
            self.choice.addItem(stream_title(one.info, one.receiver), one.key)
        self.choice.setCurrentIndex(self.choice.findData(session.solving))
        self.setVisible(len(optical) > 1)


class _Choice(QComboBox):
    """Tells when its list is closed: what came meanwhile is shown then."""

    left = Signal()

    def __init__(self) -> None:
        super().__init__()
        leave_wheel_to_panel(give_way(self))

    def hidePopup(self) -> None:  # noqa: N802
        super().hidePopup()
        QTimer.singleShot(0, self, self.left.emit)
