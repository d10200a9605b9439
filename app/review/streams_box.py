"""The streams of the take under review: a line each."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QWidget

from app.lights import Light, elided, label
from app.panels.panel import clear, column, row
from app.review.take_streams import StreamRow

SOLVED, RECORDED = "solved", "recorded"


class StreamsBox(QWidget):
    """Not there for a take of one stream: all that is known of it is said of the take."""

    def __init__(self) -> None:
        super().__init__()
        self._layout = column(self, 0, 4)
        self._layout.addWidget(label("Streams", "section"))
        self._shown: tuple[StreamRow, ...] = ()
        self.hide()

    @property
    def lines(self) -> list[str]:
        """What stands there."""
        return [f"{one.name} {SOLVED if one.solved else RECORDED}: {one.words}" for one in self._shown]

    def show_streams(self, streams: Sequence[StreamRow]) -> None:
        """Those of another take."""
        if tuple(streams) == self._shown:
            return
        self._shown = tuple(streams)
        clear(self._layout, first=1)
        for one in streams:
            self._layout.addWidget(_line(one))
        self.setVisible(bool(streams))


def _line(stream: StreamRow) -> QWidget:
    light, name = Light(8), elided(stream.name, "", Qt.TextElideMode.ElideMiddle)
    light.set_level(stream.level)
    head = row(light, name, label(SOLVED if stream.solved else RECORDED, "small"))
    head.setStretch(1, 1)
    words = label(stream.words, "small", wrap=True)
    words.setContentsMargins(18, 0, 0, 0)
    made = QWidget()
    inside = column(made, 0, 0)
    inside.addLayout(head)
    inside.addWidget(words)
    made.setToolTip(stream.tip)
    return made
