"""The file of poses: a round trip, and one clear error for a broken one."""

from __future__ import annotations

import copy
import json

import numpy as np
import pytest

from core.errors import FormatError
from core.motion.library import LIBRARY
from core.motion.pose_file import poses_from_dict, poses_to_dict

WHOLE = poses_to_dict({name: LIBRARY[name] for name in ("rest_flat", "tripod")})


def test_round_trip() -> None:
    again = poses_from_dict(json.loads(json.dumps(poses_to_dict(LIBRARY))))
    assert list(again) == list(LIBRARY)
    for pose, other in zip(LIBRARY.values(), again.values(), strict=True):
        assert (pose.activity, pose.source, pose.contacts) == (other.activity, other.source, other.contacts)
        np.testing.assert_allclose(other.angles_rad, pose.angles_rad, atol=1e-12)
        if pose.prop is None:
            assert other.prop is None
            continue
        assert other.prop is not None
        assert other.prop.shape == pose.prop.shape
        np.testing.assert_allclose(other.prop.size_m, pose.prop.size_m, atol=1e-12)
        np.testing.assert_allclose(other.prop.transform_hand, pose.prop.transform_hand, atol=1e-4)
        rotation = other.prop.transform_hand[:3, :3]
        np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)


def test_poses_cannot_be_changed_by_accident() -> None:
    with pytest.raises(ValueError, match="read-only"):
        LIBRARY["rest_flat"].angles_rad[0] = 1.0


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda d: d.update(format="poses"), "is not a pose library"),
        (lambda d: d.update(version=2), "version 2; this Phalanx reads up to 1. Update Phalanx.$"),
        (lambda d: d.update(poses={}), "no list"),
        (lambda d: d["poses"].append(d["poses"][0]), "'rest_flat' stands there twice"),
        (lambda d: d["poses"][0].pop("source"), "'rest_flat' cannot be read .'source' is missing"),
        (lambda d: d["poses"][0].update(activity="chess"), "'chess' is none of rest, "),
        (lambda d: d["poses"][0]["digits_deg"].pop("ring"), "'ring' is missing"),
        (lambda d: d["poses"][0]["digits_deg"].update(index=[1, 2, 3]), "index .* is not 4 numbers"),
        (lambda d: d["poses"][0]["digits_deg"].update(index=[1, 2, 3, float("nan")]), "is not 4 numbers"),
        (lambda d: d["poses"][0]["digits_deg"].update(index=[1, 2, 3, "straight"]), "'rest_flat' cannot be read"),
        (lambda d: d["poses"][1]["prop"].update(shape="cone"), "'tripod' .*'cone'"),
        (lambda d: d["poses"][1]["prop"].update(size_mm=[-3.0]), "is not positive"),
        (lambda d: d["poses"][1]["prop"].update(quaternion_wxyz=[0, 0, 0, 0]), "'tripod' cannot be read"),
        (lambda d: d["poses"][1].update(contacts=["prop"]), "'tripod' cannot be read"),
        (lambda d: d["poses"].append(7), "pose 2"),
    ],
)
def test_a_broken_file_is_told_in_one_error(change, words: str) -> None:
    data = copy.deepcopy(WHOLE)
    change(data)
    with pytest.raises(FormatError, match=words):
        poses_from_dict(data)
