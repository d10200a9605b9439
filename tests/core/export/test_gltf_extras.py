"""What a .glb file says of the take, of the hands and of their joints, read by a library that is not ours."""

from dataclasses import replace
from datetime import UTC, datetime

import numpy as np
import pygltflib
import pytest

from core.errors import ExportError
from core.hand.joint_axes import joint_axes
from core.hand.model import template
from core.takes.export import export, gltf_extras
from core.takes.take import Mark, TakeInfo, program_version
from tests.core.export.recordings import RATE, solution
from tests.core.export.test_performers import together

NOTES = "thumb slipped,\nsee 0:01 – 親指"
BEGUN = datetime(2026, 5, 4, 9, 30, tzinfo=UTC)
INFO = TakeInfo("take 1", "Anna", BEGUN, RATE, notes=NOTES, rating="alt", shot="12b")
MARKS = (Mark(0.5, "clap"), Mark(1.25, ""), Mark(float("nan"), "a clock that was lost"))


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    take = replace(solution(), info=INFO, marks=MARKS)
    path, *_ = export(take, ["gltf"], tmp_path_factory.mktemp("extras"))
    return pygltflib.GLTF2().load(str(path))


def test_scene_and_animation_tell_of_the_take(file):
    (animation,) = file.animations
    assert animation.name == file.scenes[0].name == "take 1"
    assert animation.extras == file.scenes[0].extras == {
        "take": "take 1", "rate_hz": RATE, "performer": "Anna", "shot": "12b", "rating": "alt", "notes": NOTES,
        "created_utc": "2026-05-04T09:30:00+00:00",
        "marks": [{"time_s": 0.5, "text": "clap"}, {"time_s": 1.25, "text": ""}],
    }  # fmt: skip


def test_the_asset_tells_program_version_unit_and_rate(file):
    assert file.asset.generator == f"Phalanx {program_version()}"
    facts = {"program": "Phalanx", "version": program_version(), "unit": "m", "up": "Y", "rate_hz": RATE}
    del file.asset.extras["profiles"]  # tests/core/export/test_made.py
    assert file.asset.extras == facts


def test_nothing_is_said_where_nothing_is_known(tmp_path):
    path, _ = export(solution(), ["gltf"], tmp_path)
    assert pygltflib.GLTF2().load(str(path)).animations[0].extras == {"take": "take 1", "rate_hz": RATE}


def test_each_hand_says_whose_it_is(tmp_path):
    path, _ = export(together(), ["gltf"], tmp_path)
    read = pygltflib.GLTF2().load(str(path))
    roots = {node.name: node.extras for node in read.nodes if node.name.endswith(" hand")}
    assert {name: (extras["performer"], extras["hand"]) for name, extras in roots.items()} == {
        "Anna Lena left hand": ("Anna Lena", "left"),
        "Anna Lena right hand": ("Anna Lena", "right"),
        "2 right hand": ("2", "right"),
    }
    assert read.animations[0].extras["performer"] == "Anna Lena, 2"


@pytest.mark.parametrize("side", ["left", "right"])
def test_each_joint_has_its_bone_and_axes(file, side):
    axes = joint_axes(template().skeleton, side)
    joints = [file.nodes[joint] for joint in file.skins[0 if side == "left" else 1].joints]
    for joint, node in enumerate(joints[:16]):
        np.testing.assert_allclose(node.extras["bone"], axes.bones[joint], atol=1e-12)
        for key, rows in (("flexion_axis", axes.flexion), ("abduction_axis", axes.abduction)):
            if np.isnan(rows[joint]).any():
                assert key not in node.extras
            else:
                np.testing.assert_allclose(node.extras[key], rows[joint], atol=1e-12)
        along = [file.nodes[child].translation for child in node.children]  # a bone leads to its only child
        if joint:
            np.testing.assert_allclose(along[0] / np.linalg.norm(along[0]), node.extras["bone"], atol=1e-9)
    assert [bool(node.extras) for node in joints[16:]] == [False] * 5


def test_a_file_that_tells_otherwise_is_refused(tmp_path, monkeypatch):
    said = iter([{"take": "take 2"}])
    honest = gltf_extras.of_take
    monkeypatch.setattr(gltf_extras, "of_take", lambda content: next(said, None) or honest(content))
    with pytest.raises(ExportError, match=r"take 1\.glb did not read back equal: what it says of the take differs"):
        export(solution(), ["gltf"], tmp_path)
