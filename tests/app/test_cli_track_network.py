"""`phalanx track --network`: points named by a network of one's own, or by the one of Phalanx after all."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from core.profile import load_profile, save_profile
from tests.app.command import phalanx
from tests.app.hand_frames import hand_frame
from tests.data import ROOT

SHIPPED = ROOT / "resources" / "networks" / "labeller.onnx"


@pytest.fixture
def still(tmp_path: Path) -> Path:
    """A right hand that holds still for a third of a second, as a device sends it."""
    markers_m = hand_frame("right").markers_world_m
    rows = ["frame,time_s,id,x_m,y_m,z_m"]
    for i in range(40):
        rows += [f"{i},{i / 120},{k},{x:.6f},{y:.6f},{z:.6f}" for k, (x, y, z) in enumerate(markers_m)]
    path = tmp_path / "still.csv"
    path.write_text("\n".join(rows) + "\n", encoding="utf-8")
    return path


def test_the_network_asked_for_names_the_points(still: Path, tmp_path: Path) -> None:
    own, gone = tmp_path / "own.onnx", tmp_path / "gone.onnx"
    own.write_bytes(SHIPPED.read_bytes())
    profile = replace(load_profile("han19"), network=str(gone))
    save_profile(profile, tmp_path / "mine.json")
    words = ("track", still, "--profile", tmp_path / "mine.json", "--gaps", "live", "--json")
    refused = phalanx(*words, "--out", tmp_path / "a")
    assert refused.code == 1 and "gone.onnx" in refused.err and "--network shipped" in refused.err
    refused = phalanx(*words, "--network", still, "--out", tmp_path / "a")
    assert refused.code == 1 and "no network that can be run" in refused.err
    solved = {}
    for network in ("shipped", str(own)):
        ran = phalanx(*words, "--network", network, "--out", tmp_path / Path(network).stem)
        assert ran.code == 0, ran.err
        assert ran.figures["network"] == network
        solved[network] = (tmp_path / Path(network).stem / "still" / "markers.csv").read_text(encoding="utf-8")
    assert solved["shipped"] == solved[str(own)]
    named = [line.split(",") for line in solved["shipped"].splitlines()[1:]]
    last = [row for row in named if int(row[0]) == 39 and row[2] == "right"]
    assert [int(row[8]) for row in last] == list(np.arange(19))
