"""The window: deck above, viewport in the middle, panels around it, status strip below."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QEvent, QSize
from PySide6.QtGui import QCloseEvent, QDragEnterEvent, QDropEvent, QUndoGroup
from PySide6.QtWidgets import (
    QFileDialog,
    QFrame,
    QMainWindow,
    QMenuBar,
    QStackedWidget,
    QVBoxLayout,
    QWidget,
)

from app import settings as names
from app import shortcuts
from app.closing import Closing
from app.control_deck import ControlDeck
from app.device_kinds import device_classes
from app.device_store import restore_devices, save_devices
from app.docks import Docks
from app.every_nth import every_words
from app.finishing import finish
from app.focus import Focus
from app.hand_size import hand_size
from app.import_desk import ImportDesk, dropped
from app.left_behind.desk import LeftBehindDesk
from app.lights import set_property
from app.live_numbers import LiveFrame
from app.live_view import LiveView
from app.menus import ViewSetting, make_action, make_menus
from app.panels.devices import DevicesPanel
from app.panels.messages import MessagesPanel
from app.panels.plots import PlotsPanel
from app.panels.recorder import RecorderPanel
from app.panels.tracking import LOOK_AHEAD_MS, SOLVE_EVERY, TrackingPanel, profile_key
from app.props.desk import PropDesk
from app.props.picking import LivePicking, Picking
from app.receiver import Receiver
from app.record_control import RecordControl
from app.session import SessionNumbers
from app.settings import Settings
from app.status_strip import StatusStrip
from app.take_plan import TakePlan
from app.take_summary import TakeSummary
from app.texts import window_title
from app.training.desk import TrainingDesk
from app.undo import UndoStack
from app.viewport.viewport import Viewport
from app.worker import SessionWorker
from core.errors import PhalanxError
from core.profile import Profile
from core.props.prop import Prop
from core.takes.take import EXTENSION

if TYPE_CHECKING:
    from app.review.importing import Importing
    from app.review.leaving import Leaving
    from app.review.review import Review

TITLE = "Phalanx"


class Pages(QStackedWidget):
    """Asks for the room of the page that is shown only: review's would squeeze the panels of the live room."""

    def __init__(self) -> None:
        super().__init__()
        self.currentChanged.connect(lambda _: self.updateGeometry())

    def minimumSizeHint(self) -> QSize:  # noqa: D102, N802
        shown = self.currentWidget()
        return shown.minimumSizeHint() if shown is not None else super().minimumSizeHint()

    sizeHint = minimumSizeHint  # noqa: N815


