"""What is selected in the list of takes is what is open, whoever moved the selection."""

from __future__ import annotations

import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QMenu

from app.review.browser import ROW_ROLE
from core.takes.reader import open_take
from devices.device import Level
from tests.app.stage import own_threads
from tests.app.takes import write_take
from tests.app.test_review import a_room, opened, shown

NAMES = ("a_foreign", "b_first", "c_second", "d_cut_short", "e_third")
LONGER_THAN_SETTLING_MS = 400


@pytest.fixture
def folder(tmp_path):
    takes = tmp_path / "takes"
    takes.mkdir()
    (takes / "a_foreign.mcap").write_bytes(b"no take at all")
    write_take(takes, "b_first", 60)
    write_take(takes, "c_second", 30, rating="alt", notes="as told")
    write_take(takes, "d_cut_short", 40, seal=False)
    write_take(takes, "e_third", 20)
    return takes


@pytest.fixture
def room(folder, qtbot):
    with a_room(folder, qtbot) as made:
        made.wait(lambda: all(row.level is not Level.IDLE for row in made.browser.table.rows), "the list")
        made.browser.view.sortByColumn(1, Qt.SortOrder.AscendingOrder)
        yield made
    assert own_threads() == []


def selected(room) -> str | None:
    rows = room.browser.view.selectionModel().selectedRows()
    assert len(rows) <= 1
    return rows[0].data(ROW_ROLE).path.stem if rows else None


def click(room, stem, button=Qt.MouseButton.LeftButton, modifier=Qt.KeyboardModifier.NoModifier):
    view = room.browser.view
    model = view.model()
    index = next(
        model.index(i, 1) for i in range(model.rowCount()) if model.index(i, 1).data(ROW_ROLE).path.stem == stem
    )
    QTest.mouseClick(view.viewport(), button, modifier, view.visualRect(index).center())


def key(room, *keys, modifier=Qt.KeyboardModifier.NoModifier, delay=20):
    for one in keys:
        QTest.keyClick(room.browser.view, one, modifier, delay)


def quiet(room):
    """Nothing is opening, and nothing is about to be."""
    QTest.qWait(LONGER_THAN_SETTLING_MS)
    room.wait(lambda: room.opening.job is None, "the end of opening")


def test_a_right_click_opens_what_it_selects_and_a_rating_goes_there(room, folder, qtbot):
    opened(room, folder / "b_first.mcap")
    click(room, "c_second", Qt.MouseButton.RightButton)
    shown(room, "c_second")
    assert selected(room) == "c_second"
    qtbot.mouseClick(room.inspector._ratings.button(1), Qt.MouseButton.LeftButton)
    room.wait(lambda: room.words.unsaved(folder / "c_second.mcap") is None, "the rating in the file")
    with open_take(folder / "c_second.mcap") as take:
        assert take.info.rating == "A"
    with open_take(folder / "b_first.mcap") as take:
        assert take.info.rating == ""


def test_keys_open_what_they_select(room):
    room.browser.view.setFocus()
    quiet(room)
    assert room.document is None and selected(room) is None, "having the focus opens nothing"
    key(room, Qt.Key.Key_Down)
    quiet(room)
    assert selected(room) == "a_foreign" and room.document is None
    for pressed, stem in (
        (Qt.Key.Key_Down, "b_first"), (Qt.Key.Key_End, "e_third"), (Qt.Key.Key_Up, "d_cut_short"),
        (Qt.Key.Key_PageUp, "c_second"), (Qt.Key.Key_PageDown, "d_cut_short"),
    ):  # fmt: skip
        key(room, pressed)
        assert selected(room) == stem
        shown(room, stem)
        assert room.inspector.notes.isEnabled()
    key(room, Qt.Key.Key_Home)
    quiet(room)
    assert selected(room) == "a_foreign" and room.document is None


