"""File > Import recording: files of other programs become takes that open in review."""

from __future__ import annotations

import multiprocessing
import os
import re
import signal
import subprocess
import sys
import threading
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from PySide6.QtCore import QMimeData, QPoint, QPointF, Qt, QTimer, QUrl
from PySide6.QtGui import QDragEnterEvent, QDropEvent
from PySide6.QtWidgets import QApplication, QComboBox, QFileDialog, QMenuBar, QMessageBox, QPushButton, QWidget

from app import settings as names
from app import shortcuts
from app.hand_tally import HandTally
from app.labels import cast_labels
from app.notifications import Severity
from app.review import document as work
from app.review.import_dialog import ImportDialog
from app.review.job import Job
from app.review.job_bar import JobBar
from app.window_ending import WindowEnding
from core.frames import HandState
from core.profile import load_profile
from core.takes.drafts import clear_drafts, draft_folder
from core.takes.export import export
from core.takes.formats import read_recording
from core.takes.reader import open_take
from core.takes.reprocess import solve
from core.takes.verify import verify
from tests.app.hand_frames import profile
from tests.app.stage import own_threads
from tests.app.takes import write_take
from tests.app.test_cli_track_doubts import trc
from tests.app.test_review import a_room, opened, shown
from tests.app.test_window import Desk
from tests.core.export.recordings import solution
from tests.data import ROOT


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
    problem, summary = room.told()
    assert "broken.c3d" in problem and not list(tmp_path.glob(".import-*"))
    assert summary == "1 imported, 1 could not be read: broken.c3d."
    assert room.outcome.isVisible() and room.outcome.words.text() == summary
    assert room.outcome.toolTip().startswith("broken.c3d is not a sound C3D") and room.outcome.open.isHidden()
    room.outcome.why.click()
    assert "broken.c3d" in room.outcome.box.informativeText()
    room.outcome.box.close()
    room.outcome.close_button.click()
    assert not room.outcome.isVisible()


def test_what_the_reader_says_is_in_the_messages(room, recording, tmp_path, monkeypatch):
    made = write_take(tmp_path, "short", 20)
    monkeypatch.setattr(
        work,
        "import_recording",
        lambda *_: (
            made,
            {
                "frames": 20,
                "labels_given": False,
                "warnings": ["Its header promises 30 frames."],
                "doubts": ["No hand was found."],
            },
        ),
    )
    room.importing.import_files([recording], (load_profile("han19"),))
    shown(room, "short")
    assert room.told() == ["subject 1.c3d: Its header promises 30 frames.", "subject 1.c3d: No hand was found."]
    assert room.outcome.isVisible() and room.outcome.toolTip().endswith("promises 30 frames. No hand was found.")
    assert "its points were named anew" in told(room, Severity.INFO)[0]


def test_importing_can_be_cancelled(room, recording, tmp_path):
    room.importing.import_files([recording] * 3, (load_profile("han19"),))
    room.wait(lambda: room.jobs.job is not None, "the job")
    room.jobs.cancel()
    room.wait(lambda: room.jobs.job is None, "the end")
    assert room.document is None and room.told() == []
    assert told(room, Severity.INFO) == ["Import cancelled; 0 of 3 were imported."]
    assert room.outcome.words.text() == "Import cancelled; 0 of 3 were imported."
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
    assert window.pages.currentIndex() == 1  # where the first dialog was left


def body(path, n=30):
    """A C3D of a body: points as far apart as no hand's are."""
    points = np.random.default_rng(1).uniform(0.0, 1.6, (1, 40, 3)) + np.linspace(0.0, 0.1, n)[:, None, None]
    return trc(path, [f"B{i}" for i in range(40)], points)


def test_what_is_no_hand_is_no_plain_success(room, tmp_path):
    room.importing.import_files([body(tmp_path / "body.trc")], (load_profile("han19"),))
    shown(room, "body")
    said = " ".join(room.told())
    assert "body.trc: None of its 40 names is a marker of han19" in said
    assert "body.trc: No hand was found" in said or "% of the markers were seen on average" in said
    assert room.outcome.isVisible() and "There is something to look at in body.trc" in room.outcome.words.text()


