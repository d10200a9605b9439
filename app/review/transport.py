"""The transport: play, step, range, loop, speed, and where the playhead is."""

from __future__ import annotations

from PySide6.QtCore import QSize, Qt
from PySide6.QtGui import QAction, QKeySequence
from PySide6.QtWidgets import QComboBox, QFrame, QLabel, QToolButton, QWidget

from app import theme
from app.editing import leave_wheel_to_panel
from app.lights import elided, label
from app.panels.panel import row
from app.review.lanes import clock
from app.review.player import SPEEDS, Player
from app.review.range_steps import RangeSteps

_ICON_PX = 14


class Transport(QWidget):
    """Buttons and keys of a player. The keys work wherever `keys_for` or a child of it has the focus."""

    def __init__(self, player: Player, ranges: RangeSteps, keys_for: QWidget) -> None:
        super().__init__(keys_for)
        self._player = player
        self._keys_for = keys_for
        self.play = self._action("Play", "Space", player.toggle, "play")
        self.loop = self._action("Loop between in and out", "Ctrl+L", None, "loop")
        self.loop.setCheckable(True)
        self.loop.toggled.connect(player.set_loop)
        moves = (
            self._action("First frame", "Ctrl+Left", player.go_to_start, "to_start"),
            self._action("One frame back", "Left", lambda: player.step(-1), "step_back"),
            self.play,
            self._action("One frame on", "Right", lambda: player.step(1), "step_forward"),
            self._action("Last frame", "Ctrl+Right", player.go_to_end, "to_end"),
            self.loop,
        )
        ranges = (
            self._action("Set in", "Ctrl+I", ranges.set_in, text="In"),
            self._action("Set out", "Ctrl+Shift+O", ranges.set_out, text="Out"),
            self._action("Play the whole take again", "Ctrl+Backspace", ranges.clear, text="All"),
        )
        self._action("Go to in", "I", player.go_to_in)
        self._action("Go to out", "O", player.go_to_out)
        self._action("Ten frames back", "Shift+Left", lambda: player.step(-10))
        self._action("Ten frames on", "Shift+Right", lambda: player.step(10))

        self.speed = leave_wheel_to_panel(QComboBox())
        self.speed.setToolTip("Playback speed.")
        for speed in SPEEDS:
            self.speed.addItem(f"{speed:g}×", speed)
        self.speed.setCurrentIndex(SPEEDS.index(1.0))
        self.speed.currentIndexChanged.connect(lambda i: player.set_speed(SPEEDS[i]))
        self.speed.setFocusPolicy(Qt.FocusPolicy.NoFocus)

        self._time = label("", "number")
        self._time.setMinimumWidth(96)
        self._whole = label("", "muted")
        self._whole.setMinimumWidth(86)
        self._whole.setToolTip("Frame shown and last frame.")
        self._range = elided("", "muted")
        self._range.setFixedWidth(self._range.fontMetrics().horizontalAdvance("00000–00000") + 4)
        self.layout_row = row(
            self._time, self._whole, _rule(), *map(self._button, moves), self.speed, _rule(),
            *map(self._button, ranges), self._range, None, spacing=4,
        )  # fmt: skip
        self.layout_row.setContentsMargins(12, 4, 12, 4)
        self.setLayout(self.layout_row)
        player.subscribe(self._show)
        self._show()

    def add_at_end(self, *widgets: QWidget) -> None:
        """Buttons of others, at the right."""
        for widget in widgets:
            self.layout_row.addWidget(widget)

    def _action(self, tip: str, keys: str, do: object, icon: str = "", text: str = "") -> QAction:
        action = QAction(text or tip, self._keys_for)
        action.setShortcut(QKeySequence(keys))
        action.setShortcutContext(Qt.ShortcutContext.WidgetWithChildrenShortcut)
        action.setToolTip(f"{tip} ({keys})")
        if icon:
            action.setIcon(theme.icon(icon))
        if do is not None:
            action.triggered.connect(lambda _=False: do())  # type: ignore[operator]
        self._keys_for.addAction(action)
        return action

    def _button(self, action: QAction) -> QToolButton:
        button = QToolButton()
        button.setDefaultAction(action)
        button.setIconSize(QSize(_ICON_PX, _ICON_PX))
        button.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        button.setProperty("flat", True)
        return button

    def _show(self) -> None:
        player = self._player
        self.setEnabled(player.n_frames > 0)
        last = max(player.n_frames - 1, 0)
        set_text(self._time, clock(player.time_s, 2))
        set_text(self._whole, f"{player.frame} / {last}")
        set_text(self._range, f"{player.in_frame}–{player.out_frame}" if player.ranged else "")
        words = "Pause" if player.playing else "Play"
        if self.play.text() != words:
            self.play.setText(words)
            self.play.setToolTip(f"{words} (Space)")
            self.play.setIcon(theme.icon(words.lower()))


def set_text(widget: QLabel, text: str) -> None:
    """Change a label only if it says something else: a text laid out again costs time."""
    if widget.text() != text:
        widget.setText(text)


def _rule() -> QFrame:
    rule = QFrame()
    rule.setFrameShape(QFrame.Shape.VLine)
    rule.setStyleSheet(f"color: {theme.LINE}; margin: 4px 4px;")
    return rule
