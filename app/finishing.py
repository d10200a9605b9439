"""The end of the window's session: it waits for the take, and not for a disk that hangs."""

from __future__ import annotations

import threading

from PySide6.QtCore import QEventLoop, QTimer
from PySide6.QtWidgets import QProgressDialog, QWidget

from app.worker import SessionWorker

PATIENCE_MS = 700
GIVE_UP = "Close without waiting"


def finish(window: QWidget, worker: SessionWorker, title: str) -> None:
    """End the session off this thread; the window says so if a long take takes its time to be finished, and how much
    of it is safe if its disk does not answer: closing without it is offered then."""
    worker.pause()
    closing = threading.Thread(target=worker.close, name="phalanx-closing", daemon=True)
    closing.start()
    progress = QProgressDialog("Finishing the take…", "", 0, 0, window)
    progress.setWindowTitle(title)
    progress.setCancelButton(None)
    progress.setMinimumDuration(PATIENCE_MS)
    progress.canceled.connect(worker.session.give_up_finishing)
    loop, timer, offered = QEventLoop(), QTimer(), False

    def look() -> None:
        nonlocal offered
        if not closing.is_alive():
            loop.quit()
            return
        stalled = next((take for take in worker.session.numbers().sealing if take.stalled_s), None)
        if stalled is None:
            progress.setLabelText("Finishing the take…")
            return
        progress.setLabelText(
            f"The disk has not answered for {stalled.stalled_s:.0f} s, and take {stalled.name} is not finished.\n"
            f"{stalled.on_disk}."
        )
        if not offered:
            offered = True
            progress.setCancelButtonText(GIVE_UP)
        if not progress.isVisible() and not progress.wasCanceled():  # Escape answers nothing
            progress.show()

    timer.timeout.connect(look)
    timer.start(20)
    loop.exec()
    progress.reset()
