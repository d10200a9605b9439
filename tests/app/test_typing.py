"""Typing, pasting and pressing keys in the window while everything refreshes ten times a second."""

from __future__ import annotations

import pytest
from PySide6.QtCore import Qt, QTimer
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QAbstractSpinBox, QApplication, QCheckBox, QComboBox, QLineEdit, QMenu, QPlainTextEdit

from app.application import DemoDevice
from app.editing import Field
from app.file_device import FileDevice
from core.profile import load_profile
from core.takes.reader import open_take
from devices.natnet.client import NatNetDevice
from tests.app.stage import server, settings_for
from tests.app.test_window import Desk

CTRL = Qt.KeyboardModifier.ControlModifier
SLOWLY_MS = 120
"""Between keys: the panels refresh in between, and the whole takes longer than a second."""


@pytest.fixture
def stage():
    with server() as simulator:
        yield simulator


@pytest.fixture
def desk(qtbot, tmp_path):
    made = Desk(qtbot, tmp_path / "takes")
    front(made)
    yield made
    made.close()


def front(desk):
    desk.window.raise_()
    desk.window.activateWindow()
    desk.until(desk.window.isActiveWindow, "the window to be active")


def press(key, modifier=Qt.KeyboardModifier.NoModifier):
    """As the keyboard does: whoever has the focus gets it."""
    QTest.keyClick(QApplication.focusWidget() or QApplication.activeWindow(), key, modifier)


def write(text, delay_ms=SLOWLY_MS):
    for letter in text:
        press(letter)
        QTest.qWait(delay_ms)


def replace(desk, editor, text, delay_ms=SLOWLY_MS):
    """Click into a field and write over what is there."""
    desk.click(editor)
    press(Qt.Key.Key_A, CTRL)
    write(text, delay_ms)


def nowhere(desk):
    """The keys go to the 3D view, and no field has them."""
    return QApplication.focusWidget() is desk.window.shown_viewport


# Nothing is written over.


def test_an_address_is_typed_and_pasted_while_frames_come(desk, stage):
    stream = desk.connected(stage)
    desk.card.show_settings(True)
    editor = desk.card.form.editor("server")
    steps = desk.window.undo.count()
    replace(desk, editor, "127.0.0.77")
    assert editor.text() == "127.0.0.77" and stream.settings["server"] == "127.0.0.1"
    QApplication.clipboard().setText("127.0.0.88")
    press(Qt.Key.Key_A, CTRL)
    press(Qt.Key.Key_V, CTRL)
    QTest.qWait(1200)
    assert editor.text() == "127.0.0.88" and desk.window.undo.count() == steps
    press(Qt.Key.Key_Z, CTRL)  # the field's own
    QTest.qWait(300)
    assert editor.text() == "127.0.0.77" and desk.window.undo.index() == steps
    press(Qt.Key.Key_Tab)
    desk.until(lambda: stream.settings["server"] == "127.0.0.77", "the address to be used")
    assert editor.text() == "127.0.0.77" and desk.window.undo.count() == steps + 1
    desk.window.undo.undo()
    desk.until(lambda: stream.settings["server"] == "127.0.0.1", "the address to be back")
    desk.until(lambda: editor.text() == "127.0.0.1", "and shown")


@pytest.mark.long
def test_two_settings_typed_one_after_the_other_are_both_used(desk, stage):
    """The second is typed while the device is connected anew with the first."""
    stream = desk.connected(stage)
    desk.card.show_settings(True)
    form = desk.card.form
    replace(desk, form.editor("group"), "239.1.2.3", 10)
    desk.click(form.editor("points"))
    press(Qt.Key.Key_Escape)
    press(Qt.Key.Key_Down)
    chosen = form.editor("points").currentText()
    assert desk.worker.reconnecting(stream) and stream.settings["points"] != chosen
    desk.worker.devices_changed.emit()  # as the one that goes away says
    assert form.editor("points").currentText() == chosen and form.editor("group").text() == "239.1.2.3"
    QTest.qWait(1500)
    assert form.editor("points").currentText() == chosen and form.editor("group").text() == "239.1.2.3"
    desk.until(lambda: stream.settings["group"] == "239.1.2.3" and stream.settings["points"] == chosen, "both")


