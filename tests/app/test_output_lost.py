"""Where what a command prints cannot go: the status is that of what was done, and nobody is told of a fault."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.app.command import TIMEOUT_S
from tests.app.test_one_status import damaged, whole
from tests.data import ROOT

FULL = Path("/dev/full")
pytestmark = pytest.mark.skipif(not FULL.exists(), reason="needs a device that is full")


def ended(*words: object, stdout: int) -> tuple[int, str]:
    done = subprocess.run(
        [sys.executable, "-m", "app", *map(str, words)],
        cwd=ROOT, stdin=subprocess.DEVNULL, stdout=stdout, stderr=subprocess.PIPE, text=True, timeout=TIMEOUT_S,
        check=False,
    )  # fmt: skip
    assert "Traceback" not in done.stderr and "Exception" not in done.stderr, done.stderr
    return done.returncode, done.stderr


def nobody_reads(*words: object) -> tuple[int, str]:
    ours, theirs = os.pipe()
    os.close(ours)
    try:
        return ended(*words, stdout=theirs)
    finally:
        os.close(theirs)


def on_a_full_disk(*words: object) -> tuple[int, str]:
    with FULL.open("wb") as full:
        return ended(*words, stdout=full.fileno())


@pytest.fixture
def takes(tmp_path: Path) -> tuple[Path, Path]:
    good, bad = tmp_path / "good.mcap", tmp_path / "bad.mcap"
    whole(good)
    damaged(bad)
    return good, bad


@pytest.mark.parametrize("command", ["verify", pytest.param("info", marks=pytest.mark.long)])
def test_a_reader_who_has_gone_changes_no_status(takes: tuple[Path, Path], command: str) -> None:
    for take, status in zip(takes, (0, 3), strict=True):
        assert nobody_reads(command, take, "--json") == (status, "")
    code, said = nobody_reads(command, takes[0].with_name("absent.mcap"), "--json")
    assert code == 1 and len(said.splitlines()) == 1


@pytest.mark.parametrize("command", ["verify", pytest.param("info", marks=pytest.mark.long)])
def test_a_full_disk_is_said_in_one_sentence(takes: tuple[Path, Path], command: str) -> None:
    said = "phalanx: What was to be printed could not be written (No space left on device). Give it another place.\n"
    for take, status in zip(takes, (1, 3), strict=True):
        assert on_a_full_disk(command, take) == (status, said)


@pytest.mark.parametrize("where", [nobody_reads, on_a_full_disk])
def test_a_recording_has_the_status_of_its_take(tmp_path: Path, where) -> None:
    path = tmp_path / "a.mcap"
    source = tmp_path / "points.csv"
    rows = [f"{i},{i / 120:.4f},{j},0.{j},1.0,0.5" for i in range(60) for j in range(3)]
    source.write_text("frame,time_s,id,x_m,y_m,z_m\n" + "\n".join(rows) + "\n")
    code, said = where("record", "playback", "--file", source, "--out", path, "--json")
    told = subprocess.run(
        [sys.executable, "-m", "app", "verify", str(path)], cwd=ROOT, capture_output=True, timeout=TIMEOUT_S,
        check=False,
    )  # fmt: skip
    assert code == told.returncode in (0, 3), said
    assert ("No space left" in said) == (where is on_a_full_disk)


def test_output_that_was_closed_before_is_no_fault(takes: tuple[Path, Path]) -> None:
    command = f"{sys.executable} -m app verify {takes[0]} >&-"
    done = subprocess.run(["sh", "-c", command], cwd=ROOT, capture_output=True, timeout=TIMEOUT_S, check=False)
    assert done.returncode == 0 and not done.stderr


@pytest.mark.parametrize(
    "words",
    [
        ["export", "a.mcap", "--to", "csv", "--json", "--out"],
        ["prop", "add", "a.json", "--profile", "han19", "--json", "--out"],
        ["calibrate", "size", "M", "--profile", "han19", "--json", "--out"],
        ["record", "demo", "--json", "--out"],
    ],
    ids=lambda words: " ".join(words[:2]),
)
def test_a_refused_out_is_told_in_json_too(tmp_path: Path, words: list[str]) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    done = subprocess.run(
        [sys.executable, "-m", "app", *words, str(pipe)], cwd=ROOT, capture_output=True, text=True, timeout=TIMEOUT_S,
        check=False,
    )  # fmt: skip
    assert done.returncode == 1
    assert f"phalanx: {json.loads(done.stdout)['error']}\n" == done.stderr
    assert f"{pipe} is a pipe" in done.stderr
