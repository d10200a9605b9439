"""`phalanx track` on files whose labels are wrong in places."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

from app.commands.track import _line
from app.tracking_figures import TrackFigures
from core.frames import FloatArray
from tests.app.command import Ran, phalanx
from tests.data import case_path

CASE = ("files", "17-one-wrong-given-label-pulls-the-hand")


def tracked(name: str, out: Path, *more: str) -> tuple[Ran, FloatArray]:
    """What was said, and the angles of the digits (f, 20) [deg]."""
    ran = phalanx(
        "track", case_path(*CASE, f"{name}.trc"), "--profile", "han19", "--gaps", "live", "--out", out, "--json", *more
    )
    assert ran.code == 0, ran.err
    with (out / name / "angles.csv").open(newline="") as file:
        rows = [row for row in csv.DictReader(file) if row["hand"] == "right"]
    angles = [name for name in rows[0] if name.endswith(("_flexion", "_abduction"))]
    return ran, np.degrees([[float(row[name]) for name in angles] for row in rows])


@pytest.mark.parametrize("name", ["hand_spike", "hand_zero"])
def test_a_wrong_label_bends_no_digit(tmp_path: Path, name: str) -> None:
    """R_ThumbTip is 200 mm off, or at zero, in frames 61 to 80: as if nobody had named it; and then as ever."""
    _, right = tracked("hand", tmp_path / "right")
    ran, given = tracked(name, tmp_path / "given")
    _, unnamed = tracked("hand_spike", tmp_path / "unnamed", "--unlabelled")
    off_deg = np.abs(given - right)
    assert off_deg.shape == (240, 20)
    assert off_deg[:60].max() == 0.0
    assert off_deg[60:80].mean() <= np.abs(unnamed - right)[60:80].mean() + 0.001
    assert off_deg[60:80].mean() < 0.1
    assert off_deg[80:].max() < 0.01
    (file,) = ran.figures["files"]
    assert file["tracked"] == 1.0 and file["rms_m"] < 0.0001
    if name == "hand_spike":
        assert file["labels_left_out"] == {"R_ThumbTip": 20}
        assert "20 of 4,424 given labels left out: R_ThumbTip 20" in ran.out
        with (tmp_path / "given" / name / "markers.csv").open(newline="") as markers:
            tips = [row for row in csv.DictReader(markers) if row["marker"] == "ThumbTip" and row["hand"] == "right"]
        assert [int(row["frame"]) for row in tips if row["source"] == "predicted"] == list(range(61, 81))
    else:
        assert file["labels_left_out"] == {} and "labels as given" in ran.out


def test_the_line_names_labels_in_the_order_of_the_file() -> None:
    figures = TrackFigures(
        Path("a.trc"), 200, 2.0, 1.0, 0.001, labels_right=0.99, labelled_points=3800, labels_given=True,
        labels_left_out={"R_IndexTip": 1200, "R_ThumbTip": 3},
    )  # fmt: skip
    assert "1,203 of 3,800 given labels left out: R_IndexTip 1,200, R_ThumbTip 3" in _line(figures)
