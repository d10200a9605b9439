"""The export dialog on a small screen: what matters comes first, and nothing is beyond the screen or out of reach."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from PySide6.QtCore import QRect, Qt
from PySide6.QtWidgets import QApplication

from core.takes.export import Exported
from tests.app.stage import own_threads
from tests.app.takes import write_take
from tests.app.test_review import a_room, opened

STEM = "Anna_and_Ben_walking_to_the_door_003"
FILES = [
    f"{STEM}.c3d", f"{STEM}.trc", "markers.csv", "angles.csv", "joints.csv", "points.csv", f"{STEM}_Anna_left.bvh",
    f"{STEM}_Anna_right.bvh", f"{STEM}_Ben_B_left.bvh", f"{STEM}_Ben_B_right.bvh", f"{STEM}.glb", f"{STEM}_held.csv",
    "marks.csv", f"{STEM}_holes.csv",
]  # fmt: skip
NOTES = [
    "CSV keeps the recording's own frames, with the time of each, at any rate.",
    "CSV is in metres, as the names of its columns say.",
    "glTF is Y up, and so is this file: programs turn it as they read it.",
]
LAPTOP = QRect(0, 0, 1366, 728)
"""Of a screen with 1366 x 768 pixels and a task bar."""


class SmallScreen:
    def availableGeometry(self):  # noqa: N802 (Qt's name)
        return LAPTOP


@pytest.fixture
def room(tmp_path, qtbot):
    write_take(tmp_path, "first", 101, silent=(50, 3.5))
    with a_room(tmp_path, qtbot) as made:
        opened(made, tmp_path / "first.mcap")
        yield made
    assert own_threads() == []


@pytest.fixture
def dialog(room, qtbot, monkeypatch):
    room.export_take()
    made = room._dialog
    monkeypatch.setattr(made, "screen", SmallScreen)
    made.activateWindow()
    room.wait(made.isActiveWindow, "the dialog to be active")
    yield made
    made.reject()


def exported(folder: Path) -> Exported:
    for name in FILES:
        (folder / name).write_text("x" * 1234)
    return Exported(
        [folder / name for name in FILES], notes=NOTES, warnings=["61 of 638 frames have no pose."],
        record=folder / f"{STEM}_export.json",
    )  # fmt: skip


def test_a_long_result_stays_on_the_screen(dialog, tmp_path, qtbot):
    dialog.move(400, 150)
    dialog._succeeded(exported(tmp_path))
    qtbot.wait(100)
    for button in (dialog.start, dialog.cancel, dialog.open_folder):
        corner = button.mapToGlobal(button.rect().bottomRight())
        assert button.isVisible() and LAPTOP.contains(corner), (button.text(), corner)
    bar = dialog.result.verticalScrollBar()
    assert bar.maximum() > 0 and bar.value() == 0
    qtbot.keyClick(dialog, Qt.Key.Key_PageDown)
    assert bar.value() > 0


def test_a_short_result_is_shown_whole(dialog, tmp_path, qtbot):
    whole = exported(tmp_path)
    dialog._succeeded(replace(whole, files=whole.files[:1], notes=[]))
    qtbot.wait(100)
    assert dialog.result.verticalScrollBar().maximum() == 0


def test_what_matters_comes_first_and_in_its_colour(dialog, tmp_path, qtbot):
    dialog._succeeded(exported(tmp_path))
    qtbot.wait(100)
    result = dialog.result
    labels = (result.warnings, result.notes, result.written)
    assert [said.property("level") or "" for said in labels] == ["warning", "", "good"]
    tops = [said.y() for said in labels]
    assert tops == sorted(tops) and not result.state.isVisible()
    lines = result.text.splitlines()
    assert lines[0] == "61 of 638 frames have no pose."
    assert lines[1].startswith("3.5 s without frames") and lines[1].endswith("…_holes.csv says where.")
    assert lines[2:5] == NOTES and lines[5].startswith("14 files written, read back and equal;")
    assert lines[6:] == FILES


def test_what_failed_comes_before_all_else(dialog, tmp_path):
    whole = exported(tmp_path)
    whole.failed["trc"] = "TRC went wrong. Do this."
    dialog._succeeded(whole)
    assert dialog.result.text.splitlines()[0] == "TRC went wrong. Do this."
    assert dialog.result.state.property("level") == "problem"
    dialog.result.say("Reading…", "")
    assert dialog.result.text == "Reading…" and dialog.result.files == []


@pytest.mark.parametrize("rate", ["abc", "0", "100000000", "nan"])
def test_a_rate_that_is_none_is_said_at_once(dialog, rate):
    dialog.choices.rate.setCurrentText(rate)
    assert not dialog.start.isEnabled() and "is no rate" in dialog.reason.text()
    assert dialog.reason.isVisible() and dialog.reason.property("level") == "warning"
    dialog.choices.rate.setCurrentText("60 Hz")
    assert dialog.start.isEnabled() and dialog.reason.text() == ""


def test_enter_does_what_the_focus_is_on(dialog, qtbot, monkeypatch):
    asked = []
    monkeypatch.setattr("app.review.export_dialog.QFileDialog.getExistingDirectory", lambda *_: asked.append(1) or "")
    assert QApplication.focusWidget() is dialog.start
    dialog.browse.setFocus()
    qtbot.keyClick(dialog.browse, Qt.Key.Key_Return)
    assert asked and not dialog.exporting


def test_tab_goes_through_the_fields_as_they_stand(dialog, qtbot):
    reached = []
    for _ in range(30):
        qtbot.keyClick(QApplication.focusWidget(), Qt.Key.Key_Tab)
        reached.append(QApplication.focusWidget())
        if reached[-1] is dialog.start:
            break
    assert reached[0] is dialog.formats["c3d"]
    fields = [dialog.choices.up, dialog.folder, dialog.browse, dialog.replace, dialog.cancel, dialog.start]
    places = [reached.index(widget) for widget in fields]
    assert places == sorted(places)


def test_while_files_are_written_nothing_else_can_be_done(room, dialog, qtbot):
    qtbot.mouseClick(dialog.start, Qt.MouseButton.LeftButton)
    assert dialog.exporting
    able = [widget for widget in dialog.choices.fields if widget.isEnabled()]
    assert able == [] and not dialog.browse.isEnabled() and not dialog.folder.isEnabled()
    qtbot.keyClick(dialog, Qt.Key.Key_Return)  # a second Enter is no Cancel
    assert dialog.cancel.isEnabled() and dialog.cancel.text() == "Cancel"
    room.wait(lambda: not dialog.exporting, "the end")
    assert dialog.browse.isEnabled() and QApplication.focusWidget() is dialog.cancel
