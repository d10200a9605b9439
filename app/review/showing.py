"""The 3D view follows the player, and the player the clock."""

from __future__ import annotations

import time
from collections.abc import Callable

from PySide6.QtCore import QObject, Qt, QTimer

from app.notifications import NotificationCentre
from app.review.document import ReviewDocument
from app.review.player import Player
from app.viewport.viewport import Viewport
from core.errors import PhalanxError
from core.takes.holes import hole_words


class Showing(QObject):
    """Shows each frame once. document: the take that can be read now, None while there is none."""

    def __init__(
        self,
        player: Player,
        viewport: Viewport,
        document: Callable[[], ReviewDocument | None],
        notifications: NotificationCentre,
        parent: QObject,
    ) -> None:
        super().__init__(parent)
        self._player, self._viewport = player, viewport
        self._document, self._notifications = document, notifications
        self._shown: tuple[object, int] = (None, -1)
        self._last_tick_s = 0.0
        self._clock = QTimer(self, interval=round(1000 * viewport.period_s), timerType=Qt.TimerType.PreciseTimer)
        self._clock.timeout.connect(self._tick)
        player.subscribe(self._player_changed)

    def _player_changed(self) -> None:
        if self._player.playing and not self._clock.isActive():
            self._last_tick_s = time.monotonic()
            self._clock.start()
        self.show()

    def _tick(self) -> None:
        now_s = time.monotonic()
        elapsed_s, self._last_tick_s = now_s - self._last_tick_s, now_s
        self._player.advance(elapsed_s)
        if not self._player.playing:
            self._clock.stop()

    def forget(self) -> None:
        """Another take or solution: the frame of the same number is another one."""
        self._shown = (None, -1)

    def show(self) -> None:
        """The frame where the player stands, if it is not shown yet; in a hole that there is none, for a pose that is
        held looks like one that was there."""
        document, frame = self._document(), self._player.frame
        if document is None or not document.n_frames:
            return
        hole = document.holes.at(self._player.time_s)
        if hole is not None:
            frame = -2 - hole
        elif self._player.playing:
            frame = document.while_playing(frame)
        if (document.solved, frame) == self._shown:
            return
        if hole is not None:
            self._shown = (document.solved, frame)
            self._viewport.show_frame(None, None, None)
            self._viewport.show_empty("No frames", hole_words(document.holes, hole))
            return
        try:
            raw, solved = document.frame(frame)
        except (PhalanxError, OSError) as error:
            self._notifications.error(error, "Review", f"Reading frame {frame}")
            return
        self._shown = (document.solved, frame)
        self._viewport.show_frame(raw, solved, document.solved.cast if document.solved else None)
