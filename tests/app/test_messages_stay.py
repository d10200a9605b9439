"""Messages tell that they are there and wait to be read: they never come before what an operator looks at."""

from __future__ import annotations

import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtWidgets import QTabBar

from tests.app.test_window import Desk


@pytest.fixture
def desk(qtbot, tmp_path):
    made = Desk(qtbot, tmp_path / "takes")
    yield made
    made.close()


def tabs(desk) -> QTabBar:
    """Of plots and messages."""
    return next(bar for bar in desk.window.findChildren(QTabBar) if bar.isVisible() and bar.count() == 2)


def test_a_problem_counts_in_the_tab_and_leaves_the_plots_before_it(desk):
    notes, bar = desk.worker.notifications, tabs(desk)
    assert [bar.tabText(i) for i in range(2)] == ["Plots", "Messages"] and bar.currentIndex() == 0
    notes.problem("The disk is nearly full.", "Free some space.")
    notes.warning("The cable is loose.", "Push it in.")
    notes.info("Saved.")
    for _ in range(3):
        notes.problem("The disk is nearly full.", "Free some space.")  # told once, counted
    desk.qtbot.wait(1200)
    assert bar.currentIndex() == 0 and not desk.window.plots.visibleRegion().isEmpty()
    assert bar.tabText(1) == "Messages (2)"
    assert desk.window.strip.message.text() == "The disk is nearly full."
    assert "Free some space." in desk.window.strip.message.toolTip()

    desk.qtbot.mouseClick(desk.window.strip.message, Qt.MouseButton.LeftButton)
    desk.until(lambda: bar.tabText(bar.currentIndex()) == "Messages", "the messages, read")
    assert not desk.window.messages.table.visibleRegion().isEmpty()
    notes.problem("Another one.")
    desk.qtbot.wait(300)
    assert bar.tabText(1) == "Messages", "what is looked at is not counted"

    desk.qtbot.mouseClick(bar, Qt.MouseButton.LeftButton, pos=QPoint(bar.tabRect(0).center()))
    desk.qtbot.wait(200)
    assert bar.currentIndex() == 0
    notes.problem("A third one.")
    desk.until(lambda: bar.tabText(1) == "Messages (1)", "its count")
    desk.window.messages.clear()
    assert bar.tabText(1) == "Messages"


def test_in_review_a_click_on_the_message_opens_the_messages_there(desk):
    desk.window.show_review(True)
    desk.qtbot.wait(100)
    desk.worker.notifications.problem("The take cannot be read.", "Choose another.")
    desk.until(lambda: desk.window.strip.message.text() != "")
    assert not desk.window.docks["messages"].isVisible()
    desk.qtbot.mouseClick(desk.window.strip.message, Qt.MouseButton.LeftButton)
    desk.until(lambda: desk.window.docks["messages"].isVisible(), "the messages")
    assert desk.window.pages.currentIndex() == 1
    desk.window.show_review(False)
    desk.qtbot.wait(100)
    bar = tabs(desk)
    assert bar.tabText(bar.currentIndex()) == "Plots", "live is as it was"
