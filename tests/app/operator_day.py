"""A capture day in the real window, by keys and mouse alone: started by test_operator_day, in a process of its own.

`python -m tests.app.operator_day FOLDER` on a display of any size. Fails at the first thing that does not hold.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path

from PySide6.QtCore import QPoint, QPointF, Qt, QTimer
from PySide6.QtGui import QWheelEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QComboBox, QDialog, QLineEdit, QMenu, QPlainTextEdit, QWidget

from app import settings as names
from app.application import start
from app.clock import clock
from app.review.solve_dialog import SolveDialog
from app.settings import Settings
from core.frames import HandState
from core.level import Level
from core.takes.reader import open_take
from tests.app.stage import server

CTRL, SHIFT = Qt.KeyboardModifier.ControlModifier, Qt.KeyboardModifier.ShiftModifier
LONG = "the_hand_takes_the_cup_and_puts_it_down_again_beside_the_plate_while_the_other_waits"
SLOWLY_MS = 130
"""Between keys: the panels refresh in between."""
PATIENCE_S = 180.0


class Day:
    """The window, and the hands of an operator."""

    def __init__(self, folder: Path) -> None:
        settings = Settings(folder / "settings.json")
        settings.set(names.TAKE_FOLDER, str(folder / "takes"))
        running = start(settings)
        sys.excepthook = sys.__excepthook__  # what does not hold is for the test, not for the operator
        self.window, self.session, self.worker = running.window, running.session, running.window.worker
        self.finished: list = []
        self.worker.take_finished.connect(self.finished.append)
        self.screen = running.application.primaryScreen().availableGeometry()
        self.front()

    def until(self, condition: Callable[[], object], what: str) -> None:
        deadline = time.monotonic() + PATIENCE_S
        while not condition():
            assert time.monotonic() < deadline, f"waited for {what}"
            QTest.qWait(20)

    def front(self) -> None:
        """Without a window manager no window takes the keys by itself."""
        self.window.raise_()
        self.window.activateWindow()
        self.until(self.window.isActiveWindow, "the window to be active")

    def press(self, key: object, modifier: Qt.KeyboardModifier = Qt.KeyboardModifier.NoModifier) -> None:
        QTest.keyClick(QApplication.focusWidget() or QApplication.activeWindow(), key, modifier)

    def write(self, text: str, delay_ms: int = SLOWLY_MS) -> None:
        for letter in text:
            self.press(letter)
            QTest.qWait(delay_ms)

    def replace(self, editor: QWidget, text: str, delay_ms: int = SLOWLY_MS) -> None:
        self.click(editor)
        self.press(Qt.Key.Key_A, CTRL)
        self.write(text, delay_ms)

    def click(self, widget: QWidget, button: Qt.MouseButton = Qt.MouseButton.LeftButton, at: QPoint | None = None):
        QTest.mouseClick(widget, button, pos=at if at is not None else widget.rect().center())

    def wheel(self, widget: QWidget) -> None:
        at = QPointF(widget.rect().center())
        for _ in range(12):
            event = QWheelEvent(
                at, QPointF(widget.mapToGlobal(at.toPoint())), QPoint(), QPoint(0, -120), Qt.MouseButton.NoButton,
                Qt.KeyboardModifier.NoModifier, Qt.ScrollPhase.NoScrollPhase, False,
            )  # fmt: skip
            QApplication.sendEvent(widget, event)
            QTest.qWait(100)

    def from_menu(self, open_menu: Callable[[], None], text: str) -> None:
        """A menu holds the keys until one chooses."""

        def choose() -> None:
            menu = QApplication.activePopupWidget()
            assert isinstance(menu, QMenu)
            action = next(action for action in menu.actions() if text in action.text())
            QTest.mouseClick(menu, Qt.MouseButton.LeftButton, pos=menu.actionGeometry(action).center())

        QTimer.singleShot(400, choose)
        open_menu()

    def at_next_dialog(self, kind: type[QDialog], do: Callable[[QDialog], None]) -> None:
        def look() -> None:
            dialog = QApplication.activeModalWidget()
            if isinstance(dialog, kind):
                do(dialog)
            else:
                QTimer.singleShot(50, look)

        QTimer.singleShot(50, look)

    def in_no_field(self) -> None:
        holder = QApplication.focusWidget()
        assert not isinstance(holder, QLineEdit | QPlainTextEdit | QComboBox), holder

    def fits(self) -> None:
        assert self.screen.contains(self.window.frameGeometry()), (self.screen, self.window.frameGeometry())

    def record(self) -> None:
        self.front()
        self.press(Qt.Key.Key_R, CTRL)
        self.until(lambda: self.session.recording and self.session.numbers().recording.received > 30, "a take")

    def stop(self):
        n = len(self.finished)
        self.press(Qt.Key.Key_R, CTRL)
        self.until(lambda: len(self.finished) > n, "the take's end")
        return self.finished[-1]

    # The day.

    def begins(self) -> None:
        self.fits()
        self.in_no_field()
        before = {line: line.text() for line in self.window.findChildren(QLineEdit)}
        for key in "MFHB":
            self.press(key)
        assert before == {line: line.text() for line in self.window.findChildren(QLineEdit)}
        self.press(Qt.Key.Key_R, CTRL)  # nothing is connected: said where one looks
        self.until(lambda: self.window.deck.refusal.isVisible(), "why nothing is recorded")
        assert (
            "No device is connected" in self.window.deck.refusal.text()
            or "not ready" in self.window.deck.refusal.text()
        )

    def connects(self, simulator) -> None:
        devices = self.window.devices
        self.from_menu(lambda: self.click(devices.add_button), "OptiTrack")
        self.until(lambda: devices.cards, "the device's card")
        card = devices.cards[0]
        self.until(lambda: card.form.isVisible(), "its settings")
        form, scroll = card.form, devices._area
        for name, text in (
            ("local", "127.0.0.1"), ("command_port", str(simulator.command_port)),
            ("data_port", str(simulator.data_port)), ("server", "127.0.0.1"),
        ):  # fmt: skip
            editor = form.editor(name)
            scroll.ensureWidgetVisible(editor)
            self.replace(editor, text)
        self.press(Qt.Key.Key_Return)
        stream = card.stream
        self.until(lambda: stream.health().received > 0, "frames")
        assert stream.settings["server"] == "127.0.0.1"
        assert "127.0.0.1" in card.name.text() and "127.0.0.1" in self.window.deck.device.text()
        self.until(self._all_tracked, "the hands")
        self.until(self.window.record_action.isEnabled, "the record button")
        assert not self.window.deck.refusal.isVisible()
        for _ in range(5):
            QTest.qWait(200)
            assert card._figures["Latency"].text() == self.window.strip.latency.value.text()
        self.in_no_field()

    def _all_tracked(self) -> bool:
        frame = self.session.latest.peek()
        hands = frame.solved.hands if frame is not None else ()
        return bool(hands) and all(hand.state is HandState.TRACKED for hand in hands)

    def scrolls(self) -> None:
        tracking, profile = self.window.tracking, self.session.profile
        block = tracking.performers.blocks[0]
        boxes = (block.profile, block.size, tracking.look_ahead, self.window.plots.angle)
        chosen = [box.currentIndex() for box in boxes]
        for box in boxes:
            self.wheel(box)
        assert chosen == [box.currentIndex() for box in boxes]
        assert self.session.profile is profile

    def records_what_was_typed(self) -> None:
        recorder, width = self.window.recorder, self.window.width()
        self.replace(recorder.shot, LONG, 20)
        self.replace(recorder.notes, "before", 20)
        self.record()
        assert LONG in self.session.recording_name, "what was typed and not left"
        self.in_no_field()
        assert self.window.width() == width
        self.fits()
        self.press("M")
        self.press("F")
        self.until(lambda: recorder.marks.count() == 1, "the mark")
        assert recorder.template.text() == "{performer}_{shot}_{take:03}"
        self.click(recorder.notes)
        self.press(Qt.Key.Key_End, CTRL)
        self.write(" and while")
        summary = self.stop()
        assert recorder.notes.toPlainText() == ""
        self.in_no_field()
        with open_take(summary.path) as take:
            assert take.info.notes == "before and while", take.info.notes
            assert len(take.marks) == 1
        assert summary.verdict.level in (Level.GOOD, Level.WARNING)

    def loses_the_server(self, simulator) -> None:
        self.replace(self.window.recorder.shot, "spoon", 20)
        self.record()
        simulator.stop()
        self.until(lambda: "none for" in self.window.deck.frames.text(), "the deck to say so")
        simulator.start()
        received = self.session.numbers().recording.received
        self.until(lambda: self.session.numbers().recording.received > received + 60, "frames again")
        summary = self.stop()
        with open_take(summary.path) as take:
            verdict, holes = take.verdict, take.holes
            assert take.info.notes == "", "the next begins empty"
        assert verdict.level is Level.PROBLEM and holes.seconds > 0.9 and summary.verdict == verdict
        deck, card = self.window.deck, self.window.recorder.last
        assert verdict.headline in deck.frames.text() and holes.words in card.reason.text()
        assert card.light.level is Level.PROBLEM
        assert deck.elapsed.text() == clock(summary.duration_s) and clock(summary.duration_s) in card.counts.text()
        assert self.window.docks["plots"].visibleRegion().isEmpty() is False, "messages stay behind"

    def changes_the_layout(self) -> None:
        self.until(self._all_tracked, "the hands")
        box = self.window.tracking.performers.blocks[0].profile
        other = next(i for i in range(box.count()) if box.itemText(i).startswith("qualisys13"))
        box.setFocus()
        seen = []
        self.worker.frame.connect(seen.append)
        self.press(Qt.Key.Key_Home)
        while box.currentIndex() != other:
            self.press(Qt.Key.Key_Down)
        self.until(lambda: self.session.profile.layout.name == "qualisys13", "the layout")
        changed = len(seen)
        self.until(lambda: len(seen) > changed + 10, "frames of it")
        assert {frame.profile.layout.name for frame in seen[changed:]} == {"qualisys13"}
        self.worker.frame.disconnect(seen.append)
        self.front()
        while self.session.profile.layout.name != "han19":  # every key was a step
            self.press(Qt.Key.Key_Z, CTRL)
            QTest.qWait(50)
        self.until(self._all_tracked, "the hands")

    def reviews(self, takes: Path) -> None:
        (takes / "torn.mcap").write_bytes(b"\x89MCAP0\r\n" + b"nothing")
        steps = self.window.undo.index()
        self.front()
        self.press(Qt.Key.Key_2, CTRL)
        room = self.window._review
        view, model = room.browser.view, room.browser.view.model()
        self.until(lambda: model.rowCount() == 3, "the list")
        self.until(lambda: all(model.index(i, 3).data() for i in range(3)), "the list to be read")
        found = [str(model.index(i, 1).data()) for i in range(3)]
        long, spoon = (next(name for name in found if part in name) for part in ("_the_hand", "_spoon_"))

        def row(name: str) -> int:
            return next(i for i in range(3) if model.index(i, 1).data() == name)

        def at(name: str) -> QPoint:
            return view.visualRect(model.index(row(name), 1)).center()

        def open_by(button: Qt.MouseButton, name: str) -> None:
            if button == Qt.MouseButton.RightButton:
                QTimer.singleShot(600, lambda: (popup := QApplication.activePopupWidget()) and popup.close())
            self.click(view.viewport(), button, at(name))

        open_by(Qt.MouseButton.LeftButton, spoon)
        self.until(lambda: room.document is not None and room.document.info.name == spoon, "the take")
        self.until(lambda: room.document.analysis is not None, "its analysis")
        assert room.inspector.light.level is Level.PROBLEM
        assert room.inspector.problems.text() == "\n".join(self.finished[-1].verdict.texts)
        assert clock(self.finished[-1].duration_s) in room.inspector.facts.text()

        open_by(Qt.MouseButton.LeftButton, "torn")
        self.until(lambda: room.document is None, "the take that cannot be read")
        self.until(lambda: "cannot be read" in room.viewport.message or "not a take" in room.viewport.message, "why")
        open_by(Qt.MouseButton.RightButton, long)
        self.until(lambda: room.document is not None and room.document.info.name == long, "what was selected")
        self.until(lambda: room.document.analysis is not None, "its analysis")
        self.click(room.inspector._ratings.button(1))
        assert room.document.info.rating == "A" and room.document.info.name == long

        # In and out, by keys, and back.
        self.front()
        room.viewport.setFocus()
        for _ in range(5):
            self.press(Qt.Key.Key_Right)
        self.press(Qt.Key.Key_I, CTRL)
        assert room.player.in_frame == 5
        self.press(Qt.Key.Key_Z, CTRL)
        assert room.player.in_frame == 0 and self.window.undo.index() == steps, "live is left alone"

        # Solved again, and not dropped without a question.
        recorded = room.document.solved
        self.at_next_dialog(SolveDialog, lambda dialog: dialog.accept())
        self.click(room.solutions.solve)
        self.until(lambda: room.document.solved is not recorded, "the new solution")
        self.front()
        open_by(Qt.MouseButton.LeftButton, spoon)
        self.until(lambda: room.leaving.box is not None and room.leaving.box.isVisible(), "the question")
        keep = next(button for button in room.leaving.box.buttons() if button.text() == "Cancel")
        QTest.mouseClick(keep, Qt.MouseButton.LeftButton, delay=50)
        QTest.qWait(400)
        assert room.document.info.name == long and view.currentIndex().row() == row(long)
        self.front()
        room.viewport.setFocus()
        self.press(Qt.Key.Key_Z, CTRL)
        assert room.document.solved is recorded, "solving again is undone"
        self.fits()

    def ends(self) -> None:
        self.front()
        self.press(Qt.Key.Key_1, CTRL)
        self.until(lambda: self.window.pages.currentIndex() == 0, "live")
        self.press(Qt.Key.Key_K, CTRL)
        self.until(lambda: not any(one.active for one in self.session.receivers), "the device to go")
        self.click(self.window.devices.find_button)
        self.until(lambda: self.window.devices.find_button.isEnabled(), "the search")
        # Nothing else streams in a test, or somebody does: then it is offered.
        popup = QApplication.activePopupWidget()
        if popup is not None:
            popup.close()


def main(folder: Path) -> None:
    """All of it; prints OK."""
    day = Day(folder)
    try:
        with server() as simulator:
            day.begins()
            day.until(lambda: day.session.ready, "the solver")
            day.connects(simulator)
            day.scrolls()
            day.records_what_was_typed()
            day.loses_the_server(simulator)
            day.changes_the_layout()
            day.reviews(folder / "takes")
            day.ends()
    finally:
        if len(sys.argv) > 2:
            day.window.grab().save(sys.argv[2])
        day.window.stop_and_close()
    print("OK")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
