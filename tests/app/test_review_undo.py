"""Each room undoes its own steps; in review, in and out points and solutions are steps too."""

from __future__ import annotations

import gc
import multiprocessing

import numpy as np
import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QMenuBar

from app.props.desk import PropDesk
from app.review.timeline import RULER
from core.profile import load_profile
from core.props.prop import Prop
from core.takes.reader import open_take
from tests.app.stage import own_threads
from tests.app.takes import write_take
from tests.app.test_review import a_room, opened
from tests.app.test_review_leaving import press, solved_again
from tests.app.test_window import Desk

CONTROL, SHIFT = Qt.KeyboardModifier.ControlModifier, Qt.KeyboardModifier.ShiftModifier


@pytest.fixture
def folder(tmp_path):
    takes = tmp_path / "takes"
    takes.mkdir()
    write_take(takes, "first", 101)
    write_take(takes, "second", 30)
    return takes


@pytest.fixture
def room(folder, qtbot):
    with a_room(folder, qtbot) as made:
        yield made
    assert own_threads() == []
    assert not multiprocessing.active_children()


@pytest.fixture
def desk(qtbot, folder):
    made = Desk(qtbot, folder)
    made.window.show_review(True)
    made.room = made.window._review
    made.room.wait = made.until
    made.window.show_review(False)
    yield made
    made.close()


def texts(stack):
    return [stack.text(i) for i in range(stack.count())]


def menu(window):
    """What the menu offers to undo and to redo."""
    (edit,) = (action.menu() for action in window.findChild(QMenuBar).actions() if action.text() == "Edit")
    return [action.text() if action.isEnabled() else "" for action in edit.actions()[:2]]


def test_the_menu_and_its_keys_are_of_the_room_that_is_shown(desk, folder):
    window, room, plan = desk.window, desk.room, desk.window.plan
    window.activateWindow()
    before = plan.notes
    window.recorder.setFocus()
    window.undo.change("change notes", lambda: plan.set_notes("live"), lambda: plan.set_notes(before))
    window.show_review(True)
    assert menu(window) == ["", ""], "nothing of the live room"
    press(room, Qt.Key.Key_Z, CONTROL)
    QTest.qWait(300)
    assert plan.notes == "live"
    opened(room, folder / "first.mcap")
    QTest.mouseClick(room.inspector._ratings.button(1), Qt.MouseButton.LeftButton)
    assert menu(window) == ["Undo rating of first", ""]
    window.show_review(False)
    assert menu(window) == ["Undo change notes", ""]
    window.activateWindow()
    desk.until(window.isActiveWindow)
    QTest.keyClick(window, Qt.Key.Key_Z, CONTROL, 50)
    QTest.keyClick(window, Qt.Key.Key_Z, CONTROL, 50)
    assert plan.notes == before and room.document.info.rating == "A", "not out of sight"
    assert menu(window) == ["", "Redo change notes"]
    window.show_review(True)
    press(room, Qt.Key.Key_Z, CONTROL)
    assert room.document.info.rating == "" and menu(window) == ["", "Redo rating of first"]
    press(room, Qt.Key.Key_Y, CONTROL)
    assert room.document.info.rating == "A" and plan.notes == before


def test_undo_in_a_field_stays_in_the_field(desk, folder):
    window, room = desk.window, desk.room
    window.show_review(True)
    document = opened(room, folder / "first.mcap")
    QTest.mouseClick(room.inspector._ratings.button(1), Qt.MouseButton.LeftButton)
    window.activateWindow()
    room.inspector.notes.setFocus()
    desk.until(room.inspector.notes.hasFocus)
    QTest.keyClicks(room.inspector.notes, "slow", delay=20)
    QTest.keyClick(room.inspector.notes, Qt.Key.Key_Z, CONTROL, 50)
    assert room.inspector.notes.toPlainText() == "" and document.info.rating == "A"


def test_in_and_out_are_undone_step_by_step(room, folder):
    opened(room, folder / "first.mcap")
    player = room.player

    def ends():
        return player.in_frame, player.out_frame

    player.seek_frame(30)
    press(room, Qt.Key.Key_I, CONTROL)
    player.seek_frame(60)
    press(room, Qt.Key.Key_O, CONTROL | SHIFT)
    assert ends() == (30, 60)
    press(room, Qt.Key.Key_O, CONTROL | SHIFT)
    assert room.undo.count() == 2, "nothing changed, nothing to undo"
    drag(room, "in", 45)
    (dragged, _) = ends()
    assert 40 < dragged < 50 and texts(room.undo) == ["in point of first", "out point of first", "in point of first"]
    press(room, Qt.Key.Key_Backspace, CONTROL)
    assert ends() == (0, 100)
    seen = []
    while room.undo.canUndo():
        room.undo.undo()
        seen.append(ends())
    assert seen == [(dragged, 60), (30, 60), (30, 100), (0, 100)]
    while room.undo.canRedo():
        room.undo.redo()
    assert ends() == (0, 100)


