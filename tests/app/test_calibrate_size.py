"""`phalanx calibrate size`: a profile whose hand measures what was asked for."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from app.hand_size import hand_size
from core.hand.measures import measure
from core.hand.sizes import GLOVE_MM, SIZES
from core.profile import load_profile
from tests.app.command import phalanx


def test_a_size_goes_into_the_profile_and_nothing_else_changes(tmp_path: Path) -> None:
    out = tmp_path / "ada.json"
    ran = phalanx("calibrate", "size", "L", "--profile", "qualisys13", "--performer", "Ada", "--out", out, "--json")
    assert ran.code == 0, ran.err
    before, after = load_profile("qualisys13"), load_profile(out)
    assert (after.performer, after.sides, after.scale) == ("Ada", before.sides, 1.0)
    assert hand_size(after) == "L"
    np.testing.assert_allclose(after.shape.ratios, SIZES["L"].ratios, atol=1e-6)
    assert after.layout.to_dict() == before.layout.to_dict()
    figures = ran.figures["measures_mm"]
    np.testing.assert_allclose([figures["length"], figures["circumference"]], GLOVE_MM["L"], atol=0.01)
    assert "192 mm" in ran.out and "229 mm around the knuckles" in ran.out


def test_a_tape_gives_the_hand_that_measures_so(tmp_path: Path) -> None:
    out = tmp_path / "ada.json"
    words = ["--length", 176, "--breadth", 74.5]
    ran = phalanx("calibrate", "size", *words, "--profile", "han19", "--out", out, "--json")
    assert ran.code == 0, ran.err
    measures = measure(load_profile(out).hand)
    assert measures.length * 1e3 == pytest.approx(176.0, abs=0.01)
    assert measures.breadth * 1e3 == pytest.approx(74.5, abs=0.01)
    assert ran.figures["measures_mm"]["breadth"] == pytest.approx(74.5, abs=0.01)
    assert ran.figures["size"] is None


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ([], "Give one of both"),
        (["M", "--length", "182"], "Give one of both"),
        (["--length", "18"], "length 18 mm"),
        (["--length", "182", "--circumference", "400"], "circumference 400 mm"),
    ],
)
def test_what_cannot_be_is_told_and_nothing_written(tmp_path: Path, words: list[str], told: str) -> None:
    ran = phalanx("calibrate", "size", *words, "--profile", "han19", "--out", tmp_path / "ada.json")
    assert ran.code == 1
    assert told in ran.err
    assert list(tmp_path.iterdir()) == []


def test_an_unknown_size_is_wrong_usage(tmp_path: Path) -> None:
    ran = phalanx("calibrate", "size", "huge", "--profile", "han19", "--out", tmp_path / "ada.json")
    assert ran.code == 2
    assert "'XS', 'S', 'M', 'L', 'XL'" in ran.err
