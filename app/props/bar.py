"""What can be done with the points picked, at the foot of the 3D view."""

from __future__ import annotations

from PySide6.QtCore import QEvent, QObject, Qt, QTimer, Signal
from PySide6.QtWidgets import QFrame, QPushButton

from app import shortcuts
from app.lights import label, set_property
from app.panels.panel import row
from app.props.picker import PointPicker
from core.props.prop import LEAST_MARKERS, MOST_MARKERS

_FOOT_PX = 14
_HINT_MS = 4000


class SelectionBar(QFrame):
    """Shown while points are picked, while the view is held, and for a moment when a click was refused."""

    make_asked = Signal()
    hold_asked = Signal()

    def __init__(self, picker: PointPicker, live: bool) -> None:
        super().__init__(picker.viewport)
        self.setObjectName("card")
        self.setAttribute(Qt.WidgetAttribute.WA_StyledBackground)
        self._picker, self._live, self._held, self._hint = picker, live, False, ""
        self.words = label()
        self.hold = QPushButton("Hold the view")
        self.hold.clicked.connect(self.hold_asked)
        self.make = QPushButton("Make a prop…")
        self.make.clicked.connect(self.make_asked)
        self.clear = QPushButton("Clear")
        self.clear.setToolTip("Pick nothing (Esc).")
        self.clear.clicked.connect(picker.clear)
        line = row(self.words, self.hold, self.make, self.clear, spacing=8)
        line.setContentsMargins(12, 6, 8, 6)
        self.setLayout(line)
        for button in (self.hold, self.make, self.clear):
            button.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self._forget = QTimer(self, singleShot=True, interval=_HINT_MS)
        self._forget.timeout.connect(lambda: self._say_hint(""))
        picker.changed.connect(self._picked)
        picker.refused.connect(self._say_hint)
        picker.viewport.installEventFilter(self)
        self._show_all()

    def show_held(self, held: bool) -> None:
        """The live view stands still, or no longer."""
        self._held = held
        self._show_all()

    def _picked(self) -> None:
        self._hint = ""
        self._show_all()

    def _say_hint(self, hint: str) -> None:
        self._hint = hint
        if hint:
            self._forget.start()
        self._show_all()

    def _show_all(self) -> None:
        rows = self._picker.rows
        n, missing = len(rows), sum(row < 0 for row in rows)
        words = ["View held, tracking goes on"] if self._held else []
        if self._hint:
            words.append(self._hint)
        elif n:
            words.append("1 point picked" if n == 1 else f"{n} points picked")
            if missing:
                words.append(f"{missing} not in this frame")
            elif n < LEAST_MARKERS:
                words.append(f"a prop takes {LEAST_MARKERS} or more: Shift+click, or Ctrl+drag around them")
        self.words.setText(" · ".join(words))
        set_property(self.words, "level", "warning" if self._held or missing or self._hint else "")
        able = LEAST_MARKERS <= n <= MOST_MARKERS and not missing
        self.make.setEnabled(able)
        self.make.setToolTip(
            f"Make the picked points the markers of a prop ({shortcuts.PROP})."
            if able
            else f"Pick {LEAST_MARKERS} to {MOST_MARKERS} points that are all in this frame."
        )
        self.make.setVisible(n > 0)
        self.clear.setVisible(n > 0)
        self.hold.setVisible(self._live and (n > 0 or self._held))
        self.hold.setText("Go on" if self._held else "Hold the view")
        self.hold.setToolTip(
            f"Show what comes in again ({shortcuts.HOLD})."
            if self._held
            else f"Let the picture stand still, to pick at ease; tracking and recording go on ({shortcuts.HOLD})."
        )
        self.setVisible(bool(words))
        self._place()

    def _place(self) -> None:
        self.adjustSize()
        around = self._picker.viewport
        self.move((around.width() - self.width()) // 2, around.height() - self.height() - _FOOT_PX)
        self.raise_()

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:  # noqa: N802 (Qt's name)
        """Stays at the foot of the view."""
        if event.type() == QEvent.Type.Resize:
            self._place()
        return False
