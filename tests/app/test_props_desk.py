"""What an operator does with the props there are, and what of them is remembered."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtWidgets import QLabel

from app.notifications import Severity
from app.panels.props_box import PropsBox
from app.props.desk import PropDesk
from app.props.picking import with_props
from app.props.shape_dialog import ShapeDialog
from app.props.shape_form import SHAPES
from app.review.solve_dialog import SolveDialog
from app.session import Session
from app.undo import UndoStack
from app.viewport.marker_states import prop_points_m
from app.worker import SessionWorker
from core.frames import PropFrame
from core.props.prop import N_LENGTHS, Prop, PropModel, load_prop
from tests.app.hand_frames import profile, sample
from tests.core.props.things import PEN, SQUARE, path


@pytest.fixture
def desk(qtbot):
    worker = SessionWorker(Session(replace(profile(), props=(PEN, SQUARE))))
    made = PropDesk(worker, UndoStack(worker.notifications))
    made.stack = made._undo
    made.names = lambda: [prop.name for prop in made.props]
    made.told = lambda: [n.line for n in worker.notifications.history if n.severity is Severity.PROBLEM]
    yield made
    worker.close()


def test_props_are_added_renamed_and_removed_each_with_its_way_back(desk) -> None:
    desk.add(replace(PEN, name="stylus"))
    desk.rename("pen", " brush ")
    desk.remove("square")
    assert desk.names() == ["brush", "stylus"]
    seen = [desk.names()]
    while desk.stack.canUndo():
        desk.stack.undo()
        seen.append(desk.names())
    assert seen[1:] == [["brush", "square", "stylus"], ["pen", "square", "stylus"], ["pen", "square"]]
    np.testing.assert_array_equal(desk.props[0].markers_m, PEN.markers_m)
    assert desk.told() == []


def test_two_props_never_share_a_name(desk) -> None:
    assert desk.free_name("pen") == "pen 2" and desk.free_name() == "prop"
    desk.rename("square", "pen")
    desk.rename("square", "  ")
    assert desk.names() == ["pen", "square"] and not desk.stack.canUndo()
    assert "called 'pen' already" in desk.told()[0] and "needs a name" in desk.told()[1]


def test_a_prop_goes_to_a_file_and_comes_back(desk, tmp_path: Path) -> None:
    desk.save("pen", tmp_path / "pen.json")
    assert load_prop(tmp_path / "pen.json").to_dict() == PEN.to_dict()
    desk.remove("pen")
    desk.open(tmp_path / "pen.json")
    assert desk.names() == ["square", "pen"]
    desk.open(tmp_path / "none.json")
    desk.save("pen", tmp_path / "no" / "pen.json")
    assert "none.json" in desk.told()[0] and "cannot be written" in desk.told()[1] and desk.names() == ["square", "pen"]


def test_the_panel_lists_them_with_a_menu_and_marks_what_looks_the_same_from_several_sides(desk, qtbot) -> None:
    box = PropsBox(desk)
    qtbot.addWidget(box)
    assert box.empty.isVisibleTo(box) and "Shift+click" in box.empty.text()
    box.show_props(desk.props, None)
    assert not box.empty.isVisibleTo(box) and list(box.lines.shown) == ["pen", "square"]
    titles = {title.text(): title.toolTip() for title in box.lines.findChildren(QLabel) if title.toolTip()}
    assert titles["pen"] == "pen" and "8 sides" in titles["square ⟲"]
    actions = {action.text(): action for action in box.menu("square").actions() if action.text()}
    assert list(actions) == ["Rename…", "Shape…", "Save as a file…", "Remove"]
    actions["Remove"].trigger()
    assert desk.names() == ["pen"]


@pytest.mark.parametrize("shape", [shape for shape, _, _ in SHAPES])
def test_another_shape_is_laid_about_the_markers_and_how_the_prop_lay_is_kept(shape, qtbot) -> None:
    lay = path(0.7)
    dialog = ShapeDialog(replace(PEN, home=lay[:3, :3]), None)
    qtbot.addWidget(dialog)
    dialog.form.choose(shape)
    dialog.accept()
    made = dialog.prop
    assert made.model.shape == shape and len(made.model.size_m) == N_LENGTHS[shape]
    relative = made.markers_m @ made.home.T
    placed = PEN.placed_m(lay)
    np.testing.assert_allclose(relative - relative[0], placed - placed[0], atol=1e-12)
    if shape == "box":
        half_m = 0.5 * np.array(made.model.size_m) + 1e-4  # to a tenth of a millimetre, as the fields show
        assert (np.abs(made.markers_m) <= half_m).all()


def test_the_same_shape_keeps_its_place(qtbot) -> None:
    dialog = ShapeDialog(PEN, None)
    qtbot.addWidget(dialog)
    assert [spin.value() for spin in dialog.form.lengths[:2]] == [10.0, 150.0]
    dialog.form.lengths[0].setValue(12.0)
    dialog.accept()
    np.testing.assert_array_equal(dialog.prop.markers_m, PEN.markers_m)
    assert dialog.prop.model == PropModel("cylinder", (0.012, 0.15))


def test_the_view_fits_the_ends_of_a_prop() -> None:
    place = path(0.2)
    frame, solved = sample()
    seen = PropFrame("pen", place, True, np.full(5, -1), 1e-4, PEN.placed_m(place))
    points_m = prop_points_m(replace(solved, props=(seen,)), (PEN,))
    local = (points_m - place[:3, 3]) @ place[:3, :3]
    assert np.abs(local[:8]).max(axis=0) == pytest.approx([0.005, 0.005, 0.075])
    np.testing.assert_allclose(points_m[8:], PEN.placed_m(place))
    lost = replace(solved, props=(replace(seen, tracked=False),))
    assert len(prop_points_m(lost, (PEN,))) == len(prop_points_m(None, ())) == 0
    assert frame is not None


def test_props_of_the_same_name_are_replaced() -> None:
    other = Prop("pen", SQUARE.markers_m)
    merged = with_props(replace(profile(), props=(PEN, SQUARE)), (other,))
    assert [prop.name for prop in merged.props] == ["square", "pen"] and merged.props[1] is other


def test_a_take_can_be_solved_again_with_the_props_in_use(qtbot) -> None:
    recorded, live = replace(profile(), performer="Ann", props=(PEN,)), replace(profile(), props=(PEN, SQUARE))
    dialog = SolveDialog(recorded, live, None)
    qtbot.addWidget(dialog)
    texts = [dialog.choice.itemText(i) for i in range(dialog.choice.count())]
    row = next(i for i, text in enumerate(texts) if text.startswith("As recorded, with square: Ann"))
    dialog.choice.setCurrentIndex(row)
    dialog.accept()
    assert dialog.profile.performer == "Ann" and [prop.name for prop in dialog.profile.props] == ["pen", "square"]
    none = SolveDialog(recorded, recorded, None)
    qtbot.addWidget(none)
    assert not any("with" in none.choice.itemText(i) for i in range(none.choice.count()))
