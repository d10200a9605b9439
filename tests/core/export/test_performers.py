"""Several performers: every file tells their hands apart, and says of each what it would say of it alone."""

from __future__ import annotations

import csv
from dataclasses import replace
from functools import cache

import ezc3d
import numpy as np
import pygltflib
import pytest

from core.errors import ExportError
from core.frames import NO_POINT
from core.takes.export import FORMATS, ExportOptions, export
from core.takes.formats import read_recording
from core.takes.formats.bvh import read_bvh
from core.takes.solution import Solution
from tests.core.export.recordings import RATE, every_point, solution

NAMES = ("Anna Lena", "")
N = 90


@cache
def alone() -> tuple[Solution, Solution]:
    """Both hands with 19 markers; one glove with 13. Of the latter every point comes after those of the former."""
    first, second = solution(N), solution(N, "qualisys13")
    later = tuple(
        replace(
            frame,
            hands=tuple(
                replace(hand, performer=1, point=np.where(hand.point == NO_POINT, NO_POINT, hand.point + 38))
                for hand in frame.hands
            ),
        )
        for frame in second.solved
    )
    return first, replace(second, solved=later)


@cache
def together(names: tuple[str, ...] = NAMES) -> Solution:
    first, second = alone()
    raw = tuple(
        replace(
            a,
            points_m=np.concatenate([a.points_m, b.points_m]),
            ids=np.concatenate([a.ids, b.ids + 38]),
            residuals_m=np.concatenate([a.residuals_m, b.residuals_m]),
        )
        for a, b in zip(first.raw, second.raw, strict=True)
    )
    solved = tuple(replace(a, hands=(*a.hands, *b.hands)) for a, b in zip(first.solved, second.solved, strict=True))
    cast = tuple(replace(one.cast[0], performer=name) for one, name in zip(alone(), names, strict=True))
    return Solution("take 1", cast, RATE, raw, solved)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("together")
    paths = export(together(), list(FORMATS), folder, options=ExportOptions(joints=True))
    assert [path.name for path in paths] == [
        "take 1.c3d", "take 1.trc", "markers.csv", "angles.csv", "joints.csv", "points.csv",
        "take 1_Anna_Lena_left.bvh", "take 1_Anna_Lena_right.bvh", "take 1_2_right.bvh", "take 1.glb",
        "take 1_held.csv",
    ]  # fmt: skip
    return folder


def rows(path):
    with path.open(newline="") as stream:
        return list(csv.DictReader(stream))


@pytest.mark.parametrize("name", ["markers.csv", "angles.csv", "joints.csv"])
def test_csv_says_of_each_performer_what_it_says_of_him_alone(folder, tmp_path, name):
    whole = rows(folder / name)
    assert list(whole[0])[:4] == ["frame", "time_s", "performer", "hand"]
    for performer, one in zip(("Anna Lena", "2"), alone(), strict=True):
        nobody_else = tuple(
            replace(frame, hands=tuple(replace(hand, performer=0) for hand in frame.hands)) for frame in one.solved
        )
        export(replace(one, solved=nobody_else), ["csv"], tmp_path, overwrite=True)
        own = [{k: v for k, v in row.items() if k != "performer"} for row in whole if row["performer"] == performer]
        assert own == rows(tmp_path / name) and own
        assert "performer" not in rows(tmp_path / name)[0]
    assert {row["performer"] for row in whole} == {"Anna Lena", "2"}


@pytest.mark.parametrize("name", ["c3d", "trc"])
def test_labels_begin_with_the_performer(folder, tmp_path, name):
    whole = every_point(folder / f"take 1.{name}")
    assert read_recording(folder / f"take 1.{name}").labels == whole.labels[:51]
    markers = [profile.layout.marker_names for profile in together().cast]
    assert whole.labels[:51] == tuple(
        [f"Anna_Lena:{side}_{marker}" for side in "LR" for marker in markers[0]] + [f"2:R_{m}" for m in markers[1]]
    )
    assert whole.labels[51::21] == ("Anna_Lena:L_wrist_joint", "Anna_Lena:R_wrist_joint", "2:R_wrist_joint")
    assert len(set(whole.labels)) == len(whole.labels) == 51 + 3 * 21
    columns = [slice(0, 38), slice(38, 51)], [slice(51, 93), slice(93, 114)]
    for k, one in enumerate(alone()):
        own = replace(
            one, solved=[replace(f, hands=tuple(replace(h, performer=0) for h in f.hands)) for f in one.solved]
        )
        (path,) = export(own, [name], tmp_path, overwrite=True, options=ExportOptions(joints=True))
        expected = every_point(path).points_m
        got = np.concatenate([whole.points_m[:, columns[0][k]], whole.points_m[:, columns[1][k]]], axis=1)
        np.testing.assert_array_equal(got, expected)


