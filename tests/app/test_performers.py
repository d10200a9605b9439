"""Several performers in the window: added, named, removed, undone, remembered, and told apart wherever hands are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from app import settings as names
from app.application import remembered_others
from app.notifications import NotificationCentre
from app.panels.profile_chooser import OPEN
from app.viewport import hover
from app.viewport.legend import legend_rows
from app.viewport.marker_states import NO_DIGIT, MarkerState, marker_view
from app.viewport.tags import tags_of_hands, tags_of_markers
from app.viewport.viewport import Viewport
from core.calibration.fixed import FixedCovariance
from core.calibration.neutral import Neutral, NeutralHand
from core.calibration.priors import fixed_covariance
from core.calibration.record import Calibrated
from core.frames import HandKey, HandState, TrackedFrame
from core.hand.limits import JointLimits
from core.hand.sizes import SIZES
from core.markers.layout import layout_names
from core.profile import load_profile, save_profile
from tests.app.hand_frames import hand_frame, sample

ANN = replace(load_profile("han19"), performer="Ann", shape=SIZES["XL"], scale=1.0)
GLOVE = load_profile("qualisys13")


def test_a_second_performer_is_added_named_and_removed_step_by_step(window, tmp_path):
    session, undo, box = window.worker.session, window.undo, window.tracking.performers
    assert box.heading.text() == "Profile" and len(box.blocks) == 1
    assert [action.text() for action in box.menu().actions()] == [*layout_names(), "", OPEN]
    save_profile(ANN, tmp_path / "ann.json")
    box.add_performer("qualisys13")
    assert [profile.layout.name for profile in session.profiles] == ["han19", "qualisys13"]
    assert undo.undoText() == "add Performer 2" and box.heading.text() == "Performers"
    assert list(window.tracking.hands) == [(0, "left"), (0, "right"), (1, "right")]
    cards = [card.title.text() for card in window.tracking.hands.values()]
    assert cards == ["Performer 1 · left", "Performer 1 · right", "Performer 2 · right"]
    assert window.plots.legend_text == ", ".join(cards)
    assert list(window.deck.hand_lights) == list(window.tracking.hands)

    box.blocks[1].rename("Ben")
    assert session.profiles[1].performer == "Ben" and undo.undoText() == "name performer 2"
    assert window.tracking.hands[HandKey(1, "right")].title.text() == "Ben · right"
    box.blocks[1].profile.choose("schroeder6")  # what he wears changes, who he is does not
    assert (session.profiles[1].performer, session.profiles[1].layout.name) == ("Ben", "schroeder6")
    box.blocks[1].size.choose("S")
    assert session.profiles[1].shape is SIZES["S"] and session.profiles[0].scale is None
    box.blocks[0].profile.choose(str(tmp_path / "ann.json"))
    assert [profile.performer for profile in session.profiles] == ["Ann", "Ben"]
    assert "Ann · left" in window.plots.legend_text

    box.remove_performer(0)
    assert [profile.performer for profile in session.profiles] == ["Ben"] and len(box.blocks) == 1
    assert box.heading.text() == "Profile" and box.blocks[0].profile.currentText() == "Ben · schroeder6"
    assert window.plots.legend_text == "Left, Right"
    before = undo.count()
    while undo.canUndo():
        undo.undo()
    assert [profile.layout.name for profile in session.profiles] == ["han19"] and before == 6
    assert box.blocks[0].profile.currentText() == "han19" and window.settings.get(names.OTHER_PROFILES, [1]) == []


def test_performers_come_back_with_the_next_start(window):
    window.tracking.performers.add_performer("qualisys13")
    window.tracking.performers.blocks[1].rename("Ben")
    (again,) = remembered_others(window.settings, NotificationCentre())
    assert again.to_json() == window.worker.session.profiles[1].to_json()
    centre = NotificationCentre()
    window.settings.set(names.OTHER_PROFILES, [{"format": "nonsense"}, again.to_dict()])
    assert [profile.performer for profile in remembered_others(window.settings, centre)] == ["Ben"]
    assert "performer 2 of the last time" in centre.history[-1].line


def test_a_neutral_trial_limits_and_a_calibration_are_not_lost_in_the_window(window, tmp_path):
    record = Calibrated(FixedCovariance.of(fixed_covariance(ANN)), 0.0006, 120, 12.0, 0.001, 0.001)
    trial = NeutralHand(np.full(20, 0.1), np.zeros(20), np.zeros(20), (), "flat.c3d", 2.0, 4.0, "2026-03-01")
    limits = JointLimits((("pinky_mcp_flexion", -50.0, 110.0),))
    whole = replace(ANN, neutral=Neutral({"right": trial}), limits=limits, calibrated=record)
    save_profile(whole, tmp_path / "ann.json")
    window.tracking.performers.add_performer(str(tmp_path / "ann.json"))
    window.tracking.performers.blocks[1].rename("Anna")
    (again,) = remembered_others(window.settings, NotificationCentre())
    for now in (window.worker.session.profiles[1], again):
        assert now.to_json() == replace(whole, performer="Anna").to_json()


def test_what_cannot_be_read_adds_nobody(window):
    window.tracking.performers.add_performer("/nowhere/ben.json")
    assert len(window.worker.session.profiles) == 1 and not window.undo.canUndo()
    assert "/nowhere/ben.json" in window.worker.notifications.history[-1].line


def test_performers_are_locked_while_a_take_is_recorded(window):
    window.tracking.performers.add_performer("han19")
    box = window.tracking.performers
    for recording in (True, False):
        window.worker.recording_changed.emit(recording)
        locked = (box.add, box.blocks[1].name, box.blocks[1].remove, box.blocks[1].profile, box.blocks[1].size)
        assert not any(widget.isEnabled() == recording for widget in locked)


def two() -> tuple:
    """A frame of two performers with different gloves, the second's index finger tip hidden."""
    hands = [hand_frame(side, worn=ANN) for side in ("left", "right")]
    other = replace(hand_frame("right", worn=GLOVE, hidden=(0,)), performer=1)
    shift = np.array([0.6, 0.0, 0.0])
    joints = other.joints_world.copy()
    joints[:, :3, 3] += shift
    other = replace(other, markers_world_m=other.markers_world_m + shift, joints_world=joints)
    return sample(*hands, other)


