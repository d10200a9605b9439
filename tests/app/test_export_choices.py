"""The options of the export dialog: followed, greyed where they mean nothing, remembered."""

from __future__ import annotations

import json

import pytest
from PySide6.QtCore import Qt

from app.review.export_choices import BONES, ExportChoices
from app.settings import Settings
from core.takes.export import ExportOptions
from core.takes.export.bone_names import BONE_SCHEMES
from tests.app.stage import own_threads
from tests.app.takes import write_take
from tests.app.test_review import a_room, opened
from tests.core.export.recordings import every_point


@pytest.fixture
def room(tmp_path, qtbot):
    write_take(tmp_path, "first", 101)
    with a_room(tmp_path, qtbot) as made:
        yield made
    assert own_threads() == []


@pytest.fixture
def choices(qtbot):
    made = ExportChoices(Settings(None))
    qtbot.addWidget(made)
    return made


def test_nothing_is_asked_for_to_begin_with(choices):
    assert choices.options == ExportOptions()


@pytest.mark.parametrize(
    ("typed", "rate_hz"), [("60 Hz", 60.0), ("59.94", 59.94), ("29,97 hz", 29.97), ("As recorded", None), (" ", None)]
)
def test_any_rate_can_be_written(choices, typed, rate_hz):
    choices.rate.setCurrentText(typed)
    assert choices.options.rate_hz == rate_hz


def test_every_naming_of_bones_can_be_chosen(choices):
    assert tuple(BONES) == tuple(BONE_SCHEMES)
    choices.bones.setCurrentIndex(choices.bones.findData("vrm"))
    assert choices.options.bones == "vrm"


def test_what_no_chosen_format_follows_is_grey(choices):
    boxes = (choices.measured, choices.joints, choices.up, choices.unit, choices.rate, choices.bones)

    def able(*formats):
        choices.follow(formats, True)
        return [box.isEnabled() for box in boxes]

    assert able("c3d") == [True, True, True, True, True, False]
    assert able("gltf") == [False, False, False, False, True, True]
    assert able("csv") == [True, False, True, False, False, False]
    assert able("bvh") == [False, False, True, True, True, True]
    assert able() == [False] * 6
    choices.follow(["c3d"], False)
    assert not any(box.isEnabled() for box in boxes)


def test_they_are_followed_and_remembered(room, tmp_path, qtbot):
    opened(room, tmp_path / "first.mcap")
    room.export_take()
    dialog = room._dialog
    for key, box in dialog.formats.items():
        box.setChecked(key in ("c3d", "gltf"))
    choices = dialog.choices
    dialog.activateWindow()
    room.wait(dialog.isActiveWindow, "the dialog to be active")
    for box in (choices.measured, choices.joints):
        box.setFocus()
        qtbot.keyClick(box, Qt.Key.Key_Space)
        assert box.isChecked(), box.text()
    choices.rate.setCurrentText("as fast as possible")
    assert not dialog.start.isEnabled() and "'as fast as possible' is no rate" in dialog.reason.text()
    choices.rate.setCurrentText("50 Hz")
    choices.up.setCurrentIndex(choices.up.findData("z"))
    choices.unit.setCurrentIndex(choices.unit.findData("m"))
    qtbot.mouseClick(dialog.start, Qt.MouseButton.LeftButton)
    room.wait(lambda: not dialog.exporting, "the export")
    result = dialog.result
    assert "3 files written, read back and equal;" in result.written.text()
    assert result.files == ["first.c3d", "first.glb", "marks.csv"] and result.written.property("level") == "good"
    assert "glTF is Y up, and so is this file" in result.notes.text() and not result.notes.property("level")
    out = tmp_path / "exports" / "first"
    recording = every_point(out / "first.c3d")
    assert recording.rate_hz == 50.0 and "R_index_tip_joint" in recording.labels
    c3d = json.loads((out / "first_export.json").read_text())["files"][0]
    assert (c3d["up"], c3d["unit"], c3d["options"]) == ("z", "m", {"joints": True, "measured": True})
    wanted = choices.options
    dialog.reject()
    room.export_take()
    assert room._dialog.choices.options == wanted
    room._dialog.reject()


def test_a_format_that_cannot_be_written_is_said_and_the_others_are_there(room, tmp_path, qtbot):
    opened(room, tmp_path / "first.mcap")
    out = tmp_path / "exports" / "first"
    out.mkdir(parents=True)
    (out / "first_export.json").write_text("mine")
    room.export_take()
    dialog = room._dialog
    dialog.export()
    room.wait(lambda: not dialog.exporting, "the export")
    assert dialog.result.state.property("level") == "problem" and (out / "first.c3d").exists()
    assert "is no record of an export. Move it away" in dialog.result.state.text()
    dialog.reject()


def test_what_is_said_of_the_take_now_is_exported(room, tmp_path):
    """Also of a solution that was made before it was said."""
    opened(room, tmp_path / "first.mcap")
    room.solving.solve_with(room.document.solved.cast)
    room.wait(lambda: room.jobs.job is None and len(room.document.solutions) == 2, "the solution")
    room.player.seek_frame(40)
    room.words.add_mark(room.player.time_s)
    room.words.write_notes("spoken of later")
    room.export_take()
    dialog = room._dialog
    dialog.export()
    room.wait(lambda: not dialog.exporting, "the export")
    out = tmp_path / "exports" / "first"
    assert [line.split(",")[0] for line in (out / "marks.csv").read_text().splitlines()[1:]] == [
        "0.100000", "0.200000", "0.400000",
    ]  # fmt: skip
    record = json.loads((out / "first_export.json").read_text(encoding="utf-8"))
    assert record["recording"]["notes"] == "spoken of later"
    dialog.reject()
