"""A take in which nothing came for a while: every place that shows it says so, and all say the same."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtGui import QColor
from PySide6.QtTest import QTest

from app import theme
from app.clock import clock
from app.review.take_row import read_row
from core.level import Level
from core.takes.reader import open_take
from devices.natnet.client import NatNetDevice
from tests.app.command import phalanx
from tests.app.stage import server, settings_for
from tests.app.takes import write_take
from tests.app.test_window import Desk

SILENT_FROM, SILENCE_S = 60, 3.0


@pytest.fixture(scope="module")
def silent(tmp_path_factory) -> Path:
    """120 frames at 100 Hz; before frame 60 nothing came for 3 s, and after the last for 2 s."""
    folder = tmp_path_factory.mktemp("silent")
    return write_take(folder, "silent", 120, silent=(SILENT_FROM, SILENCE_S), tail_s=2.0, hidden=range(10, 20))


def opened(desk: Desk, path: Path):
    desk.window.review_take(path)
    review = desk.window._review
    desk.until(lambda: review.document is not None and review.document.path == path, "the take")
    desk.until(lambda: review.document.analysis is not None, "its analysis")
    return review


@pytest.fixture
def desk(qtbot, tmp_path):
    made = Desk(qtbot, tmp_path)
    yield made
    made.close()


def test_the_file_says_how_long_it_was_and_what_is_missing(silent):
    with open_take(silent) as take:
        assert take.duration_s == pytest.approx(1.2 + SILENCE_S + 2.0)
        assert take.holes.words == "5.0 s without frames, about 500"
        assert take.holes.from_s == pytest.approx([0.6, 1.2 + SILENCE_S])
        assert take.verdict.level is Level.PROBLEM and "5.0 s without frames" in take.verdict.headline


def test_list_and_command_line_say_the_same(silent, tmp_path):
    row = read_row(silent)
    said = phalanx("info", silent, "--json")
    figures = said.figures
    assert row.level is Level.PROBLEM and figures["verdict"]["level"] == "problem"
    assert list(row.problems) == figures["verdict"]["findings"]
    assert figures["duration_s"] == pytest.approx(row.duration_s)
    assert (figures["silent_s"], figures["missing"]) == (pytest.approx(5.0), 500)
    assert "red: 5.0 s without frames, about 500" in said.out
    assert "without frames" in phalanx("verify", silent).out
    exported = phalanx("export", silent, "--to", "trc", "--out", tmp_path)
    assert exported.code == 3 and (tmp_path / "silent_holes.csv").exists()
    assert "3.0 s are gaps in C3D and TRC" in exported.out and "end with the last" in exported.out


def test_review_shows_the_hole(desk, silent):
    review = opened(desk, silent)
    analysis = review.document.analysis
    # Shares are of what should be there: 120 of 620.
    assert analysis.tracked_share(1) == pytest.approx(120 / 620)
    assert analysis.gap_shares(1)[0] == pytest.approx(500 / 620)
    assert analysis.gap_shares(0)[2] == pytest.approx(510 / 620)
    assert review.inspector.light.level is Level.PROBLEM
    assert "5.0 s without frames" in review.inspector.problems.text()
    assert clock(6.2) in review.inspector.facts.text()
    # The timeline shows all of the recording, its lanes broken where nothing came.
    timeline = review.timeline
    assert timeline.view_s == (pytest.approx(0.0), pytest.approx(6.2))
    picture = timeline.grab().toImage()
    scale = picture.devicePixelRatio()

    def colour(time_s, lane):
        y = 24 + timeline._lanes.lanes[lane].y + 3
        return QColor(picture.pixel(round((timeline.x_of(time_s)) * scale), round(y * scale))).name()

    for lane in (0, 1):
        assert colour(0.3, lane) != theme.PANEL
        assert colour(0.7, lane) == colour(3.5, lane) == colour(4.3, lane) == theme.PANEL
    place = QPoint(round(timeline.x_of(2.0)), 40)
    assert timeline.text_at(place.x(), place.y()) == "Nothing came for 3.0 s, about 300 frames."
    # Curves are broken there, not drawn through.
    x, y = review.plots.curve("rms", "right")
    assert len(x) == 122 and np.isnan(y).sum() == 2 and np.isnan(y[SILENT_FROM])
    # The view shows no pose where there was none.
    QTest.mouseClick(timeline, Qt.MouseButton.LeftButton, pos=place)
    desk.until(lambda: review.viewport.shown[0] is None, "an empty view")
    assert "No frames" in review.viewport.message and "3.0 s" in review.viewport.message
    assert "Nothing came" in review.inspector.moment.text()
    QTest.mouseClick(timeline, Qt.MouseButton.LeftButton, pos=QPoint(round(timeline.x_of(0.3)), 40))
    desk.until(lambda: review.viewport.shown[0] is not None, "a pose")


def test_a_server_that_stands_still_while_recording_is_red_everywhere(desk, tmp_path):
    with server() as simulator:
        stream = desk.window.devices.add(NatNetDevice, settings_for(simulator))
        desk.worker.connect_device(stream)
        desk.until(lambda: stream.health().received > 0 and desk.window.record_action.isEnabled(), "frames")
        QTest.mouseClick(desk.window.deck.record, Qt.MouseButton.LeftButton)
        desk.until(lambda: desk.session.recording and desk.session.numbers().recording.received > 60, "a take")
        simulator.stop()
        desk.until(lambda: "none for" in desk.window.deck.frames.text(), "the deck to say so")
        assert desk.window.deck.frames.property("level") == "problem"
        simulator.start()
        received = desk.session.numbers().recording.received
        desk.until(lambda: desk.session.numbers().recording.received > received + 60, "frames again")
        desk.until(lambda: "s without" in desk.window.deck.frames.text(), "the deck to go on saying so")
        assert desk.window.deck.frames.property("level") == "problem"
        for curves in desk.window.plots._curves.values():
            x, y = curves.rms.getOriginalDataset()
            assert np.isnan(x).sum() >= 1 and len(x) == len(y), "no curve goes through the time without frames"
        QTest.mouseClick(desk.window.deck.record, Qt.MouseButton.LeftButton)
        desk.until(lambda: desk.finished, "the take's end")
    (summary,) = desk.finished
    assert summary.received == summary.written + sum(summary.dropped.values())
    with open_take(summary.path) as take:
        verdict, length_s, holes = take.verdict, take.duration_s, take.holes
        assert 1.0 <= holes.seconds < length_s and holes.longest_s >= 1.0
        assert length_s == pytest.approx(summary.duration_s)
    assert summary.verdict == verdict and verdict.level is Level.PROBLEM
    deck, card = desk.window.deck, desk.window.recorder.last
    assert verdict.headline in deck.frames.text() and deck.frames.property("level") == "problem"
    assert card.light.level is Level.PROBLEM and holes.words in card.reason.text()
    assert deck.elapsed.text() == clock(length_s) and clock(length_s) in card.counts.text()
    row = read_row(summary.path)
    assert (row.level, row.problems) == (verdict.level, verdict.texts)
    review = opened(desk, summary.path)
    assert review.inspector.light.level is verdict.level
    assert review.inspector.problems.text() == "\n".join(verdict.texts)
    assert clock(length_s) in review.inspector.facts.text()


def test_a_take_that_was_not_solved_is_not_green(tmp_path):
    path = write_take(tmp_path, "unsolved", 40, unsolved=range(40))
    row = read_row(path)
    assert row.level is Level.WARNING and "None of its 40 frames is solved" in row.problems[0]
