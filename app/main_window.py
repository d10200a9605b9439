"""The window: deck above, viewport in the middle, panels around it, status strip below."""

from __future__ import annotations

import base64
import threading
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QByteArray, QEventLoop, Qt, QTimer, QUrl
from PySide6.QtGui import QAction, QCloseEvent, QDesktopServices, QKeySequence
from PySide6.QtWidgets import (
    QDockWidget,
    QFileDialog,
    QFrame,
    QMainWindow,
    QMessageBox,
    QProgressDialog,
    QStackedWidget,
    QVBoxLayout,
    QWidget,
)

from app import settings as names
from app import shortcuts
from app.control_deck import ControlDeck
from app.demo import DemoDevice
from app.device_kinds import device_classes
from app.device_store import restore_devices, save_devices
from app.lights import set_property
from app.live_numbers import LiveFrame
from app.notifications import Notification, Severity, log_folder
from app.panels.devices import DevicesPanel
from app.panels.messages import MessagesPanel
from app.panels.panel import Panel
from app.panels.plots import PlotsPanel
from app.panels.recorder import RecorderPanel
from app.panels.tracking import TrackingPanel, profile_key
from app.recording import TakeSummary
from app.session import SessionNumbers
from app.settings import Settings
from app.status_strip import StatusStrip
from app.take_plan import TakePlan
from app.undo import UndoStack
from app.viewport.viewport import Viewport
from app.worker import SessionWorker
from core.errors import PhalanxError
from core.profile import Profile
from core.takes.take import EXTENSION, TakeInfo
from devices.device import Level

if TYPE_CHECKING:
    from app.review.review import Review

ViewSetting = Callable[[Viewport, bool], None]

TITLE = "Phalanx"
LAYOUT_VERSION = 1
PATIENCE_MS = 700
LEFT_WIDTH, RIGHT_WIDTH, BOTTOM_HEIGHT = 320, 320, 210


