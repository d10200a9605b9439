"""`phalanx prop`: from a recording to a prop, a profile, and back to the screen."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from core.profile import load_profile
from core.props.prop import load_prop
from tests.app.command import phalanx
from tests.core.props.things import PEN, path


def write_points(file: Path, n: int = 40) -> None:
    lines = ["frame,time_s,id,x_m,y_m,z_m"]
    for i in range(n):
        points = np.concatenate([PEN.placed_m(path(i / 100.0)), [[0.0, 1.0, 0.5]]])
        lines += [f"{i},{i / 100.0:.4f},{11 + k},{x:.7f},{y:.7f},{z:.7f}" for k, (x, y, z) in enumerate(points)]
    file.write_text("\n".join(lines) + "\n")


def test_a_prop_is_defined_added_and_shown(tmp_path: Path) -> None:
    write_points(tmp_path / "points.csv")
    made = phalanx(
        "prop", "define", tmp_path / "points.csv", "--points", "11,12,13,14,15", "--name", "pen",
        "--model", "cylinder", "--size-mm", "10,150", "--out", tmp_path / "pen.json", "--json",
    )  # fmt: skip
    assert made.code == 0, made.err
    assert made.figures["frames"] == 40 and made.figures["rms_mm"] < 1e-3
    pen = load_prop(tmp_path / "pen.json")
    between = np.linalg.norm(pen.markers_m[:, None] - pen.markers_m, axis=2)
    np.testing.assert_allclose(between, np.linalg.norm(PEN.markers_m[:, None] - PEN.markers_m, axis=2), atol=3e-6)

    added = phalanx("prop", "add", tmp_path / "pen.json", "--profile", "han19", "--out", tmp_path / "ann.json")
    assert added.code == 0, added.err
    (held,) = load_profile(tmp_path / "ann.json").props
    assert held.to_dict() == pen.to_dict()
    shown = phalanx("prop", "show", tmp_path / "pen.json")
    assert "pen: 5 markers, a cylinder of 10.0 x 150.0 mm" in shown.out


def test_what_cannot_be_a_prop_is_told(tmp_path: Path) -> None:
    write_points(tmp_path / "points.csv")
    rest = ("--name", "pen", "--out", tmp_path / "pen.json")
    loose = phalanx("prop", "define", tmp_path / "points.csv", "--points", "11,12,16", *rest)
    assert loose.code == 1 and "not rigid" in loose.err and "Traceback" not in loose.err
    gone = phalanx("prop", "define", tmp_path / "points.csv", "--points", "11,12,99", *rest)
    assert gone.code == 1 and "no frame all seen together" in gone.err
    word = phalanx("prop", "define", tmp_path / "points.csv", "--points", "pen1,pen2,pen3", *rest)
    assert word.code == 1 and "'pen1' is not the id of a point" in word.err
    assert not (tmp_path / "pen.json").exists()
