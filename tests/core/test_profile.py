import json
from dataclasses import replace

import numpy as np
import pytest

from core.errors import FormatError
from core.hand.model import template
from core.hand.shape import N_SHAPE, SHAPE_NAMES, HandShape
from core.motion.subspace import shipped_subspace, subspace_of
from core.profile import Profile, load_profile

SHAPE = HandShape(np.round(np.random.default_rng(1).uniform(0.8, 1.2, N_SHAPE), 6))


def test_a_profile_reads_back_as_it_was_written() -> None:
    before = replace(load_profile("qualisys13"), performer="Ada", scale=1.0, shape=SHAPE)
    after = Profile.from_json(before.to_json())
    assert after.to_json() == before.to_json()
    np.testing.assert_array_equal(after.shape.ratios, SHAPE.ratios)
    assert after.subspace is shipped_subspace("generic")
    assert json.loads(before.to_json())["subspace"] == "generic"


def test_a_subspace_of_its_own_is_written_out() -> None:
    own = subspace_of(np.random.default_rng(0).normal(0.3, 0.2, (50, 20)), "Ada's", dimensions=4)
    after = Profile.from_json(replace(load_profile("han19"), subspace=own).to_json()).subspace
    assert after.name == "Ada's"
    np.testing.assert_allclose(after.covariance(), own.covariance(), atol=1e-6)


def test_a_profile_of_version_1_is_a_generic_hand() -> None:
    data = load_profile("han19").to_dict() | {"version": 1, "scale": 0.9}
    del data["shape"], data["subspace"]
    profile = Profile.from_dict(data)
    np.testing.assert_array_equal(profile.shape.ratios, 1.0)
    assert profile.subspace is shipped_subspace("generic")
    np.testing.assert_allclose(profile.worn.positions_m, profile.layout.positions_m, atol=1e-15)
    skeleton = template().skeleton
    np.testing.assert_allclose(profile.hand.skeleton.joint_positions_m, skeleton.joint_positions_m, atol=1e-15)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"version": 5}, "version 5"),
        ({"shape": {"palm_width": 1.0}}, "must name every measure"),
        ({"shape": dict.fromkeys(SHAPE_NAMES, 1.0) | {"ring_middle": 2.5}}, "ring_middle 2.5"),
        ({"shape": dict.fromkeys(SHAPE_NAMES, 1.0) | {"palm_width": True}}, "palm_width True"),
        ({"subspace": "dancing"}, "'dancing' is not known"),
        ({"subspace": {"format": "phalanx-subspace", "version": 1}}, "cannot be read"),
        ({"subspace": 3}, "is not a subspace"),
    ],
)
def test_what_is_wrong_is_told(change: dict[str, object], told: str) -> None:
    with pytest.raises(FormatError, match=told):
        Profile.from_dict(load_profile("han19").to_dict() | change)


def test_markers_sit_on_the_shaped_hand() -> None:
    profile = replace(load_profile("han19"), shape=HandShape.uniform(1.1))
    np.testing.assert_allclose(profile.worn.positions_m, 1.1 * profile.layout.positions_m, atol=1e-15)


def test_a_network_goes_with_the_profile_and_only_such_a_profile_is_of_the_newer_version() -> None:
    plain = load_profile("han19")
    assert plain.to_dict()["version"] == 2 and "network" not in plain.to_dict()
    trained = replace(plain, network="/networks/mine.onnx")
    assert trained.to_dict()["version"] == 3
    assert Profile.from_json(trained.to_json()).network == "/networks/mine.onnx"
    assert Profile.from_json(plain.to_json()).network is None
    for wrong in (3, " ", ["a.onnx"]):
        with pytest.raises(FormatError, match=r"network .*\.onnx file, or leave it out"):
            Profile.from_dict(trained.to_dict() | {"network": wrong})