class MainWindow(QMainWindow):
    """Binds the panels to the session. Everything that works does so elsewhere."""

    def __init__(self, worker: SessionWorker, settings: Settings) -> None:
        super().__init__()
        self.worker, self.settings = worker, settings
        self.undo = UndoStack(worker.notifications)
        """Of the live room; review has its own."""
        self.stacks = QUndoGroup(self)
        """What the menu undoes: the steps of the room that is shown."""
        self.stacks.addStack(self.undo)
        self.stacks.setActiveStack(self.undo)
        self.plan = TakePlan(settings)
        self.setWindowTitle(TITLE)
        self.setAcceptDrops(True)
        self._closing = self._ended = False
        self._put_down: list[Receiver] = []  # disconnected together
        self.closing = Closing(self)
        self.lent_props: tuple[Prop, ...] = ()
        """Those of the built-in performer: in the profile, and not remembered with it."""
        self._make_actions()
        self._make_centre()
        self._make_docks()
        self._make_top()
        self._make_strip()
        self.keys = Focus(self, lambda: self.shown_viewport)
        self._connect()
        self._room.first_size()
        self._room.arrange()
        self._room.restore()
        restore_devices(worker, settings, self.kinds)
        self._restore_look_ahead()
        self._restore_solve_every()
        self._update_actions()

    # What there is.

    def _make_actions(self) -> None:
        session = self.worker.session
        self.record_action = make_action(self, "Record", shortcuts.RECORD, lambda: self.recording.toggle())
        self.recording = RecordControl(
            self, self.worker, self.plan, self.record_action, lambda: (self.deck, self.recorder),
            lambda: self.keys.leave_fields(), lambda: self.show_review(False),
        )  # fmt: skip
        self.imports = ImportDesk(self)
        self.mark_action = make_action(self, "Mark this moment", shortcuts.MARK, self.mark)
        self.look_back_action = make_action(
            self, "Save what just happened", shortcuts.LOOK_BACK, lambda: self.recording.look_back()
        )
        self.connect_action = make_action(self, "Connect", shortcuts.CONNECT, self.toggle_connection)
        self.search_action = make_action(self, "Search again", shortcuts.SEARCH, lambda: session.search_again())
        self.live_action = make_action(self, "Live", shortcuts.LIVE, lambda: self.show_review(False))
        self.review_action = make_action(self, "Review", shortcuts.REVIEW, lambda: self.show_review(True))
        self.open_action = make_action(self, "Open take…", shortcuts.OPEN_TAKE, self.choose_take)
        self.import_action = make_action(self, "Import recording…", shortcuts.IMPORT, self.import_recording)
        self.import_action.setToolTip(
            "Solve a recording of another program (C3D, TRC, Qualisys TSV, Motive CSV, points.csv) and keep it as a "
            "take."
        )
        self.prop_action = make_action(
            self, "Make a prop of picked points…", shortcuts.PROP, lambda: self.shown_picking.make()
        )
        self.left_behind = LeftBehindDesk(self.worker, self.settings, lambda: self.plan.folder, self.review_take, self)
        self.training = TrainingDesk(self.worker, self.undo, self.settings, lambda: self.plan.folder, self)
        self.train_action = make_action(self, "Train a labelling network…", "", self.training.open)
        self.hold_action = make_action(self, "Hold the view", shortcuts.HOLD, lambda: self.picking.toggle_hold())

    def _make_centre(self) -> None:
        self.deck = ControlDeck(self.worker, self.plan, self.record_action)
        self.viewport = Viewport()
        self.props = PropDesk(self.worker, self.undo)
        self.picking = LivePicking(self.viewport, self.props)
        self.view = LiveView(self.worker.session, self.viewport, self.picking)
        self.tally = QFrame()
        self.tally.setObjectName("tally")
        frame = QVBoxLayout(self.tally)
        frame.setContentsMargins(2, 2, 2, 2)
        frame.addWidget(self.viewport)
        self.pages = Pages()
        self.pages.addWidget(self.tally)
        self._review: Review | None = None
        self.setCentralWidget(self.pages)

    def _make_docks(self) -> None:
        self.kinds = device_classes()
        self.devices = DevicesPanel(self.worker, self.undo, self.kinds)
        self.tracking = TrackingPanel(self.worker, self.undo)
        self.recorder = RecorderPanel(
            self.worker, self.plan, self.undo, self.record_action, self.mark_action, self.look_back_action
        )
        self.plots = PlotsPanel(self.worker)
        self.messages = MessagesPanel(self.worker)
        panels = (self.devices, self.recorder, self.tracking, self.plots, self.messages)
        self._room = Docks(self, panels, self.settings)
        self.docks = self._room.docks

    def _make_top(self) -> None:
        bar = QMenuBar()
        self._view_switches = make_menus(self, bar)
        top = QWidget()
        column = QVBoxLayout(top)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(0)
        column.addWidget(bar)
        column.addWidget(self.deck)
        self.setMenuWidget(top)

    def _make_strip(self) -> None:
        self.strip = StatusStrip(self.worker, lambda: self.imports.words, lambda: self.messages.in_sight)
        self.strip.work_clicked.connect(self.imports.offer)
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
        worker.solving_changed.connect(self.view.solving_changed)
        worker.profile_changed.connect(self._profile_changed)
        worker.take_finished.connect(self._take_finished)
        self.strip.message_clicked.connect(self.show_messages)
        worker.recording_refused.connect(self.recording.say_refusal)
        self.plan.changed.connect(self._watch_folder)
        self.plan.changed.connect(lambda: self.recording.say_refusal(None))
        for button in (self.deck.record, self.recorder.record):
            button.not_able.connect(self.recording.say_not_able)
        self.devices.connection_asked.connect(self.keys.leave_fields)
        self.deck.review_chosen.connect(self._turn_page)
        self.recorder.open_take.connect(self.review_take)

    # What an operator does.

    def mark(self) -> None:
        """Remember this moment of the take."""
        self.keys.leave_fields()
        try:
            self.recorder.add_mark(self.worker.session.mark())
        except PhalanxError as error:
            self.worker.notifications.error(error, "Recorder")

    def toggle_connection(self) -> None:
        """Disconnect every device, or connect again those that this disconnected; at first every one."""
        self.keys.leave_fields()
        devices = self.worker.session.receivers
        active = [device for device in devices if device.active]
        if active:
            self._put_down = [device for device in devices if device.active or device.failed]
            for device in self._put_down:
                self.worker.disconnect_device(device)
        elif devices:
            for device in [device for device in self._put_down if device in devices] or devices:
                self.worker.connect_device(device)
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

    def import_recording(self) -> None:
        """Ask for recordings of other programs."""
        self.imports.ask()

    def dragEnterEvent(self, event: QDragEnterEvent) -> None:  # noqa: N802 (Qt's name)
        """Files can be dropped: a take opens, other recordings are imported."""
        if dropped(event.mimeData()):
            event.acceptProposedAction()

    def dropEvent(self, event: QDropEvent) -> None:  # noqa: N802 (Qt's name)
        """They are."""
        event.acceptProposedAction()
        self.imports.take_up(event.mimeData())

    def review_take(self, path: Path) -> None:
        """Open a take in review."""
        self.show_review(True)
        if self._review is not None:
            self._review.open_take(path)

    def reset_layout(self) -> None:
        """The layout of a fresh start."""
        self.show_review(False)
        self._room.reset()

    def show_messages(self) -> None:
        """All messages, before the plots; only when asked for."""
        self.docks["messages"].show()
        self.docks["messages"].raise_()

    @property
    def leaving(self) -> Leaving | None:
        """What is asked for before the take in review is left, None if there was no review."""
        return self._review.leaving if self._review is not None else None

    @property
    def importing(self) -> Importing | None:
        """What imports recordings, None if there was no review."""
        return self._review.importing if self._review is not None else None

    @property
    def shown_picking(self) -> Picking:
        """What picks points in the room that is shown."""
        return self._review.picking if self._review is not None and self.pages.currentIndex() == 1 else self.picking

    @property
    def shown_viewport(self) -> Viewport:
        """The 3D view of the room that is shown."""
        return self._review.viewport if self._review is not None and self.pages.currentIndex() == 1 else self.viewport

    def set_view(self, do: ViewSetting, on: bool) -> None:
        """Switch something on or off in every 3D view."""
        do(self.viewport, on)
        if self._review is not None:
            do(self._review.viewport, on)

    # What happens.

    def _show_frame(self, frame: LiveFrame) -> None:
        if not self.picking.held and self.pages.currentIndex() == 0:
            self.viewport.show_frame(frame.raw, frame.solved, frame.profiles)

    def _refresh(self, numbers: SessionNumbers) -> None:
        self._update_actions(numbers)
        self.view.watch()

    def _update_actions(self, numbers: SessionNumbers | None = None) -> None:
        session = self.worker.session
        recording, streams = session.recording, session.streams
        active = [device for device in session.receivers if device.active]
        if recording:
            tip, able = f"End and save this take ({shortcuts.RECORD}).", True
        elif not session.ready:
            tip, able = (numbers.status if numbers else "Preparing the solver…"), False
        elif session.opening is not None:
            tip, able = "Waiting for the disk of the take folder. Recording begins when it answers.", False
        elif not streams:
            tip, able = "Connect a device first.", False
        else:
            tip, able = f"Begin the next take ({shortcuts.RECORD}).{self.recording.what}", True
        if able:
            self.recording.say_able()
        disconnect = "Disconnect all" if len(active) > 1 else "Disconnect"
        for action, text, enabled, tooltip in (
            (self.record_action, "Stop recording" if recording else "Record", able, tip),
            (self.mark_action, "Mark this moment", recording, f"Remember this moment ({shortcuts.MARK})."),
            (self.connect_action, disconnect if active else "Connect", not recording, ""),
            (self.review_action, "Review", not recording, ""),
        ):
            if action.text() != text:
                action.setText(text)
            if action.isEnabled() != enabled:
                action.setEnabled(enabled)
            if tooltip and action.toolTip() != tooltip:
                action.setToolTip(tooltip)

    def _recording_changed(self, recording: bool) -> None:
        if recording:
            self.plan.take_begun(self.worker.session.recording_name)
        set_property(self.tally, "recording", recording)
        self.setWindowTitle(window_title(f"● {self.worker.session.recording_name} - {TITLE}") if recording else TITLE)
        self._update_actions()

    def _devices_changed(self) -> None:
        save_devices(self.worker, self.settings)
        self._update_actions()
        self.view.devices_changed()

    def _profile_changed(self, profile: Profile) -> None:
        self.view.show_points_alone()
        own = tuple(prop for prop in profile.props if not any(prop is lent for lent in self.lent_props))
        self.settings.set(names.PROFILE_WHOLE, replace(profile, props=own).to_dict())
        others = self.worker.session.profiles[1:]
        self.settings.set(names.OTHER_PROFILES, [other.to_dict() for other in others])
        key = profile_key(profile)
        if key:
            self.settings.set(names.PROFILE, key)
            self.settings.set(names.HAND_SIZE, hand_size(profile))

    def _restore_look_ahead(self) -> None:
        ms = self.settings.get(names.LOOK_AHEAD_MS, 0)
        self.worker.set_look_ahead((ms if ms in LOOK_AHEAD_MS else 0) / 1000.0)
        self.worker.look_ahead_changed.connect(
            lambda seconds: self.settings.set(names.LOOK_AHEAD_MS, round(1000.0 * seconds))
        )

    def _restore_solve_every(self) -> None:
        n = self.settings.get(names.SOLVE_EVERY, 1)
        self.worker.set_solve_every(n if n in SOLVE_EVERY else 1)
        if (chosen := self.worker.session.solve_every) > 1:
            self.worker.notifications.info(
                f"{every_words(chosen, 0.0)}, as chosen before in Tracking.", source="Solver"
            )
        self.worker.solve_every_changed.connect(lambda n: self.settings.set(names.SOLVE_EVERY, n))

    def _watch_folder(self) -> None:
        if self.strip.folder != self.plan.folder:
            self.strip.folder = self.plan.folder
            self.worker.watch_disk(self.plan.folder)

    def _take_finished(self, summary: TakeSummary) -> None:
        self.plan.take_finished(summary.name, kept=summary.sealed or summary.written > 0)

    def _turn_page(self, review: bool) -> None:
        """Review has panels of its own: those of the live room go and come back as they were."""
        self.keys.leave_fields()
        if review and self._review is None:
            from app.review.review import Review

            self._review = Review(self.worker, self.plan, self.settings)
            for action, do in self._view_switches:
                do(self._review.viewport, action.isChecked())
            self.stacks.addStack(self._review.undo)
            self.pages.addWidget(self._review)
        if review:
            self._room.put_aside()
            self.pages.setCurrentIndex(1)
        else:
            self.pages.setCurrentIndex(0)
            self._room.bring_back()
        self.stacks.setActiveStack(self._review.undo if review and self._review is not None else self.undo)
        self.keys.leave_fields()

    # The end.

    def changeEvent(self, event: QEvent) -> None:  # noqa: D102, N802
        super().changeEvent(event)
        if event.type() == QEvent.Type.ActivationChange:
            self.keys.activated()

    def closeEvent(self, event: QCloseEvent) -> None:  # noqa: D102, N802
        self.keys.leave_fields()
        if not self._closing and not self.closing.may() and not self._closing:  # by then, without an answer
            event.ignore()
            return
        self._closing = True
        self._room.save()
        if not self._ended:
            self._ended = True
            self.picking.stop()
            self.training.stop()
            self.left_behind.stop()
            if self._review is not None:
                self._review.finish()
            finish(self, self.worker, TITLE)
        event.accept()

    @property
    def ended(self) -> bool:
        """It is being closed, or was."""
        return self._ended

    def stop_and_close(self) -> None:
        """Close without asking; a running take is saved."""
        self._closing = True
        self.close()
