"""Typing notes in review while the take is rated, solved and saved, and where the keys go there."""

from __future__ import annotations

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QPlainTextEdit

from core.takes.reader import open_take
from tests.app.hand_frames import profile
from tests.app.takes import write_take
from tests.app.test_review import a_room, opened, shown
from tests.app.test_typing import front, press, write
from tests.app.test_window import Desk


@pytest.fixture
def folder(tmp_path):
    write_take(tmp_path, "first", 101)
    write_take(tmp_path, "second", 30, notes="as told")
    return tmp_path


@pytest.fixture
def room(folder, qtbot):
    with a_room(folder, qtbot) as made:
        made.wait(made.isActiveWindow, "the window to be active")
        yield made


def click(widget):
    QTest.mouseClick(widget, Qt.MouseButton.LeftButton)


def test_notes_outlast_what_happens_while_they_are_typed(room, folder):
    document = opened(room, folder / "first.mcap")
    notes = room.inspector.notes
    click(notes.viewport())
    write("left thumb", 10)
    room.words.rate("A")  # by whatever: the file is written again, and the words are shown anew
    room.wait(lambda: room.words.unsaved(document.path) is None, "the rating in the file")
    room.solving.solve_with(profile())
    room.wait(lambda: document.solved is not document.recorded, "the new solution to be shown")
    assert notes.toPlainText() == "left thumb" and notes.hasFocus()
    write(" slow", 10)
    click(room.inspector._ratings.button(2))
    assert document.info.notes == "left thumb slow" and document.info.rating == "alt"
    assert notes.toPlainText() == "left thumb slow" and not notes.hasFocus()
    press(Qt.Key.Key_M)
    assert len(document.marks) == 3 and notes.toPlainText() == "left thumb slow"


def test_notes_typed_until_another_take_is_chosen_are_of_the_first(room, folder):
    opened(room, folder / "first.mcap")
    notes = room.inspector.notes
    click(notes.viewport())
    write("of the first take", 10)
    room.open_take(folder / "second.mcap")
    assert notes.toPlainText() == "" and not notes.isEnabled()
    write("akes", 0)
    shown(room, "second")
    write("akes", 0)
    assert notes.toPlainText() == "as told"
    click(room.viewport)
    room.wait(lambda: room.words.unsaved(folder / "first.mcap") is None, "the notes in the file")
    with open_take(folder / "first.mcap") as take:
        assert take.info.notes == "of the first take"
    assert room.document.info.notes == "as told"


def test_a_button_leaves_the_notes(room, folder):
    opened(room, folder / "first.mcap")
    for button in (room.markers, room.transport.layout_row.itemAt(5).widget(), room.solutions.solve):
        click(room.inspector.notes.viewport())
        assert isinstance(QApplication.focusWidget(), QPlainTextEdit)
        if button is not room.solutions.solve:  # it asks
            click(button)
        else:
            click(room.timeline)
        assert not isinstance(QApplication.focusWidget(), QPlainTextEdit)
    room.player.pause()
    playing = room.player.playing
    press(Qt.Key.Key_Space)
    assert room.player.playing != playing


def test_keys_of_the_live_room_and_of_review(qtbot, folder):
    desk = Desk(qtbot, folder)
    front(desk)
    window = desk.window
    click(window.recorder.template)
    window.review_take(folder / "first.mcap")
    review = window._review
    desk.until(lambda: review.document is not None, "the take")
    QTest.qWait(300)
    assert QApplication.focusWidget() is review.viewport
    press(Qt.Key.Key_M)
    assert len(review.document.marks) == 3
    click(review.inspector.notes.viewport())
    write("m", 0)
    press(Qt.Key.Key_1, Qt.KeyboardModifier.ControlModifier)
    assert QApplication.focusWidget() is window.viewport and review.document.info.notes == "m"
    desk.close()
