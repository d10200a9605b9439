"""Several devices at once in the real window: which is solved, what is recorded, and that none is out of sight."""

from __future__ import annotations

from contextlib import ExitStack

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QMessageBox

from app.file_device import FileDevice
from app.live_streams import ENDED, LEFT_OUT, RECORDED, SOLVED
from core.takes.reader import open_take
from devices.device import Level
from devices.natnet.client import NatNetDevice
from tests.app.many_streams import TwoStreams
from tests.app.stage import server, settings_for
from tests.app.takes import write_take
from tests.app.test_window import Desk


@pytest.fixture
def desk(qtbot, tmp_path):
    made = Desk(qtbot, tmp_path / "takes")
    yield made
    made.close()


@pytest.fixture
def stages():
    with ExitStack() as stack:
        yield [stack.enter_context(server()) for _ in range(3)]


def connect_beside(desk: Desk, simulator: object) -> object:
    """By the button of its card."""
    stream = desk.add(simulator)
    card = desk.window.devices.cards[-1]
    desk.click(card.toggle)
    desk.until(lambda: stream.health().received > 0, "frames of one more device")
    return card


def roles(desk: Desk) -> list[str]:
    return [card.role.text().removeprefix(f"{card.stream.key}\n") for card in desk.window.devices.cards]


def test_a_second_device_beside_the_first_and_which_of_them_is_solved(desk, stages):
    window, tracking = desk.window, desk.window.tracking
    first = desk.connected(stages[0])
    desk.until(lambda: desk.card._figures["Latency"].text() != "–", "a latency")
    assert roles(desk) == [""] and not tracking.solved.isVisible() and "hold" not in window.record_action.toolTip()
    begun, solving = desk.session.latest.newer(0)[0], desk.session.solving
    card = connect_beside(desk, stages[1])
    second = card.stream
    desk.until(lambda: roles(desk) == [SOLVED, RECORDED], "what becomes of each")
    assert desk.session.solving == solving and first.streaming and second.streaming
    assert desk.session.latest.newer(0)[0] > begun and not window.viewport.message, "nothing of the first is disturbed"
    assert card._figures["Latency"].text() == "–" != desk.card._figures["Latency"].text()
    choice = tracking.solved.choice
    assert choice.isVisible() and [choice.itemText(i) for i in range(choice.count())] == [first.title, second.title]
    tip = window.strip.stream.toolTip().splitlines()
    assert [line.partition(": ")[0] for line in tip] == [first.title, second.title]
    assert window.deck.device.text().startswith(first.title) and window.deck.device.text().endswith(" Hz · 1 more")
    window.activateWindow()
    choice.setFocus()
    desk.qtbot.keyClick(choice, Qt.Key.Key_Down)
    desk.until(lambda: roles(desk) == [RECORDED, SOLVED], "the other one to be solved")
    assert desk.session.solving_receiver is second and choice.currentText() == second.title
    desk.until(lambda: card._figures["Latency"].text() != "–" == desk.card._figures["Latency"].text(), "its latency")
    window.undo.undo()
    desk.until(lambda: roles(desk) == [SOLVED, RECORDED], "the first again")
    desk.click(desk.card.toggle)
    desk.until(lambda: roles(desk) == ["", ""] and not tracking.solved.isVisible(), "the second alone")
    assert desk.session.solving_receiver is second


def test_a_device_that_is_connected_anew_with_another_setting_is_solved_as_before(desk, stages):
    first, device = desk.connected(stages[0]), desk.card.stream.device
    connect_beside(desk, stages[1])
    choice = desk.card.form.editor("points")
    desk.card.show_settings(True)
    choice.setCurrentIndex(1 - choice.currentIndex())
    desk.until(lambda: first.device is not device and first.health().received > 0, "frames from the new connection")
    desk.until(
        lambda: desk.session.solving_receiver is first and not desk.worker.reconnecting(first), "it to be solved"
    )
    desk.until(lambda: roles(desk) == [SOLVED, RECORDED], "its card to say so")
    assert len(desk.session.streams) == 2 and desk.session.solving == f"{first.key}/markers"


