from __future__ import annotations

import argparse

import numpy as np
import pytest

from app.bench.certainty import _table, run
from core.errors import FormatError
from tests.app.command import phalanx
from tests.data import data_path


def test_rows_are_of_what_is_stated():
    rng = np.random.default_rng(3)
    std = rng.uniform(0.5, 3.9, 4000)
    error = np.abs(rng.normal(0.0, std))
    rows = _table(
        "angles", "°", [np.array([std[:100], error[:100]]), np.array([std[100:], error[100:]])], (0, 1, 2, 4, 8)
    )
    assert [(row["from"], row["to"]) for row in rows] == [(0, 1), (1, 2), (2, 4), (0, None)]
    assert sum(row["n"] for row in rows[:-1]) == rows[-1]["n"] == 4000
    for row in rows:
        among = (std >= row["from"]) & (std < (row["to"] or np.inf))
        assert row["n"] == among.sum()
        assert row["stated"] == pytest.approx(np.sqrt(np.mean(std[among] ** 2)))
        assert row["true"] == pytest.approx(np.sqrt(np.mean(error[among] ** 2)))
        assert row["true"] == pytest.approx(row["stated"], rel=0.1), "normal errors are as large as stated"
        assert (row["within_1"], row["within_2"]) == pytest.approx((0.683, 0.954), abs=0.05)


def test_the_performers_angles_are_as_sure_as_stated():
    ran = phalanx("bench", "certainty", "--seconds", 4, "--seed", 2, "--json")
    assert ran.code == 0, ran.err
    everything = ran.figures["angles_deg"][-1]
    assert 0.95 * 20 * 2 * 360 < everything["n"] <= 20 * 2 * 360
    assert everything["within_2"] > 0.85
    *steps, everything = ran.figures["hidden_markers_mm"]
    assert steps[0]["true"] < everything["true"] < steps[-1]["true"]


def test_each_marker_of_a_recording_is_hidden_in_turn():
    recording = data_path("qualisys_hand", "recording.tsv")
    ran = phalanx("bench", "certainty", recording, "--profile", "qualisys13", "--seconds", 1, "--from", 5, "--json")
    assert ran.code == 0, ran.err
    assert ran.figures["frames"] == 100
    assert 0.9 * 1300 < ran.figures["hidden_markers_mm"][-1]["n"] <= 1300
    assert "each of 13 markers" in ran.out


@pytest.mark.parametrize(
    ("profile", "begin", "words"), [("qualisys13", 100.0, "ends before second 100"), ("han19", 0.0, "names no marker")]
)
def test_what_cannot_be_measured_is_told(profile, begin, words):
    recording = data_path("qualisys_hand", "recording.tsv")
    with pytest.raises(FormatError, match=words):
        run(argparse.Namespace(file=recording, profile=profile, begin=begin, seconds=1.0))
