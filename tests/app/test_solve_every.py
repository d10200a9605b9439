"""Every n-th frame solved by choice: in the session, in takes, and at the window's keys."""

from __future__ import annotations

import json
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest

from app import settings as names
from app.every_nth import MOST, EveryNth, every_words
from app.live_numbers import SKIPPED
from app.main_window import MainWindow
from app.notifications import NotificationCentre
from app.review.analysis import Cell
from app.review.document import ReviewDocument, read_analysis
from app.review.inspector import Inspector
from app.review.job import Report
from app.review.moment import moment_words
from app.review.player import Player
from app.review.take_plots import TakePlots
from app.review.tasks import solve_take
from app.session import Session
from app.solver_thread import SolverThread
from app.worker import SessionWorker
from core.cast import Cast
from core.engine import Engine
from core.errors import PhalanxError
from core.frames import HandKey, MarkerFrame, Times, TrackedFrame
from core.level import Level
from core.profile import load_profile
from core.takes.reader import open_take
from core.takes.take import BY_CHOICE, TakeInfo
from core.words import ordinal
from devices.natnet.client import NatNetDevice
from tests.app.command import phalanx
from tests.app.stage import RATE_HZ, own_threads, performance, server, settings_for, until
from tests.app.test_window import Desk
from tests.some import some

HAN19 = load_profile("han19")


def empty(number: int) -> MarkerFrame:
    times = Times(number / RATE_HZ, number / RATE_HZ, number / RATE_HZ)
    return MarkerFrame(number, times, np.empty((0, 3)), np.empty(0), np.empty(0))


def numbers(frames: tuple[MarkerFrame, ...] | None) -> list[int] | None:
    return None if frames is None else [frame.sequence for frame in frames]


def test_the_first_and_every_nth_after_it_come_with_those_between() -> None:
    nth = EveryNth()
    nth.choose(2)
    assert [numbers(nth.next(empty(i), -1)) for i in range(4)] == [[], None, [1], None]
    nth.choose(1)
    assert [numbers(nth.next(empty(i), 0)) for i in range(3)] == [[], [], []]
    nth.choose(3)
    assert [numbers(nth.next(empty(i), 0)) for i in range(3, 9)] == [None, None, [3, 4], None, None, [6, 7]]
    assert nth.next(empty(9), 0) is None
    nth.choose(1)
    assert [numbers(nth.next(empty(i), 0)) for i in (10, 11)] == [[9], []]
    nth.choose(4)
    assert nth.next(empty(12), 0) is None
    assert [numbers(nth.next(empty(i), 1)) for i in (13, 14)] == [[], None]  # of another era: it begins anew


@pytest.mark.parametrize("n", [0, -1, MOST + 1])
def test_what_cannot_be_chosen_is_said(n: int) -> None:
    session = Session(HAN19)
    with pytest.raises(PhalanxError, match=f"from 1 to {MOST}, not {n}"):
        session.set_solve_every(n)
    assert session.solve_every == 1
    session.close()


def test_words() -> None:
    assert every_words(4, 480.0) == "Every 4th frame is solved: 120 Hz of 480 Hz"
    assert every_words(2, 0.0) == "Every 2nd frame is solved"
    assert [ordinal(n) for n in (1, 2, 3, 4, 11, 12, 13, 21, 112)] == [
        "1st", "2nd", "3rd", "4th", "11th", "12th", "13th", "21st", "112th"
    ]  # fmt: skip


class Told:
    """An engine that remembers what it is told of each frame."""

    def __init__(self) -> None:
        self.said: list[tuple[str, int]] = []

    def step(self, frame: MarkerFrame) -> TrackedFrame:
        self.said.append(("step", frame.sequence))
        return TrackedFrame(frame.sequence, frame.times, ())

    def pass_over(self, frame: MarkerFrame) -> None:
        self.said.append(("pass", frame.sequence))

    def skip(self, frames: int) -> None:
        self.said.append(("skip", frames))

    def reset(self) -> None: ...

    def search(self, hand: HandKey) -> None: ...

    def change(self, profiles: Cast) -> None: ...


