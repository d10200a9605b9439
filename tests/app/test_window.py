"""The real window with a real session, on a server on loopback."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtWidgets import (
    QApplication,
    QCheckBox,
    QComboBox,
    QDoubleSpinBox,
    QLineEdit,
    QMessageBox,
    QSpinBox,
)

from app import settings as names
from app import theme
from app.main_window import MainWindow
from app.panels.parameter_form import ParameterForm
from app.session import Session
from app.settings import Settings
from app.take_summary import TakeSummary
from app.worker import SessionWorker
from core.frames import HandKey
from core.hand.shape import HandShape
from core.hand.sizes import SIZES
from core.profile import load_profile
from core.takes.reader import open_take
from devices.device import Level, Parameter
from devices.natnet.client import NatNetDevice
from tests.app.stage import own_threads, server, settings_for, until


@pytest.fixture
def stage():
    with server() as simulator:
        yield simulator


class Desk:
    """A window with its session, and what an operator does at it."""

    def __init__(self, qtbot, folder: Path, settings: Settings | None = None, profiles: object = None) -> None:
        self.qtbot = qtbot
        self.settings = settings or Settings(None)
        self.settings.set(names.TAKE_FOLDER, str(folder))
        theme.apply(QApplication.instance())
        self.session = Session(profiles or load_profile("han19"))
        self.worker = SessionWorker(self.session, 30)
        self.window = MainWindow(self.worker, self.settings)
        self.finished: list[TakeSummary] = []
        self.worker.take_finished.connect(self.finished.append)
        self.session.start()
        self.window.show()
        qtbot.waitExposed(self.window)

    def until(self, condition, what: str = "") -> None:
        until(condition, what, lambda seconds: self.qtbot.wait(round(seconds * 1000)))

    def click(self, widget) -> None:
        self.qtbot.mouseClick(widget, Qt.MouseButton.LeftButton)

    def add(self, simulator):
        return self.window.devices.add(NatNetDevice, settings_for(simulator))

    def connected(self, simulator):
        stream = self.add(simulator)
        self.click(self.card.toggle)
        self.until(lambda: stream.health().received > 0, "frames")
        self.until(lambda: self.window.record_action.isEnabled(), "the record button")
        return stream

    @property
    def card(self):
        return self.window.devices.cards[0]

    def close(self) -> None:
        self.window.stop_and_close()
        assert own_threads() == []


@pytest.fixture
def desk(qtbot, tmp_path):
    made = Desk(qtbot, tmp_path / "takes")
    yield made
    made.close()


def test_record_by_the_button_puts_a_take_on_disk(desk, stage):
    desk.connected(stage)
    name = desk.window.deck.take.text()
    desk.click(desk.window.deck.record)
    desk.until(lambda: (r := desk.session.numbers().recording) and r.received >= 60, "frames in the take")
    desk.until(lambda: desk.window.deck.record.text() == "Stop")
    assert desk.window.tally.property("recording") is True
    desk.window.mark_action.trigger()
    assert desk.window.recorder.marks.count() == 1
    desk.click(desk.window.recorder.record)
    desk.until(lambda: desk.finished, "the take to be sealed")
    summary = desk.finished[0]
    assert summary.name == name and summary.verdict.whole and summary.marks == 1
    with open_take(desk.window.plan.folder / f"{name}.mcap") as take:
        assert take.sealed and take.counts.received == len(take.raw) == summary.received >= 60
        assert take.info.device["kind"] == "natnet"
    desk.until(lambda: desk.window.deck.take.text() not in ("", name), "the number to advance")
    assert f"Received {summary.received:,} = written {summary.written:,}" in desk.window.recorder.last.counts.text()
    assert desk.window.recorder.last.light.level is (Level.WARNING if summary.unsolved else Level.GOOD)


def test_panels_show_a_tracked_hand(desk, stage, monkeypatch):
    desk.connected(stage)
    hands = desk.window.tracking.hands
    desk.until(lambda: all(card.light.level is Level.GOOD for card in hands.values()), "both hands green")
    desk.until(lambda: all(float(card.rms.text()) < 2.0 for card in hands.values()), "a tight fit")
    assert all(card.figures["Markers"].text().endswith("/ 19") for card in hands.values())
    shown = desk.window.tracking.stages.shown
    assert set(shown) == {"label", "solve", "validate", "find", "smooth", "whole frame"}
    strip = desk.window.strip
    desk.until(lambda: strip.stream.light.level is Level.GOOD and "Hz" in strip.stream.value.text())
    desk.until(lambda: strip.fit.light.level is Level.GOOD and strip.fit.value.text().endswith("mm"), "a fit")
    assert strip.disk.value.text().endswith("GB free") and strip.disk.toolTip()
    desk.until(lambda: len(desk.window.plots.curve("rms", "left")[0]) > 20, "curves")
    x, y = desk.window.plots.curve("angle", "right")
    assert len(x) == len(y) and x.min() >= -10.5 and x.max() <= 0.5
    assert np.nanmax(np.abs(y)) < 180
    low, high = (desk.window.plots.curve(bound, "right")[1] for bound in ("lower bound", "upper bound"))
    known = np.isfinite(y)
    assert (low[known] < y[known]).all() and (high[known] > y[known]).all()
    assert high[known] - y[known] == pytest.approx(y[known] - low[known])
    assert all(card.unsure.text().startswith("Least sure: ") for card in hands.values())
    mean, worst = (desk.window.plots.curve(what, "right")[1] for what in ("labels", "worst label"))
    known = np.isfinite(mean)
    assert known.sum() > 20 and (np.isfinite(worst) == known).all()
    assert (worst[known] <= mean[known]).all() and 90 < np.median(mean[known]) <= 100
    assert all(card.figures["Labels"].text().endswith(" %") for card in hands.values())
    asked = []
    monkeypatch.setattr(desk.session, "search_again", lambda *hand: asked.append(hand))
    desk.click(hands[HandKey(0, "right")].again)
    desk.click(desk.window.tracking.again)
    desk.window.search_action.trigger()
    assert asked == [(HandKey(0, "right"),), (), ()]


def test_server_gone_is_red_with_its_reason_and_recovers_to_green(desk):
    with server() as first:
        stream = desk.connected(first)
        ports = first.command_port, first.data_port
        desk.until(lambda: desk.card.light.level is Level.GOOD, "green")
    desk.until(lambda: desk.card.light.level is Level.PROBLEM, "red")
    assert "127.0.0.1" in desk.card.reason.text()
    desk.until(lambda: desk.window.strip.stream.light.level is Level.PROBLEM)
    desk.until(lambda: desk.window.viewport.message, "the view to say so")
    desk.until(lambda: any("127.0.0.1" in note.text for note in desk.window.messages.model.notes), "a message")
    assert all(card.light.level is Level.IDLE for card in desk.window.tracking.hands.values())
    with server(*ports):
        desk.until(lambda: desk.card.light.level is Level.GOOD, "green again")
        desk.until(lambda: not desk.window.viewport.message, "the hands to be seen again")
        assert stream.health().reconnects >= 1


def test_devices_are_added_and_removed_with_undo(desk, stage):
    window = desk.window
    desk.add(stage)
    assert len(window.devices.cards) == 1 and len(desk.session.receivers) == 1
    assert desk.settings.get(names.DEVICES, [])[0]["settings"]["command_port"] == stage.command_port
    window.undo.undo()
    assert window.devices.cards == [] and desk.session.receivers == []
    window.undo.redo()
    assert len(window.devices.cards) == 1
    desk.click(desk.card.drop)
    assert window.devices.cards == [] and window.undo.undoText().startswith("remove")
    window.undo.undo()
    assert desk.session.receivers[0].settings["command_port"] == stage.command_port


def test_a_setting_is_changed_and_undone(desk, stage):
    desk.add(stage)
    stream = desk.session.receivers[0]
    spin = desk.card.form.editor("data_port")
    spin.setValue(4321)
    spin.editingFinished.emit()
    assert stream.settings["data_port"] == 4321
    desk.window.undo.undo()
    assert stream.settings["data_port"] == stage.data_port


def test_changing_a_setting_of_a_connected_device_connects_it_anew(desk, stage):
    stream = desk.connected(stage)
    choice = desk.card.form.editor("points")
    desk.card.show_settings(True)
    before = stream.device
    choice.setCurrentIndex(1 - choice.currentIndex())
    desk.until(lambda: stream.device is not before and stream.health().received > 0, "frames from the new connection")
    assert stream.settings["points"] == choice.currentText()


def test_settings_are_locked_while_recording(desk, stage):
    desk.connected(stage)
    desk.window.record_action.trigger()
    desk.until(lambda: desk.session.recording)
    desk.until(lambda: not desk.card.toggle.isEnabled())
    assert not desk.card.form.editor("server").isEnabled() and not desk.card.drop.isEnabled()
    assert not desk.window.tracking.profile.isEnabled() and not desk.window.recorder.template.isEnabled()
    assert not desk.window.tracking.size.isEnabled()
    assert not desk.window.recorder.folder.isEnabled() and not desk.window.recorder.browse.isEnabled()
    assert not desk.window.deck.review.isEnabled()
    desk.window.record_action.trigger()
    desk.until(lambda: desk.finished)
    desk.until(lambda: desk.card.toggle.isEnabled())
    assert desk.card.form.editor("server").isEnabled() and desk.window.deck.review.isEnabled()
    assert desk.window.recorder.browse.isEnabled()


def test_a_form_follows_its_parameters(qtbot):
    parameters = (
        Parameter("flag", "Flag", True),
        Parameter("rate", "Rate", 120.0, "Hz", 30.0, 240.0, 0.5, help="How fast."),
        Parameter("port", "Port", 1510, "", 1, 65535, 1),
        Parameter("mode", "Mode", "a", choices=("a", "b"), locked_while_recording=False),
        Parameter("server", "Server", "host"),
        Parameter("file", "Recording", ""),
    )
    form = ParameterForm(parameters, {p.name: p.default for p in parameters})
    qtbot.addWidget(form)
    kinds = [type(form.editor(p.name)) for p in parameters]
    assert kinds == [QCheckBox, QDoubleSpinBox, QSpinBox, QComboBox, QLineEdit, QLineEdit]
    rate = form.editor("rate")
    assert (rate.minimum(), rate.maximum(), rate.singleStep(), rate.suffix()) == (30.0, 240.0, 0.5, " Hz")
    assert "How fast." in rate.toolTip() and "30 to 240 Hz" in rate.toolTip() and "Locked" in rate.toolTip()
    edits: list[tuple[str, object]] = []
    form.edited.connect(lambda name, value: edits.append((name, value)))
    form.editor("mode").setCurrentText("b")
    form.editor("flag").setChecked(False)
    rate.setValue(60.5)
    rate.editingFinished.emit()
    rate.editingFinished.emit()
    assert edits == [("mode", "b"), ("flag", False), ("rate", 60.5)]
    form.set_recording(True)
    assert form.editor("mode").isEnabled() and not rate.isEnabled() and not form.browse["file"].isEnabled()
    form.set_recording(False)
    assert form.browse["file"].isEnabled()


def test_profile_is_chosen_and_undone(desk):
    chooser = desk.window.tracking.profile
    chooser.setCurrentText("qualisys13")
    chooser.activated.emit(chooser.currentIndex())
    assert desk.session.profile.layout.name == "qualisys13"
    assert desk.settings.get(names.PROFILE, "") == "qualisys13"
    desk.window.undo.undo()
    assert desk.session.profile.layout.name == "han19" and chooser.currentText() == "han19"
    desk.window.tracking.choose("/nowhere/profile.json")
    assert desk.session.profile.layout.name == "han19"
    desk.until(lambda: any("nowhere" in note.text for note in desk.window.messages.model.notes))


def test_look_ahead_is_chosen_undone_remembered_and_seen_in_the_latency(desk, stage):
    chooser = desk.window.tracking.look_ahead
    assert [chooser.itemText(i) for i in range(chooser.count())] == ["Off", "50 ms", "100 ms", "200 ms"]
    assert chooser.currentText() == "Off" and "latency" in chooser.toolTip()
    desk.connected(stage)
    solver = lambda: desk.session.numbers().solver  # noqa: E731
    desk.until(lambda: solver().latency_s > 0)
    chooser.setCurrentIndex(3)
    chooser.activated.emit(3)
    assert desk.session.look_ahead_s == 0.2 and desk.settings.get(names.LOOK_AHEAD_MS, 0) == 200
    desk.until(lambda: solver().latency_s > 0.2, "poses that come later")
    desk.until(lambda: "200 ms is the look-ahead" in desk.window.strip.latency.toolTip(), "its word")
    desk.window.undo.undo()
    assert desk.session.look_ahead_s == 0.0 and chooser.currentText() == "Off"
    assert desk.settings.get(names.LOOK_AHEAD_MS, 1) == 0
    desk.window.undo.redo()
    again = MainWindow(SessionWorker(Session(load_profile("han19"))), desk.settings)
    assert again.worker.session.look_ahead_s == 0.2 and again.tracking.look_ahead.currentText() == "200 ms"
    again.stop_and_close()


def choose_size(desk, name: str) -> None:
    """As by the mouse: the list shows it, and it is picked."""
    chooser = desk.window.tracking.size
    chooser.setCurrentIndex(chooser.findData(name))
    assert chooser.currentData() == name
    chooser.activated.emit(chooser.currentIndex())


def test_hand_size_is_chosen_undone_and_remembered(desk):
    chooser = desk.window.tracking.size
    assert [chooser.itemData(i) for i in range(chooser.count())] == ["From the motion", *SIZES]
    assert chooser.currentData() == "From the motion" and "186 mm long" in chooser.toolTip()
    choose_size(desk, "XL")
    assert chooser.currentText() == "XL · 204 mm"
    assert desk.session.profile.shape is SIZES["XL"] and desk.session.profile.scale == 1.0
    assert "204 mm long" in chooser.toolTip() and desk.window.undo.undoText() == "hand size: XL"
    assert desk.settings.get(names.HAND_SIZE, "") == "XL"
    choose_size(desk, "XL")
    assert desk.window.undo.count() == 1  # nothing changed, nothing to undo
    desk.window.undo.undo()
    assert chooser.currentData() == "From the motion" == desk.settings.get(names.HAND_SIZE, "")
    assert desk.session.profile.scale is None
    desk.window.undo.redo()
    assert chooser.currentData() == "XL"
    desk.window.tracking.choose("qualisys13")  # another profile has a size of its own
    assert chooser.currentData() == "From the motion"


def test_a_calibrated_hand_can_be_left_and_taken_up_again(desk, tmp_path):
    own = replace(load_profile("han19"), performer="Ada", shape=HandShape.uniform(0.93), scale=1.0)
    (tmp_path / "ada.json").write_text(own.to_json(), encoding="utf-8")
    desk.window.tracking.choose(str(tmp_path / "ada.json"))
    chooser = desk.window.tracking.size
    assert chooser.currentData() == "Calibrated" and "173 mm long" in chooser.toolTip()
    choose_size(desk, "S")
    assert desk.session.profile.performer == "Ada" and desk.session.profile.shape is SIZES["S"]
    choose_size(desk, "Calibrated")
    assert desk.session.profile.shape.to_dict() == own.shape.to_dict() and desk.session.profile.scale == 1.0
    desk.window.tracking.choose("han19")
    assert chooser.findData("Calibrated") < 0  # it was Ada's


def test_a_size_is_solved_for(desk, stage):
    frames = []
    desk.worker.frame.connect(frames.append)
    choose_size(desk, "S")
    desk.connected(stage)
    desk.until(lambda: frames and len(frames[-1].solved.hands) == 2, "both hands")
    assert frames[-1].profile.shape is SIZES["S"]
    assert {hand.scale for hand in frames[-1].solved.hands} == {1.0}
    bones = np.linalg.norm(np.diff(frames[-1].solved.hands[0].joints_world[7:10, :3, 3], axis=0), axis=1)
    np.testing.assert_allclose(bones, frames[-1].profile.hand.skeleton.bone_lengths_m[8:10], atol=1e-9)


def test_take_name_follows_its_fields_and_undo(desk):
    recorder, plan = desk.window.recorder, desk.window.plan
    recorder.performer.setText("ada")
    recorder.performer.editingFinished.emit()
    recorder.shot.setText("pinch")
    recorder.shot.editingFinished.emit()
    assert recorder.name.text() == desk.window.deck.take.text() == "ada_pinch_001"
    plan.folder.mkdir(parents=True)
    (plan.folder / "ada_pinch_006.mcap").touch()
    plan.changed.emit()
    assert recorder.name.text() == "ada_pinch_007"
    desk.window.undo.undo()
    assert plan.shot == recorder.shot.text() == "shot" and plan.performer == "ada"
    recorder.template.setText("{performer}")
    recorder.template.editingFinished.emit()
    assert "take number" in recorder.name_problem.text() and recorder.template.property("wrong")
    desk.window.undo.undo()
    assert not recorder.name_problem.text() and recorder.name.text() == "ada_shot_001"


def test_the_layout_is_restored_and_can_be_reset(qtbot, tmp_path):
    path = tmp_path / "settings.json"
    first = Desk(qtbot, tmp_path, Settings(path))
    first.window.docks["tracking"].setVisible(False)
    first.window.tabifyDockWidget(first.window.docks["devices"], first.window.docks["recorder"])
    first.close()
    second = Desk(qtbot, tmp_path, Settings(path))
    window = second.window
    assert not window.docks["tracking"].isVisible()
    assert window.docks["recorder"] in window.tabifiedDockWidgets(window.docks["devices"])
    window.reset_layout()
    assert window.docks["tracking"].isVisible()
    assert window.docks["recorder"] not in window.tabifiedDockWidgets(window.docks["devices"])
    second.close()


def test_review_leaves_the_live_room_as_it_was(desk):
    desk.window.resize(1366, 728)
    desk.qtbot.wait(50)
    before = {key: dock.size() for key, dock in desk.window.docks.items() if key != "messages"}
    desk.window.show_review(True)
    desk.qtbot.wait(50)
    desk.window.show_review(False)
    desk.qtbot.wait(50)
    assert {key: dock.size() for key, dock in desk.window.docks.items() if key != "messages"} == before
    assert (desk.window.width(), desk.window.height()) == (1366, 728)
    desk.window.resize(1280, 700)
    desk.qtbot.wait(50)
    assert desk.window.width() == 1280


def test_devices_and_names_are_remembered(qtbot, tmp_path, stage):
    path = tmp_path / "settings.json"
    first = Desk(qtbot, tmp_path, Settings(path))
    first.add(stage)
    first.window.plan.set_performer("ada")
    first.close()
    second = Desk(qtbot, tmp_path, Settings(path))
    assert second.session.receivers[0].settings["command_port"] == stage.command_port
    assert not second.session.receivers[0].active and second.window.recorder.performer.text() == "ada"
    second.close()


def test_switches_of_the_view_have_keys_and_are_remembered(qtbot, tmp_path):
    path = tmp_path / "settings.json"
    first = Desk(qtbot, tmp_path, Settings(path))
    first.window.raise_()
    first.window.activateWindow()
    first.until(first.window.isActiveWindow, "the window to be active")
    assert not first.window.viewport.names_shown and not first.window.viewport.coloured_by_digit
    qtbot.keyClick(first.window, Qt.Key.Key_N)
    qtbot.keyClick(first.window, Qt.Key.Key_D)
    assert first.window.viewport.names_shown and first.window.viewport.coloured_by_digit
    qtbot.keyClick(first.window, Qt.Key.Key_D)
    first.close()
    second = Desk(qtbot, tmp_path, Settings(path))
    assert second.window.viewport.names_shown and not second.window.viewport.coloured_by_digit
    second.window.show_review(True)
    assert second.window.shown_viewport is not second.window.viewport
    assert second.window.shown_viewport.names_shown and not second.window.shown_viewport.coloured_by_digit
    second.close()


def test_settings_that_cannot_be_read_are_set_aside(tmp_path):
    path = tmp_path / "settings.json"
    path.write_text("{not json")
    settings = Settings(path)
    assert settings.get(names.PROFILE, "han19") == "han19" and not path.exists()
    settings.set(names.PROFILE, "qualisys13")
    assert Settings(path).get(names.PROFILE, "") == "qualisys13"
    assert Settings(path).get(names.PROFILE, 3) == 3


@pytest.mark.parametrize("answer", [QMessageBox.StandardButton.Cancel, QMessageBox.StandardButton.Save])
def test_closing_while_recording_asks_and_saves(qtbot, tmp_path, stage, monkeypatch, answer):
    desk = Desk(qtbot, tmp_path)
    desk.connected(stage)
    desk.window.record_action.trigger()
    desk.until(lambda: (r := desk.session.numbers().recording) and r.received >= 20)
    path = desk.session.numbers().recording.path
    asked = []
    monkeypatch.setattr(QMessageBox, "question", lambda *args: asked.append(args[2]) or answer)
    closed = desk.window.close()
    assert len(asked) == 1 and path.stem in asked[0]
    if answer is QMessageBox.StandardButton.Cancel:
        assert not closed and desk.session.recording
        desk.close()
    assert own_threads() == []
    with open_take(path) as take:
        assert take.sealed and take.counts.balanced and len(take.raw) >= 20


def test_recording_a_silent_device_asks(desk, monkeypatch):
    with server() as gone:
        desk.connected(gone)
    desk.until(lambda: desk.card.light.level is Level.PROBLEM)
    asked = []
    monkeypatch.setattr(
        QMessageBox, "warning", lambda *args: asked.append(args[2]) or QMessageBox.StandardButton.Cancel
    )
    desk.window.record_action.trigger()
    assert len(asked) == 1 and "127.0.0.1" in asked[0] and not desk.session.recording


def test_keys_work_and_are_listed(desk, stage):
    desk.connected(stage)
    window = desk.window
    window.raise_()
    window.activateWindow()
    desk.until(window.isActiveWindow, "the window to be active")
    desk.qtbot.keyClick(window, Qt.Key.Key_R, Qt.KeyboardModifier.ControlModifier)
    desk.until(lambda: desk.session.recording, "recording by Ctrl+R")
    desk.until(lambda: window.mark_action.isEnabled())
    desk.qtbot.keyClick(window, Qt.Key.Key_M)
    desk.until(lambda: window.recorder.marks.count() == 1, "a mark by M")
    desk.qtbot.keyClick(window, Qt.Key.Key_R, Qt.KeyboardModifier.ControlModifier)
    desk.until(lambda: desk.finished)
    assert desk.finished[0].marks == 1
    from app.shortcuts import TABLE

    listed = {key for _, rows in TABLE for key, _ in rows}
    used = {action.shortcut().toString() for action in window.actions() if not action.shortcut().isEmpty()}
    assert used <= listed | {"Ctrl+Y"}


def test_messages_are_shown_copied_and_cleared(desk):
    notes = desk.worker.notifications
    notes.warning("The cable is loose.", "Push it in.")
    notes.error(ValueError("odd"), "Solver", "Solving a frame")
    panel = desk.window.messages
    desk.until(lambda: panel.model.rowCount() == 2)
    texts = [panel.model.index(0, column).data() for column in range(1, 4)]
    assert texts == ["warning", "The cable is loose.", "Push it in."]
    panel.copy()
    copied = QApplication.clipboard().text()
    assert "The cable is loose. Push it in." in copied and "ValueError: odd" in copied
    assert "ValueError: odd" not in panel.model.index(1, 2).data() and "odd" in panel.model.index(1, 2).data()
    panel.clear()
    assert panel.model.rowCount() == 0 and notes.history == []


def test_nothing_is_clipped_at_a_small_screen(desk, stage):
    desk.connected(stage)
    window = desk.window
    window.resize(1366, 768)
    desk.qtbot.wait(200)
    assert window.width() <= 1366 and window.height() <= 768
    assert window.viewport.width() >= 400 and window.viewport.height() >= 250
    for button in (window.deck.record, window.deck.live, window.deck.review, desk.card.toggle):
        assert button.width() >= button.fontMetrics().horizontalAdvance(button.text()) + 8
        corner = button.mapTo(window, QPoint(button.width(), button.height()))
        assert corner.x() <= window.width() and corner.y() <= window.height()
