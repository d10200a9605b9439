"""Nothing moves under the operator's mouse when a card, a bar, a mark or a longer text appears."""

from __future__ import annotations

import time
from dataclasses import replace

import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtWidgets import QAbstractButton, QAbstractItemView, QComboBox, QLabel, QLineEdit, QPlainTextEdit, QWidget

from app.review.job import Job
from app.viewport.viewport import Viewport
from core.frames import Times
from core.profile import load_profile
from core.takes.take import TakeCounts, TakeInfo
from core.takes.writer import TakeWriter
from devices.device import Health, Level
from tests.app.hand_frames import hand_frame, sample
from tests.app.stage import server
from tests.app.takes import write_take
from tests.app.test_texts import type_into
from tests.app.test_window import Desk

TOUCHED = (QAbstractButton, QAbstractItemView, QComboBox, QLineEdit, QPlainTextEdit)


def places(window: QWidget) -> dict[QWidget, tuple[int, ...]]:
    """Where everything is that is seen: what is clicked with both coordinates, words with their height alone."""
    found: dict[QWidget, tuple[int, ...]] = {}
    for widget in window.findChildren(QWidget):
        at = widget.mapTo(window, QPoint(0, 0))
        if not widget.isVisible() or isinstance(widget.parent(), Viewport) or at.x() < 0:  # there is what a tab hides
            continue
        if isinstance(widget, TOUCHED):
            found[widget] = (at.x(), at.y(), widget.width(), widget.height())
        elif isinstance(widget, QLabel) and widget.text():
            found[widget] = (at.y(),)
    return found


def moved(before: dict, after: dict) -> list[str]:
    """What is seen both times, elsewhere."""
    return [
        f"{type(widget).__name__} {getattr(widget, 'text', str)()!r}: {place} to {after[widget]}"
        for widget, place in before.items()
        if widget in after and after[widget] != place
    ]


@pytest.fixture
def desk(qtbot, tmp_path):
    made = Desk(qtbot, tmp_path / "takes")
    made.window.setWindowState(Qt.WindowState.WindowNoState)
    made.window.resize(1366, 768)
    made.window.raise_()
    made.window.activateWindow()
    made.until(made.window.isActiveWindow, "the window to be active")
    yield made
    made.close()


def test_the_live_room_stands_still_from_the_first_frame_to_the_saved_take(desk):
    window, qtbot = desk.window, desk.qtbot
    with server() as simulator:
        stream = desk.add(simulator)
        desk.card.show_settings(False)
        desk.until(lambda: desk.session.ready, "the solver")
        qtbot.wait(300)
        before = places(window)
        desk.click(desk.card.toggle)
        hands = window.tracking.hands
        desk.until(lambda: all(card.light.level is Level.GOOD for card in hands.values()), "both hands")
        desk.until(lambda: any("Least sure" in card.unsure.text() for card in hands.values()), "figures")
        qtbot.wait(300)
        assert moved(before, places(window)) == [], "hands are found"

        desk.until(lambda: window.record_action.isEnabled())
        window.record_action.trigger()
        desk.until(lambda: (r := desk.session.numbers().recording) and r.received >= 30)
        for _ in range(3):
            qtbot.keyClick(window, Qt.Key.Key_M)
        qtbot.wait(300)
        assert window.recorder.marks.count() == 3
        assert moved(before, places(window)) == [], "marks are set"
        window.record_action.trigger()
        desk.until(lambda: desk.finished)
        qtbot.wait(500)
        assert "Received" in window.recorder.last.counts.text()
        assert moved(before, places(window)) == [], "the take is saved"
        assert stream.health().received > 0
    desk.until(lambda: desk.card.light.level is Level.PROBLEM, "the server to be missed")
    qtbot.wait(300)
    gone = places(window)
    assert moved({w: p for w, p in before.items() if not window.devices.isAncestorOf(w)}, gone) == [], "frames end"


def test_a_reason_of_two_lines_moves_nothing(desk, monkeypatch):
    with server() as simulator:
        stream = desk.add(simulator)
    card = desk.card
    card.show_settings(False)
    seen = set()
    for words in ("Off.", "Receiving from the server of Stage 3.1.", "No answer from the server: is it streaming now?"):
        monkeypatch.setattr(stream, "health", lambda words=words: Health(reason=words))
        desk.until(lambda words=words: card.reason.text() == words, "the panel's next look")
        desk.qtbot.wait(120)
        seen.add((card.more.pos().toTuple(), card.drop.pos().toTuple(), card.height()))
    assert len(seen) == 1


