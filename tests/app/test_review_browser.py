from dataclasses import replace
from datetime import UTC
from itertools import pairwise

import pytest
from PySide6.QtCore import Qt

from app.review.browser import COLUMNS, ROW_ROLE, TakeBrowser
from app.review.take_row import read_row, take_files
from devices.device import Level
from tests.app.stage import until
from tests.app.takes import write_take


@pytest.fixture
def folder(tmp_path):
    write_take(tmp_path, "good", rating="A", notes="nice")
    write_take(tmp_path, "leaky", network_loss=3)
    write_take(tmp_path, "cut_short", seal=False)
    (tmp_path / "foreign.mcap").write_bytes(b"no take at all")
    (tmp_path / "notes.txt").write_text("no take")
    return tmp_path


@pytest.fixture
def browser(folder, qtbot):
    made = TakeBrowser(folder)
    qtbot.addWidget(made)
    made.resize(500, 400)
    made.show()
    until(lambda: all(row.level is not Level.IDLE for row in made.table.rows), "every take read", qtbot_wait(qtbot))
    yield made
    made.close_jobs()


def qtbot_wait(qtbot):
    return lambda seconds: qtbot.wait(max(1, int(seconds * 1000)))


def shown(browser) -> list[str]:
    model = browser.view.model()
    return [model.index(i, 1).data() for i in range(model.rowCount())]


def test_a_row_holds_what_the_take_holds(folder):
    row = read_row(folder / "good.mcap")
    assert (row.name, row.frames, row.hands, row.rating, row.performer) == ("good", 60, "L R", "A", "Ann")
    assert row.duration_s == pytest.approx(0.59)
    assert (row.sealed, row.readable, row.level, row.problems) == (True, True, Level.GOOD, ())
    assert row.created.tzinfo == UTC


@pytest.mark.parametrize(
    ("name", "level", "words", "readable"),
    [
        ("leaky", Level.WARNING, "3 frames were lost on the network", True),
        ("cut_short", Level.WARNING, "not sealed", True),
        ("foreign", Level.PROBLEM, "is not a take", False),
    ],
)
def test_what_is_wrong_is_said(folder, name, level, words, readable):
    row = read_row(folder / f"{name}.mcap")
    assert (row.level, row.readable) == (level, readable)
    assert words in " ".join(row.problems)


def test_a_file_that_vanished_is_a_row_not_an_error(tmp_path):
    row = read_row(tmp_path / "gone.mcap")
    assert row.level is Level.PROBLEM and not row.readable


def test_the_folder_is_listed_without_what_is_no_take(folder):
    assert {path.stem for path in take_files(folder)} == {"good", "leaky", "cut_short", "foreign"}


def test_it_sorts_and_filters(browser):
    browser.view.sortByColumn(COLUMNS.index("Name"), Qt.SortOrder.AscendingOrder)
    assert shown(browser) == ["cut_short", "foreign", "good", "leaky"]
    browser.view.sortByColumn(0, Qt.SortOrder.DescendingOrder)
    assert shown(browser)[0] == "foreign"
    browser.filter.setText("LEAK")
    assert shown(browser) == ["leaky"]


def test_a_click_opens_what_is_clicked(browser, qtbot):
    opened = []
    browser.opened.connect(opened.append)
    browser.view.sortByColumn(1, Qt.SortOrder.AscendingOrder)
    for i in range(4):
        index = browser.view.model().index(i, 1)
        qtbot.mouseClick(
            browser.view.viewport(), Qt.MouseButton.LeftButton, pos=browser.view.visualRect(index).center()
        )
    assert [path.stem for path in opened] == ["cut_short", "foreign", "good", "leaky"]


def test_only_a_take_that_can_be_mended_offers_it(browser):
    offered = {}
    for i in range(4):
        index = browser.view.model().index(i, 1)
        browser.view.setCurrentIndex(index)
        offered[index.data(ROW_ROLE).path.stem] = browser._recover.isVisible()
    assert offered == {"good": False, "leaky": False, "cut_short": True, "foreign": False}


def test_new_takes_appear_by_themselves_and_gone_ones_go(browser, folder, qtbot):
    write_take(folder, "fresh")
    (folder / "foreign.mcap").unlink()
    until(
        lambda: (
            sorted(row.name for row in browser.table.rows if row.level is not Level.IDLE)
            == ["cut_short", "fresh", "good", "leaky"]
        ),
        "the new take",
        qtbot_wait(qtbot),
    )
    assert sorted(shown(browser)) == ["cut_short", "fresh", "good", "leaky"]


def test_an_empty_and_a_missing_folder_say_what_to_do(tmp_path, qtbot):
    browser = TakeBrowser(tmp_path)
    qtbot.addWidget(browser)
    assert "Record one" in browser._empty.text()
    first = tmp_path / "takes"
    browser.set_folder(first)  # of a first start
    assert browser._empty.text() == f"No takes yet. Takes that you record are kept in {first}."
    first.mkdir()
    browser.refresh()
    write_take(first, "one", 2)  # the folder is watched from when it was made
    until(lambda: [take.path.stem for take in browser.table.rows] == ["one"], "the take", qtbot_wait(qtbot))
    browser.set_folder(tmp_path / "gone" / "takes")  # the take before may be read still
    until(lambda: "is not there. Connect its disk" in browser._empty.text(), "what to do", qtbot_wait(qtbot))
    (tmp_path / "file").write_text("")
    browser.set_folder(tmp_path / "file")
    until(lambda: "cannot be read" in browser._empty.text(), "what to do", qtbot_wait(qtbot))


def test_a_thousand_takes_are_a_list_like_any_other(tmp_path, qtbot):
    source = write_take(tmp_path, "take", 2).read_bytes()
    for i in range(999):
        (tmp_path / f"take_{i:03}.mcap").write_bytes(source)
    browser = TakeBrowser(tmp_path)
    qtbot.addWidget(browser)
    browser.show()
    assert len(browser.table.rows) == 1000, "listed at once"
    until(lambda: all(row.level is Level.GOOD for row in browser.table.rows), "every take read", qtbot_wait(qtbot))
    browser.filter.setText("take")
    assert len(shown(browser)) == 1000
    browser.close_jobs()


def columns(browser) -> list[str]:
    return [title for i, title in enumerate(COLUMNS) if not browser.view.isColumnHidden(i)]


@pytest.mark.parametrize("width", [240, 288, 330, 400, 470, 700])
def test_names_keep_their_room(browser, qtbot, width):
    """On a screen of 1366 x 768 the list is 288 pixels wide."""
    for k in range(40):  # a scroll bar comes
        browser.table.update_row(replace(browser.table.rows[0], path=browser.folder / f"{k}.mcap", name=f"take {k}"))
    browser.resize(width, 300)
    qtbot.wait(50)
    name = COLUMNS.index("Name")
    assert browser.view.fontMetrics().horizontalAdvance("Anna_playback_00") <= browser.view.columnWidth(name) - 8
    assert {"Name", "When"} <= set(columns(browser))


def test_columns_give_way_in_turn_and_come_back(browser, qtbot):
    seen = []
    for width in (700, 400, 350, 300, 240, 700):
        browser.resize(width, 400)
        qtbot.wait(30)
        seen.append(columns(browser))
    assert seen[0] == seen[-1] == list(COLUMNS)
    assert all(set(narrower) <= set(wider) for wider, narrower in pairwise(seen[:-1]))
    order = ["Frames", "Rating", "Hands", "Length"]
    for one in seen:
        missing = [title for title in order if title not in one]
        assert missing == order[: len(missing)]
