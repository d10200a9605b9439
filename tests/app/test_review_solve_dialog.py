import json
from dataclasses import replace

import pytest
from PySide6.QtWidgets import QFileDialog, QWidget

from app.hand_size import sized
from app.review.solve_dialog import SolveDialog
from core.hand.shape import HandShape
from core.profile import load_profile
from tests.app.hand_frames import profile


@pytest.fixture
def dialog(qtbot):
    parent = QWidget()
    qtbot.addWidget(parent)
    yield SolveDialog(profile(), load_profile("qualisys13"), parent)


def choose(dialog, text: str) -> None:
    dialog.choice.setCurrentIndex(next(i for i in range(dialog.choice.count()) if text in dialog.choice.itemText(i)))
    dialog.accept()


def test_the_takes_own_profile_is_offered_first(dialog):
    assert dialog.choice.currentText().startswith("As recorded: han19")
    dialog.accept()
    assert dialog.profile.layout.name == "han19"


def test_profiles_tell_whose_hand_they_have(qtbot):
    parent = QWidget()
    qtbot.addWidget(parent)
    calibrated = replace(profile(), performer="Ada", shape=HandShape.uniform(0.93), scale=1.0)
    dialog = SolveDialog(calibrated, sized(profile(), "M"), parent)
    assert dialog.choice.itemText(0) == "As recorded: Ada · han19 · left + right · calibrated hand"
    assert dialog.choice.itemText(1) == "In use now: han19 · left + right · hand size M"


@pytest.mark.parametrize(("text", "layout"), [("In use now", "qualisys13"), ("schroeder8", "schroeder8")])
def test_other_profiles(dialog, text, layout):
    choose(dialog, text)
    assert dialog.result() and dialog.profile.layout.name == layout


def test_a_profile_file_or_why_not(dialog, tmp_path, monkeypatch):
    path = tmp_path / "ann.json"
    monkeypatch.setattr(QFileDialog, "getOpenFileName", lambda *args: (str(path), ""))
    path.write_text(json.dumps({"format": "something else"}))
    choose(dialog, "Profile file")
    assert not dialog.result() and "is not a profile" in dialog.error.text()
    path.write_text(profile().to_json())
    dialog.accept()
    assert dialog.result() and dialog.profile.layout.marker_names == profile().layout.marker_names


def test_a_take_without_a_profile_can_still_be_solved(qtbot):
    parent = QWidget()
    qtbot.addWidget(parent)
    dialog = SolveDialog(None, profile(), parent)
    dialog.accept()
    assert dialog.profile.layout.name == "han19"


def test_points_are_named_from_the_whole_take_unless_told_otherwise(dialog, qtbot):
    assert dialog.whole.isChecked()
    parent = QWidget()
    qtbot.addWidget(parent)
    assert not SolveDialog(profile(), profile(), parent, whole=False).whole.isChecked()


def test_a_take_of_several_performers_is_solved_for_all_of_them(qtbot):
    parent = QWidget()
    qtbot.addWidget(parent)
    cast = (replace(profile(), performer="Ada"), replace(load_profile("qualisys13"), performer="Ben"))
    dialog = SolveDialog(cast, profile(), parent)
    assert dialog.choice.itemText(0) == "As recorded: Ada · han19 · left + right and Ben · qualisys13 · right"
    dialog.accept()
    assert dialog.profiles == cast and dialog.profile is cast[0]
