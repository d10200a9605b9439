"""Picking points with the mouse, and making a prop of them: in review and live, in real windows."""

from __future__ import annotations

import itertools
from contextlib import closing
from dataclasses import replace

import numpy as np
import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest

from app.application import remembered_profile
from app.props.picker import PointPicker
from app.props.picking import with_props
from app.props.selection import PointSelection, pickable
from core.frames import NO_ID
from core.motion.performer import Performer
from core.motion.stream import MarkerStream
from core.props.marked import marked
from core.props.picked import loosest, stretch_about
from core.takes.reprocess import solve
from core.takes.take import TakeCounts, TakeInfo
from core.takes.writer import TakeWriter
from devices.natnet.simulator import NatNetSimulator
from tests.app.drawn import show
from tests.app.hand_frames import hand_frame, profile, sample
from tests.app.test_review import a_room, opened
from tests.app.test_window import Desk
from tests.core.props.things import PEN, SQUARE

SHIFT, CONTROL, NONE = (
    Qt.KeyboardModifier.ShiftModifier, Qt.KeyboardModifier.ControlModifier, Qt.KeyboardModifier.NoModifier
)  # fmt: skip
FREE_M = np.array([[0.0, 1.15, 0.0], [0.05, 1.2, 0.0], [-0.05, 1.22, 0.02], [0.0, 1.3, -0.03]])
LEFT = Qt.MouseButton.LeftButton


def place(view, point_m) -> QPoint:
    x, y, _ = view.points_on_screen(np.asarray(point_m)[None])[0]
    return QPoint(round(x), round(y))


def drag(view, begin: QPoint, end: QPoint, modifier) -> None:
    QTest.mousePress(view, LEFT, modifier, begin)
    QTest.mouseMove(view, (begin + end) / 2)
    QTest.mouseMove(view, end)
    QTest.mouseRelease(view, LEFT, modifier, end)


@pytest.fixture
def picker(viewport, qtbot):
    made = PointPicker(viewport)
    show(viewport, qtbot, *sample(hand_frame("right"), extra_m=FREE_M))
    viewport.view_front()
    return made


def test_clicks_pick_points_that_no_hand_has_and_escape_lets_go(picker, qtbot) -> None:
    view, free = picker.viewport, [19, 20, 21, 22]
    qtbot.mouseClick(view, LEFT, NONE, place(view, FREE_M[0]))
    assert picker.rows == free[:1]
    qtbot.mouseClick(view, LEFT, SHIFT, place(view, FREE_M[1]))
    qtbot.mouseClick(view, LEFT, SHIFT, place(view, FREE_M[2]))
    assert picker.rows == free[:3]
    qtbot.mouseClick(view, LEFT, SHIFT, place(view, FREE_M[1]))
    assert picker.rows == [19, 21]
    marker = hand_frame("right").markers_world_m[0]
    with qtbot.waitSignal(picker.refused):
        qtbot.mouseClick(view, LEFT, NONE, place(view, marker))
    assert picker.rows == [19, 21]
    view.setFocus()
    qtbot.keyClick(view, Qt.Key.Key_Escape)
    assert picker.rows == []
    qtbot.mouseClick(view, LEFT, NONE, place(view, FREE_M[3]))
    qtbot.mouseClick(view, LEFT, NONE, QPoint(5, view.height() - 5))
    assert picker.rows == []


def test_a_rubber_band_takes_what_is_in_it_and_a_plain_drag_turns_the_camera(picker, qtbot) -> None:
    view = picker.viewport
    corners = np.array([place(view, point).toTuple() for point in FREE_M[:3]])
    low, high = QPoint(*(corners.min(axis=0) - 6).tolist()), QPoint(*(corners.max(axis=0) + 6).tolist())
    azimuth = view.camera.azimuth_rad
    drag(view, low, high, CONTROL)
    assert sorted(picker.rows) == [19, 20, 21] and view.camera.azimuth_rad == azimuth
    at = place(view, FREE_M[3])
    drag(view, at - QPoint(9, 9), at + QPoint(9, 9), CONTROL | SHIFT)
    assert sorted(picker.rows) == [19, 20, 21, 22]
    drag(view, low, high, NONE)
    assert view.camera.azimuth_rad != azimuth and len(picker.rows) == 4


def test_ids_last_over_frames_and_rows_do_not() -> None:
    frame, solved = sample(hand_frame("right"), extra_m=FREE_M)
    assert pickable(frame, solved).tolist() == [19, 20, 21, 22]
    later = replace(frame, points_m=frame.points_m[::-1], ids=frame.ids[::-1])
    chosen = PointSelection()
    chosen.pick(frame, [20, 22], more=False)
    assert chosen.rows(later) == [2, 0] and chosen.rows(None) == [-1, -1]
    assert chosen.rows(replace(later, ids=later.ids - 1)) == [1, -1]
    anonymous = replace(frame, ids=np.full(23, NO_ID))
    chosen.pick(anonymous, [20, 22], more=False)
    assert chosen.rows(anonymous) == [20, 22] and chosen.rows(replace(anonymous)) == [-1, -1]