def test_one_key_puts_all_devices_down_and_takes_them_up_again(desk, stages):
    window = desk.window
    devices = [desk.connected(stages[0]), connect_beside(desk, stages[1]).stream]
    desk.until(lambda: window.connect_action.text() == "Disconnect all")
    window.connect_action.trigger()
    desk.until(lambda: not any(device.active for device in devices), "both to go")
    desk.until(lambda: window.connect_action.text() == "Connect")
    window.connect_action.trigger()
    desk.until(lambda: all(device.streaming for device in devices), "both again")
    assert {stream.receiver for stream in desk.session.streams} == set(devices)


def test_a_device_that_could_not_be_connected_stays_red_beside_one_that_flows(desk, stages, monkeypatch):
    window, settings = desk.window, settings_for(stages[1])
    with server() as gone:
        nowhere = settings_for(gone)
    dead = window.devices.add(NatNetDevice, {**settings, **nowhere})
    desk.click(desk.card.toggle)
    desk.until(lambda: dead.failed, "no answer")
    desk.until(lambda: window.deck.device.text() == f"{dead.title}: not connected", "the deck to say so")
    card = connect_beside(desk, stages[0])
    strip, deck = window.strip.stream, window.deck
    desk.until(lambda: strip.value.text().endswith(" Hz"), "the other one to flow")
    assert strip.light.level is deck.device_light.level is Level.PROBLEM
    assert f"{dead.title}: {dead.health().reason}" in strip.toolTip().splitlines() and dead.title in deck.device.text()
    asked = []
    monkeypatch.setattr(
        QMessageBox, "warning", lambda *args: asked.append(args[2]) or QMessageBox.StandardButton.Cancel
    )
    desk.until(window.record_action.isEnabled, "the record button")
    window.record_action.trigger()
    assert len(asked) == 1 and not desk.session.recording
    assert f"{dead.title} is not connected and would not be in the take." in asked[0].splitlines()
    window.connect_action.trigger()
    desk.until(lambda: not card.stream.active and not dead.failed, "both to be put down")
    desk.until(lambda: strip.light.level is deck.device_light.level is Level.IDLE, "nobody asks for any")


def test_a_recorded_file_that_ends_is_amber_and_keeps_its_place_in_the_take(desk, stages, tmp_path):
    window = desk.window
    desk.connected(stages[0])
    file = desk.worker.add_device(FileDevice, {"file": str(write_take(tmp_path, "short", 800))})
    card = window.devices.cards[1]
    desk.click(card.toggle)
    desk.until(lambda: file.streaming, "the file")
    desk.click(window.deck.record)
    desk.until(lambda: desk.session.recording and file.finished, "its end in the take")
    strip, deck = window.strip.stream, window.deck
    desk.until(lambda: card.reason.text() == ENDED and deck.device.text().startswith(file.title), "that it ended")
    lights = card.light, strip.light, deck.device_light
    desk.until(lambda: {light.level for light in lights} == {Level.WARNING}, "amber")
    assert roles(desk) == [SOLVED, RECORDED] and f"{file.title}: {ENDED}" in strip.toolTip().splitlines()
    assert strip.value.text().endswith(" Hz") and not card.toggle.isEnabled()
    desk.until(lambda: deck.frames.text().endswith(f" frames; {file.key}/markers: ended"), "whose line it is")
    assert deck.frames.property("level") == "warning"
    desk.click(deck.record)
    desk.until(lambda: desk.finished, "the take to be sealed")
    desk.until(lambda: strip.light.level is Level.GOOD, "what is not in a take colours nothing")


def test_one_key_connects_every_device_that_was_never_connected(desk, stages):
    devices = [desk.add(stage) for stage in stages[:2]]
    desk.window.connect_action.trigger()
    desk.until(lambda: all(device.streaming for device in devices), "both")
    assert {stream.receiver for stream in desk.session.streams} == set(devices)


