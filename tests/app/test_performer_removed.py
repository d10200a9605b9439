"""A performer who is removed goes whole, and the others keep what is theirs."""

from __future__ import annotations

import pytest
from PySide6.QtTest import QTest

from core.profile import load_profile
from tests.app.stage import server
from tests.app.test_typing import front, replace
from tests.app.test_window import Desk


@pytest.fixture
def desk(qtbot, tmp_path):
    made = Desk(qtbot, tmp_path / "takes")
    front(made)
    yield made
    made.close()


@pytest.mark.parametrize("left", [True, False])
def test_the_others_keep_their_names_and_recording_goes_on(desk, left):
    box = desk.window.tracking.performers
    box.add_performer("han19")
    desk.until(lambda: len(box.blocks) == 2, "the second performer")
    QTest.qWait(300)
    replace(desk, box.blocks[0].name, "Anna", 40)
    replace(desk, box.blocks[1].name, "Bert", 40)
    if left:
        desk.click(desk.window.viewport)
        assert [profile.performer for profile in desk.session.profiles] == ["Anna", "Bert"]
    QTest.qWait(300)
    desk.click(box.blocks[1].remove)
    desk.until(lambda: len(box.blocks) == 1, "the second to go")
    QTest.qWait(600)
    assert [profile.performer for profile in desk.session.profiles] == ["Anna"]
    assert "Anna" in box.blocks[0].profile.currentText() or box.blocks[0].profile.currentText().startswith("han19")
    with server() as simulator:
        desk.connected(simulator)
        desk.click(desk.window.deck.record)
        desk.until(lambda: desk.session.recording, "a take")
        QTest.qWait(300)
        desk.click(desk.window.deck.record)
        desk.until(lambda: desk.finished, "its end")
    assert [note.line for note in desk.worker.notifications.history if "deleted" in note.line] == []
    assert load_profile("han19").layout.name == desk.session.profile.layout.name