# A take with things in it.


@pytest.fixture(scope="module")
def things():
    """Two seconds of hands and a thing with five markers, that the profile does not know, and the truth."""
    performer = Performer(profile(), 1, "grasping")
    name = next(iter(performer.props))
    thing = marked(name, performer.props[name], 1)
    stream = MarkerStream(performer, 120.0, 1, props=(thing,), hidden=0.03)
    dressed = list(itertools.islice(stream.labelled(), 1740, 1980))
    names = [label.startswith(name) for label in stream.labels]
    own = [[row for row, truth in enumerate(one.truth) if truth >= 0 and names[truth]] for one in dressed]
    return thing, [one.frame for one in dressed], own


@pytest.fixture(scope="module")
def take(things, tmp_path_factory):
    _, frames, _ = things
    path = tmp_path_factory.mktemp("takes") / "handling.mcap"
    writer = TakeWriter(path, TakeInfo("handling", "Ann", rate_hz=120.0), profile())
    for raw, solved in zip(frames, solve(frames, profile()), strict=True):
        writer.raw("", raw)
        writer.solved(solved)
    writer.seal(TakeCounts(len(frames), len(frames), solved=len(frames)))
    return path


@pytest.fixture
def room(take, qtbot):
    with a_room(take.parent, qtbot) as made:
        opened(made, take)
        yield made


def picked(room, rows, view=None) -> None:
    """As an operator: the first by a click, the others with Shift."""
    view = view or room.viewport
    frame = view.shown[0]
    for i, row in enumerate(rows):
        QTest.mouseClick(view, LEFT, SHIFT if i else NONE, place(view, frame.points_m[row]))


def at_frame(room, own, n: int = 5) -> int:
    """Go to the first frame in the middle at which all markers of the thing are seen, close up."""
    at = next(i for i in range(60, len(own)) if len(own[i]) == n)
    room.player.seek_frame(at)
    room.wait(lambda: room.viewport.shown[0].sequence == room.document.take.raw[at].sequence, "the frame")
    room.viewport.camera.fit(room.viewport.shown[0].points_m[own[at]], 1.0)
    room.viewport.set_surface_shown(False)
    return at


def test_a_prop_is_made_of_points_in_a_take_tracked_and_undone(room, things) -> None:
    thing, _, own = things
    at = at_frame(room, own)
    picked(room, own[at])
    assert sorted(room.picking.picker.rows) == sorted(own[at]) and "5 points picked" in room.picking.bar.words.text()
    room.picking.bar.make.click()
    dialog = room.picking.dialog
    room.wait(lambda: dialog.examined is not None, "the points to be examined")
    assert not dialog.said.text() and dialog.name.text() == "prop"
    found = dialog.examined
    assert found.definition.rms_m < 1e-4 and found.followed.tracked_share > 0.9
    x, y = dialog.curve.getData()
    assert len(x) == 240 and np.nanmax(y) == pytest.approx(1e3 * np.nanmax(found.followed.rms_m))
    dialog.name.setText("thing")
    dialog.form.shape.setCurrentIndex(dialog.form.shape.findData("box"))
    dialog.form.lengths[0].setValue(33.0)
    dialog.make.click()
    desk = room.picking.desk
    (made,) = desk.props
    assert made.name == "thing" and made.model.shape == "box" and made.model.size_m[0] == pytest.approx(0.033)
    gaps_m = np.linalg.norm(made.markers_m[:, None] - made.markers_m[None], axis=2)
    truth_m = np.linalg.norm(thing.markers_m[:, None] - thing.markers_m[None], axis=2)
    assert np.sort(gaps_m.ravel()) == pytest.approx(np.sort(truth_m.ravel()), abs=1e-4)
    room.wait(lambda: room.document.solved.again is not None, "the take to be solved again")
    at_frame(room, own)
    solved = room.viewport.shown[1].props
    assert [prop.name for prop in solved] == ["thing"] and solved[0].tracked
    assert sorted(solved[0].point) == sorted(own[at]) and solved[0].rms_m < 1e-3
    assert room.undo.undoText().startswith("solving")
    room.undo.undo()
    assert room.document.solved is room.document.recorded
    room.undo.undo()
    assert desk.props == ()
    room.undo.redo()
    assert [prop.name for prop in desk.props] == ["thing"]
    assert room.told() == []


