"""The streams of a device that sends several: a light, a reason and a role for each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from PySide6.QtWidgets import QGridLayout, QWidget

from app.lights import Light, elided, label, set_property
from app.live_streams import LEFT_OUT, ROLE_TIPS
from devices.device import Health, Level


@dataclass(frozen=True)
class StreamState:
    """One of them, now. name: as its device calls it. role: of app.live_streams."""

    name: str
    health: Health
    role: str


class StreamLines(QWidget):
    """A line each, and nothing for a device of one stream, whose card says it."""

    def __init__(self) -> None:
        super().__init__()
        self._grid = QGridLayout(self)
        self._grid.setContentsMargins(18, 2, 0, 2)
        self._grid.setHorizontalSpacing(8)
        self._grid.setVerticalSpacing(3)
        self._grid.setColumnStretch(2, 1)
        self.lines: list[StreamLine] = []
        self.hide()

    def show_streams(self, streams: Sequence[StreamState]) -> None:
        """How they are now."""
        while len(self.lines) > len(streams):
            self.lines.pop().leave()
        while len(self.lines) < len(streams):
            self.lines.append(StreamLine(self._grid, len(self.lines)))
        for line, stream in zip(self.lines, streams, strict=True):
            line.show_stream(stream)
        self.setVisible(bool(streams))


class StreamLine:
    """What has no room is in the tooltip: nothing around it moves when a stream falls silent."""

    def __init__(self, grid: QGridLayout, line: int) -> None:
        self.light, self.name, self.state, self.role = Light(8), elided(), elided("", "muted"), label("", "small")
        for column, widget in enumerate(self._widgets):
            grid.addWidget(widget, line, column)

    @property
    def _widgets(self) -> tuple[QWidget, ...]:
        return self.light, self.name, self.state, self.role

    def show_stream(self, stream: StreamState) -> None:
        """How it is now."""
        health, well = stream.health, stream.health.level is Level.GOOD
        self.light.set_level(health.level)
        self.name.setText(stream.name)
        self.state.setText(f"{health.rate_hz:.1f} Hz" if well and health.rate_hz > 0 else health.reason)
        self.state.setToolTip(health.reason)
        set_property(self.state, "level", "" if well else health.level.value)
        if stream.role != self.role.text():
            self.role.setText(stream.role)
            self.role.setToolTip(ROLE_TIPS[stream.role])
            set_property(self.role, "level", "warning" if stream.role == LEFT_OUT else "")

    def leave(self) -> None:
        """There is none any more."""
        for widget in self._widgets:
            widget.hide()
            widget.deleteLater()
