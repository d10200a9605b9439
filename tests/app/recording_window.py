"""The real application, in a process of its own: it connects to a server and records, for tests of how it is ended.

Says `recording TAKE` once frames are in the take; then does what the lines of standard input say (see `ORDERS`).
"""

from __future__ import annotations

import ctypes
import sys
import threading

import shiboken6
from PySide6.QtCore import QTimer
from PySide6.QtWidgets import QApplication, QMessageBox, QProgressDialog

from app.application import run
from app.main_window import MainWindow
from devices.natnet.client import NatNetDevice
from tests.hanging_disk import HangingDisk

ENOUGH = 60


def _say(text: str) -> None:
    print(text, flush=True)


def log_out() -> None:
    """What Qt does when the session manager of the desktop, or Windows, says that the session ends."""
    (application,) = shiboken6.getCppPointer(QApplication.instance())
    private = ctypes.cast(application, ctypes.POINTER(ctypes.c_void_p))[1]  # behind the table of its functions
    commit = ctypes.CDLL("libQt6Gui.so.6")["_ZN22QGuiApplicationPrivate10commitDataEv"]
    commit.argtypes = [ctypes.c_void_p]
    commit(private)


def say_what_is_left(window: MainWindow) -> None:
    """As soon as the window shows it."""
    left = window.left_behind
    if left.dialog is None or not left.dialog.isVisible():
        QTimer.singleShot(100, lambda: say_what_is_left(window))
        return
    faults, takes = [run.fault for run in left.found.faults], [take.path.name for take in left.found.takes]
    finished = [take.name for run in left.found.displays for take in run.finished]
    _say(f"shown {faults} {takes} {finished}")


def say_question(window: MainWindow) -> None:
    """What the window asks."""
    box = QApplication.activeModalWidget()
    _say(f"asked {box.text()} {box.informativeText()!r}" if isinstance(box, QMessageBox) else "asked nothing")


def say_what_is_waited_for(window: MainWindow) -> None:
    """As soon as the window that closes says how much of the take is on the disk."""
    dialogs = [one for one in QApplication.topLevelWidgets() if isinstance(one, QProgressDialog)]
    labels = [one.labelText().replace("\n", " ") for one in dialogs if "on the disk" in one.labelText()]
    if labels:
        _say(f"waits {labels[0]}")
    else:
        QTimer.singleShot(100, lambda: say_what_is_waited_for(window))


def hang(window: MainWindow) -> None:
    """The disk answers no more."""
    DISK[0].hangs = lambda: True


ORDERS = {
    "close": lambda window: window.close(),
    "end": lambda window: window.stop_and_close(),
    "log out": lambda window: log_out(),
    "quit": lambda window: QApplication.exit(0),  # as the system does, past every question
    "left": say_what_is_left,
    "question": say_question,
    "waits": say_what_is_waited_for,
    "hang": hang,
}
DISK: list[HangingDisk] = []
"""Under the take, where a test asks for one."""


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
    if "hanging" in sys.argv[3:]:
        DISK.append(HangingDisk(lambda: False))
    operator = Operator(int(sys.argv[1]), int(sys.argv[2]))
    looking = QTimer()
    looking.timeout.connect(operator.look)
    looking.start(50)
    sys.exit(run())