def test_the_engine_is_told_of_every_frame_once_and_in_order() -> None:
    engine, held = Told(), []
    solver = SolverThread((HAN19,), lambda _: engine, lambda: None, held.append, NotificationCentre(), queue_frames=4)
    solver.start()
    assert solver.ready.wait(60)
    solver.set_solve_every(3)
    busy, free = threading.Event(), threading.Event()
    solver._queue.command(lambda: (busy.set(), free.wait(60)))
    assert busy.wait(60)
    for i in range(18):  # 0, 3, ..., 15 are to be solved; of these 4 may wait
        solver.offer(empty(i), None)
    free.set()
    until(lambda: ("step", 15) in engine.said)
    assert engine.said == [
        ("skip", 4), ("pass", 4), ("pass", 5), ("step", 6), ("pass", 7), ("pass", 8), ("step", 9),
        ("pass", 10), ("pass", 11), ("step", 12), ("pass", 13), ("pass", 14), ("step", 15),
    ]  # fmt: skip
    assert solver.meter.numbers().dropped == {SKIPPED: 2}  # the two frames that were to be solved
    assert solver.close(60)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, Any]]:
    """A take of which every fourth frame was solved, until its end, and what was said meanwhile."""
    folder, session = tmp_path_factory.mktemp("nth"), Session(HAN19)
    session.start()
    session.wait_ready()
    session.set_solve_every(4)
    with server() as simulator:
        stream = session.add_device(NatNetDevice, settings_for(simulator))
        session.connect(stream)
        stream.wait_connected(30)
        until(lambda: session.numbers().solver.solved > 20, "poses")
        session.start_recording(folder / "a.mcap", TakeInfo("a", rate_hz=RATE_HZ))
        until(lambda: session.numbers().recording.received >= 2 * RATE_HZ)
        summary = session.stop_recording().result(60)
        dropped = session.numbers().solver.dropped
    session.close()
    assert own_threads() == []
    yield {"summary": summary, "dropped": dropped, "history": session.notifications.history}


def test_a_take_holds_all_frames_and_counts_those_left_out_by_choice(recorded) -> None:
    summary = recorded["summary"]
    assert BY_CHOICE not in recorded["dropped"]
    assert summary.received == summary.written == summary.solved + sum(summary.unsolved.values())
    left_out = summary.unsolved[BY_CHOICE]
    assert summary.unsolved.keys() <= {BY_CHOICE, SKIPPED}
    assert left_out == pytest.approx(0.75 * summary.written, abs=3)
    assert f"not solved, left out by choice: {left_out:,}" in summary.line
    with open_take(summary.path) as take:
        assert take.counts.left_out == left_out and len(take.raw) == summary.written
        raw = [frame.sequence for frame in take.raw]
        solved = [frame.sequence for frame in take.solved]
        if summary.unsolved.keys() == {BY_CHOICE}:  # the machine kept up
            at = [raw.index(one) for one in solved]
            assert set(np.diff(at).tolist()) == {4}
        verdict = take.verdict
    assert verdict.whole and summary.verdict.headline == verdict.headline
    if summary.unsolved.keys() == {BY_CHOICE} and not summary.lost:
        assert verdict.level is Level.GOOD and verdict.texts == ()
        assert verdict.headline == f"{summary.written:,} frames, none lost, {left_out:,} without a pose by choice"
        note = recorded["history"][-1]
        assert note.text == f"Take a is saved. {summary.line}."


def test_solve_again_solves_all_of_them(recorded, tmp_path: Path) -> None:
    summary, target = recorded["summary"], tmp_path / "again.mcap"
    solve_take(str(summary.path), str(target), [HAN19.to_json()], True, lambda share, text: None)
    with open_take(target) as take:
        assert len(take.raw) == len(take.solved) == summary.written
        assert take.counts.unsolved == {} and take.counts.left_out == 0
        assert take.verdict.headline.endswith("none lost") or summary.lost


def test_review_joins_what_was_solved_and_holds_the_rest_against_nobody(recorded, qtbot) -> None:
    summary = recorded["summary"]
    document = ReviewDocument(summary.path)
    assert document.solved is not None
    with_pose = np.flatnonzero(document.solved.matched >= 0)
    first = int(with_pose[0])
    for i in range(first, document.n_frames):
        shown = document.while_playing(i)
        assert (i - MOST < shown <= i and document.frame(shown)[1] is not None) or SKIPPED in summary.unsolved
    assert document.while_playing(first) == first
    assert document.frame(first + 1)[1] is None  # so it is shown where it stops
    analysis = read_analysis(summary.path, document.solved, Report(lambda what, told: None, threading.Event()))
    assert analysis is not None and analysis.left_out == summary.unsolved[BY_CHOICE]
    for hand in (0, 1):
        tracked = int((analysis.states[hand] == Cell.TRACKED).sum())
        assert analysis.tracked_share(hand) == pytest.approx(
            tracked / (document.n_frames - analysis.left_out + analysis.missing)
        )
        assert tracked > 40 and analysis.losses(hand) == 0
    if summary.unsolved.keys() == {BY_CHOICE}:
        words = "No pose, left out by choice: every 4th frame was solved. Solve again makes poses of all."
        said = {i: moment_words(analysis, i, 0) for i in range(document.n_frames)}
        assert [i for i, told in some(said.items()) if told != words] == with_pose.tolist()
        inspector = Inspector()
        qtbot.addWidget(inspector)
        inspector.show_analysis(analysis)
        assert inspector.hands.text().endswith(f"not counted here: {analysis.left_out:,} frames")
        told = phalanx("info", str(summary.path), "--json")
        assert f"solved, left out by choice: {analysis.left_out:,}" in told.out
        figures = json.loads(told.out.splitlines()[-1])
        shares = [figures["tracked"][hand] for hand in ("left", "right")]
        assert figures["left_out"] == analysis.left_out
        assert shares == pytest.approx([analysis.tracked_share(hand) for hand in (0, 1)])
        assert f"left {100 * shares[0]:.1f} %" in told.out and min(shares) > 0.5
    plots = TakePlots(Player())
    qtbot.addWidget(plots)
    plots.show_take(document.times_s, analysis)
    x, y = plots.curve("angle", "right")
    assert np.isfinite(y).sum() >= len(with_pose) - 1 and np.isfinite(x).all()
    assert len(y) - len(with_pose) == len(analysis.holes)
    document.close()