def test_hands_are_counted_frame_by_frame(recording):
    """Against the same figures from all frames at once; the left hand is lost for half a second."""
    read, cast = read_recording(recording), (load_profile("han19"),)
    frames = [
        replace(frame, points_m=frame.points_m[frame.ids >= 19], ids=frame.ids[frame.ids >= 19]) if i < 30 else frame
        for i, frame in enumerate(read.frames())
    ]
    solved = solve(frames, cast, labels=cast_labels(read, cast))
    tally = HandTally(cast)
    for frame in solved:
        tally.add(frame)
    hands = tally.hands(read.times_s, 100)
    assert list(hands) == ["left", "right"] and (tally.frames, tally.tracked) == (60, 60)
    every = []
    for side, figure in hands.items():
        own = [(i, hand) for i, frame in enumerate(solved) for hand in frame.hands if hand.side == side]
        own = [(i, hand) for i, hand in own if hand.state is HandState.TRACKED]
        assert len(own) == (30 if side == "left" else 60)
        seen = np.array([hand.observed.sum() for _, hand in own])
        square_m2 = seen * np.array([hand.rms_m for _, hand in own]) ** 2
        every.append((seen.sum(), square_m2.sum()))
        assert figure.tracked == len(own) / 100 and figure.first_s == read.times_s[own[0][0]]
        assert figure.rms_m == pytest.approx(np.sqrt(square_m2.sum() / seen.sum()))
        assert figure.hidden == pytest.approx(1.0 - seen.sum() / (19 * len(own)))
    assert tally.rms_m == pytest.approx(np.sqrt(sum(m2 for _, m2 in every) / sum(n for n, _ in every)))


def test_two_performers_and_one_profile_are_refused_in_words_of_the_window(room, tmp_path):
    names = [f"{who}:R_{name}" for who in ("Ada", "Ben") for name in load_profile("han19").layout.marker_names]
    points = np.random.default_rng(2).uniform(0.0, 0.2, (5, len(names), 3))
    room.importing.import_files([trc(tmp_path / "two.trc", names, points)], (load_profile("han19"),))
    room.wait(lambda: room.outcome.isVisible(), "the end")
    (line,) = room.told()
    assert "two.trc names markers of 2 performers (Ada, Ben)" in line and "--profile" not in line
    assert "a profile for each performer" in line and not list(tmp_path.glob("*.mcap"))
    assert room.outcome.words.text() == "two.trc was not imported."


def made_of(monkeypatch, folder, hold):
    """Imports give a take by the name of their file, each once `hold` is set."""

    def give(path, *_):
        assert hold.wait(60)
        target = write_take(folder, path.stem, 10)
        return target, {"frames": 10, "labels_given": True, "warnings": [], "doubts": []}

    monkeypatch.setattr(work, "import_recording", give)


def test_what_is_chosen_during_an_import_follows(room, tmp_path, monkeypatch):
    hold = threading.Event()
    made_of(monkeypatch, tmp_path, hold)
    cast = (load_profile("han19"),)
    room.importing.import_files([tmp_path / "a.c3d", tmp_path / "b.c3d"], cast)
    assert room.importing.words == "Importing 1 of 2: 0 %"
    room.importing.import_files([tmp_path / "c.c3d"], cast)
    assert room.importing.words == "Importing 1 of 3: 0 %"
    hold.set()
    room.wait(lambda: room.importing.batch is None, "the end")
    shown(room, "c")
    assert sorted(path.name for path in tmp_path.glob("*.mcap")) == ["a.mcap", "b.mcap", "c.mcap"]
    room.wait(lambda: sorted(take.path.stem for take in room.browser.table.rows) == ["a", "b", "c"], "the list")
    assert told(room, Severity.INFO)[0] == "One more recording is imported after those before."
    assert told(room, Severity.INFO)[-1] == "3 imported." and room.told() == []


def test_an_import_waits_for_another_job(room, tmp_path, monkeypatch):
    hold = threading.Event()
    hold.set()
    made_of(monkeypatch, tmp_path, hold)
    busy = threading.Event()
    room._run("Recovering", lambda report: busy.wait(60), lambda _: None)
    room.importing.import_files([tmp_path / "a.c3d"], (load_profile("han19"),))
    assert told(room, Severity.INFO) == ["One more recording is imported after recovering."]
    busy.set()
    shown(room, "a")


