"""Angles that count from a neutral trial, in the window: live plots, review, and the export dialog."""

from __future__ import annotations

import csv
from dataclasses import replace

import numpy as np
import pytest
from PySide6.QtCore import Qt

from app.hand_size import CALIBRATED
from app.panels.hand_size_chooser import HandSizeChooser
from app.panels.plots import PlotsPanel
from app.review.analysis import analyse
from app.review.export_choices import ExportChoices
from app.review.moment import moment_words
from app.review.player import Player
from app.review.take_plots import TakePlots
from app.session import Session
from app.settings import Settings
from app.undo import UndoStack
from app.worker import SessionWorker
from core.calibration.neutral import Neutral, NeutralHand
from core.hand.shape import HandShape
from core.hand.skeleton import DOF_NAMES
from core.takes.export import ExportOptions
from core.takes.reader import open_take
from tests.app.hand_frames import hand_frame, profile, sample
from tests.app.takes import write_take
from tests.app.test_review import a_room, opened

DOF = DOF_NAMES.index("index_pip_flexion")
ZERO_RAD = 0.01 * np.arange(20)
STD_RAD = 0.2
WORDS = "angles from the neutral trial of flat.c3d, 2.0 to 4.0 s"
TRIAL = NeutralHand(ZERO_RAD, np.full(20, STD_RAD), np.zeros(20), (), "flat.c3d", 2.0, 4.0, "2026-03-01T09:00:00+00:00")
ZEROED = replace(profile(), neutral=Neutral({"right": TRIAL}))


def test_review_counts_from_it_and_says_so(tmp_path, qtbot):
    with open_take(write_take(tmp_path, "a", 60, guessed=range(40, 50), worn=ZEROED)) as take:
        analysis, plain = (analyse(take.solved, np.arange(60), worn) for worn in (take.profile, profile()))
    left, right = (analysis.sides.index(side) for side in ("left", "right"))
    np.testing.assert_array_equal(analysis.theta_rad[left], plain.theta_rad[left])
    np.testing.assert_array_equal(analysis.theta_std[left], plain.theta_std[left])
    np.testing.assert_allclose(analysis.theta_rad[right, :, 6:], plain.theta_rad[right, :, 6:] - ZERO_RAD, atol=1e-6)
    np.testing.assert_allclose(
        analysis.theta_std[right, :, 6:], np.hypot(plain.theta_std[right, :, 6:], STD_RAD), rtol=1e-6
    )
    np.testing.assert_array_equal(analysis.guessed_joints, plain.guessed_joints)
    degrees = np.degrees(float(plain.theta_rad[right, 5, DOF]) - ZERO_RAD[DOF - 6])
    lines = moment_words(analysis, 5, DOF).splitlines()
    assert lines[right].startswith(f"Right: index PIP flexion {degrees:.0f}° ±12° from neutral, least sure")
    assert "neutral" not in lines[left]
    plots = TakePlots(Player())
    qtbot.addWidget(plots)
    plots.show_take(np.arange(60) / 100, analysis)
    np.testing.assert_allclose(plots.curve("angle", "right")[1], degrees, atol=1e-4)
    assert f"right {WORDS}." in plots.angle.toolTip()
    plots.show_take(np.arange(60) / 100, plain)
    np.testing.assert_allclose(plots.curve("angle", "right")[1], np.degrees(plain.theta_rad[right, :, DOF]))
    assert "neutral" not in plots.angle.toolTip()


