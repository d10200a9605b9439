"""The window when the disk of a take hangs or its file is taken away: it says so, and it can be closed."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest
from PySide6.QtCore import Qt, QTimer
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QProgressDialog, QPushButton

from app import recording
from app.finishing import GIVE_UP
from app.notifications import Severity
from core.takes.reader import open_take
from core.takes.take_names import TakeNames
from devices.device import Level
from tests.app.stage import own_threads, server
from tests.app.test_window import Desk
from tests.data import ROOT
from tests.hanging_disk import HangingDisk

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Windows itself keeps an open file where it is")


@pytest.fixture
def stage():
    with server() as simulator:
        yield simulator


@pytest.fixture
def disk():
    made = HangingDisk(lambda: False)
    yield made
    made.restore()


@pytest.fixture
def desk(qtbot, tmp_path, disk, monkeypatch):
    monkeypatch.setattr(recording, "rescued_folder", lambda: tmp_path / "data")
    made = Desk(qtbot, tmp_path / "takes")
    yield made
    disk.answer()
    made.until(lambda: made.window.isVisible() or not own_threads(), "the writer of a take that was given up")
    made.close()


def recorded(desk, stage, frames: int = 30) -> None:
    desk.connected(stage)
    desk.click(desk.window.deck.record)
    desk.until(lambda: (r := desk.session.numbers().recording) and r.written >= frames, "frames")


def shot(window, name: str) -> None:
    folder = os.environ.get("PHALANX_SHOTS")
    if folder:
        window.grab().save(str(Path(folder) / f"{name}.png"))


def test_a_file_that_is_taken_away_is_seen_at_the_button_the_deck_and_the_strip(desk, stage):
    recorded(desk, stage)
    path = desk.session.numbers().recording.path
    path.unlink()
    panel, deck, strip = desk.window.recorder, desk.window.deck, desk.window.strip
    desk.until(lambda: "rescued as" in panel.trouble.text(), "the words")
    assert panel.trouble.isVisible() and not panel.name.isVisible()
    assert "was deleted" in deck.frames.text() and deck.frames.property("level") == "warning"
    assert strip.disk.light.level is Level.WARNING
    desk.until(lambda: (r := desk.session.numbers().recording) and r.seconds_left < float("inf"))
    shot(desk.window, "rescued")
    desk.click(desk.window.recorder.record)
    desk.until(lambda: desk.finished, "the take")
    summary = desk.finished[0]
    assert (
        summary.sealed
        and summary.received == summary.written
        and summary.path == path.with_name(f"{path.stem}_rescued.mcap")
    )
    desk.until(lambda: panel.last.light.level in (Level.WARNING, Level.PROBLEM))  # red if this machine was held up
    assert str(summary.path) in panel.last.reason.text() and panel.name.isVisible()
    shot(desk.window, "rescued-ended")
    problems = [note.text for note in desk.session.notifications.history if note.severity is Severity.PROBLEM]
    assert len([text for text in problems if "was deleted" in text]) == 1
    desk.until(lambda: desk.window.deck.take.text() not in ("", path.stem), "another number for the next take")


def test_a_file_that_is_cut_short_stays_red_and_the_hints_fit(desk, stage):
    recorded(desk, stage)
    os.truncate(desk.session.numbers().recording.path, 4096)
    panel, deck, strip = desk.window.recorder, desk.window.deck, desk.window.strip
    desk.until(lambda: "frames may be lost" in panel.trouble.text(), "the words")
    assert deck.frames.property("level") == "problem" and strip.disk.light.level is Level.PROBLEM
    shot(desk.window, "cut")
    desk.click(desk.window.recorder.record)
    desk.until(lambda: desk.finished, "the take")
    desk.until(lambda: panel.last.light.level is Level.PROBLEM, "the card")
    told = panel.last.reason.text()
    assert "frames lost from the file" in told and "once there is room" not in told and "Check in Devices" not in told
    shot(desk.window, "cut-ended")


def test_a_folder_that_is_renamed_in_mid_take_is_not_made_anew_and_no_number_is_given_twice(desk, stage, tmp_path):
    recorded(desk, stage)  # the first take of a folder that was not there before
    plan, panel = desk.window.plan, desk.window.recorder
    folder, away, name = plan.folder, tmp_path / "away", desk.session.recording_name
    folder.rename(away)
    desk.until(lambda: "moved" in panel.trouble.text(), "the words")
    desk.click(panel.record)
    desk.until(lambda: desk.finished, "the take")
    assert desk.finished[0].sealed and desk.finished[0].path == away / f"{name}.mcap"
    before = len(desk.session.notifications.history)
    desk.click(desk.window.deck.record)
    assert "is not there, and it held takes. Choose it where it is now" in desk.window.deck.refusal.text()
    panel.show_folder()
    assert not desk.session.recording and not folder.exists()
    assert any("is not there" in note.text for note in desk.session.notifications.history[before:])
    plan.set_folder(folder)  # meant so
    assert plan.next()[0] != name
    plan.set_folder(away)
    second = plan.next()[0]
    assert second != name
    desk.click(desk.window.deck.record)
    desk.until(lambda: desk.session.recording_name == second, "the next take")


def test_a_disk_that_hangs_is_seen_and_the_take_can_be_given_up(desk, stage, disk):
    recorded(desk, stage)
    disk.hangs = lambda: True
    panel, deck, strip = desk.window.recorder, desk.window.deck, desk.window.strip
    desk.until(lambda: "has not answered" in panel.trouble.text(), "the words")
    assert panel.trouble.isVisible() and deck.frames.property("level") == "problem"
    assert strip.disk.light.level is Level.PROBLEM and "hangs" in strip.disk.value.text()
    desk.until(lambda: any("has not answered" in note.text for note in desk.session.notifications.history))
    shot(desk.window, "hangs")
    desk.click(desk.window.recorder.record)
    desk.until(lambda: panel.last.give_up.isVisible(), "the way out")
    assert "frames are on the disk" in panel.last.counts.text() and not desk.finished
    shot(desk.window, "hangs-stopped")
    desk.click(panel.last.give_up)
    desk.until(lambda: desk.finished, "the summary")
    summary = desk.finished[0]
    assert not summary.sealed and summary.received == summary.written + sum(summary.dropped.values())
    desk.until(lambda: not panel.last.give_up.isVisible())
    shot(desk.window, "given-up")
    with open_take(summary.path) as take:
        assert len(take.raw) == summary.written
    disk.answer()
    desk.until(lambda: any("after all" in note.text for note in desk.session.notifications.history), "the end of it")
    with open_take(summary.path) as take:
        assert take.sealed and take.complete and len(take.raw) == summary.received


@pytest.mark.parametrize("escape_first", [False, True])
def test_a_window_closes_without_a_disk_that_hangs(desk, stage, disk, escape_first):
    """Also where Escape comes before the answer: it must not leave a window that does nothing any more."""
    recorded(desk, stage)
    disk.hangs = lambda: True
    offered: list[str] = []
    escapes = [Qt.Key.Key_Escape] if escape_first else []

    def press() -> None:
        for dialog in QApplication.topLevelWidgets():
            if isinstance(dialog, QProgressDialog) and dialog.isVisible():
                buttons = [b for b in dialog.findChildren(QPushButton) if b.text() == GIVE_UP and b.isVisible()]
                if buttons:
                    shot(dialog, "closing")
                    offered.append(dialog.labelText())
                    if escapes:
                        QTest.keyClick(dialog, escapes.pop())
                    else:
                        buttons[0].click()

    timer = QTimer()
    timer.timeout.connect(press)
    timer.start(100)
    desk.window.stop_and_close()
    timer.stop()
    assert offered and "has not answered" in offered[0] and "frames are on the disk" in offered[0]


def waits_to_begin(desk, stage, disk) -> None:
    desk.connected(stage)
    disk.hangs = lambda: True
    desk.click(desk.window.deck.record)
    desk.until(lambda: "has not answered" in desk.window.recorder.trouble.text(), "the words")


def test_a_take_that_waits_for_its_disk_is_seen_where_record_was_pressed(desk, stage, disk):
    waits_to_begin(desk, stage, disk)
    panel, deck, strip = desk.window.recorder, desk.window.deck, desk.window.strip
    assert panel.trouble.isVisible() and "no take has begun" in panel.trouble.text()
    for button in (deck.record, panel.record):
        assert button.text() == "Waiting…" and not button.isEnabled()
    assert deck.caption.text() == "Waiting for the disk…" and deck.caption.property("level") == "problem"
    assert "No take has begun" in deck.frames.text() and deck.frames.property("level") == "problem"
    assert "hangs" in strip.disk.value.text()
    desk.until(lambda: "has not begun" in strip.message.text(), "the message")
    shot(desk.window, "waits-to-begin")
    desk.click(deck.record)
    assert "Waiting for the disk" in deck.refusal.text()
    disk.answer()
    desk.until(lambda: desk.session.recording and deck.record.text() == "Stop", "the take")
    desk.until(lambda: not panel.trouble.text() and deck.caption.text() == "Recording", "the words to go")
    assert not deck.refusal.text() and panel.record.text() == "Stop"
    assert "answers again" in strip.message.text()
    desk.click(deck.record)
    desk.until(lambda: desk.finished and deck.record.text() == "Record", "the end")


@pytest.mark.parametrize("answers", [True, False])
def test_a_take_that_begins_only_while_the_window_closes_leaves_nothing(desk, stage, disk, answers):
    waits_to_begin(desk, stage, disk)
    offered: list[str] = []

    def press() -> None:
        for dialog in QApplication.topLevelWidgets():
            if isinstance(dialog, QProgressDialog) and dialog.isVisible():
                buttons = [b for b in dialog.findChildren(QPushButton) if b.text() == GIVE_UP and b.isVisible()]
                if buttons and not offered:
                    shot(dialog, "closing-before-it-began")
                    offered.append(dialog.labelText())
                    disk.answer() if answers else buttons[0].click()

    timer = QTimer()
    timer.timeout.connect(press)
    timer.start(100)
    desk.window.close()
    timer.stop()
    assert offered and str(desk.window.plan.folder) in offered[0] and "No take has begun" in offered[0]
    assert not desk.window.isVisible() and not desk.session.recording
    disk.answer()
    desk.until(lambda: not list(desk.window.plan.folder.iterdir()), "the file that was begun to go")
    assert not desk.finished


def test_a_folder_that_does_not_answer_does_not_hold_up_the_window(desk, monkeypatch):
    hung: list[bool] = [True]

    def next_path(names, folder, when, used):
        while hung:
            time.sleep(0.05)
        return folder / "a.mcap"

    monkeypatch.setattr(TakeNames, "next_path", next_path)
    begun = time.monotonic()
    for _ in range(10):  # as typing does
        assert "does not answer" in desk.window.plan.preview()[1]
    assert time.monotonic() - begun < 5.0
    desk.window.plan.changed.emit()
    panel, deck = desk.window.recorder, desk.window.deck
    assert deck.take.text() == panel.name.text() == "Disk does not answer"
    assert panel.folder.property("wrong") and not panel.template.property("wrong")
    hung.clear()
    desk.until(lambda: desk.window.plan.preview()[:2] == ("a", ""), "an answer")


CLOSING = """
import sys, threading
from tests.hanging_disk import HangingDisk
from tests.core.takes.frames import plain_frame
from app.recording import Recorder
from core.profile import load_profile
from core.takes.take import TakeInfo
from pathlib import Path
import time

hung = []
disk = HangingDisk(lambda: bool(hung))
recorder = Recorder(Path(sys.argv[1]), TakeInfo("a", rate_hz=120.0), (load_profile("han19"),))
for i in range(50):
    recorder.raw("", plain_frame(i))
    recorder.unsolved("no solver")
while recorder.numbers().written < 50:
    time.sleep(0.01)
if sys.argv[2] == "hang":
    hung.append(True)
    recorder.raw("", plain_frame(50))
    recorder.unsolved("no solver")
    recorder.stop()
    recorder.give_up()
"""


@pytest.mark.parametrize("how", ["hang", "whole"])
def test_a_process_ends_without_a_disk_that_hangs_and_not_before_a_take_is_sealed(tmp_path: Path, how: str) -> None:
    path = tmp_path / "a.mcap"
    done = subprocess.run(
        [sys.executable, "-c", CLOSING, str(path), how],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    with open_take(path) as take:
        assert len(take.raw) == 50 and take.sealed == (how == "whole")
