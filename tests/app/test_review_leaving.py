"""A take is not left before the operator was asked for what would be lost with it."""

from __future__ import annotations

import multiprocessing
from pathlib import Path

import pytest
from PySide6.QtCore import Qt, QTimer
from PySide6.QtGui import QCloseEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QMessageBox

from app.review import document as work
from app.review.leaving import took
from app.training.desk import TrainingDesk
from core.takes.reader import open_take
from core.takes.verify import verify
from tests.app.hand_frames import profile
from tests.app.stage import own_threads
from tests.app.takes import write_take
from tests.app.test_review import a_room, opened, shown
from tests.app.test_review_selection import click, quiet, selected
from tests.app.test_window import Desk


@pytest.fixture
def folder(tmp_path):
    takes = tmp_path / "takes"
    takes.mkdir()
    write_take(takes, "first", 40)
    write_take(takes, "second", 30)
    write_take(takes, "third", 20)
    return takes


@pytest.fixture
def room(folder, qtbot):
    with a_room(folder, qtbot) as made:
        made.browser.view.sortByColumn(1, Qt.SortOrder.AscendingOrder)
        yield made
    assert own_threads() == []
    assert not multiprocessing.active_children()


def solved_again(room, path, times: int = 1):
    document = opened(room, path)
    for count in range(1, times + 1):
        room.solving.solve_with(profile())
        room.wait(lambda count=count: len(document.unsaved) == count, "the solution")
    return document


def answer(room, text):
    """Press a button of the question, and see it go."""
    room.wait(lambda: room.leaving.box is not None and room.leaving.box.isVisible(), "the question")
    box = room.leaving.box
    button = next(button for button in box.buttons() if button.text() == text)
    QTest.mouseClick(button, Qt.MouseButton.LeftButton, delay=50)
    room.wait(lambda: room.leaving.box is not box, "the answer to be taken")


def press(room, key, modifier=Qt.KeyboardModifier.NoModifier):
    """Without a window manager no window takes the keys by itself once a question has closed."""
    room.window().activateWindow()
    room.setFocus()
    room.wait(room.isActiveWindow, "the focus")
    QTest.keyClick(room, key, modifier)


def page_key(room, path=None):
    press(room, Qt.Key.Key_PageDown)


ASKS = {
    "click": lambda room, path: click(room, path.stem),
    "right click": lambda room, path: click(room, path.stem, Qt.MouseButton.RightButton),
    "page key": page_key,
    "from elsewhere": lambda room, path: room.open_take(path),
}


@pytest.mark.parametrize("way", ASKS)
def test_another_take_is_opened_only_after_the_question(room, folder, way):
    document = solved_again(room, folder / "first.mcap")
    solution = document.solved
    ASKS[way](room, folder / "second.mcap")
    room.wait(lambda: room.leaving.box is not None, "the question")
    box = room.leaving.box
    words = box.text() + box.informativeText()
    assert "first was solved again" in words and solution.title in words and f"{took(solution.took_s)} of" in words
    assert "before second is opened" in words
    assert selected(room) == "first" and room.inspector.name.text() == "first" and room.inspector.notes.isEnabled()
    answer(room, "Cancel")
    quiet(room)
    assert room.document is document and document.solved is solution and selected(room) == "first"
    assert solution.again.path.exists()

    ASKS[way](room, folder / "second.mcap")
    answer(room, "Discard")
    shown(room, "second")
    assert selected(room) == "second" and not solution.again.path.exists()
    assert not list(folder.glob("*_solved*"))
    page_key(room)
    shown(room, "third")
    assert room.leaving.box is None, "nothing to ask for"


def test_the_question_takes_the_place_of_a_menu(room, folder):
    solved_again(room, folder / "first.mcap")
    view = room.browser.view
    at = view.visualRect(room.browser._line_of(folder / "second.mcap")).center()
    QTest.mouseClick(view.viewport(), Qt.MouseButton.RightButton, pos=at)
    view.customContextMenuRequested.emit(at)
    assert QApplication.activePopupWidget() is not None
    room.wait(lambda: room.leaving.box is not None, "the question")
    assert QApplication.activePopupWidget() is None
    answer(room, "Cancel")
    assert selected(room) == "first"


def test_saving_goes_on_to_what_was_asked_for(room, folder):
    document = solved_again(room, folder / "first.mcap", times=2)
    click(room, "third")
    room.wait(lambda: room.leaving.box is not None, "the question")
    assert all(solved.title in room.leaving.box.text() for solved in document.unsaved)
    answer(room, "Save as takes")
    shown(room, "third")
    assert selected(room) == "third"
    for name in ("first_solved", "first_solved2"):
        assert verify(folder / f"{name}.mcap").ok
        with open_take(folder / f"{name}.mcap") as take:
            assert len(take.solved) == 40
    assert room.told() == []


def test_a_failure_to_save_stays(room, folder, monkeypatch):
    document = solved_again(room, folder / "first.mcap")
    solution = document.solved
    monkeypatch.setattr(work, "free_name", lambda path: folder / "nowhere" / "first_solved.mcap")
    click(room, "second")
    answer(room, "Save as a take")
    room.wait(room.told, "the reason")
    quiet(room)
    assert room.document is document and selected(room) == "first" and document.unsaved
    assert "cannot be written" in room.told()[0] and solution.again.path.exists()