def test_live_plots_count_from_it_and_say_so(qtbot):
    worker = SessionWorker(Session(profile()))
    panel = PlotsPanel(worker)
    qtbot.addWidget(panel)
    with qtbot.waitExposed(panel):
        panel.show()
    try:
        hands = [replace(hand_frame(side), theta_std=np.full(26, 0.1)) for side in ("left", "right")]
        tracked = np.degrees(hands[0].theta_rad[DOF])

        def drawn():
            for i in range(20):
                worker.session.trail.add(sample(*hands, sequence=i)[1])
            panel._refresh()
            return {(what, side): panel.curve(what, side)[1][-1] for what in ("angle", "upper bound")
                    for side in ("left", "right")}  # fmt: skip

        before = drawn()
        assert before["angle", "right"] == before["angle", "left"] == pytest.approx(tracked)
        assert "neutral" not in panel.angle.toolTip()
        worker.set_profile(ZEROED, 0)
        after = drawn()
        assert after["angle", "left"] == before["angle", "left"]
        zeroed = tracked - np.degrees(ZERO_RAD[DOF - 6])
        assert after["angle", "right"] == pytest.approx(zeroed)
        assert after["upper bound", "right"] == pytest.approx(zeroed + np.degrees(np.hypot(0.1, STD_RAD)))
        assert f"right {WORDS}." in panel.angle.toolTip()
    finally:
        worker.close()


def test_another_size_has_no_neutral_trial_and_the_calibrated_hand_its_own(qtbot):
    own = replace(ZEROED, shape=HandShape.uniform(1.07), scale=1.0)
    worker = SessionWorker(Session(own))
    try:
        chooser = HandSizeChooser(worker, UndoStack(worker.notifications))
        qtbot.addWidget(chooser)
        assert "at another size angles are as tracked" in chooser.toolTip()
        chooser.choose("M")
        assert "neutral" not in chooser.toolTip()
        assert worker.session.profiles[0].neutral is None
        chooser.choose(CALIBRATED)
        assert worker.session.profiles[0].neutral is own.neutral
    finally:
        worker.close()


def test_the_export_dialog_asks_only_where_there_is_a_trial(qtbot):
    settings = Settings(None)
    plain, zeroed = ExportChoices(settings), ExportChoices(settings, [WORDS])
    for choices in (plain, zeroed):
        qtbot.addWidget(choices)
        choices.show()
        choices.follow(["csv"], True)
    assert not plain.neutral.isVisible() and plain.neutral not in plain.fields
    assert zeroed.neutral.isVisible() and zeroed.neutral.isChecked() and zeroed.neutral in zeroed.fields
    assert WORDS in zeroed.neutral.toolTip()
    assert plain.options == zeroed.options == ExportOptions()
    zeroed.neutral.setChecked(False)
    assert zeroed.options == ExportOptions(neutral=False)
    zeroed.remember()
    assert ExportChoices(settings).options.neutral, "a take without a trial has nothing to leave out"
    zeroed.follow(["c3d", "bvh"], True)
    assert not zeroed.neutral.isEnabled()


def test_it_is_exported_left_out_and_remembered(tmp_path, qtbot):
    write_take(tmp_path, "first", 30, worn=ZEROED)
    with a_room(tmp_path, qtbot) as room:
        opened(room, tmp_path / "first.mcap")
        degrees = []
        for counted in (True, False):
            room.export_take()
            dialog = room._dialog
            for key, box in dialog.formats.items():
                box.setChecked(key == "csv")
            assert dialog.choices.neutral.isChecked() and dialog.choices.neutral.isVisible()
            if not counted:
                dialog.activateWindow()
                room.wait(dialog.isActiveWindow, "the dialog to be active")
                dialog.choices.neutral.setFocus()
                qtbot.keyClick(dialog.choices.neutral, Qt.Key.Key_Space)
            dialog.replace.setChecked(True)
            dialog.export()
            room.wait(lambda dialog=dialog: not dialog.exporting, "the export")
            with (tmp_path / "exports" / "first" / "angles.csv").open(newline="") as stream:
                row = next(row for row in csv.DictReader(stream) if row["hand"] == "right")
            degrees.append(float(row["index_pip_flexion"]))
            dialog.reject()
        assert degrees[1] - degrees[0] == pytest.approx(ZERO_RAD[DOF - 6], abs=1e-8)
        room.export_take()
        assert not room._dialog.choices.neutral.isChecked()
        room._dialog.reject()
