"""What became of an export, as it matters: what went wrong, what to know, and which files there are."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

from PySide6.QtCore import QSize, Qt
from PySide6.QtWidgets import QFrame, QGridLayout, QScrollArea, QSizePolicy, QWidget

from app.lights import elided, label, set_property
from app.panels.panel import clear, column

LEAST_LINES = 3
"""Always kept free, so that nothing below moves as the work tells of itself."""


class ExportResult(QScrollArea):
    """Sentences, each in the colour of its kind, and the list of files; it scrolls where there is no room for all.

    state: how far the work is, or what went wrong. warnings: what to know of the files. notes: options that a format
    does not follow. written: that all is well with the files below it.
    """

    def __init__(self) -> None:
        super().__init__()
        self.state = label(wrap=True)
        self.warnings = label(wrap=True)
        self.notes = label(wrap=True)
        self.written = label(wrap=True)
        set_property(self.warnings, "level", "warning")
        set_property(self.written, "level", "good")
        body = QWidget()
        body.setObjectName("result")
        inside = column(body, 0, 6)
        inside.setContentsMargins(0, 0, 8, 0)  # from the scroll bar
        for said in (self.state, self.warnings, self.notes, self.written):
            said.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
            inside.addWidget(said)
        self._files = QGridLayout()
        self._files.setContentsMargins(0, 0, 0, 0)
        self._files.setHorizontalSpacing(12)
        self._files.setVerticalSpacing(1)
        self._files.setColumnStretch(0, 1)
        inside.addLayout(self._files)
        inside.addStretch(1)
        self.setWidget(body)
        self.setWidgetResizable(True)
        self.setFrameShape(QFrame.Shape.NoFrame)
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Expanding)
        self.setStyleSheet("QScrollArea, #result { background: transparent; }")
        self.viewport().setAutoFillBackground(False)
        self.say("", "")

    @property
    def text(self) -> str:
        """All that is said, a line for each sentence and file."""
        labels = (self.state, self.warnings, self.notes, self.written)
        return "\n".join([*(said.text() for said in labels if said.text()), *self.files])

    @property
    def files(self) -> list[str]:
        """The names in the list."""
        names = (self._files.itemAtPosition(line, 0) for line in range(self._files.rowCount()))
        return [item.widget().text() for item in names if item is not None]

    def say(self, text: str, level: str) -> None:
        """Nothing but this."""
        self.show_result(text, level, (), (), "", ())

    def show_result(
        self, text: str, level: str, warnings: Sequence[str], notes: Sequence[str], written: str, files: Sequence[Path]
    ) -> None:
        """text, level: what went wrong, or where the work is. written: said of the files."""
        set_property(self.state, "level", level)
        for said, words in (
            (self.state, text),
            (self.warnings, "\n".join(warnings)),
            (self.notes, "\n".join(notes)),
            (self.written, written),
        ):
            said.setText(words)
            said.setVisible(bool(words))
        clear(self._files)
        for i, path in enumerate(files):
            name = elided(path.name, mode=Qt.TextElideMode.ElideMiddle)
            name.setToolTip(str(path))
            size = label(_size(path), "muted")
            self._files.addWidget(name, i, 0)
            self._files.addWidget(size, i, 1, Qt.AlignmentFlag.AlignRight)
            for widget in (name, size):
                widget.show()  # at once, so that the room they need is known
        self.verticalScrollBar().setValue(0)

    def scroll_page(self, pages: int) -> None:
        """For keys."""
        bar = self.verticalScrollBar()
        bar.setValue(bar.value() + pages * bar.pageStep())

    def sizeHint(self) -> QSize:  # noqa: N802 (Qt's name)
        """Room for all of it."""
        body, least = self.widget(), self.minimumSizeHint()
        if body is None:
            return least
        layout = body.layout()
        layout.activate()
        return QSize(least.width(), max(layout.totalHeightForWidth(self.width()), least.height()))

    def minimumSizeHint(self) -> QSize:  # noqa: N802 (Qt's name)
        """Room for some lines, at any width."""
        return QSize(0, LEAST_LINES * self.fontMetrics().lineSpacing())


def _size(path: Path) -> str:
    try:
        n = path.stat().st_size
    except OSError:  # somebody has moved it already
        return ""
    if n < 1000:
        return f"{n} bytes"
    power = min(int(math.log10(n) // 3), 3)
    return f"{n / 1000**power:.1f} {('', 'kB', 'MB', 'GB')[power]}"
