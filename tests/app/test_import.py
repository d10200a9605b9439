"""File > Import recording: files of other programs become takes that open in review."""

from __future__ import annotations

import multiprocessing
from dataclasses import replace

import numpy as np
import pytest
from PySide6.QtCore import QMimeData, QPoint, QPointF, Qt, QUrl
from PySide6.QtGui import QDragEnterEvent, QDropEvent
from PySide6.QtWidgets import QComboBox, QFileDialog, QMenuBar, QWidget

from app import shortcuts
from app.notifications import Severity
from app.review import document as work
from app.review.import_dialog import ImportDialog
from core.profile import load_profile
from core.takes.export import export
from core.takes.formats import read_recording
from core.takes.reader import open_take
from core.takes.verify import verify
from tests.app.hand_frames import profile
from tests.app.stage import own_threads
from tests.app.takes import write_take
from tests.app.test_review import a_room, shown
from tests.app.test_window import Desk
from tests.core.export.recordings import solution


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    """A labelled C3D, two seconds of both hands."""
    short = replace(solution(60, lost=(), untracked=(0, 0)), name="subject 1")
    return export(short, ["c3d"], tmp_path_factory.mktemp("other"))[0]


@pytest.fixture
def room(tmp_path, qtbot):
    with a_room(tmp_path, qtbot) as made:
        yield made
    assert own_threads() == []
    assert not multiprocessing.active_children()


@pytest.fixture
def desk(qtbot, tmp_path):
    made = Desk(qtbot, tmp_path / "takes")
    yield made
    made.close()


def told(room, severity):
    return [note.line for note in room._worker.notifications.history if note.severity is severity]


def test_a_recording_becomes_a_take_that_is_listed_and_open(room, recording, tmp_path, qtbot, monkeypatch):
    monkeypatch.setattr(QFileDialog, "getOpenFileNames", lambda *args: ([str(recording)], ""))
    room.importing.ask()
    dialog = room.importing.dialog
    assert dialog.files.text() == "subject 1.c3d" and dialog.performers[0].currentText().startswith("han19")
    qtbot.keyClick(dialog, Qt.Key.Key_Return)
    shown(room, "subject 1")
    room.wait(lambda: room.document.analysis is not None, "the analysis")
    made = tmp_path / "subject 1.mcap"
    assert room.document.path == made and room.importing.dialog is None
    room.wait(lambda: any(take.path == made and take.frames for take in room.browser.table.rows), "the list")
    assert verify(made).ok and not list(tmp_path.glob(".import-*"))
    with open_take(made) as take:
        assert take.sealed and len(take.raw) == len(take.solved) == 60 and take.counts.tracked["right"] == 60
        assert take.info.name == "subject 1" and take.info.device["title"] == "subject 1.c3d"
        points = read_recording(recording).points_m[30]
        np.testing.assert_array_equal(take.raw[30].points_m, points[~np.isnan(points).any(axis=1)])
    (line,) = told(room, Severity.INFO)
    assert "subject 1.c3d was imported as subject 1.mcap: 60 frames, its labels are used." in line
    assert room.told() == []


def test_no_take_is_overwritten_and_what_cannot_be_read_stops_nothing(room, recording, tmp_path):
    whole = write_take(tmp_path, "subject 1", 20)
    before = whole.read_bytes()
    broken = tmp_path / "broken.c3d"
    broken.write_bytes(b"\2\x50" + bytes(600))
    room.importing.import_files([broken, recording], (load_profile("han19"),))
    shown(room, "subject 1_2")
    assert whole.read_bytes() == before
    (problem,) = room.told()
    assert "broken.c3d" in problem and not list(tmp_path.glob(".import-*"))


def test_what_the_reader_says_is_in_the_messages(room, recording, tmp_path, monkeypatch):
    made = write_take(tmp_path, "short", 20)
    monkeypatch.setattr(
        work,
        "import_recording",
        lambda *_: (made, {"frames": 20, "labels_given": False, "warnings": ["Its header promises 30 frames."]}),
    )
    room.importing.import_files([recording], (load_profile("han19"),))
    shown(room, "short")
    assert len(room.told()) == 1 and "subject 1.c3d: Its header promises 30 frames." in room.told()[0]
    assert "its points were named anew" in told(room, Severity.INFO)[0]