def test_a_held_key_opens_only_where_it_ends(room, folder, monkeypatch):
    for i in range(100):
        write_take(folder, f"f_{i:03}", 2)
    room.browser.refresh()
    room.wait(lambda: len(room.browser.table.rows) == 105, "the list")
    opened(room, folder / "b_first.mcap")
    room.browser.view.setFocus()
    begun = []
    run = room.opening.run
    monkeypatch.setattr(room.opening, "run", lambda job: (begun.append(job), run(job)))
    key(room, *[Qt.Key.Key_Down] * 60, delay=10)
    shown(room, "f_056")
    assert selected(room) == "f_056" and len(begun) < 10


def test_while_another_take_is_coming_nothing_can_be_done_to_the_one_before(room, folder, qtbot):
    document = opened(room, folder / "b_first.mcap")
    room.inspector.notes.setFocus()
    QTest.keyClicks(room.inspector.notes, "typed", delay=5)
    room.browser.view.setFocus()
    key(room, Qt.Key.Key_Down, delay=0)
    assert selected(room) == "c_second" and room.document is document, "before it settles"
    assert room.inspector.name.text() == "c_second" and not room.inspector.notes.isEnabled()
    assert room.inspector._ratings.checkedButton() is None
    assert not room.solutions.export.isEnabled() and not room.solutions.solve.isEnabled()
    room.words.rate("A")
    qtbot.keyClick(room, Qt.Key.Key_M)
    qtbot.keyClick(room, Qt.Key.Key_E, Qt.KeyboardModifier.ControlModifier)
    assert room._dialog is None
    assert (document.info.rating, document.info.notes, len(document.marks)) == ("", "typed", 2)
    key(room, Qt.Key.Key_Up, delay=0)
    quiet(room)
    assert room.document is document and room.inspector.notes.isEnabled(), "back to it: it was never closed"
    assert room.inspector.name.text() == "b_first" and room.inspector.notes.toPlainText() == "typed"
    assert "tracked" in room.inspector.hands.text() and room.solutions.export.isEnabled()


def test_why_a_take_cannot_be_read_stands_in_the_middle_and_nothing_of_the_one_before(room, folder):
    opened(room, folder / "b_first.mcap")
    for button in (Qt.MouseButton.LeftButton, Qt.MouseButton.RightButton):
        click(room, "a_foreign", button)
        quiet(room)
        assert selected(room) == "a_foreign" and room.document is None
        assert "a_foreign.mcap cannot be read" in room.viewport.message
        assert "is not a take" in room.viewport.message
        assert room.inspector.name.text() == "a_foreign" and not room.inspector.notes.isEnabled()
        assert room.inspector.facts.text() == "" and room.inspector.marks.count() == 0
        assert room.player.n_frames == 0 and room.timeline.text_at(400, 40) == ""
        click(room, "c_second")
        shown(room, "c_second")
        assert room.viewport.message == "" and selected(room) == "c_second"


def test_a_take_that_could_not_be_read_opens_when_it_can(room, folder, tmp_path):
    click(room, "a_foreign")
    quiet(room)
    write_take(tmp_path, "a_foreign", 25).replace(folder / "a_foreign.mcap")
    shown(room, "a_foreign")
    assert selected(room) == "a_foreign" and room.player.n_frames == 25


def test_a_filter_and_a_new_order_select_nothing_else(room, folder):
    document = opened(room, folder / "c_second.mcap")
    room.browser.filter.setFocus()
    QTest.keyClicks(room.browser.filter, "third", delay=20)
    quiet(room)
    assert room.document is document and selected(room) is None
    assert room.inspector.name.text() == "c_second" and room.inspector.notes.isEnabled()
    room.words.rate("A")
    assert document.info.rating == "A"
    for _ in "third":
        QTest.keyClick(room.browser.filter, Qt.Key.Key_Backspace, delay=20)
    quiet(room)
    assert room.document is document and selected(room) == "c_second"
    header = room.browser.view.horizontalHeader()
    QTest.mouseClick(header.viewport(), Qt.MouseButton.LeftButton, pos=QPoint(header.sectionPosition(1) + 10, 5))
    quiet(room)
    assert room.document is document and selected(room) == "c_second"