def test_markers_are_named_by_what_their_performer_wears():
    frame, tracked = two()
    layouts, performers = (ANN.layout, GLOVE.layout), ("Ann", "Performer 2")
    view = marker_view(frame, tracked, layouts)
    assert view.counts().tolist() == [2 * 19 + 12, 1, 0, 0]
    last = np.flatnonzero(view.hands == 2)
    assert view.digits[last].tolist() == [(joint - 1) // 3 if joint else NO_DIGIT for joint in GLOVE.layout.joints]
    hidden = int(last[view.states[last] == MarkerState.PREDICTED][0])
    words = hover.marker_words(view, hidden, tracked, layouts, performers)
    assert words == f"Performer 2 · right {GLOVE.layout.marker_names[0]}: hidden, predicted"
    screen = np.column_stack([view.positions_m[:, :2] * 1000, np.ones(len(view.positions_m))])
    tags = tags_of_markers(view, screen, tracked, layouts, False, performers)
    assert [tag.text for tag in tags] == [*2 * ANN.layout.marker_names, *GLOVE.layout.marker_names]
    assert [row[0] for row in legend_rows(view, tracked, False, performers)][:3] == [
        "Ann · left", "Ann · right", "Performer 2 · right",
    ]  # fmt: skip


def test_hands_carry_the_name_of_their_performer_only_where_there_are_several():
    _, tracked = two()

    def flat(points_m: np.ndarray) -> np.ndarray:
        return np.column_stack([points_m[:, :2], np.ones(len(points_m))])

    tags = tags_of_hands(tracked, ("Ann", "Ben"), flat)
    assert [tag.text for tag in tags] == ["Ann · left", "Ann · right", "Ben · right"]
    assert len({tag.bar for tag in tags}) == 3
    assert tags_of_hands(tracked, (), flat) == []
    lost = tuple(replace(hand, state=HandState.LOST) for hand in tracked.hands)
    assert tags_of_hands(TrackedFrame(0, tracked.times, lost), ("Ann", "Ben"), flat) == []


def test_both_performers_are_drawn_each_in_a_skin_of_his_own(qtbot):
    view = Viewport()
    if view.failure:
        pytest.skip(view.failure)
    qtbot.addWidget(view)
    view.resize(700, 500)
    with qtbot.waitExposed(view):
        view.show()

    def drawn(*shown):
        with qtbot.waitSignal(view.drawn, timeout=20_000):
            view.show_frame(*shown)
        return view._surface._scene

    scene = drawn(*two(), (ANN, GLOVE))
    assert {key: hand.visible for key, hand in scene.hands.items()} == {
        (0, "left"): True, (0, "right"): True, (1, "left"): False, (1, "right"): True,
    }  # fmt: skip
    skins = [tuple(scene.hands[HandKey(*key)].view_program["u_color"]) for key in ((0, "right"), (1, "right"))]
    assert skins[0] != skins[1]
    assert "Ann · left" in view.legend_text
    scene = drawn(*sample(hand_frame("right", worn=ANN)), ANN)
    assert list(scene.hands) == [(0, "left"), (0, "right")] and "Right hand" in view.legend_text