def test_c3d_names_its_subjects_as_programs_of_studios_do(folder, tmp_path):
    parameters = ezc3d.c3d(str(folder / "take 1.c3d"))["parameters"]
    assert parameters["SUBJECTS"]["NAMES"]["value"] == ["Anna_Lena", "2"]
    assert parameters["SUBJECTS"]["LABEL_PREFIXES"]["value"] == ["Anna_Lena:", "2:"]
    assert parameters["SUBJECTS"]["USED"]["value"] == [2]
    (path,) = export(alone()[0], ["c3d"], tmp_path)
    assert "SUBJECTS" not in ezc3d.c3d(str(path))["parameters"]


def test_a_crowd_has_more_labels_than_one_parameter_holds(tmp_path):
    """Eight people, 304 markers: C3D keeps 255 in LABELS and the rest in LABELS2."""
    one = solution(4)
    solved = [
        replace(frame, hands=tuple(replace(h, performer=k) for k in range(8) for h in frame.hands))
        for frame in one.solved
    ]
    (path,) = export(Solution("crowd", one.cast * 8, RATE, one.raw, solved), ["c3d"], tmp_path)
    names = one.cast[0].layout.marker_names
    expected = tuple(f"{k}:{side}_{marker}" for k in range(1, 9) for side in "LR" for marker in names)
    assert read_recording(path).labels == expected and len(expected) == 304
    point = ezc3d.c3d(str(path))["parameters"]["POINT"]
    assert (*point["LABELS"]["value"], *point["LABELS2"]["value"]) == expected
    assert len(point["LABELS"]["value"]) == 255 == len(point["DESCRIPTIONS"]["value"])


def test_every_skeleton_has_names_of_its_own(folder, tmp_path):
    files = [folder / f"take 1_{whose}.bvh" for whose in ("Anna_Lena_left", "Anna_Lena_right", "2_right")]
    named = [read_bvh(file).names for file in files]
    assert [names[0] for names in named] == ["Anna_Lena_L_wrist", "Anna_Lena_R_wrist", "2_R_wrist"]
    assert len(set().union(*named)) == sum(map(len, named))
    (path,) = export(solution(N, "qualisys13"), ["bvh"], tmp_path)
    np.testing.assert_array_equal(read_bvh(path).values, read_bvh(files[2]).values)


def test_no_joint_of_bvh_holds_a_sign_that_three_js_takes_for_a_path(tmp_path):
    path, *_ = export(together(("Dr. A. [left-handed]", "")), ["bvh"], tmp_path)
    assert read_bvh(path).names[0] == "Dr__A___left-handed__L_wrist"


def test_the_scene_holds_every_hand_apart(folder):
    gltf = pygltflib.GLTF2().load(str(folder / "take 1.glb"))
    names = [node.name for node in gltf.nodes]
    assert len(set(names)) == len(names)
    roots = [names[i] for i in gltf.scenes[0].nodes]
    hands = ("Anna Lena left", "Anna Lena right", "2 right")
    assert roots == [f"{hand} {what}" for hand in hands for what in ("hand", "surface")]
    assert [gltf.meshes[gltf.nodes[i].mesh].primitives[0].material for i in gltf.scenes[0].nodes[1::2]] == [0, 0, 1]
    colours = [tuple(one.pbrMetallicRoughness.baseColorFactor) for one in gltf.materials]
    assert len(set(colours)) == 2


def test_names_that_files_and_joints_cannot_hold(tmp_path):
    paths = export(together(("a/b: c", "a<b\\ c")), ["bvh", "trc"], tmp_path)
    names = [path.name for path in paths]
    assert names == [
        "take 1_a_b_c_left.bvh",
        "take 1_a_b_c_right.bvh",
        "take 1_a_b_c_2_right.bvh",
        "take 1.trc",
        "take 1_held.csv",
    ]
    assert read_recording(paths[-2]).labels[0].startswith("a_b_c:L_")


def test_hands_of_a_performer_without_a_profile_are_refused(tmp_path):
    stranger = replace(together(), profiles=together().cast[:1])
    with pytest.raises(ExportError, match=r"take 1 holds hands of 2 performers, and the profiles of 1.*Solve it again"):
        export(stranger, ["csv"], tmp_path)
    assert not list(tmp_path.iterdir())
