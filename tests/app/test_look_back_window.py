"""Saving what just happened, as an operator does: by the button, the key and the menu; and what is seen of it."""

from __future__ import annotations

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QMenu

from app import shortcuts
from app.panels.last_take import LastTake
from app.panels.look_back_button import LookBackButton
from app.take_summary import SealingNumbers
from core.level import Level
from core.takes.reader import open_take
from core.takes.take import LOOKED_BACK
from devices.common.clock import host_clock
from tests.app.stage import server
from tests.app.test_window import Desk
from tests.hanging_disk import HangingDisk

CONTROL_SHIFT = Qt.KeyboardModifier.ControlModifier | Qt.KeyboardModifier.ShiftModifier


@pytest.fixture
def stage():
    with server() as simulator:
        yield simulator


@pytest.fixture
def desk(qtbot, tmp_path):
    made = Desk(qtbot, tmp_path / "takes")
    made.window.raise_()
    made.window.activateWindow()
    made.until(made.window.isActiveWindow, "the window to be active")
    yield made
    made.close()


def test_the_key_saves_the_last_seconds_under_the_next_name_also_while_a_take_runs(desk, stage) -> None:
    window, recorder = desk.window, desk.window.recorder
    recorder.notes.setPlainText("for the next")
    desk.connected(stage)
    desk.until(lambda: desk.session.look_back.seconds > 1.0, "a second")
    desk.until(lambda: "Save last" in recorder.look_back.text() and "last 1 s" in recorder.look_back.text(), "words")
    first = window.plan.next()[0]
    desk.click(window.deck.record)
    desk.until(lambda: desk.session.recording, "a take")
    desk.qtbot.keyClick(window, Qt.Key.Key_R, CONTROL_SHIFT)
    desk.until(lambda: desk.session.numbers().sealing, "what just happened to be written")
    (sealing,) = desk.session.numbers().sealing
    second = sealing.name
    assert second != first and desk.session.recording_name == first
    desk.until(lambda: recorder.last.title.text() == second, "the card")
    assert recorder.last.no_poses.isVisibleTo(window) and not recorder.last.review.isVisibleTo(window)
    assert "Looked back" in recorder.last.counts.text() and "Solving" in recorder.last.reason.text()
    desk.until(lambda: "Solving them: 0%" not in recorder.last.reason.text(), "the first poses")
    desk.until(lambda: desk.finished, "it to be solved and sealed")
    assert desk.session.recording and window.plan.next()[0] not in (first, second)
    (summary,) = desk.finished
    assert summary.name == second and summary.solved == summary.received > 100
    assert recorder.last.light.level is summary.verdict.level and "· looked back" in recorder.last.counts.text()
    assert not recorder.last.no_poses.isVisibleTo(window) and recorder.last.review.isVisibleTo(window)
    with open_take(summary.path) as take:
        assert take.info.looked_back and take.info.notes == "" and take.info.performer == window.plan.performer
    desk.click(window.deck.record)
    desk.until(lambda: len(desk.finished) == 2, "the take that ran")
    with open_take(desk.finished[1].path) as take:
        assert not take.info.looked_back and take.info.notes == "for the next"


def test_solving_is_cancelled_at_the_card_and_the_take_is_reviewed_with_what_it_is(desk, stage) -> None:
    window, recorder = desk.window, desk.window.recorder
    desk.connected(stage)
    desk.until(lambda: desk.session.look_back.seconds > 1.0, "a second")
    desk.click(recorder.look_back)
    desk.until(lambda: recorder.last.no_poses.isVisibleTo(window), "the way out")
    desk.click(recorder.last.no_poses)
    desk.until(lambda: desk.finished, "the take")
    assert desk.finished[0].verdict.level is Level.WARNING and desk.finished[0].verdict.whole
    desk.until(lambda: not recorder.last.no_poses.isVisibleTo(window))
    assert "Solve it again in review" in recorder.last.reason.text()
    desk.click(recorder.last.review)
    room = window._review
    desk.until(lambda: LOOKED_BACK in room.inspector.facts.text(), "review to say so")
    rows = room.browser.table
    desk.until(lambda: rows.rows and rows.rows[0].looked_back, "the list to say so")
    assert LOOKED_BACK in rows.index(0, 1).data(Qt.ItemDataRole.ToolTipRole)
    desk.qtbot.keyClick(window, Qt.Key.Key_R, CONTROL_SHIFT)  # live goes on behind it
    desk.until(lambda: desk.session.numbers().sealing, "another from review")
    desk.session.solve_no_more()
    desk.until(lambda: len(desk.finished) == 2, "it to be sealed")
    assert window.pages.currentIndex() == 1


