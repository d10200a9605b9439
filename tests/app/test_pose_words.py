from dataclasses import replace

import numpy as np
import pytest
from PySide6.QtCore import Qt

from app.panels.hand_card import HandCard, hidden_markers
from app.pose_words import angle_title, joint_words, least_sure, plus_minus_mm
from app.why_lost import state_in
from core.frames import HandState
from core.hand.skeleton import DOF_JOINTS, DOF_NAMES
from devices.device import Level
from tests.app.hand_frames import hand_frame, profile, sample

NAMES = profile().layout.marker_names


def std(degrees_by_name, otherwise=1.0):
    values = np.full(26, np.radians(otherwise))
    values[:3] = 0.0005
    for name, degrees in degrees_by_name.items():
        values[DOF_NAMES.index(name)] = np.radians(degrees)
    return values


@pytest.mark.parametrize("dof", range(6, 26))
def test_the_least_sure_joint_is_named(dof):
    name = DOF_NAMES[dof]
    digit, joint, _ = name.split("_")
    assert joint_words(DOF_JOINTS[dof - 6]) == f"{digit} {joint.upper()}"
    assert least_sure(std({name: 14.0}, otherwise=0.0)) == f"{digit} {joint.upper()} ±14°"


def test_both_angles_of_a_joint_and_the_wrist_count():
    assert least_sure(std({"index_mcp_flexion": 12, "index_mcp_abduction": 9, "pinky_dip_flexion": 14})) == (
        "index MCP ±15°"
    )
    far = std({"pinky_dip_flexion": 5})
    far[1] = 0.02
    assert least_sure(far) == "wrist ±20 mm"
    far[1], far[4] = 0.002, np.radians(7)
    assert least_sure(far) == "wrist ±7°"
    assert least_sure(np.full(26, np.nan)) == ""


@pytest.mark.parametrize(
    ("std_m", "words"),
    [(0.0124, " ±12 mm"), (0.001, " ±1 mm"), (0.00097, " ±1 mm"), (0.00064, " ±0.6 mm"), (float("nan"), "")],
)
def test_millimetres(std_m, words):
    assert plus_minus_mm(std_m) == words


def test_angle_titles():
    assert angle_title("thumb_cmc_abduction") == "Thumb CMC abduction"


def test_hidden_markers_carry_the_error_to_expect():
    hand = hand_frame("left", hidden=(3, 12))
    hand.marker_std_m[3] = 0.0092
    assert hidden_markers(hand, NAMES) == f"{NAMES[3]} ±9 mm, {NAMES[12]}"
    assert hidden_markers(hand_frame("left"), NAMES) == ""


def test_the_card_says_what_it_is_least_sure_of(qtbot):
    card = HandCard("Right hand")
    qtbot.addWidget(card)
    hand = hand_frame("right", hidden=(3,))
    card.show_hand(hand, NAMES)
    assert card.unsure.text() == "" and card.hidden.text() == f"Hidden: {NAMES[3]}"
    hand.theta_std[:] = std({"ring_dip_flexion": 4.0})
    card.show_hand(hand, NAMES)
    assert card.unsure.text() == "Least sure: ring DIP ±4°"
    assert card.unsure.property("level") == ""
    hand.theta_std[:] = std({"ring_dip_flexion": 30.0})
    card.show_hand(hand, NAMES)
    assert card.unsure.text() == "Least sure: ring DIP ±30°" and card.unsure.property("level") == "guess"
    hand.theta_std[:] = std({"ring_dip_flexion": 4.0})
    card.show_hand(hand, NAMES)
    assert card.unsure.text() == "Least sure: ring DIP ±26°", "doubt goes slowly"
    card.show_hand(hand_frame("right", state=HandState.LOST), NAMES)
    assert card.unsure.text() == ""
    hand.theta_std[:] = std({"index_pip_flexion": 8.0})
    card.show_hand(hand, NAMES)
    assert card.unsure.text() == "Least sure: index PIP ±8°", "nothing is left of before it was lost"


def test_the_card_tells_the_size_in_millimetres(qtbot):
    card = HandCard("Right hand")
    qtbot.addWidget(card)
    hand = replace(hand_frame("right"), scale=0.768)
    size = card.figures["Hand size"]
    card.show_hand(hand, NAMES, length_m=profile().hand.skeleton.length_m)
    assert size.text() == "0.768 (143 mm)"
    card.show_hand(replace(hand, state=HandState.LOST), NAMES, length_m=0.186)
    assert size.text() == "–"


def test_the_card_says_how_sure_its_labels_are(qtbot):
    card = HandCard("Right hand")
    qtbot.addWidget(card)
    labels = card.figures["Labels"]
    hand = hand_frame("right")
    card.show_hand(hand, NAMES)
    assert labels.text() == "–" and labels.property("level") == "", "takes of before do not know"
    for worst, level in ((0.97, ""), (0.7, "warning"), (0.2, "problem")):
        sure = np.full(19, 0.999)
        sure[5] = worst
        card.show_hand(replace(hand, label_confidence=sure), NAMES)
        mean = (18 * 0.999 + worst) / 19
        assert labels.text() == (">99 %" if mean > 0.995 else f"{100 * mean:.0f} %")
        assert labels.property("level") == level
        assert labels.toolTip().endswith(f"Least sure: {NAMES[5]} {100 * worst:.0f} %")


def test_the_card_says_why_a_hand_is_lost(qtbot):
    card = HandCard("Right hand")
    qtbot.addWidget(card)
    lost = hand_frame("right", state=HandState.LOST, hidden=tuple(range(19)))
    lost = replace(lost, why="too few markers")
    frame, solved = sample(lost, extra_m=lost.markers_world_m[:6])
    card.show_hand(solved.hands[0], NAMES, state_in(solved.hands[0], frame, solved, 3.1))
    assert card.state.text() == "Lost for 3 s: 6 of 19 markers seen, needs 12. Is the hand in view?"
    assert card.light.level is Level.PROBLEM and card.state.property("level") == "problem"
    doubted = replace(hand_frame("right"), why="searching")
    card.show_hand(doubted, NAMES)
    assert card.light.level is Level.WARNING and "labels" in card.state.text()


def test_the_card_asks_for_its_hand_to_be_searched(qtbot):
    card = HandCard("Right hand")
    qtbot.addWidget(card)
    with qtbot.waitSignal(card.search_asked):
        qtbot.mouseClick(card.again, Qt.MouseButton.LeftButton)
    assert "this hand" in card.again.toolTip() and card.again.accessibleName() == "Search right hand again"


@pytest.mark.parametrize("title", ["Performer 1 · left", "Performer 2 · right", "Right hand"])
def test_a_card_has_room_for_whose_hand_it_is(qtbot, title):
    """In the narrowest panel, with figures."""
    card = HandCard(title)
    qtbot.addWidget(card)
    sure = replace(hand_frame("right"), label_confidence=np.full(19, 0.999))
    card.show_hand(sure, NAMES, length_m=profile().hand.skeleton.length_m)
    card.rms.setText("12.3")
    assert card.minimumSizeHint().width() <= 290
    card.resize(290, card.sizeHint().height())
    card.show()
    qtbot.waitExposed(card)
    assert card.title.shown == title and card.again.isVisible()