def test_what_a_device_refuses_stays_to_be_mended(desk, stage):
    desk.add(stage)
    stream, form = desk.session.receivers[0], desk.card.form
    replace(desk, form.editor("group"), "10.0.0.1", 10)
    press(Qt.Key.Key_Tab)
    QTest.qWait(300)
    desk.worker.devices_changed.emit()
    assert form.editor("group").text() == "10.0.0.1" and form.editor("group").property("wrong") is True
    assert "multicast" in form.problems["group"].text() and form.problems["group"].isVisible()
    assert stream.settings["group"] == "239.255.42.99"
    replace(desk, form.editor("group"), "239.255.42.98", 10)
    press(Qt.Key.Key_Tab)
    assert stream.settings["group"] == "239.255.42.98" and not form.problems["group"].isVisible()
    assert form.editor("group").property("wrong") is False


def test_no_panel_writes_into_a_field_that_somebody_is_at(desk, stage):
    """Every text and number field of the window, whatever changes behind it."""
    window = desk.window
    window.resize(1600, 1000)
    desk.add(stage)
    for kind in (FileDevice, DemoDevice):
        window.devices.add(kind, {})
    for card in window.devices.cards:
        card.show_settings(True)
    desk.worker.set_profiles((load_profile("han19"), load_profile("han19")))
    QTest.qWait(100)
    tried = 0
    for field in window.findChildren(Field):
        editor = field.editor
        if isinstance(editor, QComboBox | QCheckBox) or not editor.isVisible():
            continue
        editor.setFocus()
        if isinstance(editor, QLineEdit | QAbstractSpinBox):
            editor.selectAll()
        write("3", 0)  # in the range of every number there is
        holds = editor.toPlainText() if isinstance(editor, QPlainTextEdit) else editor.text()
        assert "3" in holds
        for changed in (desk.worker.devices_changed, window.plan.changed, window.plan.notes_changed):
            changed.emit()
        desk.worker.set_profiles(tuple(desk.session.profiles))
        QTest.qWait(130)
        assert holds == (editor.toPlainText() if isinstance(editor, QPlainTextEdit) else editor.text()), field.editor
        press(Qt.Key.Key_Escape)
        if isinstance(editor, QPlainTextEdit):
            editor.clear()
        tried += 1
    assert tried >= 4 + 4 + 2 + 5 + 2  # of NatNet, the recorder, two performers, the demo, the file


def test_a_field_catches_up_when_it_is_left(desk):
    recorder, plan = desk.window.recorder, desk.window.plan
    desk.click(recorder.shot)
    plan.set_shot("elsewhere")
    QTest.qWait(300)
    assert recorder.shot.text() == "shot"
    press(Qt.Key.Key_Tab)
    assert recorder.shot.text() == "elsewhere" == plan.shot and desk.window.undo.count() == 0


def test_escape_puts_back_what_was_there(desk):
    recorder, plan = desk.window.recorder, desk.window.plan
    replace(desk, recorder.shot, "oops", 10)
    assert recorder.name.text() == "performer_oops_001"
    press(Qt.Key.Key_Escape)
    assert recorder.shot.text() == "shot" == plan.shot and recorder.name.text() == "performer_shot_001"
    assert nowhere(desk) and desk.window.undo.count() == 0


def test_a_list_that_is_open_is_not_made_anew(desk):
    chooser = desk.window.tracking.profile
    chooser.showPopup()
    desk.until(lambda: chooser.view().isVisible())
    chooser.view().setCurrentIndex(chooser.model().index(3, 0))
    desk.worker.profile_changed.emit(desk.session.profile)
    QTest.qWait(200)
    assert chooser.view().isVisible() and chooser.view().currentIndex().row() == 3
    chooser.hidePopup()
    desk.until(lambda: chooser.currentText() == "han19")


# Enter, titles.


@pytest.mark.parametrize("key", [Qt.Key.Key_Return, pytest.param(Qt.Key.Key_Enter, marks=pytest.mark.long)])
def test_enter_in_an_address_connects(desk, stage, key):
    stream = desk.window.devices.add(NatNetDevice, {**settings_for(stage), "server": "127.0.0.9"})
    assert "127.0.0.9" in desk.card.name.text()
    replace(desk, desk.card.form.editor("server"), "127.0.0.1", 20)
    press(key)
    assert stream.settings["server"] == "127.0.0.1"
    desk.until(lambda: stream.health().received > 0, "frames")
    assert "127.0.0.1" in desk.card.name.text() and nowhere(desk)
    desk.until(lambda: f"{stream.title} · " in desk.window.deck.device.text(), "the same title in the deck")
    replace(desk, desk.card.form.editor("local"), "127.0.0.2", 20)
    before = stream.device
    press(key)
    desk.until(lambda: stream.device is not before and stream.health().received > 0, "frames from the other interface")
    assert stream.settings["local"] == "127.0.0.2"