def test_a_take_that_somebody_works_on_stays_open(room, tmp_path, monkeypatch):
    hold = threading.Event()
    made_of(monkeypatch, tmp_path, hold)
    opened(room, write_take(tmp_path, "mine", 30))
    room.importing.import_files([tmp_path / "a.c3d"], (load_profile("han19"),))
    room.player.seek_frame(7)
    hold.set()
    room.wait(lambda: room.outcome.isVisible(), "the end")
    assert room.document.path.stem == "mine" and room.player.frame == 7
    assert room.outcome.words.text() == "a.mcap is ready."
    room.wait(lambda: any(take.path.stem == "a" for take in room.browser.table.rows), "the list")
    room.outcome.open.click()
    shown(room, "a")
    assert not room.outcome.isVisible()
    room.importing.import_files([tmp_path / "b.c3d"], (load_profile("han19"),))
    shown(room, "b")  # nothing was touched since
    assert not room.outcome.isVisible()


def test_words_of_a_take_are_written_while_others_are_imported(room, tmp_path, monkeypatch):
    hold = threading.Event()
    made_of(monkeypatch, tmp_path, hold)
    opened(room, write_take(tmp_path, "mine", 30))
    room.importing.import_files([tmp_path / "a.c3d"], (load_profile("han19"),))
    path = room.document.path
    room.words.rate("A")
    room.wait(lambda: room.words.in_progress is None and not room.words.unsaved(path), "the rating in the file")
    with open_take(path) as take:
        assert take.info.rating == "A"
    assert room.importing.batch is not None
    hold.set()
    room.wait(lambda: room.importing.batch is None, "the end")


def test_files_of_a_batch_are_named_in_the_job(room, tmp_path, monkeypatch):
    texts = []

    def give(path, folder, cast, live_labels, report):
        report(0.5, "Labelling forward, frame 250 of 6,000")
        target = write_take(folder, path.stem, 10)
        return target, {"frames": 10, "labels_given": True, "warnings": [], "doubts": []}

    monkeypatch.setattr(work, "import_recording", give)
    room.importing.import_files([tmp_path / "a.trc", tmp_path / "b.trc"], (load_profile("han19"),))
    room.jobs.job.progressed.connect(lambda share, text: texts.append((share, text)))
    shown(room, "b")
    assert texts == [
        (0.0, "1 of 2: a.trc: reading"),
        (0.25, "1 of 2: a.trc: labelling forward, frame 250 of 6,000"),
        (0.5, "2 of 2: b.trc: reading"),
        (0.75, "2 of 2: b.trc: labelling forward, frame 250 of 6,000"),
    ]


def test_the_words_of_a_job_have_their_room(qtbot):
    over = QWidget()
    qtbot.addWidget(over)
    over.resize(645, 400)
    over.show()
    bar, done = JobBar(over), threading.Event()
    bar.run(Job("Importing", lambda report: done.wait(60), bar))
    bar._appear()
    bar._progressed(0.3, "hand.trc: labelling forward, frame 250 of 6,000")
    qtbot.wait(1)
    try:
        assert not bar._text.elided
    finally:
        done.set()
        bar.end(wait=True)


def test_drafts_of_a_process_that_was_ended_go(tmp_path):
    left = tmp_path / ".import-left"
    left.mkdir()
    (left / "lock").write_bytes(b"")
    (left / "hand.mcap").write_bytes(b"half")
    old = tmp_path / ".import-old"
    old.mkdir()
    os.utime(old, (0, 0))
    with draft_folder(tmp_path) as mine:
        clear_drafts(tmp_path)
        assert mine.is_dir() and [path.name for path in tmp_path.iterdir()] == [mine.name]
        other = "from pathlib import Path; from core.takes.drafts import clear_drafts; clear_drafts(Path({!r}))"
        subprocess.run([sys.executable, "-c", other.format(str(tmp_path))], check=True, cwd=ROOT)
        assert mine.is_dir()
    assert list(tmp_path.iterdir()) == []


def test_closing_during_an_import_asks(desk, tmp_path, monkeypatch):
    window, hold, asked = desk.window, threading.Event(), []
    (tmp_path / "takes").mkdir()
    made_of(monkeypatch, tmp_path / "takes", hold)
    window.show_review(True)
    window.importing.import_files([tmp_path / "a.c3d", tmp_path / "b.c3d"], (load_profile("han19"),))
    desk.until(lambda: window.strip.work.text() == "Importing 1 of 2: 0 %", "the strip")

    def answer(box):
        asked.append((box.text(), box.informativeText()))
        box.buttons()[[button.text() for button in box.buttons()].index("Go on")].click()

    monkeypatch.setattr(QMessageBox, "exec", answer)
    window.close()
    assert window.isVisible() and asked == [
        ("An import is running: 0 of 2 are done.", "Cancel it and quit? The takes that are made stay.")
    ]
    window.show_review(False)
    assert window.strip.work.isVisible()
    window.importing.cancel()
    hold.set()
    desk.until(lambda: window.importing.batch is None, "the end")
    desk.until(lambda: not window.strip.work.isVisible(), "the strip")
    window.close()
    assert len(asked) == 1 and not window.isVisible()


