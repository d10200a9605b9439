"""One place where everything worth telling the operator passes. Knows no window: the command line uses it too."""

from __future__ import annotations

import logging
import threading
import time
import traceback
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace
from datetime import datetime
from enum import Enum
from logging.handlers import RotatingFileHandler
from pathlib import Path

import platformdirs

from core.errors import PhalanxError
from core.printable import MOST_OF_TEXT, printable, printable_lines

LOG = logging.getLogger("phalanx")
LOG.addHandler(logging.NullHandler())
REPEAT_WINDOW_S = 10.0
HISTORY = 2000


class Severity(Enum):
    """How much a message matters; the colours are those of the lights."""

    INFO = "info"
    WARNING = "warning"
    PROBLEM = "problem"


@dataclass(frozen=True)
class Notification:
    """One message. number: identifies it; a repeat carries the number of the first and a higher count.

    text: what happened. action: what to do about it. source: the part that speaks. details: a traceback, for the
    log and for those who ask. settles: what its source warned of last is over.
    """

    number: int
    severity: Severity
    text: str
    action: str = ""
    source: str = ""
    details: str = ""
    count: int = 1
    time: datetime = datetime.min
    settles: bool = False

    @property
    def line(self) -> str:
        """The message on one line, as the status bar and the command line show it."""
        return f"{self.text} {self.action}".strip()


Subscriber = Callable[[Notification], None]


class NotificationCentre:
    """Collects messages from any thread and hands them to subscribers, in the thread that sent them.

    The same text within ten seconds is the same message, counted: a fault at every frame is told once.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._history: deque[Notification] = deque(maxlen=HISTORY)
        self._recent: dict[tuple[Severity, str], tuple[float, Notification]] = {}
        self._subscribers: list[Subscriber] = []
        self._next = 1

    @property
    def history(self) -> list[Notification]:
        """Every message kept, oldest first."""
        with self._lock:
            return list(self._history)

    def clear(self) -> None:
        """Forget the messages kept."""
        with self._lock:
            self._history.clear()
            self._recent.clear()

    def subscribe(self, subscriber: Subscriber) -> Callable[[], None]:
        """Call `subscriber` for every message from now on. Returns what ends the subscription."""
        with self._lock:
            self._subscribers.append(subscriber)

        def unsubscribe() -> None:
            with self._lock:
                if subscriber in self._subscribers:
                    self._subscribers.remove(subscriber)

        return unsubscribe

    def info(self, text: str, action: str = "", source: str = "", settles: bool = False) -> None:
        """Something worth knowing. settles: what this source warned of last is over."""
        self._publish(Severity.INFO, text, action, source, "", settles)

    def warning(self, text: str, action: str = "", source: str = "") -> None:
        """Something that may become a problem."""
        self._publish(Severity.WARNING, text, action, source, "")

    def problem(self, text: str, action: str = "", source: str = "") -> None:
        """Something is wrong."""
        self._publish(Severity.PROBLEM, text, action, source, "")

    def error(self, error: BaseException, source: str = "", doing: str = "") -> None:
        """An exception, as what, why and what to do; the traceback goes to the log."""
        details = "".join(traceback.format_exception(error))
        if isinstance(error, PhalanxError):
            text, action = error.what, error.action
            if error.__cause__ is None:
                details = ""  # a refusal, in words; where in the program it was refused helps nobody
        else:
            text = f"{doing or 'Something'} failed: {str(error) or type(error).__name__}."
            action = "The details are in the log file (Help > Open log folder)."
        self._publish(Severity.PROBLEM, text, action, source, details)

    def _publish(
        self, severity: Severity, text: str, action: str, source: str, details: str, settles: bool = False
    ) -> None:
        text, action = printable(text, MOST_OF_TEXT), printable(action, MOST_OF_TEXT)
        source, details = printable(source), printable_lines(details)
        now = time.monotonic()
        with self._lock:
            seen = self._recent.get((severity, text))
            if seen is not None and now - seen[0] < REPEAT_WINDOW_S:
                note = replace(seen[1], count=seen[1].count + 1)
                for i in range(len(self._history) - 1, -1, -1):
                    if self._history[i].number == note.number:
                        self._history[i] = note
                        break
                self._recent[severity, text] = (seen[0], note)
            else:
                note = Notification(self._next, severity, text, action, source, details, 1, datetime.now(), settles)
                self._next += 1
                self._history.append(note)
                self._recent[severity, text] = (now, note)
                if len(self._recent) > HISTORY:
                    self._recent.clear()
            subscribers = list(self._subscribers)
        if note.count == 1:
            level = {Severity.INFO: logging.INFO, Severity.WARNING: logging.WARNING}.get(severity, logging.ERROR)
            LOG.log(level, "%s%s%s", f"{source}: " if source else "", note.line, f"\n{details}" if details else "")
        for subscriber in subscribers:
            try:
                subscriber(note)
            except Exception:
                LOG.exception("A subscriber to messages failed")


class _Printable(logging.Formatter):
    """A log that can be read in a terminal. Whatever comes after the first line of a message is set in, so that no
    text from elsewhere looks like a message of its own."""

    def format(self, record: logging.LogRecord) -> str:
        return printable_lines(super().format(record)).replace("\n", "\n    ")


def log_folder() -> Path:
    """Where the log file is kept."""
    return Path(platformdirs.user_log_path("phalanx", appauthor=False))


def start_log(folder: Path | None = None) -> Path | None:
    """Write the log to a file of at most 2 MB, with two older ones kept. None if the folder cannot be written."""
    path = (folder or log_folder()) / "phalanx.log"
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handler = RotatingFileHandler(path, maxBytes=2_000_000, backupCount=2, encoding="utf-8")
    except OSError:
        return None
    handler.setFormatter(_Printable("%(asctime)s %(levelname)s %(threadName)s %(message)s"))
    LOG.addHandler(handler)
    LOG.setLevel(logging.INFO)
    return path
