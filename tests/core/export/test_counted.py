"""What exports say of the neutral trials that their angles count from; of several performers, whose."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from core.calibration.neutral import Neutral, NeutralHand
from core.profile import load_profile
from core.takes.export import ExportOptions, export_each
from core.takes.export.counted import neutral_words
from core.takes.made import profile_sha256
from tests.core.export.recordings import solution

TRIAL = NeutralHand(
    np.full(20, 0.25), np.full(20, 0.1), np.zeros(20), ("ring_dip_flexion",), "flat.c3d", 2.0, 4.0, "2026-03-01"
)
ANN = replace(load_profile("han19"), performer="Ann", neutral=Neutral({"right": TRIAL}))
BEN = replace(load_profile("qualisys13"), performer="Ben")
CARL = replace(load_profile("qualisys13"), neutral=Neutral({"right": replace(TRIAL, source="carl.trc")}))


def test_each_performer_is_named():
    assert neutral_words(()) == neutral_words((BEN,)) == ()
    assert neutral_words((ANN,)) == ("right angles from the neutral trial of flat.c3d, 2.0 to 4.0 s",)
    assert neutral_words((ANN, BEN, CARL)) == (
        "Ann: right angles from the neutral trial of flat.c3d, 2.0 to 4.0 s",
        "3: angles from the neutral trial of carl.trc, 2.0 to 4.0 s",
    )


@pytest.mark.parametrize("up", ["y", "z"])
def test_only_angles_csv_and_the_hand_of_the_trial_count_from_it(tmp_path, up):
    plain = solution(40)
    zeroed = replace(plain, profiles=replace(plain.cast[0], neutral=ANN.neutral))
    for name, one in (("plain", plain), ("zeroed", zeroed)):
        done = export_each(one, ["csv", "c3d", "bvh", "gltf"], tmp_path / name, options=ExportOptions(up=up))
        assert not done.failed
        assert done.neutral == list(neutral_words(one.cast))
    files = sorted(path.name for path in (tmp_path / "plain").iterdir())
    assert files == sorted(path.name for path in (tmp_path / "zeroed").iterdir())
    own, its = (profile_sha256(one.cast[0]).encode() for one in (plain, zeroed))
    differ = [
        f
        for f in files
        if (tmp_path / "plain" / f).read_bytes().replace(own, its) != (tmp_path / "zeroed" / f).read_bytes()
    ]
    assert len(differ) == 2 and differ[0] == "angles.csv" and differ[1].endswith("_export.json")
    before, after = (
        (tmp_path / name / "angles.csv").read_text(encoding="utf-8").splitlines() for name in ("plain", "zeroed")
    )
    assert before[0] == after[0]
    for one, two in zip(before[1:], after[1:], strict=True):
        cells, counted = one.split(","), two.split(",")
        if cells[2] == "left" or not cells[4]:
            assert cells == counted
            continue
        assert cells[:11] == counted[:11], "the wrist has no zero"
        np.testing.assert_allclose(np.array(counted[11:31], float), np.array(cells[11:31], float) - 0.25, atol=2e-9)
        stds = np.array(cells[37:57], float)
        np.testing.assert_allclose(np.array(counted[37:57], float), np.hypot(stds, 0.1), atol=2e-7)
    record = json.loads(next((tmp_path / "zeroed").glob("*_export.json")).read_text(encoding="utf-8"))
    told = {entry["file"]: entry.get("neutral") for entry in record["files"]}
    assert told.pop("angles.csv") == [
        {
            "performer": "", "hand": "right", "file": "flat.c3d", "from_s": 2.0, "to_s": 4.0, "date": "2026-03-01",
            "hidden": ["ring_dip_flexion"], "prior": [],
        }
    ]  # fmt: skip
    assert set(told.values()) == {None}


def test_nothing_is_said_of_trials_without_angles_csv(tmp_path):
    plain = solution(40)
    zeroed = replace(plain, profiles=replace(plain.cast[0], neutral=ANN.neutral))
    assert export_each(zeroed, ["c3d"], tmp_path).neutral == []
