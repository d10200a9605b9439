"""The review room as an operator uses it: real takes, real files, a real window."""

from __future__ import annotations

import multiprocessing
import os
import signal
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import pytest
from PySide6.QtCore import Qt

from app.notifications import Severity
from app.review.analysis import Cell
from app.review.export_dialog import ExportDialog
from app.review.review import Review
from app.session import Session
from app.settings import Settings
from app.take_plan import TakePlan
from app.worker import SessionWorker
from core.hand.shape import HandShape
from core.hand.skeleton import DIGIT_DOF_NAMES
from core.takes.formats import read_recording
from core.takes.reader import open_take
from core.takes.verify import verify
from tests.app.drawn import need_opengl, pixels, silhouette, surface_m
from tests.app.hand_frames import profile
from tests.app.stage import own_threads, until
from tests.app.takes import write_take


@pytest.fixture
def folder(tmp_path):
    write_take(tmp_path, "first", 101, lost=range(20, 40))
    write_take(tmp_path, "second", 30, rating="alt", notes="as told")
    write_take(tmp_path, "cut_short", 40, seal=False)
    return tmp_path


@pytest.fixture
def room(folder, qtbot):
    with a_room(folder, qtbot) as made:
        yield made
    assert own_threads() == []
    assert not multiprocessing.active_children()


@contextmanager
def a_room(folder, qtbot):
    settings = Settings(None)
    plan = TakePlan(settings)
    plan.set_folder(folder)
    worker = SessionWorker(Session(profile()))
    room = Review(worker, plan, settings)
    room.told = lambda: [n.line for n in worker.notifications.history if n.severity is not Severity.INFO]
    room.wait = lambda condition, what="": until(condition, what, lambda s: qtbot.wait(max(1, int(s * 1000))))
    qtbot.addWidget(room)
    room.resize(1300, 800)
    with qtbot.waitExposed(room):
        room.show()
    room.activateWindow()
    room.setFocus()
    try:
        yield room
    finally:
        room.finish()
        worker.close()


def opened(room, path):
    room.open_take(path)
    shown(room, path.stem)
    room.wait(lambda: room.document.analysis is not None, "the analysis")
    return room.document


def shown(room, stem):
    room.wait(lambda: room.document is not None and room.document.path.stem == stem, f"take {stem}")


def test_a_take_is_shown_as_it_was_recorded(room, folder):
    document = opened(room, folder / "first.mcap")
    assert room.player.n_frames == 101
    assert (document.analysis.states[0] == Cell.LOST).nonzero()[0].tolist() == list(range(20, 40))
    room.player.seek_frame(30)
    room.wait(lambda: "Left hand lost" in room.viewport.legend_text, "frame 30 in the view")
    assert "tracked 80.2 %, lost once" in room.inspector.hands.text()
    assert [room.inspector.marks.item(i).text() for i in range(2)] == ["0:00.10  clap", "0:00.20  Mark"]
    assert room.told() == []


def test_a_take_says_where_it_is_a_guess(room, folder):
    write_take(folder, "unsure", 60, lost=range(10, 20), guessed=range(40, 50))
    document = opened(room, folder / "unsure.mcap")
    assert "Left: tracked 83.3 %, lost once, 0.0 % of markers hidden, some joint a guess in 20\u00a0%" in (
        room.inspector.hands.text().splitlines()
    )
    room.player.seek_frame(45)
    room.plots.angle.setCurrentIndex(DIGIT_DOF_NAMES.index("ring_dip_flexion"))
    left = room.inspector.moment.text().splitlines()[document.analysis.sides.index("left")]
    assert left.startswith("Left: ring DIP flexion ") and left.endswith("°), least sure: ring DIP ±30°")
    assert " ±30° (in all frames ±" in left
    (_, angle), (_, low), (_, high) = (
        room.plots.curve(part, "left") for part in ("angle", "lower bound", "upper bound")
    )
    assert high - angle == pytest.approx(angle - low, nan_ok=True)
    assert (high - angle)[[39, 40, 49, 50]] == pytest.approx([2.0, 30.0, 30.0, 2.0], abs=1e-3)
    room.player.seek_frame(15)
    assert "Left: not tracked" in room.inspector.moment.text()
    opened(room, folder / "second.mcap")
    assert "±" not in room.inspector.moment.text() and "guess" not in room.inspector.hands.text()
    assert room.plots.curve("upper bound", "left")[1].size == 0