def drag(room, handle, frame):
    """Drag a triangle of the ruler to a frame, in many small moves."""
    timeline, player = room.timeline, room.player
    at = player.in_frame if handle == "in" else player.out_frame
    y = RULER - 4
    from_x, to_x = (round(timeline.x_of(float(player.times_s[f]))) for f in (at, frame))
    from_x += -3 if handle == "in" else 3
    QTest.mousePress(timeline, Qt.MouseButton.LeftButton, pos=QPoint(from_x, y))
    for x in np.linspace(from_x, to_x, 12).round().astype(int).tolist():
        QTest.mouseMove(timeline, QPoint(x, y), 10)
    QTest.mouseRelease(timeline, Qt.MouseButton.LeftButton, pos=QPoint(to_x, y))


def test_solving_again_is_undone_and_done_again_without_solving(room, folder):
    document = solved_again(room, folder / "first.mcap")
    solution = document.solved
    assert texts(room.undo) == ["solving first again"]
    room.undo.undo()
    assert document.solved is document.recorded and not room.solutions.choice.isVisible()
    assert solution.again.path.exists() and document.frame(5)[1] is not None
    room.undo.redo()
    assert room.jobs.job is None and document.solved is solution
    assert room.solutions.choice.count() == 2 and document.frame(5)[1].sequence == 5
    room.wait(lambda: document.analysis is not None, "the analysis")
    room.solutions.choice.setFocus()
    room.solutions.choice.setCurrentIndex(0)
    room.solutions.choice.activated.emit(0)
    assert document.solved is document.recorded and room.undo.undoText() == "choice of a solution of first"
    room.undo.undo()
    assert document.solved is solution and room.solutions.choice.currentIndex() == 1


def test_a_solution_is_undone_while_the_words_of_its_take_are_written(room, folder):
    """The file is closed then, and opened anew; the step must not be refused and lost."""
    document = solved_again(room, folder / "first.mcap")
    solution = document.solved
    went = []

    def undo_both(_path):  # as the signal comes: the writing is over before a timer would look
        room.words.saving.disconnect(undo_both)
        assert room.words.in_progress is not None and document._take is None
        room.undo.undo()  # the rating
        room.undo.undo()
        assert document.solved is document.recorded and room.undo.canRedo()
        room.undo.redo()
        assert document.solved is solution and not room.leaving.free
        went.append(True)

    room.words.saving.connect(undo_both)
    room.words.rate("A")
    room.wait(lambda: went, "the rating to be written")
    room.wait(lambda: room.words.in_progress is None and not room.words.unsaved(document.path), "the words in the file")


def test_what_solving_has_written_goes_with_its_step(room, folder):
    document = solved_again(room, folder / "first.mcap")
    path = document.solved.again.path
    room.wait(lambda: document.analysis is not None, "the analysis")
    room.undo.undo()
    room.words.rate("A")
    assert not room.undo.canRedo()
    room.wait(lambda: document.analysis is not None, "the analysis")
    gc.collect()
    room.wait(lambda: not path.exists(), "the file to go")


def test_steps_of_a_take_that_is_closed(room, folder):
    """Words are steps of the file and stay; in, out and solutions end with the take."""
    document = solved_again(room, folder / "first.mcap")
    path = document.solved.again.path
    room.words.rate("A")
    room.player.seek_frame(30)
    press(room, Qt.Key.Key_I, CONTROL)
    room.words.add_mark(0.5)
    room.undo.undo()
    document.saved(document.solved, path)
    opened(room, folder / "second.mcap")
    assert texts(room.undo) == ["rating of first", "mark of first"] and room.undo.index() == 1
    assert not path.exists()
    room.words.rate("alt")
    assert texts(room.undo) == ["rating of first", "rating of second"]
    room.undo.undo()
    room.undo.undo()
    assert not room.undo.canUndo()
    room.undo.redo()
    assert room.document.info.rating == ""
    room.wait(lambda: not room.words._unsaved, "the words in the files")
    for stem, rating in (("first", "A"), ("second", "")):
        with open_take(folder / f"{stem}.mcap") as take:
            assert take.info.rating == rating


def test_steps_are_dropped_as_done_or_undone_as_they_were(room):
    stack, log, gone = room.undo, [], object()
    for text in "abcd":
        stack.change(
            text,
            lambda text=text: log.append(f"+{text}"),
            lambda text=text: log.append(f"-{text}"),
            of=gone if text in "bd" else None,
        )
    stack.undo()
    stack.undo()
    log.clear()
    stack.drop(gone)
    assert log == [] and texts(stack) == ["a", "c"]
    assert (stack.undoText(), stack.redoText()) == ("a", "c")
    stack.redo()
    stack.undo()
    stack.undo()
    assert log == ["+c", "-c", "-a"]


def test_a_prop_made_in_review_is_undone_there_and_nothing_else_is(desk):
    window, session = desk.window, desk.session
    markers_m = 0.03 * np.array([[0, 0, 0], [1, 0, 0], [0, 1.3, 0], [0, 0, 1.7]])
    live, review = window.props, PropDesk(desk.worker, desk.room.undo)
    live.add(Prop("live", markers_m))
    review.add(Prop("review", markers_m))
    window.tracking.choose("schroeder17")
    live.add(Prop("later", markers_m))
    window.stacks.setActiveStack(desk.room.undo)
    desk.room.undo.undo()
    assert session.profile.layout.name == load_profile("schroeder17").layout.name
    assert [prop.name for prop in session.profile.props] == ["later"]
    desk.room.undo.redo()
    assert [prop.name for prop in session.profile.props] == ["later", "review"]
    window.undo.undo()
    assert [prop.name for prop in session.profile.props] == ["review"]