def test_a_rating_that_the_filter_hides_leaves_its_take_open(room, folder, qtbot):
    room.browser.filter.setFocus()
    QTest.keyClicks(room.browser.filter, "alt", delay=20)
    click(room, "c_second")
    shown(room, "c_second")
    qtbot.mouseClick(room.inspector._ratings.button(1), Qt.MouseButton.LeftButton)
    room.wait(lambda: selected(room) is None, "the line to go, as the filter says")
    quiet(room)
    assert room.document.path.stem == "c_second" and room.document.info.rating == "A"


def test_the_folder_read_again_and_a_take_deleted_or_put_in_its_place(room, folder, tmp_path):
    document = opened(room, folder / "c_second.mcap")
    (folder / "b_first.mcap").unlink()
    write_take(folder, "f_new", 10)
    room.wait(lambda: len(room.browser.table.rows) == 5 and room.browser._line_of(folder / "f_new.mcap").isValid())
    quiet(room)
    assert room.document is document and selected(room) == "c_second"
    write_take(tmp_path, "c_second", 77).replace(folder / "c_second.mcap")
    room.wait(lambda: room.player.n_frames == 77, "the take that is there now")
    assert selected(room) == "c_second" and room.document.path.stem == "c_second"
    (folder / "c_second.mcap").unlink()
    room.wait(lambda: room.document is None, "the take to close")
    assert selected(room) is None and "c_second is not there any more" in room.viewport.message
    assert room.inspector.name.text() == "" and not room.inspector.notes.isEnabled()


def test_saving_words_is_not_taken_for_another_file(room, folder):
    document = opened(room, folder / "c_second.mcap")
    room.words.rate("A")
    room.wait(lambda: room.words.unsaved(document.path) is None, "the rating in the file")
    room.browser.refresh()
    quiet(room)
    assert room.document is document and selected(room) == "c_second" and room.told() == []


def test_a_take_of_another_folder_is_open_and_no_line_is_selected(room, folder, tmp_path):
    opened(room, folder / "c_second.mcap")
    elsewhere = write_take(tmp_path, "elsewhere", 15)
    opened(room, elsewhere)
    assert selected(room) is None and room.inspector.name.text() == "elsewhere"
    room.browser.view.setFocus()
    quiet(room)
    assert room.document.path == elsewhere, "the focus in the list opens nothing"
    room.words.rate("A")
    room.wait(lambda: room.words.unsaved(elsewhere) is None, "the rating in the file")
    quiet(room)
    assert len(room.browser.table.rows) == len(NAMES) and selected(room) is None
    room.browser.set_folder(tmp_path)
    assert selected(room) == "elsewhere" and room.document.path == elsewhere


def test_a_line_cannot_be_deselected(room, folder):
    opened(room, folder / "c_second.mcap")
    click(room, "c_second", modifier=Qt.KeyboardModifier.ControlModifier)
    quiet(room)
    assert selected(room) == "c_second" and room.document.path.stem == "c_second"


def test_the_menu_of_a_line(room, folder, qtbot):
    view = room.browser.view
    for stem, offered in (
        ("c_second", ["Show in folder", "Copy path"]), ("d_cut_short", ["Show in folder", "Copy path", "Recover"]),
    ):  # fmt: skip
        index = room.browser._line_of(folder / f"{stem}.mcap")
        QTest.mouseClick(view.viewport(), Qt.MouseButton.RightButton, pos=view.visualRect(index).center())
        view.customContextMenuRequested.emit(view.visualRect(index).center())
        menu = room.browser.findChild(QMenu)
        assert [action.text() for action in menu.actions()] == offered
        shown(room, stem)
        assert menu.isVisible(), "over the take it is about"
        menu.actions()[1].trigger()
        assert QApplication.clipboard().text() == str(folder / f"{stem}.mcap")
        menu.close()
        qtbot.wait(50)


def test_recovering_a_take_selects_what_it_became(room, folder, qtbot):
    path = folder / "d_cut_short.mcap"
    path.write_bytes(path.read_bytes()[:-200])
    click(room, "d_cut_short")
    shown(room, "d_cut_short")
    qtbot.mouseClick(room.browser._recover, Qt.MouseButton.LeftButton)
    shown(room, "d_cut_short_recovered")
    quiet(room)
    assert selected(room) == "d_cut_short_recovered"