def test_the_view_shows_the_hands_of_each_take(room, folder):
    """One take after the other: a stout performer's hands are drawn stout, and the next one's as they are."""
    need_opengl()
    ratios = np.ones(23)
    ratios[:3], ratios[3:18], ratios[18:] = 1.25, 0.85, 1.3
    stout = replace(profile(), shape=HandShape(ratios))
    write_take(folder, "stout", 30, worn=stout)
    view = room.viewport
    for stem, worn, other in (("stout", stout, profile()), ("second", profile(), stout)):
        document = opened(room, folder / f"{stem}.mcap")
        room.wait(lambda: "Right hand tracked" in view.legend_text, "hands in the view")
        view.view_fit()
        view.set_surface_shown(False)
        without = pixels(view)
        view.set_surface_shown(True)
        drawn = np.abs(pixels(view) - without).sum(axis=2) > 12
        hands = document.frame(room.player.frame)[1].hands

        def agreement(of, drawn=drawn, hands=hands):
            skin = np.any([silhouette(view, surface_m(hand, of.hand)) for hand in hands], axis=0)
            return (drawn & skin).sum() / (drawn | skin).sum()

        assert agreement(worn) > 0.93  # markers cover some of it
        assert agreement(worn) > agreement(other) + 0.05


def test_it_plays_by_key_and_stops_at_the_end(room, folder, qtbot):
    opened(room, folder / "second.mcap")
    qtbot.keyClick(room, Qt.Key.Key_Space)
    assert room.player.playing
    room.wait(lambda: not room.player.playing, "the end")
    assert room.player.frame == 29


@pytest.mark.parametrize(
    ("key", "modifier", "frame"),
    [
        (Qt.Key.Key_Left, Qt.KeyboardModifier.NoModifier, 49),
        (Qt.Key.Key_Right, Qt.KeyboardModifier.NoModifier, 51),
        (Qt.Key.Key_Left, Qt.KeyboardModifier.ControlModifier, 0),
        (Qt.Key.Key_Right, Qt.KeyboardModifier.ControlModifier, 100),
        (Qt.Key.Key_I, Qt.KeyboardModifier.NoModifier, 10),
        (Qt.Key.Key_O, Qt.KeyboardModifier.NoModifier, 90),
    ],
)
def test_keys_move_the_playhead(room, folder, qtbot, key, modifier, frame):
    opened(room, folder / "first.mcap")
    room.player.set_range(10, 90)
    room.player.seek_frame(50)
    qtbot.keyClick(room, key, modifier)
    assert room.player.frame == frame


def test_keys_set_the_range_the_loop_and_marks(room, folder, qtbot):
    document = opened(room, folder / "first.mcap")
    control, shift = Qt.KeyboardModifier.ControlModifier, Qt.KeyboardModifier.ShiftModifier
    room.player.seek_frame(30)
    qtbot.keyClick(room, Qt.Key.Key_I, control)
    room.player.seek_frame(60)
    qtbot.keyClick(room, Qt.Key.Key_O, control | shift)
    qtbot.keyClick(room, Qt.Key.Key_L, control)
    qtbot.keyClick(room, Qt.Key.Key_M)
    assert (room.player.in_frame, room.player.out_frame, room.player.loop) == (30, 60, True)
    assert [mark.time_s for mark in document.marks] == pytest.approx([0.1, 0.2, 0.6])


def test_typing_notes_is_not_taken_for_keys(room, folder, qtbot):
    document = opened(room, folder / "first.mcap")
    room.inspector.notes.setFocus()
    qtbot.keyClicks(room.inspector.notes, "mio loop")
    assert room.inspector.notes.toPlainText() == "mio loop"
    assert len(document.marks) == 2 and not room.player.playing


def test_words_can_be_undone_and_reach_the_file(room, folder, qtbot):
    path = folder / "first.mcap"
    with open_take(path) as take:
        frames = [take.raw.message(i)[1] for i in range(len(take.raw))]
    opened(room, path)
    room.words.rate("A")
    room.words.write_notes("left thumb slow")
    room.player.seek_frame(50)
    room.words.add_mark(room.player.time_s)
    room.words.name_mark(1, "turn")
    room.words.remove_mark(0)
    room.undo.undo()
    assert [mark.text for mark in room.document.marks] == ["clap", "turn", ""]
    room.wait(lambda: room.words.unsaved(path) is None, "the words in the file")
    with open_take(path) as take:
        assert (take.info.rating, take.info.notes) == ("A", "left thumb slow")
        assert [(mark.text, round(mark.time_s, 3)) for mark in take.marks] == [("clap", 0.1), ("turn", 0.2), ("", 0.5)]
        assert [take.raw.message(i)[1] for i in range(len(take.raw))] == frames
    assert verify(path).ok
    room.player.seek_frame(70)
    room.wait(lambda: room.document.frame(70)[0].sequence == 70, "the take open again")
    while room.undo.canUndo():
        room.undo.undo()
    room.wait(lambda: room.words.unsaved(path) is None, "the old words in the file")
    with open_take(path) as take:
        assert (take.info.rating, take.info.notes, len(take.marks)) == ("", "", 2)


