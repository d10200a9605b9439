"""The real application, in a process of its own: it connects to a server and records, for tests of how it is ended.

Says `recording TAKE` once frames are in the take; then does what the lines of standard input say (see `ORDERS`).
"""

from __future__ import annotations

import ctypes
import sys
import threading

from PySide6.QtCore import QTimer
from PySide6.QtWidgets import QApplication

from app.application import run
from app.main_window import MainWindow
from devices.natnet.client import NatNetDevice

ENOUGH = 60
ORDERS = {
    "close": lambda window: window.close(),
    "log out": lambda window: QApplication.instance().commitDataRequest.emit(None),
    "quit": lambda window: QApplication.exit(0),  # as the system does, past every question
    "crash": lambda window: ctypes.string_at(0),
}


def _say(text: str) -> None:
    print(text, flush=True)


class Operator:
    """Looks at the window now and then, and does the next step."""

    def __init__(self, command_port: int, data_port: int) -> None:
        self._ports = {"command_port": command_port, "data_port": data_port}
        self._window: MainWindow | None = None
        self._begun = self._said = False

    def look(self) -> None:
        if self._window is None:
            self._window = next((w for w in QApplication.topLevelWidgets() if isinstance(w, MainWindow)), None)
            if self._window is not None:
                stream = self._window.devices.add(
                    NatNetDevice, {"server": "127.0.0.1", "local": "127.0.0.1", **self._ports}
                )
                self._window.worker.connect_device(stream)
            return
        session = self._window.worker.session
        if not self._begun and self._window.record_action.isEnabled():
            self._begun = True
            self._window.record_action.trigger()
        recording = session.numbers().recording
        if not self._said and recording is not None and recording.received >= ENOUGH:
            self._said = True
            _say(f"recording {recording.path}")
            threading.Thread(target=self._obey, daemon=True).start()

    def _obey(self) -> None:
        for line in sys.stdin:
            order = ORDERS[line.strip()]
            self._window.worker.later(lambda order=order: (_say("obeyed"), order(self._window)))


if __name__ == "__main__":
    application = QApplication(sys.argv[:1])
    operator = Operator(int(sys.argv[1]), int(sys.argv[2]))
    looking = QTimer()
    looking.timeout.connect(operator.look)
    looking.start(50)
    sys.exit(run())
