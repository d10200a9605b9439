"""The end of the window's session: it waits for the take, and not for a disk that hangs."""

from __future__ import annotations

import threading

from PySide6.QtCore import QEventLoop, QTimer
from PySide6.QtWidgets import QProgressDialog, QWidget

from app.session import Session
from app.worker import SessionWorker
from core.printable import printable

PATIENCE_MS = 700
GIVE_UP = "Close without waiting"


def finish(window: QWidget, worker: SessionWorker, title: str) -> None:
    """End the session off this thread; the window says so if a long take takes its time to be finished, and how much
    of it is safe if its disk does not answer: closing without it is offered then."""
    worker.pause()
    closing = threading.Thread(target=worker.close, name="phalanx-closing", daemon=True)
    closing.start()
    progress = QProgressDialog(_what_is_done(worker.session), "", 0, 0, window)
    progress.setWindowTitle(title)
    progress.setCancelButton(None)
    progress.setMinimumDuration(PATIENCE_MS)
    progress.canceled.connect(worker.give_up)
    loop, timer, offered = QEventLoop(), QTimer(), False

    def look() -> None:
        nonlocal offered
        if not closing.is_alive():
            loop.quit()
            return
        stalled = _what_hangs(worker.session)
        progress.setLabelText(stalled or _what_is_done(worker.session))
        if not stalled:
            return
        if not offered:
            offered = True
            progress.setCancelButtonText(GIVE_UP)
        if not progress.isVisible() and not progress.wasCanceled():  # Escape answers nothing
            progress.show()

    timer.timeout.connect(look)
    timer.start(20)
    loop.exec()
    progress.reset()


def _what_is_done(session: Session) -> str:
    return "Finishing the take…" if session.unsealed else "Closing…"


def _what_hangs(session: Session) -> str:
    """The disk that is waited for, and what that means for a take; "" for none."""
    numbers = session.numbers()
    take = next((take for take in numbers.sealing if take.stalled_s), None)
    if take is not None:
        return (
            f"The disk has not answered for {take.stalled_s:.0f} s, and take {take.name} is not finished.\n"
            f"{take.on_disk}."
        )
    opening = numbers.opening
    if opening is not None and opening.stalled:
        waited = f"The disk of {printable(opening.folder)} has not answered for {opening.seconds:.0f} s."
        return f"{waited}\nNo take has begun: there is nothing to save."
    return ""
