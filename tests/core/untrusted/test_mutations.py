"""Good files of every format of ours, spoilt: what comes out is a result or one of Phalanx' own errors."""

from __future__ import annotations

import io
import json
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from core.calibration.neutral import Neutral, NeutralHand
from core.errors import PhalanxError
from core.hand.imports import mano
from core.hand.limits import JointLimits
from core.hand.model import template
from core.labelling.network import LabelNetwork
from core.markers.layout import load_layout
from core.motion.subspace import load_subspace, shipped_subspace, subspace_of
from core.profile import load_profile
from core.props.prop import Prop, PropModel, load_prop
from core.training.labelled import read_labelled
from core.untrusted.json_text import read_json
from tests.core.hand.imports.files import dense, mano_arrays
from tests.core.untrusted.mutations import mutations
from tests.data import ROOT

HAN19 = load_layout("han19")
LONGEST_S = 60.0  # of one file, on a busy machine; none takes half a second


def text(data: object) -> bytes:
    return json.dumps(data, indent=1).encode()


def npz(**arrays: object) -> bytes:
    stream = io.BytesIO()
    np.savez_compressed(stream, **arrays)
    return stream.getvalue()


def profile() -> bytes:
    random = np.random.default_rng(0)
    trial = NeutralHand(np.full(20, 0.1), np.full(20, 0.01), np.zeros(20), (), "flat.c3d", 0.0, 1.0, "2026-05-31")
    prop = Prop("pen", random.uniform(-0.1, 0.1, (4, 3)), PropModel("cylinder", (0.01, 0.15)), np.eye(3))
    made = replace(
        load_profile("han19"),
        performer="Ada",
        scale=1.01,
        subspace=subspace_of(random.normal(0.3, 0.2, (50, 20)), "Ada's", dimensions=3),
        props=(prop,),
        network="own.onnx",
        neutral=Neutral({"left": trial}),
        limits=JointLimits((("index_mcp_flexion", -20.0, 95.0),)),
    )
    return made.to_json().encode()


def prop() -> bytes:
    return text(Prop("box", np.eye(3) * 0.1, PropModel("box", (0.1, 0.1, 0.2)), np.eye(3)).to_dict())


def labelled() -> bytes:
    points = np.repeat(HAN19.positions_m[None].astype(np.float32), 30, axis=0)
    return npz(points=points, hand=np.ones(30, np.uint8), marker_names=np.array(HAN19.marker_names))


def settings() -> bytes:
    profile_data = json.loads(profile())
    return text({"window/layout": "AAAA", "takes/folder": "/takes", "profile/whole": profile_data, "view/axes": True})


def mano_hand() -> bytes:
    hand = template()
    return npz(**mano_arrays(hand.vertices_m, hand.faces, dense(hand), hand.skeleton.joint_positions_m))


READERS: dict[str, tuple[str, Callable[[], bytes], Callable[[Path], object], int]] = {
    "layout": ("json", lambda: text(HAN19.to_dict()), load_layout, 400),
    "profile": ("json", profile, load_profile, 400),
    "profile of a layout": ("json", lambda: text(HAN19.to_dict()), load_profile, 100),
    "prop": ("json", prop, load_prop, 400),
    "subspace": ("json", lambda: text(shipped_subspace("generic").to_dict()), load_subspace, 400),
    "settings": ("json", settings, lambda path: read_json(path, "Settings", ""), 300),
    "labelled": ("npz", labelled, lambda path: read_labelled(path, HAN19), 400),
    "mano": ("npz", mano_hand, mano.read_rig, 200),
    "network": ("onnx", (ROOT / "resources" / "networks" / "labeller.onnx").read_bytes, LabelNetwork, 12),
}


@pytest.mark.parametrize("kind", READERS)
def test_of_a_spoilt_file_comes_a_result_or_an_error_of_ours(kind: str, tmp_path: Path) -> None:
    suffix, good, read, count = READERS[kind]
    path = tmp_path / f"spoilt.{suffix}"
    path.write_bytes(good())
    read(path)
    refused = 0
    for n, data in enumerate(mutations(path.read_bytes(), count, seed=len(kind), is_text=suffix == "json")):
        path.write_bytes(data)
        began = time.monotonic()
        try:
            read(path)
        except PhalanxError as error:
            refused += 1
            assert error.what and len(str(error)) < 2000, (n, error)
        except Exception as error:
            raise AssertionError(f"mutation {n} of {kind}") from error
        assert time.monotonic() - began < LONGEST_S, n
    assert refused >= count / 4