def test_importing_can_be_cancelled(room, recording, tmp_path):
    room.importing.import_files([recording] * 3, (load_profile("han19"),))
    room.wait(lambda: room.jobs.job is not None, "the job")
    room.jobs.cancel()
    room.wait(lambda: room.jobs.job is None, "the end")
    assert room.document is None and room.told() == []
    assert [path.name for path in tmp_path.iterdir() if path.suffix == ".mcap"] == []
    assert not list(tmp_path.glob(".import-*"))


def test_a_profile_for_each_performer(qtbot, tmp_path, monkeypatch):
    parent = QWidget()
    qtbot.addWidget(parent)
    cast = (replace(profile(), performer="Ada"), replace(load_profile("qualisys13"), performer="Ben"))
    dialog = ImportDialog([tmp_path / "a.c3d", tmp_path / "b.trc"], cast, tmp_path, parent)
    assert [box.currentText().split(" ·")[0] for box in dialog.performers] == ["Ada", "Ben"]
    assert dialog.files.text() == "2 files: a.c3d, b.trc" and dialog.start.isEnabled()
    qtbot.mouseClick(dialog.add, Qt.MouseButton.LeftButton)
    choose(dialog.performers[2], "schroeder8")
    dialog.accept()
    assert [one.layout.name for one in dialog.profiles] == ["han19", "qualisys13", "schroeder8"]
    dialog._remove(dialog.performers[1])
    path = tmp_path / "cleo.json"
    path.write_text(replace(profile(), performer="Cleo").to_json())
    monkeypatch.setattr(QFileDialog, "getOpenFileName", lambda *args: (str(path), ""))
    choose(dialog.performers[1], "Profile file")
    dialog.accept()
    assert [one.performer for one in dialog.profiles] == ["Ada", "Cleo"]
    path.write_text("{}")
    choose(dialog.performers[0], "Profile file")
    assert "cleo.json" in dialog.error.text() and dialog.performers[0].currentText().startswith("Ada")


def choose(box: QComboBox, text: str) -> None:
    box.setCurrentIndex(next(i for i in range(box.count()) if text in box.itemText(i)))
    box.activated.emit(box.currentIndex())


def test_nothing_is_imported_without_a_file_or_from_a_take(qtbot, tmp_path):
    parent = QWidget()
    qtbot.addWidget(parent)
    dialog = ImportDialog([], (profile(),), tmp_path, parent)
    assert not dialog.start.isEnabled() and dialog.start.toolTip() == "Choose a recording first."
    dialog.set_files([tmp_path / "x.mcap"])
    dialog.accept()
    assert dialog.error.text() == "x.mcap is a take already. Open it with File > Open take." and not dialog.result()


def test_the_menu_has_it_with_its_key_and_files_can_be_dropped(desk, recording, qtbot, monkeypatch):
    window = desk.window
    menus = window.menuWidget().findChild(QMenuBar)
    actions = menus.actions()[0].menu().actions()
    action = next(action for action in actions if action.text() == "Import recording…")
    assert action.shortcut().toString() == shortcuts.IMPORT and "C3D, TRC" in action.toolTip()
    data = QMimeData()
    data.setUrls([QUrl.fromLocalFile(str(recording))])
    copy, button, keys = Qt.DropAction.CopyAction, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier
    entering = QDragEnterEvent(QPoint(5, 5), copy, data, button, keys)
    window.dragEnterEvent(entering)
    assert entering.isAccepted()
    window.dropEvent(QDropEvent(QPointF(5, 5), copy, data, button, keys))
    desk.until(lambda: window._review is not None and window._review.importing.dialog is not None, "the dialog")
    dialog = window._review.importing.dialog
    assert dialog.paths == (recording,)
    qtbot.keyClick(dialog, Qt.Key.Key_Escape)
    assert window._review.importing.dialog is None
    monkeypatch.setattr(QFileDialog, "getOpenFileNames", lambda *args: ([], ""))
    qtbot.keyClick(window, Qt.Key.Key_I, Qt.KeyboardModifier.ControlModifier | Qt.KeyboardModifier.ShiftModifier)
    assert window._review.importing.dialog is None