def test_a_wrong_template_is_told_where_the_name_was(desk):
    recorder = desk.window.recorder
    desk.qtbot.wait(200)
    before = places(desk.window)
    type_into(desk, recorder.template, "{performer}")
    desk.qtbot.wait(200)
    assert recorder.name_problem.isVisible() and "take number" in recorder.name_problem.text()
    assert recorder.name_problem.height() >= recorder.name_problem.heightForWidth(recorder.name_problem.width())
    assert moved(before, places(desk.window)) == []


def busy(report):
    """Until it is cancelled."""
    share = 0.0
    while report(min(share, 1.0), f"Frame {share:.2f}"):
        share += 0.01
        time.sleep(0.02)


def test_the_review_room_stands_still_under_jobs_and_marks(desk, tmp_path):
    folder = desk.window.plan.folder
    folder.mkdir(parents=True)
    take = write_take(folder, "first", 101)
    desk.window.review_take(take)
    room = desk.window._review
    desk.until(lambda: room.document is not None and room.document.analysis is not None, "the take")
    desk.qtbot.wait(300)
    before = places(desk.window)
    for bar in (room.jobs, room.opening):
        bar.run(Job("Busy", busy, room))
    desk.until(lambda: room.jobs.isVisible() and room.opening.isVisible(), "the bars")
    desk.qtbot.wait(200)
    assert moved(before, places(desk.window)) == [], "jobs run"
    assert not room.jobs.geometry().intersects(room.opening.geometry())
    assert room.viewport.rect().contains(room.jobs.geometry())
    room.opening.cancel()
    desk.click(room.jobs._cancel)
    desk.until(lambda: not room.jobs.isVisible() and not room.opening.isVisible(), "both to end")
    for _ in range(len(room.document.marks)):
        room.words.remove_mark(0)
    desk.qtbot.wait(200)
    assert room.inspector.marks.count() == 0
    assert moved(before, places(desk.window)) == [], "no marks"
    room.words.add_mark(0.3)
    desk.qtbot.wait(200)
    assert moved(before, places(desk.window)) == [], "a mark"
    desk.until(lambda: room.words.in_progress is None)


def write_duet(folder):
    """A take of two performers, four hands."""
    path, cast = folder / "duet.mcap", (load_profile("han19"), load_profile("han19"))
    writer = TakeWriter(path, TakeInfo("duet", "Ann and Ben", rate_hz=100.0), cast)
    hands = [replace(hand_frame(side), performer=number) for number in range(2) for side in ("left", "right")]
    for i in range(30):
        frame, tracked = sample(*hands, sequence=i)
        times = Times(i / 100, i / 100, i / 100)
        writer.raw("", replace(frame, times=times))
        writer.solved(replace(tracked, times=times))
    writer.seal(TakeCounts(30, 30, solved=30))
    return path


def test_the_timeline_has_its_height_before_the_take_is_read(desk, monkeypatch):
    folder = desk.window.plan.folder
    folder.mkdir(parents=True)
    desk.window.show_review(True)
    room = desk.window._review
    monkeypatch.setattr(room.reading, "start", lambda document: None)
    room.open_take(write_duet(folder))
    desk.until(lambda: room.document is not None)
    desk.qtbot.wait(100)
    early = room.timeline.height()
    monkeypatch.undo()
    room.reading.start(room.document)
    desk.until(lambda: room.document.analysis is not None)
    desk.qtbot.wait(100)
    assert len(room.document.analysis.hands) == 4 and room.timeline.height() == early


def test_before_a_take_is_open_the_inspector_says_what_to_do(desk):
    desk.window.show_review(True)
    room = desk.window._review
    desk.qtbot.wait(200)
    inspector = room.inspector
    assert inspector.empty.isVisible() and "No take is open" in inspector.empty.text()
    assert not inspector.notes.isVisible() and not inspector.remove.isVisible()
    for widget in inspector.findChildren(QWidget):
        if widget.isVisible() and isinstance(widget, QLabel | QAbstractButton) and widget.text():
            right = widget.mapTo(inspector.viewport(), QPoint(widget.width(), 0)).x()
            assert right <= inspector.viewport().width(), widget.text()
