"""The streams of a device that sends several: a light, a reason and a role for each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from PySide6.QtWidgets import QLabel, QWidget

from app.lights import Light, elided, set_property
from app.live_streams import LEFT_OUT, ROLE_TIPS
from app.panels.panel import column, row
from app.texts import ElidedLabel
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
        self._layout = column(self, 0, 2)
        self._layout.setContentsMargins(18, 2, 0, 2)
        self.lines: list[StreamLine] = []
        self.hide()

    def show_streams(self, streams: Sequence[StreamState]) -> None:
        """How they are now."""
        while len(self.lines) > len(streams):
            gone = self.lines.pop()
            self._layout.removeWidget(gone)
            gone.hide()
            gone.deleteLater()
        while len(self.lines) < len(streams):
            self.lines.append(StreamLine())
            self._layout.addWidget(self.lines[-1])
        for line, stream in zip(self.lines, streams, strict=True):
            line.show_stream(stream)
        self.setVisible(bool(streams))


class StreamLine(QWidget):
    """What has no room is in the tooltip: nothing around it moves when a stream falls silent."""

    def __init__(self) -> None:
        super().__init__()
        self.light = Light(8)
        self.name = elided()
        self.state = elided("", "muted")
        self.role = RoleLabel()
        layout = row(self.light, self.name, self.state, self.role)
        layout.setStretch(1, 2)
        layout.setStretch(2, 3)
        self.setLayout(layout)

    def show_stream(self, stream: StreamState) -> None:
        """How it is now."""
        health, well = stream.health, stream.health.level is Level.GOOD
        self.light.set_level(health.level)
        _say(self.name, stream.name)
        _say(self.state, f"{health.rate_hz:.1f} Hz" if well and health.rate_hz > 0 else health.reason)
        self.state.setToolTip(health.reason)
        set_property(self.state, "level", "" if well else health.level.value)
        self.role.show_role(stream.role)


class RoleLabel(QLabel):
    """Whether a stream is solved, or only recorded, or not in the take that runs."""

    def __init__(self) -> None:
        super().__init__()
        self.setProperty("role", "small")

    def show_role(self, role: str) -> None:
        """role: of app.live_streams, "" where there is nothing to tell apart."""
        if role != self.text():
            self.setText(role)
            self.setToolTip(ROLE_TIPS[role])
            set_property(self, "level", "warning" if role == LEFT_OUT else "")


def _say(widget: ElidedLabel, text: str) -> None:
    if widget.text() != text:
        widget.setText(text)