def test_words_are_not_lost_by_another_take_or_the_end(folder, qtbot):
    with a_room(folder, qtbot) as room:
        opened(room, folder / "first.mcap")
        room.inspector.notes.setPlainText("typed and left")
        opened(room, folder / "second.mcap")
        room.words.rate("no good")
    with open_take(folder / "first.mcap") as take:
        assert take.info.notes == "typed and left"
    with open_take(folder / "second.mcap") as take:
        assert (take.info.rating, take.info.notes) == ("no good", "as told")


def test_a_take_is_solved_again_beside_its_recorded_solution(room, folder):
    path = folder / "second.mcap"
    before = path.read_bytes()
    opened(room, path)
    room.solving.solve_with(profile())
    room.wait(lambda: room.document.solved.again is not None and room.document.analysis is not None, "the solution")
    assert len(room.document.solved.again.solved) == 30
    assert room.solutions.choice.count() == 2 and "Solved again: han19" in room.inspector.facts.text()
    raw, solved = room.document.frame(12)
    assert (raw.sequence, solved.sequence) == (12, 12)
    room.solving.save_shown()
    target = folder / "second_solved.mcap"
    room.wait(lambda: target.exists() and room.jobs.job is None, "the new take")
    assert path.read_bytes() == before
    assert verify(target).ok
    with open_take(path) as old, open_take(target) as new:
        assert [f.sequence for f in new.solved] == list(range(30))
        assert [new.raw.message(i)[1] for i in range(30)] == [old.raw.message(i)[1] for i in range(30)]
        assert (new.info.rating, len(new.marks)) == ("alt", 2)
    room.solutions.chosen.emit(room.document.recorded)
    assert room.document.solved is room.document.recorded
    assert room.told() == []


def test_solving_can_be_cancelled_and_one_job_runs_at_a_time(room, folder):
    write_take(folder, "long", 2000)
    opened(room, folder / "long.mcap")
    room.solving.solve_with(profile())
    room.solving.save_shown()
    room.open_take(folder / "first.mcap")
    assert room.document.path.stem == "long"
    assert [line for line in room.told() if "is not done yet" in line]
    room.jobs.cancel()
    room.wait(lambda: room.jobs.job is None, "the end of the job")
    assert room.document.solved is room.document.recorded
    opened(room, folder / "first.mcap")


def test_work_that_breaks_down_is_told_once_and_can_be_done_again(room, folder):
    write_take(folder, "long", 2000)
    opened(room, folder / "long.mcap")
    room.solving.solve_with(profile())
    room.wait(multiprocessing.active_children, "the process")
    os.kill(multiprocessing.active_children()[0].pid, signal.SIGKILL)
    room.wait(lambda: room.jobs.job is None, "the end of the job")
    told = room.told()
    assert len(told) == 1 and "broke down (exit code -9)" in told[0]
    assert room.document.solved is room.document.recorded
    opened(room, folder / "second.mcap")
    room.solving.solve_with(profile())
    room.wait(lambda: room.document.solved is not room.document.recorded, "the solution")


def test_the_end_of_the_room_ends_the_work(folder, qtbot):
    write_take(folder, "long", 2000)
    with a_room(folder, qtbot) as room:
        opened(room, folder / "long.mcap")
        room.solving.solve_with(profile())
        room.wait(multiprocessing.active_children, "the process")
    assert not multiprocessing.active_children()


def test_a_take_cut_short_is_made_whole(room, folder):
    path = folder / "cut_short.mcap"
    opened(room, path)
    assert "not sealed" in room.inspector.problems.text()
    room.recover(path)
    room.wait(lambda: room.document is not None and room.document.path == path and room.jobs.job is None, "the rescue")
    report = verify(path)
    assert report.sealed and report.ok and report.raw == 40


def test_a_damaged_take_is_written_anew_beside_itself(room, folder):
    path = folder / "cut_short.mcap"
    path.write_bytes(path.read_bytes()[:-200])
    before = path.read_bytes()
    room.recover(path)
    room.wait(lambda: room.document is not None and room.jobs.job is None, "the rescue")
    assert room.document.path.name == "cut_short_recovered.mcap"
    assert path.read_bytes() == before