def test_with_nothing_there_it_is_said_where_it_was_asked_and_the_name_stays_free(desk) -> None:
    window, recorder = desk.window, desk.window.recorder
    name = window.plan.next()[0]
    assert recorder.look_back.text() == "Save last 0 s" and "once a device is connected" in recorder.look_back.toolTip()
    desk.click(recorder.look_back)
    desk.until(lambda: "Nothing has come" in recorder.refusal.text(), "the refusal")
    assert window.plan.next()[0] == name
    assert "Nothing has come" in desk.session.notifications.history[-1].line


def test_a_disk_that_hangs_is_said_and_what_happened_before_is_saved_when_it_answers(desk, stage) -> None:
    window, recorder = desk.window, desk.window.recorder
    desk.connected(stage)
    desk.until(lambda: desk.session.look_back.seconds > 1.0, "a second")
    hangs = [True]
    disk = HangingDisk(lambda: bool(hangs))
    try:
        desk.click(recorder.look_back)
        asked_s = host_clock()
        notes = desk.session.notifications
        desk.until(lambda: any("not saved yet" in note.line for note in notes.history), "the message")
        desk.click(window.deck.live)  # the window is alive, and frames come
        number = desk.session.latest.newer(0)[0]
        desk.until(lambda: desk.session.latest.newer(0)[0] > number + 10, "live frames")
    finally:
        hangs.clear()
        disk.answer()
        disk.restore()
    desk.until(lambda: desk.session.numbers().sealing, "the take to be begun")
    desk.session.solve_no_more()
    desk.until(lambda: desk.finished, "the take")
    (summary,) = desk.finished
    assert summary.sealed and summary.written == summary.received > 100 and summary.verdict.whole
    with open_take(summary.path) as take:
        assert take.raw[-1].times.arrival_s <= asked_s


def test_it_is_in_the_menu_with_its_key_and_in_the_list_of_keys(desk) -> None:
    menus = {menu.title(): menu for menu in desk.window.findChildren(QMenu)}
    action = next(one for one in menus["Session"].actions() if one.text() == "Save what just happened")
    assert action.shortcut().toString() == shortcuts.LOOK_BACK
    dialog = shortcuts.ShortcutsDialog(desk.window)
    desk.qtbot.addWidget(dialog)
    assert (shortcuts.LOOK_BACK, "Save what just happened") in dict(shortcuts.TABLE)["Recording"]


def test_the_button_says_how_much_there_is_and_up_to_when(desk) -> None:
    button: LookBackButton = desk.window.recorder.look_back
    wide = button.width()
    button.show_kept(29.99, 0.1)
    assert button.text() == "Save last 30 s" and "the last 30 s, of every device" in button.toolTip()
    button.show_kept(12.3, 600.0)
    assert button.text() == "Save last 12 s" and "when the last frame came" in button.toolTip()
    assert shortcuts.LOOK_BACK in button.toolTip() and button.width() == wide
    assert desk.window.look_back_action.toolTip() == button.toolTip()


def test_the_card_says_how_many_takes_wait_to_be_solved(qtbot) -> None:
    card = LastTake(lambda path: None, lambda: None, lambda: None)
    qtbot.addWidget(card)
    first, second = (
        SealingNumbers(name, part, received=90, written=90, solving=True) for name, part in (("a", 0.3), ("b", 0.0))
    )
    card.show_finishing([first])
    assert (card.title.text(), card.reason.text()) == ("a", "Solving them: 30%")
    card.show_finishing([first, second])
    assert (card.title.text(), card.reason.text()) == ("a", "Solving them: 30%, then 1 more take")