def test_titles_tell_devices_of_one_kind_apart(desk, tmp_path):
    for address in ("192.168.1.20", "192.168.1.21"):
        desk.window.devices.add(NatNetDevice, {"server": address})
    desk.window.devices.add(NatNetDevice, {})
    desk.window.devices.add(NatNetDevice, {"command_port": 2000})
    desk.window.devices.add(NatNetDevice, {"transmission": "listen only"})
    desk.window.devices.add(FileDevice, {"file": str(tmp_path / "walk.trc")})
    titles = [card.name.text() for card in desk.window.devices.cards]
    assert titles == [
        "OptiTrack (NatNet) 192.168.1.20", "OptiTrack (NatNet) 192.168.1.21", "OptiTrack (NatNet) 127.0.0.1",
        "OptiTrack (NatNet) 127.0.0.1:2000", "OptiTrack (NatNet) 239.255.42.99", "Recording walk.trc",
    ]  # fmt: skip
    title = desk.window.devices.cards[0].name
    assert title.lines(500) == [titles[0]] and title.lines(150) == ["OptiTrack (NatNet)", "192.168.1.20"]
    assert all(card.name.toolTip() == title for card, title in zip(desk.window.devices.cards, titles, strict=True))


# What was typed and not left.


def recorded(desk, name):
    desk.until(lambda: desk.session.recording, "the take to begin")
    assert desk.session.recording_name == name
    desk.until(lambda: (r := desk.session.numbers().recording) and r.received >= 5, "frames")


def stopped(desk):
    n = len(desk.finished)
    press(Qt.Key.Key_R, CTRL)
    desk.until(lambda: len(desk.finished) > n, "the take to be sealed")
    desk.until(lambda: desk.window.record_action.isEnabled())
    return desk.finished[-1]


def notes_of(summary):
    with open_take(summary.path) as take:
        return take.info.notes


def test_a_take_has_the_name_that_was_typed_and_not_left(desk, stage):
    desk.connected(stage)
    recorder, deck = desk.window.recorder, desk.window.deck
    desk.click(recorder.shot)
    press(Qt.Key.Key_A, CTRL)
    for letter, name in zip("wave", ("w", "wa", "wav", "wave"), strict=True):
        write(letter)
        assert recorder.name.text() == deck.take.text() == f"performer_{name}_001"
    press(Qt.Key.Key_R, CTRL)
    assert nowhere(desk) and desk.window.undo.undoText() == "change shot"
    recorded(desk, "performer_wave_001")
    stopped(desk)
    replace(desk, recorder.performer, "ada", 10)
    desk.click(deck.record)
    recorded(desk, "ada_wave_001")
    stopped(desk)
    replace(desk, recorder.template, "{shot}{take}", 10)
    desk.click(recorder.record)
    recorded(desk, "wave1")
    stopped(desk)
    desk.click(recorder.template)
    press(Qt.Key.Key_A, CTRL)
    write("{shot", 10)
    assert "template" in recorder.name_problem.text() and deck.take.text() == "No valid name"
    press(Qt.Key.Key_Escape)
    assert deck.take.text() == "wave2" and not recorder.name_problem.text()
    for _ in range(3):
        desk.window.undo.undo()
    assert deck.take.text() == "performer_shot_001"


def test_undo_of_the_menu_takes_back_what_was_typed_last(desk):
    plan = desk.window.plan
    replace(desk, desk.window.recorder.performer, "ada", 10)
    replace(desk, desk.window.recorder.shot, "wave", 10)
    edit = next(menu for menu in desk.window.menuWidget().findChildren(QMenu) if menu.title() == "Edit")
    QTimer.singleShot(100, lambda: press_in(edit))
    edit.exec(desk.window.mapToGlobal(desk.window.rect().center()))
    assert (plan.performer, plan.shot) == ("ada", "shot") and desk.window.recorder.shot.text() == "shot"


def press_in(menu):
    assert menu.actions()[0].text() == "Undo change shot"
    QTest.keyClick(menu, Qt.Key.Key_Down)
    QTest.keyClick(menu, Qt.Key.Key_Return)


