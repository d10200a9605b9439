"""Messages tell that they are there and wait to be read: they never come before what an operator looks at."""

from __future__ import annotations

import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtWidgets import QTabBar

from app import status_strip
from app.main_window import MainWindow
from app.notifications import NotificationCentre
from app.session import Session
from app.settings import Settings
from app.worker import SessionWorker
from core.profile import load_profile
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


def test_a_warning_stays_in_the_strip_until_it_is_read_or_over(desk, monkeypatch):
    monkeypatch.setattr(status_strip, "MESSAGE_S", 0.3)
    notes, shown = desk.worker.notifications, desk.window.strip.message
    notes.warning("The settings cannot be written.", "What you change holds until Phalanx is closed.", "Settings")
    notes.info("Take a is saved.", source="Recorder")
    desk.qtbot.wait(800)
    assert shown.text() == "The settings cannot be written." and shown.property("level") == "warning"
    desk.qtbot.mouseClick(shown, Qt.MouseButton.LeftButton)
    desk.until(lambda: shown.text() == "", "it, read")
    tabs(desk).setCurrentIndex(0)

    notes.problem("Motive sends no frames.", "Check it.", "Motive")
    notes.info("Take b is saved.", source="Recorder")
    assert shown.text() == "Motive sends no frames."
    notes.info("Motive is back.", source="Motive", settles=True)
    assert shown.text() == "Motive is back." and not shown.property("level")
    desk.until(lambda: shown.text() == "", "its end")


def test_what_went_wrong_before_the_window_was_there_stands_in_the_strip(qtbot, tmp_path):
    centre = NotificationCentre()
    centre.warning("The settings file cannot be read.", "It is kept beside it.", "Settings")
    worker = SessionWorker(Session(load_profile("han19"), notifications=centre), 30)
    window = MainWindow(worker, Settings(None))
    qtbot.addWidget(window)
    assert window.strip.message.text() == "The settings file cannot be read."
    window.stop_and_close()
