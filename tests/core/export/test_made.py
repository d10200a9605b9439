"""What exported files say of what they came from, read by libraries that are not ours where there is one."""

import hashlib
import json
from dataclasses import replace

import ezc3d
import pygltflib
import pytest

from core.profile import load_profile, save_profile
from core.takes.export import export
from core.takes.made import Made, file_sha256, profile_sha256
from tests.core.export.recordings import solution
from tests.core.export.test_performers import together

SOURCE = "5e" * 32
SETTINGS = {"labels": "as given in the file", "gaps": "fill"}


def exported(some, folder):
    """The group PHALANX of the C3D, the extras of the glTF's asset, what NAME_export.json says of the recording."""
    export(some, ["c3d", "gltf"], folder)
    (c3d,), (glb,), (record,) = folder.glob("*.c3d"), folder.glob("*.glb"), folder.glob("*_export.json")
    own = {name: one["value"] for name, one in ezc3d.c3d(str(c3d))["parameters"]["PHALANX"].items() if name[0] != "_"}
    extras = pygltflib.GLTF2().load(str(glb)).asset.extras
    return own, extras, json.loads(record.read_text(encoding="utf-8"))["recording"]


def test_source_profile_and_settings_are_in_c3d_gltf_and_the_record(tmp_path):
    sha256 = profile_sha256(load_profile("han19"))
    own, extras, said = exported(
        replace(solution(), file="s1.trc", made=Made(("ab" * 32,), SOURCE, SETTINGS)), tmp_path
    )
    assert own["SOURCE"] == ["s1.trc"] and own["SOURCE_SHA256"] == [SOURCE]
    assert own["LAYOUTS"] == ["han19"] and own["PROFILES_SHA256"] == ["ab" * 32]
    assert own["SETTINGS"] == ["labels: as given in the file", "gaps: fill"]
    assert extras["source"] == "s1.trc" and extras["source_sha256"] == SOURCE
    assert extras["profiles"] == [{"performer": "", "layout": "han19", "sha256": "ab" * 32}]
    assert extras["settings"] == "labels: as given in the file; gaps: fill"
    assert said["file_sha256"] == SOURCE and said["settings"] == SETTINGS
    assert [one["profile_sha256"] for one in said["performers"]] == ["ab" * 32] != [sha256]


@pytest.mark.parametrize("several", [False, True])
def test_of_a_take_the_profiles_are_known(tmp_path, several):
    some = together() if several else solution()
    own, extras, said = exported(some, tmp_path)
    hashes = [profile_sha256(profile) for profile in some.cast]
    assert own["PROFILES_SHA256"] == hashes == [one["sha256"] for one in extras["profiles"]]
    assert hashes == [one["profile_sha256"] for one in said["performers"]]
    assert not {"SOURCE", "SOURCE_SHA256", "SETTINGS"} & own.keys()
    assert not {"source", "source_sha256", "settings"} & extras.keys()
    assert not {"file_sha256", "settings"} & said.keys()


def test_the_hash_of_a_profile_is_that_of_its_file(tmp_path):
    profile = replace(load_profile("han19"), performer="Åsa", scale=1.03)
    save_profile(profile, tmp_path / "asa.json")
    assert profile_sha256(load_profile(tmp_path / "asa.json")) == profile_sha256(profile)
    found = hashlib.sha256((tmp_path / "asa.json").read_bytes()).hexdigest()
    assert file_sha256(tmp_path / "asa.json") == found == profile_sha256(profile)
    assert profile_sha256(replace(profile, scale=1.04)) != found
