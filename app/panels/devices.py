"""The devices panel: add, find, connect; one light per device with the reason in words."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from PySide6.QtCore import QSize, Qt, QTimer, Signal
from PySide6.QtGui import QAction, QPainter, QPaintEvent
from PySide6.QtWidgets import QFrame, QGridLayout, QLabel, QMenu, QPushButton, QSizePolicy, QToolButton, QWidget

from app.lights import Light, elided, label, set_property
from app.live_latency import latency_parts, latency_value
from app.live_numbers import SolverNumbers
from app.live_streams import LEFT_OUT, ROLE_TIPS, armed_or_ended, role, short_name, stream_health
from app.panels.panel import Panel, column, row, scrolling
from app.panels.parameter_form import ParameterForm
from app.panels.stream_lines import StreamLines, StreamState
from app.receiver import Receiver
from app.session import SessionNumbers
from app.texts import on_button
from app.undo import UndoStack
from app.worker import SessionWorker
from devices.device import Device, Found, Health, Level, Value

DISCOVER_S = 1.5
EMPTY = (
    "No device yet.\n\nAdd an OptiTrack server, play a recording back, or start the demo performer to see "
    "everything at work without any hardware."
)
NO_ANSWER = "No server answered on this network."
NO_ANSWER_ACTION = (
    "Check that it streams, that both machines are on one network and that no firewall is between; "
    "or add it by its address."
)


class DevicesPanel(Panel):
    """A card per device of the session."""

    title, key = "Devices", "devices"
    connection_asked = Signal()
    """Somebody connects or disconnects a device here."""

    def __init__(self, worker: SessionWorker, undo: UndoStack, kinds: Sequence[type[Device]]) -> None:
        super().__init__()
        self._worker, self._undo, self._kinds = worker, undo, kinds
        self._cards: dict[Receiver, DeviceCard] = {}
        self._numbers: SessionNumbers | None = None

        self.add_button = QPushButton("Add device")
        self.add_button.setProperty("primary", True)
        self.add_button.setMenu(self._add_menu())
        self.find_button = QPushButton("Find")
        self.find_button.setToolTip("Ask the network which systems answer.")
        self.find_button.clicked.connect(self.find)
        self.find_answer = label("", "small", wrap=True)
        self.find_answer.setProperty("level", "warning")
        self.find_answer.hide()

        self._empty = label(EMPTY, "empty", wrap=True)
        body = QWidget()
        self._list = column(body, 8)
        self._list.addWidget(self._empty)
        self._list.addStretch(1)

        layout = column(self, 0, 0)
        bar = column(margin=8, spacing=4)
        bar.addLayout(row(self.add_button, self.find_button, None))
        bar.addWidget(self.find_answer)
        layout.addLayout(bar)
        self._area = scrolling(body)
        layout.addWidget(self._area, 1)

        worker.devices_changed.connect(self._rebuild)
        worker.numbers.connect(self._refresh)
        self._rebuild()

    @property
    def cards(self) -> list[DeviceCard]:
        """The cards shown, in order."""
        return list(self._cards.values())

    def _add_menu(self) -> QMenu:
        menu = QMenu(self)
        for kind in self._kinds:
            action = QAction(kind.title, menu)
            action.triggered.connect(lambda _=False, kind=kind: self.add(kind, {}))
            menu.addAction(action)
        return menu

    def add(self, kind: type[Device], settings: dict[str, Value], connect: bool = False) -> Receiver | None:
        """Add a device as one step that can be undone. None if the settings are refused."""
        added: list[Receiver] = []

        def do() -> None:
            if added:
                self._worker.session.restore_device(added[0], len(self._worker.session.receivers))
            else:
                added.append(self._worker.session.add_device(kind, settings))
            self._worker.devices_changed.emit()

        def undo() -> None:
            self._worker.session.remove_device(added[0])
            self._worker.devices_changed.emit()

        self._undo.change(f"add {kind.title}", do, undo)
        if not added:
            return None
        # A fresh device with nothing to decide connects at once; one that needs a file or a server shows its settings.
        if connect:
            self._worker.connect_device(added[0])
        elif added[0] in self._cards:
            self._cards[added[0]].show_settings(True)
        self.show_card(added[0])
        return added[0]

    def show_card(self, stream: Receiver) -> None:
        """Scroll until the whole card can be seen, once it has its size."""
        shown = self._cards.get(stream)
        if shown is not None:
            QTimer.singleShot(0, shown, lambda: self._area.ensureWidgetVisible(shown, 0, 8))

    def remove(self, stream: Receiver) -> None:
        """Remove a device as one step that can be undone."""
        place: list[int] = []

        def do() -> None:
            place[:] = [self._worker.session.remove_device(stream)]
            self._worker.devices_changed.emit()

        def undo() -> None:
            self._worker.session.restore_device(stream, place[0])
            self._worker.devices_changed.emit()

        self._undo.change(f"remove {stream.title}", do, undo)

    def configure(self, stream: Receiver, name: str, value: Value) -> None:
        """Change one setting as one step that can be undone; a connected device is connected anew."""
        before = stream.settings[name]
        text = next(p.label for p in stream.device_class.parameters if p.name == name)
        self._undo.change(
            f"change {text.lower()}",
            lambda: self._worker.configure_device(stream, {name: value}),
            lambda: self._worker.configure_device(stream, {name: before}),
        )

    def find(self) -> None:
        """Ask the network; what answers is offered as a menu."""
        self._answer("")
        self.find_button.setEnabled(False)
        self.find_button.setText("Looking…")
        kinds = list(self._kinds)
        self._worker.background(
            lambda: [(kind, found) for kind in kinds for found in kind.discover(DISCOVER_S)],
            self._found,
            lambda: self._found([], told=True),
        )

    def _found(self, answers: list[tuple[type[Device], Found]], told: bool = False) -> None:
        self.find_button.setEnabled(True)
        self.find_button.setText("Find")
        if not answers:
            if told:
                self._answer(
                    "The network could not be searched. Messages say why; a server can be added by its address."
                )
            else:
                self._answer(f"{NO_ANSWER} {NO_ANSWER_ACTION}")
                self._worker.notifications.warning(NO_ANSWER, NO_ANSWER_ACTION, "Devices")
            return
        menu = QMenu(self)
        for kind, found in answers:
            action = menu.addAction(on_button(f"Add {found.title}"))
            action.triggered.connect(
                lambda _=False, kind=kind, found=found: self.add(kind, dict(found.settings), connect=True)
            )
        menu.popup(self.find_button.mapToGlobal(self.find_button.rect().bottomLeft()))

    def _answer(self, text: str) -> None:
        """What came of the search, where it was asked for."""
        self.find_answer.setText(text)
        self.find_answer.setVisible(bool(text))

    def _rebuild(self) -> None:
        streams = self._worker.session.receivers
        if any(stream not in self._cards for stream in streams):
            self._answer("")
        for stream in [stream for stream in self._cards if stream not in streams]:
            gone = self._cards.pop(stream)
            self._list.removeWidget(gone)
            gone.hide()
            gone.deleteLater()
        for stream in streams:
            if stream not in self._cards:
                made = DeviceCard(stream, self._worker, self)
                self._cards[stream] = made
        self._cards = {stream: self._cards[stream] for stream in streams}
        for place, made in enumerate(self._cards.values()):
            self._list.insertWidget(place, made)
        self._empty.setVisible(not streams)
        self._each(lambda c: c.refresh(self._numbers))
        self._each(DeviceCard.show_settings_in_force)

    def _refresh(self, numbers: SessionNumbers) -> None:
        self._numbers = numbers
        self._each(lambda c: c.refresh(numbers))

    def _each(self, do: Callable[[DeviceCard], None]) -> None:
        for made in self._cards.values():
            do(made)


class DeviceCard(QFrame):
    """One device: light, reason, figures, settings, what is heard."""

    def __init__(self, stream: Receiver, worker: SessionWorker, panel: DevicesPanel) -> None:
        super().__init__()
        self.setObjectName("card")
        self.stream, self._worker = stream, worker
        self.light = Light(10)
        self.name = CardTitle()
        self.reason = label("", "muted", wrap=True, lines=2)
        self.toggle = QPushButton("Connect")
        self.toggle.setMinimumWidth(92)
        self.toggle.clicked.connect(self._toggle)
        self.toggle.clicked.connect(panel.connection_asked)
        self.more = QToolButton(text="Settings")
        self.more.setCheckable(True)
        self.more.setProperty("flat", True)
        self.more.toggled.connect(self.show_settings)
        self.more.clicked.connect(lambda: panel.show_card(stream))
        self.drop = QToolButton(text="Remove")
        self.drop.setProperty("flat", True)
        self.drop.clicked.connect(lambda: panel.remove(stream))

        self._figures: dict[str, QLabel] = {}
        grid = QGridLayout()
        grid.setContentsMargins(18, 0, 0, 0)
        grid.setHorizontalSpacing(8)
        grid.setVerticalSpacing(1)
        for i, (key, tip) in enumerate(
            (
                ("Rate", "Frames per second over the last second."),
                ("Latency", latency_parts(SolverNumbers(), Health())),
                ("Lost", "Frames that the system sent and that never arrived, or while Phalanx stood still."),
                ("Rejected", "Packets that could not be decoded."),
            )
        ):
            name, value = label(key, "small"), elided("–")
            for widget in (name, value):
                widget.setToolTip(tip)
            grid.addWidget(name, 0, i)
            grid.addWidget(value, 1, i)
            grid.setColumnStretch(i, 1)
            self._figures[key] = value

        self.form = ParameterForm(stream.device_class.parameters, stream.settings, stream.check)
        self.form.edited.connect(lambda name, value: panel.configure(stream, name, value))
        self.form.confirmed.connect(self._connect)
        self.form.confirmed.connect(panel.connection_asked)
        self.heard = label("", "small", wrap=True)
        self.heard.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        self._details = QWidget()
        inner = column(self._details, 0, 6)
        inner.setContentsMargins(18, 4, 0, 0)
        inner.addWidget(self.form)
        inner.addWidget(self.heard)
        self._details.setVisible(False)

        layout = column(self, 9, 6)
        head = row(self.light, self.name, self.toggle)
        head.setStretch(1, 1)
        layout.addLayout(head)
        indented = row(self.reason)
        indented.setContentsMargins(18, 0, 0, 0)
        layout.addLayout(indented)
        layout.addLayout(grid)
        self.lines = StreamLines()
        layout.addWidget(self.lines)
        self.role = label("", "small")
        self.role.setAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
        tools = row(self.more, self.drop, None, self.role)
        tools.setContentsMargins(12, 0, 0, 0)
        layout.addLayout(tools)
        layout.addWidget(self._details)
        self.refresh(None)

    def show_settings(self, shown: bool) -> None:
        """Unfold or fold the settings."""
        self._details.setVisible(shown)
        if self.more.isChecked() != shown:
            self.more.setChecked(shown)

    def refresh(self, numbers: SessionNumbers | None) -> None:
        """Show how the device is doing now, how soon what it sends is solved, and lock it while it is recorded."""
        session, stream = self._worker.session, self.stream
        recording = numbers.recording if numbers is not None else None
        recorded = recording.streams.keys() if recording is not None else None
        armed = [one for one in armed_or_ended(session) if one.receiver is stream]
        active = stream.active
        health = stream_health(armed[0]) if armed and not active else stream.health()
        self._lock(recorded is not None and any(key.startswith(f"{stream.key}/") for key in recorded))
        self.light.set_level(health.level)
        self.name.show_title(stream.system, stream.title)
        _say(self.reason, health.reason)
        set_property(self.reason, "level", health.level.value if health.level is not Level.GOOD else "")
        _say(self.toggle, "Disconnect" if active else "Connect")
        set_property(self.toggle, "primary", not active)
        _say(self._figures["Rate"], f"{health.rate_hz:.1f} Hz" if active and health.rate_hz else "–")
        _say(self._figures["Lost"], f"{health.lost:,}" if active else "–")
        _say(self._figures["Rejected"], f"{health.rejected:,}" if active else "–")
        set_property(self._figures["Lost"], "level", "warning" if health.lost else "")
        set_property(self._figures["Rejected"], "level", "warning" if health.rejected else "")
        states = [StreamState(short_name(one.info), stream_health(one), role(one, session, recorded)) for one in armed]
        solved = next((stream_health(one) for one in armed if one.key == session.solving), None)
        solver = numbers.solver if numbers is not None and solved is not None else SolverNumbers()
        _say(self._figures["Latency"], latency_value(solver, solved or Health()))
        self._figures["Latency"].setToolTip(latency_parts(solver, solved or Health()))
        self._show_role({state.role for state in states})
        self.lines.show_streams(states if len(states) > 1 else ())
        if self._details.isVisible():
            _say(self.heard, _what_i_hear(health, stream))

    def _show_role(self, roles: set[str]) -> None:
        """What becomes of its stream, below the name under which takes and messages have the device."""
        role = next(iter(roles)) if len(roles) == 1 else ""
        _say(self.role, "\n".join(filter(None, (self.stream.key, role))) if roles - {""} else "")
        self.role.setToolTip(ROLE_TIPS[role])
        set_property(self.role, "level", "warning" if role == LEFT_OUT else "")

    def _lock(self, locked: bool) -> None:
        """Lock what may not change while it is recorded."""
        self.form.set_recording(locked)
        self.toggle.setEnabled(not locked)
        self.drop.setEnabled(not locked)
        tip = "Locked while a take is recorded." if locked else ""
        self.toggle.setToolTip(tip)
        self.drop.setToolTip(tip)

    def show_settings_in_force(self) -> None:
        """Not while others are asked for and the device is being connected anew."""
        if not self._worker.reconnecting(self.stream):
            self.form.set_values(self.stream.settings)

    def _toggle(self) -> None:
        if self.stream.active:
            self._worker.disconnect_device(self.stream)
        else:
            self._worker.connect_device(self.stream)

    def _connect(self) -> None:
        """Enter in a setting: a connected device has just been connected anew if the setting is another one."""
        if not self.stream.active and not self._worker.reconnecting(self.stream):
            self._worker.connect_device(self.stream)


class CardTitle(QLabel):
    """A device's title. Where it has no room on one line its address goes below the system, and both are kept short."""

    def __init__(self) -> None:
        super().__init__()
        self.setProperty("role", "heading")
        policy = QSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
        policy.setHeightForWidth(True)
        self.setSizePolicy(policy)
        self._system = ""

    def show_title(self, system: str, title: str) -> None:
        """title: the system, and behind it maybe its address."""
        if title != self.text():
            self._system = system
            self.setText(title)
            self.setToolTip(title)

    def lines(self, width: int) -> list[str]:
        """As it is drawn."""
        metrics, address = self.fontMetrics(), self.text().removeprefix(self._system).strip()
        if not address or metrics.horizontalAdvance(self.text()) <= width:
            return [metrics.elidedText(self.text(), Qt.TextElideMode.ElideRight, width)]
        return [
            metrics.elidedText(self._system, Qt.TextElideMode.ElideRight, width),
            metrics.elidedText(address, Qt.TextElideMode.ElideMiddle, width),
        ]

    def minimumSizeHint(self) -> QSize:  # noqa: D102, N802
        return QSize(0, self.fontMetrics().lineSpacing())

    def hasHeightForWidth(self) -> bool:  # noqa: D102, N802
        return True

    def heightForWidth(self, width: int) -> int:  # noqa: D102, N802
        return self.fontMetrics().lineSpacing() * len(self.lines(width))

    def paintEvent(self, event: QPaintEvent) -> None:  # noqa: D102, N802
        text = "\n".join(self.lines(self.width()))
        QPainter(self).drawText(self.rect(), Qt.AlignmentFlag.AlignVCenter, text)


def _what_i_hear(health: Health, stream: Receiver) -> str:
    lines = [f"What I hear: {health.heard}" if health.heard else "What I hear: nothing."]
    if health.last_error:
        lines.append(f"Last error: {health.last_error}")
    if health.reconnects:
        lines.append(f"Reconnected {health.reconnects} times.")
    lines += [f"{key}: {value}" for key, value in stream.describe().details.items()]
    return "\n".join(lines)


def _say(widget: QLabel | QPushButton, text: str) -> None:
    if widget.text() != text:
        widget.setText(text)