def test_export_of_a_part(room, folder, qtbot):
    opened(room, folder / "first.mcap")
    room.player.set_range(50, 80)
    room.export_take()
    dialog = room._dialog
    assert dialog.part.isChecked()
    for key, box in dialog.formats.items():
        box.setChecked(key in ("trc", "csv"))
    dialog.folder.setText(str(folder / "out"))
    qtbot.mouseClick(dialog.start, Qt.MouseButton.LeftButton)
    room.wait(lambda: not dialog.exporting, "the export")
    assert "read back and equal" in dialog.result.text
    files = sorted((folder / "out").iterdir())
    assert sorted([*dialog.result.files, "first_export.json"]) == [path.name for path in files]
    recording = read_recording(next(path for path in files if path.suffix == ".trc"))
    assert recording.n_frames == 31

    qtbot.mouseClick(dialog.start, Qt.MouseButton.LeftButton)
    room.wait(lambda: not dialog.exporting, "the refusal")
    assert dialog.result.state.property("level") == "problem" and "exist" in dialog.result.state.text()
    dialog.replace.setChecked(True)
    qtbot.mouseClick(dialog.start, Qt.MouseButton.LeftButton)
    room.wait(lambda: not dialog.exporting, "the second export")
    assert "read back and equal" in dialog.result.text
    dialog.reject()
    assert room._dialog is None


def test_export_can_be_cancelled_and_says_what_is_missing(room, folder, qtbot):
    write_take(folder, "long", 1500)
    opened(room, folder / "long.mcap")
    room.export_take()
    dialog: ExportDialog = room._dialog
    for box in dialog.formats.values():
        box.setChecked(False)
    assert not dialog.start.isEnabled() and dialog.reason.text() == "Choose a format."
    for box in dialog.formats.values():
        box.setChecked(True)
    dialog.folder.setText(str(folder / "out"))
    dialog.export()
    dialog.reject()
    room.wait(lambda: not dialog.exporting, "the end")
    assert "Cancelled" in dialog.result.state.text()
    assert not [path for path in (folder / "out").glob("*") if path.name.startswith(".")]
    dialog.reject()


def test_page_keys_go_from_take_to_take(room, folder, qtbot):
    room.wait(lambda: all(row.frames for row in room.browser.table.rows), "the list")
    room.browser.view.sortByColumn(1, Qt.SortOrder.AscendingOrder)
    opened(room, folder / "first.mcap")
    qtbot.keyClick(room, Qt.Key.Key_PageDown)
    shown(room, "second")
    assert (room.browser.chosen, room.player.n_frames) == (folder / "second.mcap", 30)
    qtbot.keyClick(room, Qt.Key.Key_PageUp)
    shown(room, "first")
    assert (room.browser.chosen, room.document.path) == (folder / "first.mcap", folder / "first.mcap")


def test_of_takes_opened_in_a_hurry_the_last_is_shown(room, folder):
    for name in ("first", "second", "cut_short", "second"):
        room.open_take(folder / f"{name}.mcap")
    shown(room, "second")
    room.wait(lambda: room.opening.job is None and room.document.analysis is not None, "quiet")
    assert room.document.path.stem == "second" and room.player.n_frames == 30 and room.told() == []


def test_an_empty_room_says_what_to_do_and_does_nothing_wrong(room, qtbot):
    assert "Choose one in the list" in room.viewport.message
    for do in (room.solving.ask, room.export_take, lambda: room.words.add_mark(0.0), room.solving.save_shown):
        do()
    room.words.rate("A")
    qtbot.keyClick(room, Qt.Key.Key_Space)
    assert room.told() == [] and not room.undo.canUndo()


def test_timeline_and_plots_show_the_same_part(room, folder):
    opened(room, folder / "first.mcap")
    room.timeline.set_view(0.2, 0.6)
    assert room.plots._rms.getViewBox().viewRange()[0] == pytest.approx([0.2, 0.6])
    x = room.plots._rms.mapFromScene(room.plots._rms.getViewBox().mapViewToScene(qpoint(0.4, 1.0))).x()
    at = room.plots.mapFromGlobal(room.plots._rms.mapToGlobal(qpoint(x, 0).toPoint())).x()
    assert abs(at - room.timeline.x_of(0.4)) < 4, "one above the other"
    room.plots._rms.setXRange(0.1, 0.5, padding=0)
    assert room.timeline.view_s == pytest.approx((0.1, 0.5))


def qpoint(x, y):
    from PySide6.QtCore import QPointF

    return QPointF(x, y)