def test_ctrl_c_during_an_import_says_what_becomes_of_it(desk, tmp_path, monkeypatch, capsys):
    window, hold, asked = desk.window, threading.Event(), []
    (tmp_path / "takes").mkdir()
    made_of(monkeypatch, tmp_path / "takes", hold)
    window.show_review(True)
    window.importing.import_files([tmp_path / "a.c3d", tmp_path / "b.c3d"], (load_profile("han19"),))
    desk.until(lambda: window.strip.work.text() == "Importing 1 of 2: 0 %", "the strip")

    def look() -> None:
        box = QApplication.activeModalWidget()
        if isinstance(box, QMessageBox) and "Without an answer" in box.informativeText():
            asked.append(box.informativeText())
            box.escapeButton().click()

    looking = QTimer()
    looking.timeout.connect(look)
    looking.start(100)
    with WindowEnding(window):
        os.kill(os.getpid(), signal.SIGINT)
        desk.until(lambda: asked, "the question")
        desk.until(lambda: not window.closing.asking)
        assert window.isVisible() and window.importing.batch is not None
        hold.set()
        desk.until(lambda: window.importing.batch is None, "the end")
    looking.stop()
    assert re.search(r"Without an answer the import is cancelled and Phalanx closes in \d+ s\.", asked[0])
    said = capsys.readouterr().err
    assert "The window asks. Without an answer in 10 s the import is cancelled and Phalanx closes." in said
    assert "Ctrl+C again ends at once" in said


def test_the_room_stays_until_something_is_chosen_and_the_folder_is_remembered(desk, recording, qtbot, monkeypatch):
    window, starts = desk.window, []
    monkeypatch.setattr(QFileDialog, "getOpenFileNames", lambda *args: (starts.append(args[2]), ([], ""))[1])
    window.import_recording()
    assert window.pages.currentIndex() == 0 and starts == [str(window.plan.folder.parent)]  # no take has been there yet
    window.plan.folder.mkdir()
    window.import_recording()
    assert starts.pop() == str(window.plan.folder)
    monkeypatch.setattr(QFileDialog, "getOpenFileNames", lambda *args: ([str(recording)], ""))
    window.import_recording()
    assert window.pages.currentIndex() == 1
    dialog = window.importing.dialog
    monkeypatch.setattr(window.importing, "import_files", lambda *args: None)
    dialog.start.click()
    monkeypatch.setattr(QFileDialog, "getOpenFileNames", lambda *args: (starts.append(args[2]), ([], ""))[1])
    window.import_recording()
    assert starts[1:] == [str(recording.parent)]
    window.settings.set(names.IMPORT_FOLDER, str(recording.parent / "gone"))
    window.import_recording()
    assert starts[2:] == [str(window.plan.folder)]


def test_performers_have_room_and_import_is_on_the_right(qtbot, tmp_path):
    parent = QWidget()
    qtbot.addWidget(parent)
    dialog = ImportDialog([tmp_path / "a.c3d"], (profile(),), tmp_path, parent)
    dialog.show()
    qtbot.waitExposed(dialog)
    for n in (2, 3):
        dialog.add.click()
        layout = dialog.layout()
        layout.activate()
        assert dialog.height() >= layout.totalHeightForWidth(dialog.width())
        cells = [[dialog.rows.itemAtPosition(i, j).widget() for j in range(3)] for i in range(n)]
        for number, box, remove in cells:
            assert abs(number.geometry().center().y() - box.geometry().center().y()) <= 1
            assert box.height() >= box.sizeHint().height() and remove.height() >= remove.sizeHint().height()
        for above, below in pairwise(cells):
            assert all(
                b.geometry().top() - a.geometry().bottom() > 2 for a, b in zip(above[1:], below[1:], strict=True)
            )
    cancel = next(button for button in dialog.findChildren(QPushButton) if button.text() == "Cancel")
    assert cancel.x() < dialog.start.x() and dialog.start.isDefault()
