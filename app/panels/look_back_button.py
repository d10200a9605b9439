"""The button that saves what just happened."""

from __future__ import annotations

import math
from datetime import datetime, timedelta

from PySide6.QtGui import QAction
from PySide6.QtWidgets import QPushButton

from app import shortcuts
from app.look_back import LOOK_BACK_S

SILENT_S = 2.0
"""Without frames for so long it is said up to when they are kept [s]."""


class LookBackButton(QPushButton):
    """Saves what just happened, and says how much of that there is."""

    def __init__(self, action: QAction) -> None:
        super().__init__()
        self._said: tuple[int, str] | None = None
        self.clicked.connect(action.trigger)
        self._action = action
        self.show_kept(0.0, math.inf)
        self.setFixedWidth(self.fontMetrics().horizontalAdvance(_last(round(LOOK_BACK_S))) + 26)

    def show_kept(self, seconds: float, silent_s: float) -> None:
        """seconds: how much there is. silent_s: since the last frame, infinite if none came [s]."""
        ended = "" if silent_s < SILENT_S or not math.isfinite(silent_s) else f"{_ago(silent_s):%H:%M:%S}"
        said = round(seconds) if math.isfinite(silent_s) else -1, ended
        if said == self._said:
            return
        self._said = said
        self.setText(_last(max(said[0], 0)))
        key = shortcuts.LOOK_BACK
        if said[0] < 0:
            tip = f"Save what just happened ({key}): once a device is connected, its last {LOOK_BACK_S:g} s."
        else:
            of = f"the {said[0]} s up to {ended}, when the last frame came" if ended else f"the last {said[0]} s"
            tip = (
                f"Save what just happened ({key}): {of}, of every device, as a take of its own, while one is recorded "
                "as well. Its frames are on the disk at once, then it is solved."
            )
        self.setToolTip(tip)
        self._action.setToolTip(tip)


def _last(seconds: int) -> str:
    return f"Save last {seconds} s"


def _ago(seconds: float) -> datetime:
    return datetime.now() - timedelta(seconds=seconds)