def test_points_of_hand_and_thing_together_are_refused_with_the_one_that_moves(room, things) -> None:
    _, frames, own = things
    at = at_frame(room, own)
    frame = room.viewport.shown[0]
    others = [row for row in pickable(frame, None) if row not in own[at]]
    stray = max(others, key=lambda row: loosest(stretch_about(frames, at, [*own[at][:4], row]).samples_m)[1])
    room.picking.picker.selection.pick(frame, [*own[at][:4], stray], more=False)
    room.picking.make()
    dialog = room.picking.dialog
    room.wait(lambda: "point" in dialog.said.text() and not dialog.progress.isVisible(), "the refusal")
    assert "not rigid: point 5 moves by" in dialog.said.text() and "Shift+click" in dialog.said.text()
    assert not dialog.make.isEnabled() and dialog.said.property("level") == "problem"
    dialog.cancel.click()
    assert room.picking.desk.props == () and room.picking.dialog is None


def test_too_few_points_and_points_that_are_not_there_are_told(room, things) -> None:
    _, _, own = things
    at = at_frame(room, own)
    picked(room, own[at][:2])
    room.picking.make()
    assert room.picking.dialog is None and "2 picked" in room.told()[-1]
    assert not room.picking.bar.make.isEnabled()
    room.picking.picker.selection.pick(room.viewport.shown[0], own[at], more=False)
    ids = room.viewport.shown[0].ids[own[at]]
    elsewhere = next(
        i for i in range(room.player.n_frames) if 0 < np.isin(ids, room.document.take.raw[i].ids).sum() < 5
    )
    room.player.seek_frame(elsewhere)
    room.wait(lambda: "not in this frame" in room.picking.bar.words.text(), "the bar to say so")
    room.picking.make()
    assert room.picking.dialog is None and "not in this frame" in room.told()[-1]


def test_a_thing_seen_live_is_picked_in_a_held_view_and_tracked_from_then_on(qtbot, tmp_path, things) -> None:
    """Frames come over the real wire; the view is held, the hands go on."""
    _, frames, own = things
    simulator = NatNetSimulator(frames, 120.0, command_port=0, data_port=0, loop=True, name="Stage")
    with closing(simulator):
        simulator.start()
        desk = Desk(qtbot, tmp_path)
        try:
            desk.connected(simulator)
            window, picking = desk.window, desk.window.picking
            view = window.viewport

            def rows():
                """Of the markers of the thing in the frame shown, by where they are."""
                raw = view.shown[0]
                number = (raw.sequence - frames[0].sequence) % len(frames) if raw is not None else -1
                truth_m = frames[number].points_m[own[number]] if number >= 0 else np.empty((0, 3))
                gaps_m = [np.linalg.norm(raw.points_m - point_m, axis=1) for point_m in truth_m]
                return [int(gap_m.argmin()) for gap_m in gaps_m if gap_m.min() < 1e-5]

            desk.until(lambda: desk.session.look_back.seconds > 1.5 and len(rows()) == 5, "all five markers")
            window.hold_action.trigger()
            held = view.shown[0]
            solved = desk.session.numbers().solver.solved
            desk.until(lambda: desk.session.numbers().solver.solved > solved + 60, "frames to go on")
            assert view.shown[0] is held and "tracking goes on" in picking.bar.words.text()
            picking.picker.selection.pick(held, rows(), more=False)
            window.prop_action.trigger()
            dialog = picking.dialog
            desk.until(lambda: dialog.examined is not None, "the points to be examined")
            before, at = picking._before  # all that came, and not what was drawn of it
            assert before[at] is held and len(dialog.examined.followed.times_s) == len(before) > 120
            assert {one.sequence for one in before} == set(range(before[0].sequence, before[-1].sequence + 1))
            dialog.name.setText("thing")
            dialog.make.click()
            assert picking._before is None
            assert not picking.held and [prop.name for prop in desk.session.profile.props] == ["thing"]
            lines = window.tracking.props.lines
            desk.until(lambda: "5 / 5 markers" in lines.shown.get("thing", ""), "the prop to be tracked")
            again = remembered_profile(desk.settings, False, desk.session.notifications)
            np.testing.assert_allclose(again.props[0].markers_m, desk.session.profile.props[0].markers_m, atol=1e-6)
            window.undo.undo()
            desk.until(lambda: lines.shown == {} and window.tracking.props.empty.isVisibleTo(window), "no prop")
            window.lent_props = (PEN,)
            desk.worker.set_profile(with_props(desk.session.profile, (PEN, SQUARE)))
            again = remembered_profile(desk.settings, False, desk.session.notifications)
            assert [prop.name for prop in again.props] == ["square"]
        finally:
            desk.close()