def test_that_nothing_has_come_is_said_until_frames_come(desk, stages):
    refusal = desk.window.deck.refusal
    desk.window.look_back_action.trigger()
    desk.until(lambda: "Nothing has come" in refusal.text(), "the refusal")
    desk.connected(stages[0])
    desk.until(lambda: not refusal.text(), "it to be over")
    assert desk.session.look_back.silent_s < float("inf") and desk.finished == []


def test_a_take_of_two_devices_and_one_that_came_later(desk, stages, monkeypatch):
    window = desk.window
    desk.connected(stages[0])
    silent = connect_beside(desk, stages[1])
    desk.until(lambda: all(card.light.level is Level.GOOD for card in window.devices.cards), "both green")
    desk.until(lambda: f"{silent.stream.title}." in window.record_action.toolTip(), "what a take will hold")
    desk.click(window.deck.record)
    desk.until(lambda: not any(card.toggle.isEnabled() for card in window.devices.cards), "both locked")
    assert not silent.form.editor("server").isEnabled() and not silent.drop.isEnabled()
    assert not window.tracking.solved.choice.isEnabled()
    late = connect_beside(desk, stages[2])
    desk.until(lambda: roles(desk) == [SOLVED, RECORDED, LEFT_OUT], "that the third is not in the take")
    assert late.toggle.isEnabled() and late.role.toolTip()
    stages[1].close()
    desk.until(lambda: silent.light.level is Level.PROBLEM, "the second to fall silent")
    strip, deck = window.strip, window.deck
    desk.until(lambda: strip.stream.light.level is deck.device_light.level is Level.PROBLEM, "the strip to say so")
    assert strip.stream.value.text().endswith("Hz") and silent.reason.text() in strip.stream.toolTip()
    assert deck.device.text().startswith(silent.stream.title)
    assert desk.card.light.level is Level.GOOD and not window.viewport.message
    desk.until(lambda: any(note.source == silent.stream.title for note in window.messages.model.notes), "a message")
    desk.click(deck.record)
    desk.until(lambda: desk.finished, "the take to be sealed")
    desk.until(lambda: silent.toggle.isEnabled() and desk.card.toggle.isEnabled(), "both free")
    summary = desk.finished[0]
    with open_take(summary.path) as take:
        assert list(take.streams) == [desk.card.stream.streams[0].key, silent.stream.streams[0].key]
        assert take.solving == desk.card.stream.streams[0].key and take.holes_in(list(take.streams)[1]).seconds > 0
        assert all(one.counts.balanced and one.frames for one in take.streams.values())
    asked = []
    monkeypatch.setattr(
        QMessageBox, "warning", lambda *args: asked.append(args[2]) or QMessageBox.StandardButton.Cancel
    )
    window.record_action.trigger()
    assert len(asked) == 1 and asked[0].startswith(f"{silent.stream.title}: ") and not desk.session.recording
    window.review_take(summary.path)
    review = window._review
    desk.until(lambda: review.inspector.streams.lines, "its streams in review")
    solved, other = review.inspector.streams.lines
    assert solved.startswith(f"{desk.card.stream.streams[0].key} solved: ")
    assert other.startswith(f"{silent.stream.streams[0].key} recorded: ") and "without frames" in other


def test_a_device_of_several_streams_has_a_light_and_a_reason_for_each(desk):
    device = desk.window.devices.add(TwoStreams, {})
    desk.click(desk.card.toggle)
    desk.until(lambda: len(desk.card.lines.lines) == 2, "a line each")
    left, right = desk.card.lines.lines
    desk.until(lambda: right.light.level is Level.PROBLEM and left.light.level is Level.GOOD, "their lights")
    assert (left.name.text(), right.name.text()) == ("left", "right")
    desk.until(lambda: (left.role.text(), right.role.text()) == (SOLVED, RECORDED), "what becomes of each")
    assert desk.card.role.text() == device.key
    assert right.state.text() == TwoStreams.SILENT
    desk.until(lambda: left.state.text().endswith("Hz"), "its rate")
    strip = desk.window.strip.stream
    desk.until(lambda: strip.light.level is Level.PROBLEM, "the gravest of them")
    assert f"{device.title}, right: {TwoStreams.SILENT}" in strip.toolTip().splitlines()
