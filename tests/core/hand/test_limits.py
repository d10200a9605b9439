"""Joint limits of one performer: in the profile, on the skeleton, and in whatever solves."""

from __future__ import annotations

from dataclasses import replace
from itertools import islice

import numpy as np
import pytest

from app.reconstruction.known_hands import made
from core.calibration.hand import calibrate_hand
from core.engine import Engine
from core.errors import FormatError
from core.gap_filling import filled
from core.hand.limits import JointLimits, limits_deg
from core.hand.model import template
from core.hand.skeleton import DIGIT_DOF_NAMES, N_ROOT_DOFS
from core.motion.performer import Performer
from core.motion.stream import MarkerStream
from core.profile import Profile, load_profile

TIGHT = {"index_mcp_flexion": [-5.0, 20.0], "middle_dip_flexion": [0.0, 12.5]}
HAN = load_profile("han19")
LIMITED = replace(HAN, limits=JointLimits.from_dict(TIGHT, "limits"))
ROWS = [DIGIT_DOF_NAMES.index(name) for name in TIGHT]


def test_a_profile_keeps_them_and_is_of_version_4_only_then() -> None:
    written = LIMITED.to_dict()
    assert written["version"] == 4 and written["limits"] == TIGHT
    again = Profile.from_json(LIMITED.to_json())
    assert again.limits == LIMITED.limits and again.to_json() == LIMITED.to_json()
    assert HAN.to_dict()["version"] == 2 and "limits" not in HAN.to_dict()
    assert replace(HAN, network="a.onnx").to_dict()["version"] == 3


def test_only_the_named_angles_change_and_the_template_does_not() -> None:
    ours, own = template().skeleton.limits_rad, LIMITED.hand.skeleton.limits_rad
    np.testing.assert_allclose(np.degrees(own[ROWS]), list(TIGHT.values()), atol=1e-12)
    others = np.delete(np.arange(20), ROWS)
    np.testing.assert_array_equal(own[others], ours[others])
    np.testing.assert_array_equal(HAN.hand.skeleton.limits_rad, ours)
    assert limits_deg(LIMITED.hand.skeleton) == limits_deg(template().skeleton) | TIGHT


def test_hands_of_other_limits_are_not_the_same() -> None:
    assert LIMITED.same_hands(replace(HAN, limits=JointLimits.from_dict(TIGHT, "limits")))
    assert not LIMITED.same_hands(HAN) and not HAN.same_hands(LIMITED)


@pytest.mark.parametrize(
    ("limits", "told"),
    [
        ([], "limits: \\[\\]"),
        ({"index_mcp": [0, 90]}, "'index_mcp' is no angle of a digit. Name one .* such as index_mcp_flexion"),
        ({"wrist_rx": [0, 90]}, "'wrist_rx' is no angle"),
        ({"index_mcp_flexion": [90, 0]}, "index_mcp_flexion \\[90, 0\\]"),
        ({"index_mcp_flexion": [10, 10.5]}, "1 degree apart"),
        ({"index_mcp_flexion": [-181, 0]}, "between -180 and 180"),
        ({"index_mcp_flexion": [0, 181]}, "between -180 and 180"),
        ({"index_mcp_flexion": [0, float("nan")]}, "nan"),
        ({"index_mcp_flexion": [True, 90]}, "True"),
        ({"index_mcp_flexion": [0, "90"]}, "'90'"),
        ({"index_mcp_flexion": [0]}, "\\[0\\]"),
        ({"index_mcp_flexion": 90}, "90"),
    ],
)
def test_what_is_wrong_is_told(limits: object, told: str) -> None:
    with pytest.raises(FormatError, match=told) as error:
        Profile.from_dict(HAN.to_dict() | {"version": 4, "limits": limits}, "anna.json")
    assert str(error.value).startswith("anna.json: its limits")


def test_engine_and_filled_gaps_keep_within_them() -> None:
    stream = MarkerStream(Performer(HAN), 120.0, hidden=0.2)
    frames = list(islice(stream.frames(), 300))
    free, bound = Engine(HAN), Engine(LIMITED)
    low, high = np.radians(list(TIGHT.values())).T
    beyond = 0
    for frame in frames:  # this hand does go further
        angles = np.array([hand.theta_rad[N_ROOT_DOFS:][ROWS] for hand in free.step(frame).hands])
        beyond += int(((angles < low - 0.05) | (angles > high + 0.05)).any())
    assert beyond > 30
    for shown in filled([bound.step(frame) for frame in frames], LIMITED):
        for hand in shown.hands:
            angles = hand.theta_rad[N_ROOT_DOFS:][ROWS]
            assert (angles >= low - 1e-12).all() and (angles <= high + 1e-12).all()


def test_calibration_keeps_them_and_its_poses_within_them(monkeypatch: pytest.MonkeyPatch) -> None:
    from core.calibration import hand as module

    seen = []

    class Watched(module.Bundle):  # type: ignore[misc, name-defined]
        def __init__(self, skeleton, *rest):  # type: ignore[no-untyped-def]
            seen.append(skeleton.limits_rad[ROWS])
            super().__init__(skeleton, *rest)

    monkeypatch.setattr(module, "Bundle", Watched)
    scene = made(1)
    found = calibrate_hand(scene.frames, replace(scene.given, limits=LIMITED.limits), labels=scene.labels, keyframes=20)
    assert found.profile.limits == LIMITED.limits
    assert seen
    np.testing.assert_allclose(np.degrees(seen[0]), list(TIGHT.values()), atol=1e-12)