def test_turning_to_review_and_quitting_keep_what_was_typed(qtbot, tmp_path):
    desk = Desk(qtbot, tmp_path)
    front(desk)
    replace(desk, desk.window.recorder.shot, "wave", 10)
    desk.click(desk.window.deck.review)
    assert desk.window.plan.shot == "wave" and nowhere(desk)
    desk.click(desk.window.deck.live)
    assert nowhere(desk)
    replace(desk, desk.window.recorder.performer, "ada", 10)
    press(Qt.Key.Key_Q, CTRL)
    desk.until(lambda: not desk.window.isVisible())
    assert desk.window.plan.performer == "ada"
    desk.close()


def test_notes_belong_to_the_take_that_runs(desk, stage):
    desk.connected(stage)
    notes, plan = desk.window.recorder.notes, desk.window.plan
    assert "next take" in notes.placeholderText()
    desk.click(notes)
    write("before", 10)
    press(Qt.Key.Key_R, CTRL)
    recorded(desk, "performer_shot_001")
    desk.until(lambda: "this take" in notes.placeholderText())
    assert notes.toPlainText() == "before"
    desk.click(notes)
    press(Qt.Key.Key_End, CTRL)
    write(", and during")
    with open_take(desk.session.numbers().recording.path) as take:
        assert take.info.notes.startswith("before, and")  # would outlive this process
    assert notes_of(stopped(desk)) == "before, and during"
    desk.until(lambda: notes.toPlainText() == "" == plan.notes, "notes for the next take")
    assert "next take" in notes.placeholderText()
    desk.window.undo.undo()  # of what is on disk nothing comes back
    assert notes.toPlainText() == ""
    press(Qt.Key.Key_R, CTRL)
    recorded(desk, "performer_shot_002")
    assert notes_of(stopped(desk)) == ""
    desk.click(notes)
    write("kept", 10)
    press(Qt.Key.Key_R, CTRL)
    recorded(desk, "performer_shot_003")
    desk.session.close()  # the window goes, and saves
    desk.until(lambda: len(desk.finished) == 3)
    assert notes_of(desk.finished[-1]) == "kept"


def test_notes_stay_when_a_take_is_refused(desk, stage, tmp_path):
    desk.connected(stage)
    (tmp_path / "file").write_text("no folder")
    replace(desk, desk.window.recorder.folder, str(tmp_path / "file"), 0)
    desk.click(desk.window.recorder.notes)
    write("mine", 10)
    press(Qt.Key.Key_R, CTRL)
    desk.until(lambda: "file" in desk.window.deck.refusal.text(), "the refusal")
    desk.until(lambda: desk.window.record_action.isEnabled())
    assert desk.window.recorder.notes.toPlainText() == "mine" == desk.window.plan.notes


# Where the keys go.


@pytest.mark.long
def test_no_field_has_the_keys_that_nobody_chose(desk, stage):
    assert nowhere(desk)
    desk.connected(stage)
    assert nowhere(desk)  # after Connect by the mouse
    window, recorder = desk.window, desk.window.recorder
    template, camera = recorder.template.text(), window.viewport.camera
    for start, stop in ((recorder.record, recorder.record), (window.deck.record, window.deck.record)):
        n = len(desk.finished)
        desk.click(start)
        assert nowhere(desk)
        desk.until(lambda: window.mark_action.isEnabled())
        QTest.qWait(300)
        assert nowhere(desk)
        camera.distance_m = 9.0
        press("m")
        press("f")
        assert camera.distance_m != 9.0
        desk.click(recorder.mark)
        assert nowhere(desk)
        press("m")
        desk.until(lambda: recorder.marks.count() == 3)
        desk.click(stop)
        desk.until(lambda n=n: len(desk.finished) > n)
        QTest.qWait(300)
        assert nowhere(desk)
        camera.distance_m = 9.0
        press("f")
        press("m")
        assert camera.distance_m != 9.0
        assert recorder.template.text() == template and recorder.notes.toPlainText() == ""
        assert desk.finished[-1].marks == 3