def test_what_is_saved_undone_or_recorded_is_not_asked_for(room, folder):
    document = solved_again(room, folder / "first.mcap", times=2)
    room.undo.undo()
    assert len(document.unsaved) == 1
    QTest.mouseClick(room.solutions.save, Qt.MouseButton.LeftButton)
    room.wait(lambda: not document.unsaved, "the solution to be saved")
    assert not room.solutions.save.isEnabled() and "first_solved.mcap" in room.solutions.save.toolTip()
    click(room, "second")
    shown(room, "second")
    assert room.leaving.box is None
    opened(room, folder / "third.mcap")


def test_a_solution_being_saved_is_waited_for(room, folder):
    write_take(folder, "long", 1500)
    document = solved_again(room, folder / "long.mcap")
    room.solving.save_shown()
    click(room, "second")
    shown(room, "second")
    assert room.leaving.box is None and document.saved_as(document.solved) == folder / "long_solved.mcap"
    assert verify(folder / "long_solved.mcap").ok


def test_while_solving_another_take_can_be_had_by_stopping(room, folder):
    write_take(folder, "long", 2000)
    document = opened(room, folder / "long.mcap")
    room.wait(lambda: selected(room) == "long", "its line")
    room.solving.solve_with(profile())
    room.wait(multiprocessing.active_children, "the process")
    click(room, "second")
    room.wait(lambda: room.leaving.box is not None, "the question")
    assert "long is still being solved again" in room.leaving.box.text()
    assert selected(room) == "long" and room.document is document
    answer(room, "Keep solving")
    quiet(room)
    assert selected(room) == "long" and room.jobs.job is not None
    click(room, "second")
    answer(room, "Stop solving")
    shown(room, "second")
    assert selected(room) == "second" and room.jobs.job is None
    assert not multiprocessing.active_children() and room.told() == []


def test_recovering_the_take_asks_too(room, folder):
    write_take(folder, "cut_short", 30, seal=False)
    document = solved_again(room, folder / "cut_short.mcap")
    room.wait(room.browser._recover.isVisible, "the button")
    QTest.mouseClick(room.browser._recover, Qt.MouseButton.LeftButton)
    answer(room, "Cancel")
    assert room.document is document and document.unsaved
    QTest.mouseClick(room.browser._recover, Qt.MouseButton.LeftButton)
    answer(room, "Discard")
    room.wait(lambda: room.document not in (None, document), "the recovered take")
    assert verify(folder / "cut_short.mcap").sealed and selected(room) == "cut_short"


def test_a_take_deleted_on_disk_keeps_its_solution(room, folder):
    document = solved_again(room, folder / "first.mcap")
    (folder / "first.mcap").unlink()
    room.wait(room.told, "the warning")
    assert room.document is document and "first.mcap was moved, deleted or replaced" in room.told()[0]
    QTest.mouseClick(room.solutions.save, Qt.MouseButton.LeftButton)
    room.wait(lambda: not document.unsaved, "the solution to be saved")
    assert verify(folder / "first_solved.mcap").ok


@pytest.fixture
def desk(qtbot, folder):
    made = Desk(qtbot, folder)
    made.window.show_review(True)
    made.room = made.window._review
    made.room.wait = made.until
    made.room.told = lambda: [note.line for note in made.worker.notifications.history]
    yield made
    made.close()


def test_leaving_phalanx_asks_and_turning_to_live_does_not(desk, folder):
    window, room = desk.window, desk.room
    document = solved_again(room, folder / "first.mcap")
    press(room, Qt.Key.Key_1, Qt.KeyboardModifier.ControlModifier)
    desk.until(lambda: window.pages.currentIndex() == 0, "live")
    assert room.leaving.box is None and room.document is document
    QTest.keyClick(window, Qt.Key.Key_Q, Qt.KeyboardModifier.ControlModifier)
    desk.until(lambda: room.leaving.box is not None, "the question")
    assert window.pages.currentIndex() == 1 and "before Phalanx is closed" in room.leaving.box.informativeText()
    answer(room, "Cancel")
    assert window.isVisible() and room.document is document and document.unsaved
    event = QCloseEvent()
    QApplication.sendEvent(window, event)
    assert not event.isAccepted()
    answer(room, "Save as a take")
    desk.until(lambda: not window.isVisible(), "the end")
    assert verify(folder / "first_solved.mcap").ok


def test_phalanx_can_be_left_without_the_solution(desk, folder):
    document = solved_again(desk.room, folder / "first.mcap")
    desk.window.close()
    answer(desk.room, "Discard")
    desk.until(lambda: not desk.window.isVisible(), "the end")
    assert not list(Path(folder).glob("*_solved*")) and not document.solved.again.path.exists()


@pytest.mark.parametrize(("button", "closed"), [("Go on training", False), ("End training and quit", True)])
def test_a_network_that_is_trained_in_the_background_is_asked_for(desk, monkeypatch, button, closed):
    monkeypatch.setattr(TrainingDesk, "training", True)

    def answer_training():
        (pressed,) = (one for one in QApplication.activeModalWidget().buttons() if one.text() == button)
        QTest.mouseClick(pressed, Qt.MouseButton.LeftButton)

    QTimer.singleShot(300, answer_training)
    assert desk.window.close() is closed


def test_the_end_of_the_application_does_not_wait_for_an_answer(desk, folder):
    solved_again(desk.room, folder / "first.mcap")
    desk.window.close()
    desk.until(lambda: desk.room.leaving.box is not None, "the question")
    desk.window.stop_and_close()
    assert not [one for one in QApplication.topLevelWidgets() if isinstance(one, QMessageBox) and one.isVisible()]


@pytest.mark.parametrize(
    ("seconds", "words"), [(0.2, "under a second"), (42.4, "42 s"), (59.6, "1 min 0 s"), (185.0, "3 min 5 s")]
)
def test_how_long_it_took(seconds, words):
    assert took(seconds) == words
