import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from core.errors import FormatError
from core.profile import Profile, load_profile
from core.props.prop import Prop, load_prop, save_prop
from tests.core.props.things import BALL, PEN, SQUARE, pose


@pytest.mark.parametrize("prop", [PEN, BALL, SQUARE], ids=lambda prop: prop.name)
def test_a_prop_reads_back_as_it_was_written(prop: Prop, tmp_path: Path) -> None:
    save_prop(prop, tmp_path / "prop.json")
    again = load_prop(tmp_path / "prop.json")
    assert again.to_dict() == prop.to_dict()
    assert again.model == prop.model and again.name == prop.name
    np.testing.assert_allclose(again.markers_m, prop.markers_m, atol=5e-7)


def test_markers_are_placed_by_the_pose() -> None:
    transform = pose(np.random.default_rng(1))
    by_hand = [(transform @ [*marker, 1.0])[:3] for marker in PEN.markers_m]
    np.testing.assert_allclose(PEN.placed_m(transform), by_hand, atol=1e-15)
    assert PEN.marker_names == ("pen1", "pen2", "pen3", "pen4", "pen5")


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"format": "pen"}, "is not a prop"),
        ({"version": 2}, "version 2"),
        ({"name": " "}, "name ' '"),
        ({"markers_m": [[0, 0, 0], [0.1, 0, 0]]}, "2x3"),
        ({"markers_m": [[0, 0], [0.1, 0], [0, 1]]}, "not a list of 3"),
        ({"markers_m": "none"}, "cannot be read"),
        ({"markers_m": [[0, 0, 0], [0.1, 0, 0], [0, float("nan"), 1]]}, "nan is not a number"),
        ({"markers_m": [[0, 0, 0], [0.1, 0, 0], [0, 3, 1]]}, "further than 2 m"),
        ({"markers_m": [[0, 0, 0], [0.1, 0, 0], [0.001, 0, 0]]}, "markers 1 and 3 are 1.0 mm apart"),
        ({"markers_m": [[0, 0, 0], [0.1, 0, 0], [0.2, 0.001, 0]]}, "of one line"),
        ({"model": {"shape": "cone", "size_m": []}}, "cone"),
        ({"model": {"shape": "box", "size_m": [0.1, 0.1]}}, "3 lengths"),
        ({"model": {"shape": "sphere", "size_m": [-1.0]}}, "1 lengths above 0"),
        ({"model": {"shape": "sphere", "size_m": ["a"]}}, "of a sphere"),
    ],
)
def test_what_is_wrong_is_told(change: dict[str, Any], told: str) -> None:
    with pytest.raises(FormatError, match=told):
        Prop.from_dict(PEN.to_dict() | change)


def test_a_profile_holds_props() -> None:
    profile = replace(load_profile("han19"), props=(PEN, BALL))
    again = Profile.from_json(profile.to_json())
    assert again.to_json() == profile.to_json()
    assert [prop.to_dict() for prop in again.props] == [PEN.to_dict(), BALL.to_dict()]
    thicker = replace(PEN, model=replace(PEN.model, size_m=(0.02, 0.15)))
    assert [prop.model for prop in profile.with_prop(thicker).props] == [BALL.model, thicker.model]


def test_an_older_profile_has_none() -> None:
    data = load_profile("han19").to_dict()
    del data["props"]
    assert Profile.from_dict(data).props == ()


def test_two_props_need_two_names() -> None:
    data = replace(load_profile("han19"), props=(PEN, PEN)).to_dict()
    with pytest.raises(FormatError, match="'pen' stands there twice"):
        Profile.from_dict(json.loads(json.dumps(data)))
