from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh

from core.errors import FormatError
from core.hand.model import template
from core.markers.layout import MarkerLayout, layout_names, load_layout
from core.profile import Profile, load_profile

COUNTS = {
    "han19": 19, "alexanderson13": 13, "schroeder17": 17, "schroeder8": 8, "schroeder6": 6, "pavllo9": 9,
    "qualisys13": 13,
}  # fmt: skip
FINGERS = ("Index", "Middle", "Ring", "Pinky")
HAN19_ORDER = [f"Thumb{part}" for part in ("CMC", "MCP", "IP", "Tip")]
HAN19_ORDER += [f"{finger}{part}" for finger in FINGERS for part in ("MCP", "PIP", "Tip")]
HAN19_ORDER += [f"BackHand{i}" for i in (1, 2, 3)]


def test_the_shipped_layouts() -> None:
    assert {name: len(load_layout(name).marker_names) for name in layout_names()} == COUNTS
    assert list(load_layout("han19").marker_names) == HAN19_ORDER
    assert load_layout("qualisys13").sides == ("right",)


@pytest.mark.parametrize("name", COUNTS)
def test_markers_sit_on_the_hand(name: str) -> None:
    """Within a glove and a marker of the surface, outside the flesh, and apart from each other."""
    layout, hand = load_layout(name), template()
    distance = np.linalg.norm(layout.positions_m[:, None] - hand.vertices_m[None], axis=2)
    assert distance.min(axis=1).max() < 0.018
    normals = trimesh.Trimesh(hand.vertices_m, hand.faces, process=False).vertex_normals
    nearest = distance.argmin(axis=1)
    above = np.einsum("ma,ma->m", layout.positions_m - hand.vertices_m[nearest], normals[nearest])
    assert above.min() > -0.001
    between = np.linalg.norm(layout.positions_m[:, None] - layout.positions_m[None], axis=2)
    assert between[~np.eye(len(between), dtype=bool)].min() > 0.010


@pytest.mark.parametrize("name", COUNTS)
def test_round_trips(name: str) -> None:
    profile = Profile("Ada", load_layout(name), ("left",), 1.07)
    back = Profile.from_json(profile.to_json())
    assert back.performer == "Ada"
    assert (back.sides, back.scale) == (("left",), 1.07)
    assert back.layout.marker_names == profile.layout.marker_names
    np.testing.assert_array_equal(back.layout.joints, profile.layout.joints)
    np.testing.assert_array_equal(back.layout.positions_m, profile.layout.positions_m)


def test_a_users_own_file(tmp_path: Path) -> None:
    layout = replace(load_layout("pavllo9"), name="my glove")
    file = tmp_path / "glove.json"
    file.write_text(json.dumps(layout.to_dict()), encoding="utf-8")
    assert load_layout(file).name == "my glove"
    profile = Profile("Ada", layout)
    (tmp_path / "ada.json").write_text(profile.to_json(), encoding="utf-8")
    assert load_profile(tmp_path / "ada.json").layout.name == "my glove"
    assert load_profile("pavllo9").scale is None
    assert load_profile(file).layout.name == "my glove"


GOOD = load_layout("pavllo9").to_dict()
MARKER = GOOD["markers"][0]


@pytest.mark.parametrize(
    ("data", "says"),
    [
        ([], "not a marker layout"),
        ({**GOOD, "format": "other"}, "not a marker layout"),
        ({**GOOD, "version": 2}, "version 2"),
        ({**GOOD, "markers": []}, "1 to 64 markers"),
        ({**GOOD, "markers": [MARKER] * 65}, "1 to 64 markers"),
        ({**GOOD, "markers": [MARKER, MARKER]}, "'LEHAR'"),
        ({**GOOD, "markers": [{**MARKER, "joint": "elbow"}]}, "elbow"),
        ({**GOOD, "markers": [{**MARKER, "position_m": [0, 1]}]}, "marker 1"),
        ({**GOOD, "markers": [{**MARKER, "position_m": [0, 0, float("nan")]}]}, "nan"),
        ({**GOOD, "markers": [{**MARKER, "position_m": [0, 0, 5]}]}, "5.0"),
        ({**GOOD, "markers": ["LEHAR"]}, "marker 1"),
        ({**GOOD, "sides": ["up"]}, "up"),
    ],
)
def test_a_bad_layout_is_one_clear_error(data: object, says: str) -> None:
    with pytest.raises(FormatError) as caught:
        MarkerLayout.from_dict(data, "Layout x")
    assert says in str(caught.value)
    assert "Layout x" in str(caught.value)


@pytest.mark.parametrize(
    "text", ["", "{", "[]", '{"format": "phalanx-profile"}', "\u0000", '{"format": "phalanx-profile", "version": 9}']
)
def test_a_bad_profile_is_one_clear_error(tmp_path: Path, text: str) -> None:
    file = tmp_path / "p.json"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(FormatError) as caught:
        load_profile(file)
    assert "p.json" in str(caught.value)
    assert caught.value.action


@pytest.mark.parametrize("scale", [0.1, 9, "big", True, float("inf")])
def test_a_hand_of_no_human_size_is_refused(scale: object) -> None:
    data = {**Profile("", load_layout("pavllo9")).to_dict(), "scale": scale}
    with pytest.raises(FormatError, match="hand scale"):
        Profile.from_dict(data)


def test_a_profile_that_is_not_there_names_the_layouts(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match=r"none\.json cannot be read \(No such file or directory\)\. .*han19"):
        load_profile(tmp_path / "none.json")
    (tmp_path / "binary").write_bytes(b"\xff\xfe\x00\x80")
    with pytest.raises(FormatError, match="cannot be read"):
        load_profile(tmp_path / "binary")