class MainWindow(QMainWindow):
    """Binds the panels to the session. Everything that works does so elsewhere."""

    def __init__(self, worker: SessionWorker, settings: Settings) -> None:
        super().__init__()
        self.worker, self.settings = worker, settings
        self.undo = UndoStack(worker.notifications)
        self.plan = TakePlan(settings)
        self.setWindowTitle(TITLE)
        self.setDockOptions(
            QMainWindow.DockOption.AnimatedDocks
            | QMainWindow.DockOption.AllowTabbedDocks
            | QMainWindow.DockOption.AllowNestedDocks
        )
        self._closing = self._ended = False
        self._make_actions()
        self._make_centre()
        self._make_docks()
        self._make_menus()
        self._make_strip()
        self._connect()
        self.resize(1600, 950)
        self._arrange()
        self._default_state = self.saveState(LAYOUT_VERSION)
        self._restore_layout()
        restore_devices(worker, settings, self.kinds)
        self._update_actions()

    # What there is.

    def _make_actions(self) -> None:
        self.record_action = self._action("Record", shortcuts.RECORD, self.toggle_recording)
        self.mark_action = self._action("Mark this moment", shortcuts.MARK, self.mark)
        self.connect_action = self._action("Connect", shortcuts.CONNECT, self.toggle_connection)
        self.search_action = self._action("Search again", shortcuts.SEARCH, self.worker.session.search_again)
        self.live_action = self._action("Live", shortcuts.LIVE, lambda: self.show_review(False))
        self.review_action = self._action("Review", shortcuts.REVIEW, lambda: self.show_review(True))
        self.open_action = self._action("Open take…", shortcuts.OPEN_TAKE, self.choose_take)

    def _action(self, text: str, keys: str, do: object, checkable: bool = False) -> QAction:
        action = QAction(text, self)
        action.setShortcut(QKeySequence(keys))
        action.setShortcutContext(Qt.ShortcutContext.WindowShortcut)
        action.setCheckable(checkable)
        if checkable:
            action.toggled.connect(do)
        else:
            action.triggered.connect(lambda _=False: do())  # type: ignore[operator]
        self.addAction(action)
        return action

    def _make_centre(self) -> None:
        self.deck = ControlDeck(self.worker, self.plan, self.record_action)
        self.viewport = Viewport()
        self.tally = QFrame()
        self.tally.setObjectName("tally")
        frame = QVBoxLayout(self.tally)
        frame.setContentsMargins(2, 2, 2, 2)
        frame.addWidget(self.viewport)
        self.pages = QStackedWidget()
        self.pages.addWidget(self.tally)
        self._review: Review | None = None
        self._live_state: QByteArray | None = None
        self.setMenuWidget(None)
        self.setCentralWidget(self.pages)

    def _make_docks(self) -> None:
        self.kinds = [*device_classes(), DemoDevice]
        self.devices = DevicesPanel(self.worker, self.undo, self.kinds)
        self.tracking = TrackingPanel(self.worker, self.undo)
        self.recorder = RecorderPanel(self.worker, self.plan, self.undo, self.record_action, self.mark_action)
        self.plots = PlotsPanel(self.worker)
        self.messages = MessagesPanel(self.worker)
        self.docks: dict[str, QDockWidget] = {}
        for panel in (self.devices, self.recorder, self.tracking, self.plots, self.messages):
            self.docks[panel.key] = self._dock(panel)

    def _dock(self, panel: Panel) -> QDockWidget:
        dock = QDockWidget(panel.title, self)
        dock.setObjectName(panel.key)
        dock.setWidget(panel)
        dock.setFeatures(
            QDockWidget.DockWidgetFeature.DockWidgetMovable
            | QDockWidget.DockWidgetFeature.DockWidgetFloatable
            | QDockWidget.DockWidgetFeature.DockWidgetClosable
        )
        return dock

    def _arrange(self) -> None:
        """The layout a new operator meets."""
        left, right, bottom = (
            Qt.DockWidgetArea.LeftDockWidgetArea,
            Qt.DockWidgetArea.RightDockWidgetArea,
            Qt.DockWidgetArea.BottomDockWidgetArea,
        )
        for corner, area in (
            (Qt.Corner.BottomLeftCorner, left),
            (Qt.Corner.TopLeftCorner, left),
            (Qt.Corner.BottomRightCorner, right),
            (Qt.Corner.TopRightCorner, right),
        ):
            self.setCorner(corner, area)
        for key, area in (
            ("devices", left), ("recorder", left), ("tracking", right), ("plots", bottom), ("messages", bottom),
        ):  # fmt: skip
            dock = self.docks[key]
            dock.setFloating(False)
            self.addDockWidget(area, dock)
            dock.show()
        self.tabifyDockWidget(self.docks["plots"], self.docks["messages"])
        self.docks["plots"].raise_()
        self.resizeDocks(
            [self.docks["devices"], self.docks["tracking"]], [LEFT_WIDTH, RIGHT_WIDTH], Qt.Orientation.Horizontal
        )
        self.resizeDocks([self.docks["devices"], self.docks["recorder"]], [280, 520], Qt.Orientation.Vertical)
        self.resizeDocks([self.docks["plots"]], [BOTTOM_HEIGHT], Qt.Orientation.Vertical)

    def _make_menus(self) -> None:
        bar = self.menuBar()
        file = bar.addMenu("File")
        file.addAction(self.open_action)
        self._menu_action(file, "Open take folder", "", self.recorder._show_folder)
        file.addSeparator()
        self._menu_action(file, "Quit", shortcuts.QUIT, self.close)

        edit = bar.addMenu("Edit")
        undo, redo = self.undo.createUndoAction(self, "Undo"), self.undo.createRedoAction(self, "Redo")
        undo.setShortcut(QKeySequence(shortcuts.UNDO))
        redo.setShortcuts([QKeySequence(shortcuts.REDO), QKeySequence("Ctrl+Y")])
        edit.addActions([undo, redo])

        session = bar.addMenu("Session")
        session.addActions([self.live_action, self.review_action])
        session.addSeparator()
        session.addActions([self.record_action, self.mark_action])
        session.addSeparator()
        session.addActions([self.connect_action, self.search_action])

        view = bar.addMenu("View")
        self._view_toggles: list[tuple[QAction, ViewSetting]] = []
        for text, keys, do in (
            ("Fit to the hands", shortcuts.FIT, Viewport.view_fit),
            ("Front", shortcuts.FRONT, Viewport.view_front),
            ("Side", shortcuts.SIDE, Viewport.view_side),
            ("Top", shortcuts.TOP, Viewport.view_top),
        ):
            self._menu_action(view, text, keys, lambda do=do: do(self.shown_viewport))
        view.addSeparator()
        for text, keys, do, on in (
            ("Follow the hands", shortcuts.FOLLOW, Viewport.set_follow_hand, False),
            ("Surface", "", Viewport.set_surface_shown, True),
            ("Skeleton", shortcuts.SKELETON, Viewport.set_skeleton_shown, False),
            ("Marker names", shortcuts.NAMES, Viewport.set_names_shown, False),
            ("Colour by digit", "", Viewport.set_colour_by_digit, False),
        ):
            action = self._action(text, keys, lambda on, do=do: self._set_view(do, on), checkable=True)
            action.setChecked(on)
            view.addAction(action)
            self._view_toggles.append((action, do))

        window = bar.addMenu("Window")
        for dock in self.docks.values():
            window.addAction(dock.toggleViewAction())
        window.addSeparator()
        self._menu_action(window, "Reset layout", "", self.reset_layout)

        help_menu = bar.addMenu("Help")
        self._menu_action(help_menu, "Keyboard shortcuts", shortcuts.SHORTCUTS, self.show_shortcuts)
        self._menu_action(
            help_menu, "Open log folder", "", lambda: QDesktopServices.openUrl(QUrl.fromLocalFile(str(log_folder())))
        )
        self._menu_action(help_menu, "About Phalanx", "", self.show_about)

        top = QWidget()
        column = QVBoxLayout(top)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(0)
        column.addWidget(bar)
        column.addWidget(self.deck)
        self.setMenuWidget(top)

    def _menu_action(self, menu: object, text: str, keys: str, do: object) -> QAction:
        action = self._action(text, keys, do)
        menu.addAction(action)  # type: ignore[attr-defined]
        return action

    def _make_strip(self) -> None:
        self.strip = StatusStrip(self.worker)
        self._watch_folder()
        bar = self.statusBar()
        bar.setSizeGripEnabled(False)
        bar.setContentsMargins(0, 0, 0, 0)
        bar.addWidget(self.strip, 1)

    def _connect(self) -> None:
        worker = self.worker
        worker.frame.connect(self._show_frame)
        worker.numbers.connect(self._refresh)
        worker.recording_changed.connect(self._recording_changed)
        worker.devices_changed.connect(self._devices_changed)
        worker.profile_changed.connect(self._profile_changed)
        worker.take_finished.connect(self._take_finished)
        worker.notified.connect(self._notified)
        self.plan.changed.connect(self._watch_folder)
        self.deck.review_chosen.connect(self._turn_page)
        self.recorder.open_take.connect(self.review_take)

    # What an operator does.

    def toggle_recording(self) -> None:
        """Begin the next take, or end the one that runs."""
        if self.worker.session.recording:
            self.record_action.setEnabled(False)
            self.worker.stop_recording()
            return
        self.show_review(False)
        stream = self.worker.session.live_stream
        try:
            name, path = self.plan.next()
            if stream is None:
                raise PhalanxError("No device is connected, so there is nothing to record.", "Connect a device first.")
        except PhalanxError as error:
            self.worker.notifications.error(error, "Recorder")
            return
        description, health = stream.describe(), stream.health()
        info = TakeInfo(
            name=name,
            performer=self.plan.performer,
            rate_hz=description.rate_hz or health.rate_hz or float("nan"),
            device={"kind": stream.device_class.kind, "title": description.title, **description.details},
            notes=self.plan.notes,
        )
        if health.level is Level.PROBLEM and not self._record_anyway(health.reason):
            return
        self.record_action.setEnabled(False)
        self.worker.start_recording(path, info)

    def _record_anyway(self, reason: str) -> bool:
        answer = QMessageBox.warning(
            self,
            "No frames are coming",
            f"{reason}\n\nRecord anyway? The take begins with the first frame that arrives.",
            QMessageBox.StandardButton.Yes | QMessageBox.StandardButton.Cancel,
            QMessageBox.StandardButton.Cancel,
        )
        return answer == QMessageBox.StandardButton.Yes

    def mark(self) -> None:
        """Remember this moment of the take."""
        try:
            self.recorder.add_mark(self.worker.session.mark())
        except PhalanxError as error:
            self.worker.notifications.error(error, "Recorder")

    def toggle_connection(self) -> None:
        """Disconnect the live device, or connect the first one."""
        session = self.worker.session
        live = session.live_stream
        if live is not None:
            self.worker.disconnect_device(live)
        elif session.streams:
            self.worker.connect_device(session.streams[0])
        else:
            self.worker.notifications.warning("There is no device to connect.", "Add one in the Devices panel.")

    def show_review(self, review: bool) -> None:
        """Turn to review, or back to live. Recording stays in live."""
        if not (review and self.worker.session.recording):
            (self.deck.review if review else self.deck.live).setChecked(True)

    def choose_take(self) -> None:
        """Ask for a take and review it."""
        path, _ = QFileDialog.getOpenFileName(self, "Open take", str(self.plan.folder), f"Takes (*{EXTENSION})")
        if path:
            self.review_take(Path(path))

    def review_take(self, path: Path) -> None:
        """Open a take in review."""
        self.show_review(True)
        if self._review is not None:
            self._review.open_take(path)

    def reset_layout(self) -> None:
        """The layout of a fresh start."""
        self.restoreState(self._default_state, LAYOUT_VERSION)
        self._arrange()
        self.settings.forget(names.LAYOUT)

    def show_shortcuts(self) -> None:
        """The list of keys."""
        shortcuts.ShortcutsDialog(self).show()

    def show_about(self) -> None:
        """What this is."""
        QMessageBox.about(
            self, "About Phalanx", "<b>Phalanx</b><p>Marker-based hand motion capture: live tracking, recording, "
            "review and export.</p>"
        )  # fmt: skip

    # What happens.

    def _show_frame(self, frame: LiveFrame) -> None:
        if self.pages.currentIndex() == 0:
            self.viewport.show_frame(frame.raw, frame.solved, self.worker.session.profile)

    def _refresh(self, numbers: SessionNumbers) -> None:
        self._update_actions(numbers)
        self._watch_stream()

    def _watch_stream(self) -> None:
        """A pose that is held must not look like one that is live: without frames the view says so."""
        stream = self.worker.session.live_stream
        if stream is None:
            return
        health = stream.health()
        if health.connected and health.rate_hz > 0 and health.level is not Level.PROBLEM:
            return
        self.worker.session.latest.clear()
        self.viewport.show_frame(None, None, None)
        self.viewport.show_empty("No frames", health.reason)

    def _update_actions(self, numbers: SessionNumbers | None = None) -> None:
        session = self.worker.session
        recording, stream = session.recording, session.live_stream
        if recording:
            tip, able = f"End and save this take ({shortcuts.RECORD}).", True
        elif not session.ready:
            tip, able = (numbers.status if numbers else "Preparing the solver…"), False
        elif stream is None or not stream.streaming:
            tip, able = "Connect a device first.", False
        else:
            tip, able = f"Begin the next take ({shortcuts.RECORD}).", True
        for action, text, enabled, tooltip in (
            (self.record_action, "Stop recording" if recording else "Record", able, tip),
            (self.mark_action, "Mark this moment", recording, f"Remember this moment ({shortcuts.MARK})."),
            (self.connect_action, "Disconnect" if stream else "Connect", not recording, ""),
            (self.review_action, "Review", not recording, ""),
        ):
            if action.text() != text:
                action.setText(text)
            if action.isEnabled() != enabled:
                action.setEnabled(enabled)
            if tooltip and action.toolTip() != tooltip:
                action.setToolTip(tooltip)

    def _recording_changed(self, recording: bool) -> None:
        set_property(self.tally, "recording", recording)
        self.setWindowTitle(f"● {self.worker.session.recording_name} - {TITLE}" if recording else TITLE)
        self._update_actions()

    def _devices_changed(self) -> None:
        save_devices(self.worker, self.settings)
        self._update_actions()
        if self.worker.session.live_stream is None:
            self.worker.session.latest.clear()
            self.viewport.show_frame(None, None, None)
            streams = self.worker.session.streams
            if streams:
                self.viewport.show_empty("No device connected", "Connect one in the Devices panel (Ctrl+K).")
        else:
            self.viewport.show_empty("Waiting for frames", "The device is connected; nothing has come yet.")

    def _profile_changed(self, profile: Profile) -> None:
        self.settings.set(names.PROFILE, profile_key(profile) or self.settings.get(names.PROFILE, ""))

    def _watch_folder(self) -> None:
        if self.strip.folder != self.plan.folder:
            self.strip.folder = self.plan.folder
            self.worker.watch_disk(self.plan.folder)

    def _take_finished(self, summary: TakeSummary) -> None:
        self.plan.changed.emit()

    def _notified(self, note: Notification) -> None:
        if note.severity is Severity.PROBLEM and note.count == 1 and not self._closing:
            self.docks["messages"].raise_()

    def _turn_page(self, review: bool) -> None:
        """Review has panels of its own: those of the live room go and come back as they were."""
        if review and self._review is None:
            from app.review.review import Review

            self._review = Review(self.worker, self.undo, self.plan, self.settings)
            for action, do in self._view_toggles:
                do(self._review.viewport, action.isChecked())
            self.pages.addWidget(self._review)
        if review and self._live_state is None:
            self._live_state = self.saveState(LAYOUT_VERSION)
            for dock in self.docks.values():
                dock.hide()
        elif not review and self._live_state is not None:
            self.restoreState(self._live_state, LAYOUT_VERSION)
            self._live_state = None
        self.pages.setCurrentIndex(1 if review else 0)

    @property
    def shown_viewport(self) -> Viewport:
        """The 3D view of the room that is shown."""
        return self._review.viewport if self._review is not None and self.pages.currentIndex() == 1 else self.viewport

    def _set_view(self, do: ViewSetting, on: bool) -> None:
        do(self.viewport, on)
        if self._review is not None:
            do(self._review.viewport, on)

    # Layout and the end.

    def _restore_layout(self) -> None:
        geometry, state = self.settings.get(names.GEOMETRY, ""), self.settings.get(names.LAYOUT, "")
        try:
            if geometry:
                self.restoreGeometry(QByteArray(base64.b64decode(geometry)))
            if state:
                self.restoreState(QByteArray(base64.b64decode(state)), LAYOUT_VERSION)
        except ValueError:
            self.reset_layout()

    def _save_layout(self) -> None:
        state = self._live_state or self.saveState(LAYOUT_VERSION)
        self.settings.set(names.GEOMETRY, base64.b64encode(self.saveGeometry().data()).decode())
        self.settings.set(names.LAYOUT, base64.b64encode(state.data()).decode())

    def closeEvent(self, event: QCloseEvent) -> None:  # noqa: D102, N802
        if self.worker.session.recording and not self._closing and not self._may_stop():
            event.ignore()
            return
        self._closing = True
        self._save_layout()
        if not self._ended:
            self._ended = True
            if self._review is not None:
                self._review.finish()
            self._finish()
        event.accept()

    def stop_and_close(self) -> None:
        """Close without asking; a running take is saved."""
        self._closing = True
        self.close()

    def _may_stop(self) -> bool:
        answer = QMessageBox.question(
            self,
            "Still recording",
            f"Take {self.worker.session.recording_name} is still being recorded. Stop it, save it and quit?",
            QMessageBox.StandardButton.Save | QMessageBox.StandardButton.Cancel,
            QMessageBox.StandardButton.Save,
        )
        return answer == QMessageBox.StandardButton.Save

    def _finish(self) -> None:
        """End the session off this thread; the window says so if a long take takes its time to be finished."""
        self.worker.pause()
        closing = threading.Thread(target=self.worker.close, name="phalanx-closing")
        closing.start()
        progress = QProgressDialog("Finishing the take…", "", 0, 0, self)
        progress.setWindowTitle(TITLE)
        progress.setCancelButton(None)
        progress.setMinimumDuration(PATIENCE_MS)
        loop, timer = QEventLoop(), QTimer()
        timer.timeout.connect(lambda: None if closing.is_alive() else loop.quit())
        timer.start(20)
        loop.exec()
        progress.reset()
