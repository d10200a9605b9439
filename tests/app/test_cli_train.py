"""`phalanx train labeller`: a network in a file that Phalanx runs, and plain words where it cannot be made."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from core.labelling.network import LabelNetwork
from core.markers.layout import load_layout
from tests.app.command import phalanx
from tests.data import ROOT

LAYOUT = load_layout("alexanderson13")


def needs_torch() -> None:
    for package in ("torch", "onnx"):
        pytest.importorskip(package, reason="needs the extra train")


@pytest.fixture
def recordings(tmp_path: Path) -> Path:
    folder = tmp_path / "mine"
    folder.mkdir()
    points = LAYOUT.positions_m + np.random.default_rng(0).normal(0.0, 0.001, (30, 13, 3))
    np.savez(folder / "own.npz", points=points, hand=np.ones(30), marker_names=np.array(LAYOUT.marker_names))
    return folder


def test_seconds_of_training_make_a_network_that_runs_and_its_card(tmp_path: Path, recordings: Path) -> None:
    needs_torch()
    out = tmp_path / "own.onnx"
    ran = phalanx("train", "labeller", "--layout", "alexanderson13", "--data", recordings, "--minutes", "0.05",
                  "--threads", 1, "--seed", 3, "--out", out, "--json")  # fmt: skip
    assert ran.code == 0, ran.err
    assert "minutes left" in ran.err and "loss" in ran.err
    card = json.loads(out.with_suffix(".json").read_text(encoding="utf-8"))
    assert card["seed"] == "3" and card["layouts"] == "alexanderson13" and "own.npz" in card["data"]
    assert ran.figures["budget"] == card["budget"] and card["budget"]["clouds"] > 0
    hand = LabelNetwork(out).name(LAYOUT.positions_m, LAYOUT, "right")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["mine", "own.json", "own.onnx"]
    assert hand.point.shape == (13,)

    again = tmp_path / "again.onnx"
    ran = phalanx("train", "labeller", "--layout", "alexanderson13", "--from", out, "--minutes", "0.02",
                  "--threads", 1, "--seed", 4, "--out", again)  # fmt: skip
    assert ran.code == 0, ran.err
    told = json.loads(again.with_suffix(".json").read_text(encoding="utf-8"))["started from"]
    assert told == {"seed": "3", "budget": card["budget"]}


def test_ctrl_c_keeps_the_best_so_far(tmp_path: Path) -> None:
    needs_torch()
    out = tmp_path / "own.onnx"
    words = ["train", "labeller", "--minutes", "0.9", "--threads", "1", "--out", str(out)]
    with subprocess.Popen(
        [sys.executable, "-m", "app", *words], cwd=ROOT, stderr=subprocess.PIPE, text=True
    ) as command:
        assert command.stderr is not None
        for line in command.stderr:
            if "loss" in line:
                break
        command.send_signal(signal.SIGINT)
        command.communicate(timeout=120)
    assert command.returncode == 0 and LabelNetwork(out).about["seed"] == "0"


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--minutes", "0"], "--minutes 0"),
        (["--threads", "0"], "--threads 0"),
        (["--layout", "nobody"], "nobody"),
        (["--data", "."], "--layout"),
        (["--layout", "han19", "--data", "/nowhere/at/all"], "/nowhere/at/all"),
        (["--architecture", "han2018"], "--layout"),
        (["--architecture", "han2018", "--layout", "han19", "--from", "n.onnx"], "--from"),
    ],
)
def test_what_cannot_be_trained_is_said_in_a_line(tmp_path: Path, words: list[str], said: str) -> None:
    ran = phalanx("train", "labeller", *words, "--out", tmp_path / "own.onnx")
    assert ran.code == 1 and said in ran.err and ran.err.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_recordings_can_be_left_out_to_measure_on(tmp_path: Path, recordings: Path) -> None:
    words = ("train", "labeller", "--layout", "alexanderson13", "--data", recordings, "--out", tmp_path / "n.onnx")
    ran = phalanx(*words, "--without", "other.npz")
    assert ran.code == 1 and "other.npz" in ran.err and "own.npz" in ran.err
    ran = phalanx(*words, "--without", "own.npz")
    assert ran.code == 1 and "holds no recording" in ran.err


def test_where_it_cannot_be_written_is_said_before_any_work(tmp_path: Path) -> None:
    for out, said in ((tmp_path / "network.bin", ".onnx"), (tmp_path / "no" / "n.onnx", "not there")):
        ran = phalanx("train", "labeller", "--out", out)
        assert ran.code == 1 and said in ran.err


def test_the_card_never_replaces_the_layout(tmp_path: Path) -> None:
    worn = tmp_path / "glove.json"
    worn.write_text(json.dumps(LAYOUT.to_dict()), encoding="utf-8")
    before = worn.read_bytes()
    ran = phalanx("train", "labeller", "--layout", worn, "--minutes", "0.05", "--out", tmp_path / "glove.onnx")
    assert ran.code == 1 and "glove.json would replace the layout" in ran.err
    assert worn.read_bytes() == before and list(tmp_path.iterdir()) == [worn]


def test_a_folder_without_markers_of_the_layout_is_refused(tmp_path: Path) -> None:
    (tmp_path / "mine").mkdir()
    ran = phalanx("train", "labeller", "--layout", "han19", "--data", tmp_path / "mine", "--out", tmp_path / "n.onnx")
    assert ran.code == 1 and "han19" in ran.err and "mine" in ran.err
