"""What each shipped layout can tell, checked against which bones carry its markers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from core.hand.skeleton import DOF_NAMES, JOINT_NAMES
from core.markers.layout import layout_names, load_layout
from core.observability import Observability, not_told, observability
from core.profile import Profile, load_profile

WORDS = {
    "alexanderson13": (
        "IP of the thumb is posture statistics: one marker tells MCP and IP.",
        "MCP flexion of the thumb is measured in 86 % of usual postures, posture statistics in the others: one marker "
        "tells MCP and IP.",
        "DIP of the index, middle and ring fingers is measured in 59 to 81 % of usual postures, posture statistics in "
        "the others: markers sit close to the joints.",
    ),
    "han19": (
        "DIP of the index, middle and ring fingers is measured in 61 to 81 % of usual postures, posture statistics in "
        "the others: markers sit close to the joints.",
    ),
    "pavllo9": (
        "MCP, PIP and DIP of the index finger are posture statistics: three coordinates, four angles.",
        "PIP and DIP of the middle, ring and little fingers are posture statistics: three coordinates, four angles.",
        "MCP flexion of the middle, ring and little fingers is measured in 58 to 65 % of usual postures, posture "
        "statistics in the others: three coordinates, four angles.",
    ),
    "qualisys13": (
        "DIP of the index finger is measured in 72 % of usual postures, posture statistics in the others: one marker "
        "tells PIP and DIP.",
        "PIP and DIP of the middle, ring and little fingers are measured in 59 to 86 % of usual postures, posture "
        "statistics in the others: one marker tells PIP and DIP.",
    ),
    "schroeder17": (
        "The back of the hand has two markers: how the wrist turns is told with the help of the digits' markers.",
    ),
    "schroeder6": (
        "The back of the hand has two markers: how the wrist turns is told with the help of the digits' markers, in "
        "81 % of usual postures by the points alone.",
        "CMC flexion, MCP and IP of the thumb are posture statistics: three coordinates, four angles.",
        "CMC abduction of the thumb is measured in 87 % of usual postures, posture statistics in the others: three "
        "coordinates, four angles.",
        "MCP, PIP and DIP of the index, middle and little fingers are posture statistics: three coordinates, four "
        "angles.",
        "MCP abduction of the index, middle and little fingers is measured in 76 to 87 % of usual postures, posture "
        "statistics in the others: three coordinates, four angles.",
        "All four angles of the ring finger are posture statistics: no marker moves with them.",
    ),
    "schroeder8": (
        "The back of the hand has two markers: how the wrist turns is told with the help of the digits' markers.",
        "IP of the thumb is posture statistics: one marker tells MCP and IP.",
        "MCP flexion of the thumb is measured in 75 % of usual postures, posture statistics in the others: one marker "
        "tells MCP and IP.",
        "MCP, PIP and DIP of the index, middle, ring and little fingers are posture statistics: three coordinates, "
        "four angles.",
        "MCP abduction of the middle, ring and little fingers is measured in 83 to 89 % of usual postures, posture "
        "statistics in the others: three coordinates, four angles.",
    ),
}


def with_markers(*names: str) -> Profile:
    """schroeder17 with these markers alone."""
    full = load_layout("schroeder17")
    rows = [full.marker_names.index(name) for name in names]
    layout = replace(
        full, name="some", marker_names=names, joints=full.joints[rows], positions_m=full.positions_m[rows]
    )
    return Profile("", layout)


def share(told: Observability, name: str) -> float:
    return told.angles[DOF_NAMES.index(name)].share


def test_every_shipped_layout_is_here() -> None:
    assert set(WORDS) == set(layout_names())


@pytest.mark.parametrize("layout", WORDS)
def test_what_a_shipped_layout_tells(layout: str) -> None:
    profile = load_profile(layout)
    told = observability(profile)
    assert told.words == WORDS[layout]
    assert not_told((profile, profile)) == tuple(f"{layout}: {words}" for words in WORDS[layout])
    form = told.to_dict()
    assert list(form["angles"]) == list(DOF_NAMES) and form["words"] == list(told.words)
    bones = [JOINT_NAMES[joint] for joint in profile.layout.joints]
    for angle in told.angles:
        digit, joint, *_ = angle.name.split("_")
        beyond = JOINT_NAMES[JOINT_NAMES.index(f"{digit}_{joint}") :][:3] if digit != "wrist" else bones
        if not any(bone.startswith(digit) and bone in beyond for bone in bones) and digit != "wrist":
            assert angle.share == 0.0, angle  # nothing that is seen moves with it
        assert angle.measured or any(
            word in " ".join(told.words) for word in (joint.upper(), "All four angles", "wrist turns")
        )


@pytest.mark.parametrize("layout", WORDS)
def test_a_finger_with_three_coordinates_never_tells_its_four_angles(layout: str) -> None:
    profile = load_profile(layout)
    told = observability(profile)
    for finger in ("index", "middle", "ring", "pinky"):
        n = sum(JOINT_NAMES[joint].startswith(finger) for joint in profile.layout.joints)
        flexions = [share(told, f"{finger}_{joint}_flexion") for joint in ("mcp", "pip", "dip")]
        assert (min(flexions) < 0.05) == (n < 2), (finger, flexions)


def test_a_finger_without_a_marker_on_its_last_bone_says_so() -> None:
    thumb = ("thumb_metacarpal", "thumb_proximal", "thumb_tip")
    index = ("index_proximal", "index_middle")
    others = [f"{f}_{bone}" for f in ("middle", "ring", "pinky") for bone in ("proximal", "middle", "tip")]
    told = observability(with_markers("wrist_radial", "wrist_ulnar", *thumb, *index, *others))
    assert told.words[1:] == ("DIP of the index finger is posture statistics: no marker moves with it.",)
    assert share(told, "index_dip_flexion") == 0.0 and share(told, "index_pip_flexion") == 1.0


def test_a_bare_back_leaves_the_wrist_to_the_digits() -> None:
    tips = ("thumb_tip", "index_tip", "middle_tip", "ring_tip", "pinky_tip")
    told = observability(with_markers(*tips))
    assert told.words[0].startswith("The back of the hand has no markers: how the wrist turns is told with the help of")
    assert min(angle.share for angle in told.angles[:6]) < 0.5


def test_three_markers_on_one_line_do_not_tell_how_the_wrist_turns_about_it() -> None:
    han = load_profile("han19")
    back = [name.startswith("Back") for name in han.layout.marker_names]
    positions_m = han.layout.positions_m.copy()
    positions_m[back] = np.outer([0.0, 0.5, 1.0], [0.0, 0.0, -0.04]) + [0.0, 0.03, -0.02]
    told = observability(replace(han, layout=replace(han.layout, positions_m=positions_m)))
    assert told.words[0].startswith("The back of the hand has three markers on one line:")
    assert not observability(han).words[0].startswith("The back")


def test_closer_points_tell_more() -> None:
    """The stated deviation is of points of 1 mm: with 19 markers a few degrees, where nothing is seen the width of the
    joint's range."""
    dense, sparse = observability(load_profile("han19")), observability(load_profile("schroeder6"))
    assert np.degrees(dense.angles[DOF_NAMES.index("ring_mcp_flexion")].std) < 3.0
    limits = load_profile("schroeder6").hand.skeleton.limits_rad[13]
    unseen = sparse.angles[DOF_NAMES.index("ring_mcp_flexion")].std
    assert unseen == pytest.approx((limits[1] - limits[0]) / np.sqrt(12.0), rel=1e-6)
