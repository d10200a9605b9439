"""Every way in which others end the window: Ctrl+C, SIGTERM, a terminal that closes, the end of the desktop's session,
a display that goes away.

In each the take that runs is finished first. Only Ctrl+C asks, as the window's own button does, for it comes from the
operator; and it does not wait for an answer for ever.
"""

from __future__ import annotations

import math
import signal
import sys
import threading
import time
from collections.abc import Callable
from contextlib import ExitStack
from types import TracebackType
from typing import Any

from PySide6.QtCore import QTimer
from PySide6.QtWidgets import QApplication, QDialog, QMessageBox

from app.commands.terminal import say
from app.lost_display import display_watched
from app.main_window import MainWindow
from app.notifications import LOG
from app.signals import Asked, end_at_once, heard

ANSWER_S = 10.0
"""How long Ctrl+C waits for the answer to what the window asks before it closes [s]."""
LOG_OUT_S = 60.0
"""How long the end of the desktop's session is held up for a take that is being finished."""
_LOOK_MS = 100
_AT_ONCE_S = 2.0
"""The most that counts between two looks [s]: while the machine sleeps, or the window hangs, nobody can answer."""
_NESTED = 10
_TOLD = "told"
"""Property of a question: what it told before it counted."""


class WindowEnding:
    """While the block lasts, the window ends well, whoever ends it."""

    def __init__(self, window: MainWindow, display_gone: Callable[[], None] = lambda: None) -> None:
        """display_gone: called first when the display goes away, after which little can be done."""
        self._window, self._display_gone = window, display_gone
        self._asked = Asked()
        self._left_s, self._looked_s = 0.0, 0.0
        self._look = QTimer(window)
        self._look.timeout.connect(self._look_for_an_answer)
        self._stack = ExitStack()

    def __enter__(self) -> WindowEnding:
        application = QApplication.instance()
        assert isinstance(application, QApplication)
        application.commitDataRequest.connect(self.seal)
        application.aboutToQuit.connect(self.seal)
        self._stack.enter_context(heard(self._hear))
        self._stack.enter_context(_console_heard(self._console_closes))
        self._stack.enter_context(display_watched(self._display_lost))
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stack.close()
        if not self._window.ended:
            self._window.stop_and_close()

    # On the threads of the signals.

    def _hear(self, number: int) -> None:
        first = self._asked.when_s is None
        if self._asked.take(number):
            end_at_once(f"Ended at once by a second Ctrl+C. {self._left()}".rstrip())
        if number != signal.SIGINT:
            LOG.info("Asked to end by %s", signal.Signals(number).name)
            self._window.worker.later(self.end)
        elif first:
            LOG.info("Asked to end by Ctrl+C")
            self._window.worker.later(self.ask)

    def _left(self) -> str:
        return " ".join(
            f"Take {path} is not sealed: {take.on_disk}, which the next start offers."
            for path, take in self._window.worker.session.unsealed_numbers
        )

    def _console_closes(self) -> None:
        """The system ends this process when this returns, or some seconds after it began."""
        done = threading.Event()

        def seal() -> None:
            self.seal()
            done.set()

        self._window.worker.later(seal)
        done.wait(LOG_OUT_S)

    # On the window's.

    def _display_lost(self) -> None:
        LOG.error("The display has gone")
        self._display_gone()
        self._window.worker.session.seal(LOG_OUT_S)

    def ask(self) -> None:
        """Close as by the window's button; if that asks something which nobody answers, close all the same."""
        window = self._window
        if window.ended:
            doing = "; the take is being finished" if window.worker.session.unsealed else ""
            say(f"phalanx: It is closing{doing}. Ctrl+C again ends at once.")
            return
        self._left_s, self._looked_s = ANSWER_S, time.monotonic()
        if window.closing.may_lose:
            happens = self._happens()
            say(f"phalanx: The window asks. Without an answer in {ANSWER_S:.0f} s {happens}.")
            say("phalanx: Ctrl+C again ends at once.")
        self._look.start(_LOOK_MS)
        QTimer.singleShot(0, self._look_for_an_answer)  # with the question, not a moment after it
        window.close()
        self._stop_if_answered()

    def _look_for_an_answer(self) -> None:
        now_s = time.monotonic()
        self._left_s -= min(now_s - self._looked_s, _AT_ONCE_S)
        self._looked_s = now_s
        if self._stop_if_answered():
            return
        if self._left_s <= 0.0:
            LOG.info("Nobody answered for %g s", ANSWER_S)
            self.end()
        else:
            self._count_down()

    def _stop_if_answered(self) -> bool:
        """Whether the question was answered so that the window stays."""
        if self._window.ended or self._window.closing.asking:
            return False
        self._look.stop()
        self._asked = Asked()
        return True

    def _count_down(self) -> None:
        """The question says how long there is to answer it."""
        box = QApplication.activeModalWidget()
        if not isinstance(box, QMessageBox):
            return
        told = box.property(_TOLD)
        if told is None:
            told = box.informativeText()
            box.setProperty(_TOLD, told)
        text = f"Without an answer {self._happens()} in {math.ceil(self._left_s)} s."
        text = f"{told}\n\n{text}" if told else text
        if text != box.informativeText():
            box.setInformativeText(text)

    def _happens(self) -> str:
        """What is done if nobody answers."""
        done = self._window.closing.may_lose
        return f"{', '.join(done)} and Phalanx closes" if done else "Phalanx closes"

    def end(self) -> None:
        """Close without a question; a take that runs is finished, and said to be while that takes its time."""
        self._look.stop()
        if self._window.ended:
            return
        for _ in range(_NESTED):  # a question leaves its own loop, and what it was asked for does not happen
            dialog = QApplication.activeModalWidget()
            if dialog is None:
                break
            dialog.done(0) if isinstance(dialog, QDialog) else dialog.close()
        self._window.stop_and_close()
        QApplication.exit(0)

    def seal(self, manager: Any = None) -> None:
        """Finish the take that runs and wait for it: this process may be ended as soon as this returns. The window
        stays, for the end of the session may be called off."""
        session = self._window.worker.session
        if session.unsealed:
            LOG.info("Finishing the take before the end")
            session.seal(LOG_OUT_S)


def _console_heard(closes: Callable[[], None]) -> ExitStack:
    """Windows: `closes` is called, on a thread of the system's, when the console is closed, or the user logs out."""
    stack = ExitStack()
    if sys.platform == "win32":
        import ctypes

        close, log_off, shut_down = 2, 5, 6  # CTRL_CLOSE_EVENT, CTRL_LOGOFF_EVENT, CTRL_SHUTDOWN_EVENT

        @ctypes.WINFUNCTYPE(ctypes.c_int, ctypes.c_uint)
        def handler(event: int) -> int:
            if event not in (close, log_off, shut_down):
                return 0
            closes()
            return 1

        kernel = ctypes.windll.kernel32
        kernel.SetConsoleCtrlHandler(handler, 1)
        stack.callback(kernel.SetConsoleCtrlHandler, handler, 0)
    return stack
