"""`phalanx calibrate import`: from a file of a hand to a profile that fits it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from core.hand.model import template
from core.hand.shape import N_SHAPE, HandShape, shaped_hand
from core.profile import load_profile
from tests.app.command import phalanx
from tests.core.hand.imports.files import write_webxr

SHAPE = HandShape(np.random.default_rng(3).uniform(0.85, 1.15, N_SHAPE))


def test_a_glb_becomes_a_profile(tmp_path: Path) -> None:
    hand = shaped_hand(template(), SHAPE)
    write_webxr(tmp_path / "anna.glb", hand, np.zeros(26), "left")
    out = tmp_path / "anna.json"
    ran = phalanx("calibrate", "import", tmp_path / "anna.glb", "--profile", "schroeder8", "--out", out, "--json")
    assert ran.code == 0
    assert ran.out.startswith("anna.glb: a left hand, ")
    assert ran.figures["side"] == "left"
    lengths = np.concatenate([ran.figures["bones_mm"][digit] for digit in ran.figures["bones_mm"]])
    joints = hand.skeleton.joint_positions_m
    own = np.linalg.norm(
        joints[[2, 3, 5, 6, 8, 9, 11, 12, 14, 15]] - joints[[1, 2, 4, 5, 7, 8, 10, 11, 13, 14]], axis=1
    )
    assert lengths.reshape(5, 3)[:, :2].ravel() == pytest.approx(1e3 * own, abs=0.01)
    profile = load_profile(out)
    assert (profile.layout.name, profile.scale) == ("schroeder8", 1.0)
    np.testing.assert_allclose(profile.shape.ratios, SHAPE.ratios, rtol=0.06)
    assert profile.shape.to_dict() == pytest.approx(ran.figures["shape"], abs=1e-6)


def test_what_cannot_be_read_is_one_line(tmp_path: Path) -> None:
    out = tmp_path / "p.json"
    ran = phalanx("calibrate", "import", "MANO_RIGHT.pkl", "--profile", "han19", "--out", out)
    assert (ran.code, ran.out, len(ran.err.splitlines())) == (1, "", 1)
    assert "is a pickle" in ran.err
    assert not out.exists()


def test_a_profile_that_cannot_be_written(tmp_path: Path) -> None:
    write_webxr(tmp_path / "hand.glb", template(), np.zeros(26))
    out = tmp_path / "no such folder" / "p.json"
    ran = phalanx("calibrate", "import", tmp_path / "hand.glb", "--profile", "han19", "--out", out)
    assert ran.code == 1
    assert "cannot be written (No such file or directory). Choose another place with --out." in ran.err
