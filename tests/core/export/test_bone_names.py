"""Joints by the names of other programs."""

from dataclasses import replace
from pathlib import Path

import pytest

from core.errors import ExportError
from core.gltf import read_glb
from core.hand.skeleton import JOINT_NAMES, TIP_NAMES
from core.takes.export import ExportOptions, export
from core.takes.export.bone_names import BONE_SCHEMES, bone_names
from core.takes.formats.bvh import read_bvh
from tests.core.export.test_performers import together
from tests.core.export.test_props import PEN, with_props

DOCS = Path(__file__).parents[3] / "docs" / "joints.md"
RIGHT = {"vrm": "right", "unreal": "_r", "unity": "Right", "mixamo": ":Right", "mano": "right_", "phalanx": "R_"}


def test_the_table_of_the_docs_is_what_is_written():
    rows = [
        [cell.strip(" `") for cell in line.strip("|").split("|")] for line in DOCS.read_text("utf-8").splitlines()
        if line.startswith(("| `phalanx`", "| `L_"))
    ]  # fmt: skip
    schemes, *bones = rows
    assert schemes == list(BONE_SCHEMES)
    for scheme, column in zip(schemes, zip(*bones, strict=True), strict=True):
        names = bone_names(scheme, "left")
        assert column == names.joints + names.tips


@pytest.mark.parametrize("scheme", BONE_SCHEMES)
def test_every_bone_has_a_name_of_its_own_that_every_format_can_hold(scheme):
    sides = [bone_names(scheme, side, subject) for side in ("left", "right") for subject in ("", "Anna", "2")]
    names = [name for hand in sides for name in hand.joints + hand.tips]
    assert len(names) == 6 * 21 == len({name.casefold() for name in names})
    assert not any(set(name) & set(" \t/\\[].") for name in names)
    safe = ["".join(c for c in name if c not in "[].:/") for name in names]  # as three.js does
    assert len(set(safe)) == len(safe)
    assert all(RIGHT[scheme] in name for hand in sides[3:] for name in hand.joints + hand.tips)
    assert sides[1].joints[0] == f"Anna:{sides[0].joints[0]}"


def test_the_names_are_those_of_the_programs():
    """Some of each, as their own documents have them."""
    assert bone_names("phalanx", "left").joints == tuple(f"L_{name}" for name in JOINT_NAMES)
    assert bone_names("phalanx", "right").tips == tuple(f"R_{name}" for name in TIP_NAMES)
    thumbs = {scheme: bone_names(scheme, "right").joints[1:4] for scheme in BONE_SCHEMES}
    assert thumbs["vrm"] == ("rightThumbMetacarpal", "rightThumbProximal", "rightThumbDistal")
    assert thumbs["unity"] == ("RightThumbProximal", "RightThumbIntermediate", "RightThumbDistal")
    assert thumbs["unreal"] == ("thumb_01_r", "thumb_02_r", "thumb_03_r")
    assert thumbs["mixamo"] == tuple(f"mixamorig:RightHandThumb{i}" for i in (1, 2, 3))
    assert thumbs["mano"] == ("right_thumb1", "right_thumb2", "right_thumb3")
    assert bone_names("vrm", "left").joints[13] == "leftLittleProximal"


@pytest.mark.parametrize("scheme", BONE_SCHEMES)
def test_bvh_and_gltf_have_them_and_move_as_ever(tmp_path, scheme):
    options = ExportOptions(bones=scheme)
    files = export(together(), ["bvh", "gltf"], tmp_path, options=options)
    plain = export(together(), ["bvh", "gltf"], tmp_path / "plain")
    subjects = [("left", "Anna_Lena"), ("right", "Anna_Lena"), ("right", "2")]
    for file, own, (side, subject) in zip(files, plain, subjects, strict=False):
        names = tuple(f"{subject}_{name}" for name in bone_names(scheme, side).joints)  # no colon of ours in BVH
        read = read_bvh(file)
        assert tuple(name for name in read.names if not name.endswith(" end")) == names
        assert (read.values == read_bvh(own).values).all()
    glb = read_glb(files[3])
    nodes = [node["name"] for node in glb.document["nodes"]]
    assert len(set(nodes)) == len(nodes)
    for skin, (side, subject) in zip(glb.document["skins"], subjects, strict=True):
        named = bone_names(scheme, side, subject)
        assert tuple(nodes[joint] for joint in skin["joints"]) == named.joints + named.tips
    assert glb.buffer == read_glb(plain[3]).buffer


def test_no_other_name_is_known():
    with pytest.raises(ExportError, match=r"'ue6' is no way to name bones. Choose of phalanx, vrm, unreal, unity"):
        ExportOptions(bones="ue6")


def test_a_prop_that_is_called_like_a_bone_gets_another_name_in_gltf(tmp_path):
    pen = replace(PEN, name="R_wrist")
    source = with_props()
    solved = tuple(replace(f, props=tuple(replace(p, name="R_wrist") for p in f.props)) for f in source.solved)
    profile = replace(source.cast[0], props=(pen,))
    file, *_ = export(replace(source, profiles=profile, solved=solved), ["gltf"], tmp_path)
    names = [node["name"] for node in read_glb(file).document["nodes"]]
    assert names.count("R_wrist") == 1 and "R_wrist 2" in names
