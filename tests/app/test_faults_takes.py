"""Damaged, crafted and hostile takes, opened by whatever opens takes: a right reading or one clear sentence, soon, in
little memory, and the same from everyone."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from tests.app.takes import write_take
from tests.data import CASES, ROOT, case_path

SECONDS = 10.0
"""Of the processor, and twice what is promised: a machine that runs other tests is slower by that."""
BYTES = 500e6

FAULTS = sorted(path.name for path in (CASES / "faults").glob("*.mcap")) or ["bomb_zstd_64x256MB_sealed.mcap"]

HELD = {
    "counts_2_40.mcap": "Its counts cannot be read.",
    "counts_huge_digits.mcap": "Its counts cannot be read.",
    "bomb_zstd_64x256MB_sealed.mcap": "unpacks to more than a take can hold",
    "bomb_zstd_64x256MB_scan.mcap": "unpacks to more than a take can hold",
    "mark_bad_proto.mcap": "1 mark cannot be read: A record of 8 bytes is not a Mark.",
    "sealed_summary_claims_2_62.mcap": "Its index does not lead to its records, though every one is readable.",
    "unsealed_claims_2_40.mcap": "109 bytes at byte 4592 are damaged.",
    "version_5000_digits.mcap": "has format version 999999999… (written by",
    "version_arabic_digits.mcap": "has format version \N{ARABIC-INDIC DIGIT NINE} (written by",
    "profile_deep_json.mcap": "200,000 deep",
}
"""What is to be said of some by `info` and `verify` alike."""


def opened(path: Path) -> dict[str, Any]:
    """How each way to open a file ended (tests.app.opened)."""
    done = subprocess.run(
        [sys.executable, "-m", "tests.app.opened", path],
        cwd=ROOT, capture_output=True, text=True, timeout=240, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    told: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return told


@pytest.fixture(scope="module")
def compiled(tmp_path_factory: pytest.TempPathFactory) -> None:
    """What is compiled once on a machine says nothing of a file."""
    opened(write_take(tmp_path_factory.mktemp("good"), "good", 3))


def judge(told: dict[str, Any]) -> None:
    """Every way ended as it may."""
    assert told.pop("bytes") < BYTES
    for name, way in told.items():
        assert way["code"] in (0, 1, 3), (name, way)
        assert "Traceback" not in way["text"] and "Unexpected" not in way["text"], (name, way)
        assert way["code"] != 1 or way["text"].strip(), name
        assert way["seconds"] < SECONDS, (name, way)


def same(told: dict[str, Any]) -> None:
    """`info`, `verify` and `recover` say the same of it, in the same words."""
    info, verify, recover = (json.loads(told[name]["text"].splitlines()[-1]) for name in ("info", "verify", "recover"))
    assert "Recover the take" not in told["recover"]["text"]
    if "error" in verify:
        assert info == verify == recover
        return
    problems = [one["text"] for one in verify["findings"] if one["level"] == "problem"]
    assert problems == info["problems"] and all(text in told["info"]["text"] for text in problems)
    assert all(info[of] == verify[of] for of in ("raw", "solved", "sealed", "counts", "format", "frames", "seconds"))
    assert info["verdict"] == verify["verdict"]
    assert told["info"]["code"] == told["verify"]["code"]
    if problems or not info["sealed"]:
        assert told["info"]["code"] == (3 if info["raw"] else 1)
    if "error" in recover:
        assert "holds no readable frame" in recover["error"] and info["raw"] == info["solved"] == 0
        assert not info["sealed"] or info["damage"]
        return
    assert recover["findings"] == problems
    assert (recover["recovered"], recover["recovered_solved"]) == (info["raw"], info["solved"])
    assert (recover["lost"], recover["lost_solved"]) == (info["lost_raw"], info["lost_solved"])
    assert (recover["recovered_take"] is None) == (info["sealed"] and not info["damage"])


@pytest.mark.parametrize("name", FAULTS)
def test_a_faulty_take(compiled: None, name: str) -> None:
    told = opened(case_path("faults", name))
    judge(told)
    same(told)
    for command in ("info", "verify"):
        assert HELD.get(name, "") in told[command]["text"], command
