"""Keys, in one place: the actions use them and the help lists them."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtGui import QIcon
from PySide6.QtWidgets import QDialog, QDialogButtonBox, QGridLayout, QVBoxLayout, QWidget

from app.lights import label

RECORD = "Ctrl+R"
MARK = "M"
LOOK_BACK = "Ctrl+Shift+R"
LIVE = "Ctrl+1"
REVIEW = "Ctrl+2"
CONNECT = "Ctrl+K"
SEARCH = "Ctrl+F"
FIT = "F"
FRONT = "1"
SIDE = "3"
TOP = "7"
FOLLOW = "H"
SKELETON = "B"
NAMES = "N"
DIGITS = "D"
UNDO = "Ctrl+Z"
REDO = "Ctrl+Shift+Z"
REDO_TOO = "Ctrl+Y"
OPEN_TAKE = "Ctrl+O"
IMPORT = "Ctrl+Shift+I"
QUIT = "Ctrl+Q"
SHORTCUTS = "F1"
PROP = "Ctrl+P"
HOLD = "P"

TABLE: tuple[tuple[str, tuple[tuple[str, str], ...]], ...] = (
    (
        "Recording",
        (
            (RECORD, "Record, stop"),
            (MARK, "Mark this moment"),
            (LOOK_BACK, "Save what just happened"),
            (CONNECT, "Connect, disconnect"),
            (SEARCH, "Search again"),
        ),
    ),
    (
        "View",
        (
            (FIT, "Fit to hands and props"), (FRONT, "Front"), (SIDE, "Side"), (TOP, "Top"),
            (FOLLOW, "Follow the hands"), (SKELETON, "Skeleton"), (NAMES, "Marker names"),
            (DIGITS, "Colour by digit"), ("Left drag", "Orbit"), ("Middle drag, Shift+left drag", "Pan"),
            ("Wheel", "Zoom"), (HOLD, "Hold the live view, go on"),
        ),
    ),
    (
        "Points",
        (
            ("Click", "Pick a point that is no hand's"), ("Shift+click", "One more, one less"),
            ("Ctrl+drag", "All in a rectangle"), ("Esc", "Pick nothing"), (PROP, "Make a prop of them"),
        ),
    ),
    (
        "Review",
        (
            ("Space", "Play, pause"), ("Left, Right", "Step one frame"), ("Shift+Left, Shift+Right", "Step ten frames"),
            ("Ctrl+Left, Ctrl+Right", "First, last frame"), ("I, O", "Go to in, out"),
            ("Ctrl+I, Ctrl+Shift+O", "Set in, out"), ("Ctrl+Backspace", "Clear in and out"), ("Ctrl+L", "Loop"),
            ("PgUp, PgDown", "Take before, after"), ("Ctrl+E", "Export"),
        ),
    ),
    (
        "Application",
        (
            (LIVE, "Live"), (REVIEW, "Review"), (OPEN_TAKE, "Open a take"),
            (IMPORT, "Import a recording"), (UNDO, "Undo"),
            (f"{REDO}, {REDO_TOO}", "Redo"), ("Enter", "Take what was typed; connect a device"),
            ("Esc", "Put back what was there"),
            (SHORTCUTS, "This list"), (QUIT, "Quit"),
        ),
    ),
)  # fmt: skip


class ShortcutsDialog(QDialog):
    """Help > Keyboard shortcuts."""

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self.setWindowTitle("Keyboard shortcuts")
        grid = QGridLayout()
        grid.setHorizontalSpacing(28)
        grid.setVerticalSpacing(4)
        for half, groups in enumerate((TABLE[:3], TABLE[3:])):
            line = 0
            for title, rows in groups:
                grid.addWidget(label(title, "heading"), line, half * 3, 1, 2)
                line += 1
                for keys, meaning in rows:
                    grid.addWidget(label(meaning, "muted"), line, half * 3)
                    grid.addWidget(label(keys), line, half * 3 + 1, Qt.AlignmentFlag.AlignRight)
                    line += 1
                grid.setRowMinimumHeight(line, 10)
                line += 1
        grid.setColumnMinimumWidth(2, 20)
        buttons = QDialogButtonBox(QDialogButtonBox.StandardButton.Close)
        buttons.button(QDialogButtonBox.StandardButton.Close).setIcon(QIcon())
        buttons.rejected.connect(self.close)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(20, 18, 20, 14)
        layout.addLayout(grid)
        layout.addWidget(buttons)