@pytest.mark.long
def test_what_is_locked_or_hidden_does_not_hand_the_keys_to_the_next_field(desk, stage):
    desk.connected(stage)
    window, card = desk.window, desk.card
    desk.window.record_action.trigger()
    desk.until(lambda: window.recorder.mark.isEnabled())
    window.recorder.mark.setFocus()
    desk.worker.stop_recording()  # as a full disk would
    desk.until(lambda: desk.finished and not window.recorder.mark.isEnabled())
    assert nowhere(desk)
    card.show_settings(True)
    desk.click(card.form.editor("server"))
    write("9", 0)
    desk.click(card.more)
    assert not isinstance(QApplication.focusWidget(), QLineEdit)
    card.show_settings(True)
    card.form.editor("local").setFocus()
    card.show_settings(False)
    assert nowhere(desk)
    card.more.setFocus()
    window.recorder.template.setFocus()
    window.docks["recorder"].hide()
    assert nowhere(desk)


def test_clicks_beside_fields_leave_them(desk):
    window = desk.window
    for place in (window.viewport, window.deck, window.recorder.last.parentWidget(), window.strip, window.deck.take):
        replace(desk, window.recorder.shot, "wave", 0)
        desk.click(place)
        assert not isinstance(QApplication.focusWidget(), QLineEdit), place
        assert window.plan.shot == "wave"
        window.plan.set_shot("shot")


# Refusals where one looks.


def test_a_refused_take_is_said_at_the_button(desk, stage):
    window = desk.window
    desk.until(lambda: desk.session.ready)
    desk.until(lambda: "device" in window.record_action.toolTip())
    assert not window.record_action.isEnabled() and not window.deck.refusal.isVisible()
    press(Qt.Key.Key_R, CTRL)
    for refusal in (window.deck.refusal, window.recorder.refusal):
        assert refusal.isVisible() and "No device is connected" in refusal.text() and "Connect one" in refusal.text()
        assert refusal.property("level") == "problem"
    desk.connected(stage)
    assert not window.deck.refusal.isVisible() and window.deck.elapsed.isVisible()
    replace(desk, window.recorder.template, "{shot}", 0)
    desk.click(window.deck.record)
    assert "take number" in window.deck.refusal.text() and "take number" in window.recorder.name_problem.text()
    assert not window.recorder.refusal.isVisible()  # once is enough
    assert any("take number" in note.text for note in window.messages.model.notes)
    replace(desk, window.recorder.template, "{take}", 0)
    press(Qt.Key.Key_R, CTRL)
    assert not window.deck.refusal.isVisible()
    recorded(desk, "1")


def test_a_click_on_the_locked_button_says_why(desk):
    desk.until(lambda: desk.session.ready)
    desk.until(lambda: "device" in desk.window.record_action.toolTip())
    desk.click(desk.window.recorder.record)
    assert "No device is connected" in desk.window.recorder.refusal.text()


def test_a_search_that_finds_nothing_says_so_below_its_button(desk, monkeypatch):
    monkeypatch.setattr(NatNetDevice, "discover", classmethod(lambda cls, timeout_s=1.0: ()))
    panel = desk.window.devices
    desk.click(panel.find_button)
    desk.until(lambda: panel.find_answer.isVisible(), "the answer")
    assert "No server answered" in panel.find_answer.text() and "by its address" in panel.find_answer.text()
    below = panel.find_answer.mapTo(panel, panel.find_answer.rect().topLeft()).y()
    assert below >= panel.find_button.geometry().bottom()
    panel.add(NatNetDevice, {})
    assert not panel.find_answer.isVisible()


def test_the_keys_of_a_panel_that_floats_go_to_the_view_as_well(desk, stage):
    desk.connected(stage)
    window, recorder = desk.window, desk.window.recorder
    window.docks["recorder"].setFloating(True)
    desk.qtbot.waitExposed(window.docks["recorder"])
    window.docks["recorder"].activateWindow()
    desk.until(window.docks["recorder"].isActiveWindow, "the panel to be active")
    replace(desk, recorder.shot, "wave", 10)
    desk.click(recorder.record)
    recorded(desk, "performer_wave_001")
    desk.until(window.isActiveWindow, "the window to be active")
    assert nowhere(desk)
    press("m")
    desk.until(lambda: recorder.marks.count() == 1)
    stopped(desk)
    window.docks["recorder"].activateWindow()
    desk.until(window.docks["recorder"].isActiveWindow, "the panel to be active")
    desk.click(recorder.shot)
    recorder.shot.setEnabled(False)
    desk.until(lambda: nowhere(desk), "the view to have the keys")