def test_hands_are_tracked_on_while_the_choice_changes() -> None:
    engines: list[Engine] = []
    shown: list[TrackedFrame] = []

    def make(cast: Cast) -> Engine:
        engines.append(Engine(cast))
        return engines[0]

    solver = SolverThread((HAN19,), make, lambda: None, lambda frame: shown.append(frame.solved), NotificationCentre())
    solver.start()
    assert solver.ready.wait(60)
    for i, frame in enumerate(performance()[:240]):
        if i % 40 == 0:
            solver.set_solve_every(1 + (i // 40) * 3 % MOST)
        solver.offer(frame, None)
        until(lambda: not solver.queue_depth)
    n = len(shown)
    until(lambda: len(shown) == solver.meter.numbers().solved)
    assert solver.close(60) and 40 < n < 140
    tracked = [hand.state.name for frame in shown[20:] for hand in frame.hands]
    assert set(some(tracked)) == {"TRACKED"}


# At the window.


@pytest.fixture
def stage():
    with server() as simulator:
        yield simulator


@pytest.fixture
def desk(qtbot, tmp_path):
    made = Desk(qtbot, tmp_path / "takes")
    yield made
    made.close()


def test_it_is_chosen_by_keys_undone_remembered_and_said_with_the_rate_that_results(desk, stage) -> None:
    tracking, strip, session = desk.window.tracking, desk.window.strip, desk.session
    chooser = tracking.solve_every
    texts = [chooser.itemText(i) for i in range(chooser.count())]
    assert len(texts) == MOST and texts[:3] == ["Every frame", "Every 2nd frame", "Every 3rd frame"]
    assert chooser.currentText() == "Every frame" and tracking.solved_rate.text() == ""
    desk.connected(stage)
    desk.until(lambda: session.numbers().solver.rate_hz > 0)
    desk.until(lambda: "solved per second" in strip.solver.toolTip())
    assert "as chosen" not in strip.solver.toolTip()

    chooser.setFocus()
    for _ in range(3):
        QTest.keyClick(chooser, Qt.Key.Key_Down, delay=50)
    assert session.solve_every == 4 and desk.settings.get(names.SOLVE_EVERY, 1) == 4
    words = "Every 4th frame is solved: 30 Hz of 120 Hz"
    desk.until(lambda: words in chooser.toolTip() and words in tracking.solved_rate.toolTip(), "the rate that results")
    desk.until(lambda: tracking.solved_rate.text() == "30 of 120 Hz")
    desk.until(lambda: f"{words}, as chosen in Tracking." in strip.solver.toolTip())
    assert "no loss" in chooser.toolTip() and "Solve again" in chooser.toolTip()
    desk.until(lambda: session.numbers().solver.rate_hz < 40, "fewer poses")
    assert BY_CHOICE not in session.numbers().solver.dropped

    desk.window.undo.undo()
    assert session.solve_every == 3 and chooser.currentText() == "Every 3rd frame"
    desk.window.undo.redo()
    again = MainWindow(SessionWorker(Session(HAN19)), desk.settings)
    assert again.worker.session.solve_every == 4 and again.tracking.solve_every.currentText() == "Every 4th frame"
    notes = [note.line for note in again.worker.notifications.history]
    assert "Every 4th frame is solved, as chosen before in Tracking." in notes
    again.stop_and_close()
    QTest.keyClick(chooser, Qt.Key.Key_Home, delay=50)
    assert session.solve_every == 1 and desk.settings.get(names.SOLVE_EVERY, 4) == 1
    desk.until(lambda: tracking.solved_rate.text() == "" and "as chosen" not in strip.solver.toolTip())


@pytest.mark.parametrize("remembered", [0, MOST + 1, "2"])
def test_what_settings_cannot_mean_is_every_frame(desk, remembered: object) -> None:
    desk.settings.set(names.SOLVE_EVERY, remembered)
    window = MainWindow(SessionWorker(Session(HAN19)), desk.settings)
    assert window.worker.session.solve_every == 1
    window.stop_and_close()
