"""Angles over gaps: what is counted, and that deviations hold for postures that the prior has not seen."""

from __future__ import annotations

import numpy as np
import pytest

from app import gap_angles
from app.gap_angles import KINDS, LENGTHS_S, Errors, Trial
from core.profile import load_profile
from tests.app.command import phalanx
from tests.data import data_path


def test_people_and_activities_that_are_stated_are_others_than_those_constants_were_chosen_on() -> None:
    for group in (gap_angles.OUTSIDE, gap_angles.INSIDE):
        assert not {one.person for one in group["chosen"]} & {one.person for one in group["stated"]}
    pairs = [{(one.subspace, one.activity) for one in gap_angles.OUTSIDE[half]} for half in ("chosen", "stated")]
    assert len(pairs[1] - pairs[0]) > len(pairs[1]) / 2


def test_a_table_counts_errors_against_what_was_stated() -> None:
    degree = np.radians(1.0)
    errors = Errors(
        np.array([0.15, 0.15, 0.15, 2.0, 0.15]),
        np.array([0.0, 0.0, 1.0, 0.0, 5.0]),
        degree * np.array([[3.0, 4.0, 1.0, 9.0, 7.0], [0.5, 1.5, 1.0, 9.0, 8.0]]),
        degree * np.array([[1.0, 3.0, 2.0, 1.0, np.nan], [1.0, 1.0, 2.0, 9.5, 5.0]]),
    )
    rows = {(row["length_s"], row["kind"]): row for row in gap_angles.table([errors])}
    assert len(rows) == len(LENGTHS_S) * (len(KINDS) + 1)
    mcp = rows[0.15, "MCP"]
    assert mcp["n"] == 2
    assert mcp["live"] == pytest.approx(
        {"rms_deg": np.sqrt(12.5), "stated_deg": np.sqrt(5.0), "within_1": 0.0, "within_2": 0.5}
    )
    assert mcp["filled"]["within_1"] == 0.5
    assert mcp["filled"]["within_2"] == 1.0
    assert rows[0.15, "all"]["n"] == 3  # of digits
    assert "live" not in rows[0.15, "wrist"]
    assert rows[0.15, "wrist"]["filled"]["rms_deg"] == pytest.approx(8.0)
    lines = gap_angles.said_of(list(rows.values()))
    assert len(lines) == 1 + 2 * len(LENGTHS_S)
    assert "3.5  2.2  50 %" in lines[1]


def test_two_standard_deviations_hold_for_postures_that_the_prior_has_not_seen() -> None:
    """A person who spells, told by the postures of grasping: half a minute, so shares are rough."""
    errors = gap_angles.of_performer(Trial("grasping", "signs", 26), load_profile("han19"), 30.0, 120.0, 0.0006)
    digits = errors.kind != KINDS.index("wrist")
    within = np.abs(errors.error_rad) < 2.0 * errors.std_rad
    long = errors.length_s > 0.5
    for among in (digits & ~long, digits & long):
        assert among.sum() > 500
        assert within[1, among].mean() > 0.9
    among = digits & long
    stated, true = (np.sqrt(np.mean(np.square(one[:, among]), axis=1)) for one in (errors.std_rad, errors.error_rad))
    assert (stated < 2.0 * true).all()
    assert within[1, ~digits].mean() > 0.9


def test_a_recording_is_held_against_what_all_of_its_markers_tell() -> None:
    path = data_path("han2018", "trc", "user2_sequence.12_training_dense_right.trc")
    ran = phalanx("bench", "gaps", path, "--seeds", 0, 5, "--json")
    assert ran.code == 0, ran.err
    assert ran.figures["half"] is None
    (rows,) = ran.figures["angles"].values()
    told = {(row["length_s"], row["kind"]) for row in rows if "filled" in row}
    assert (0.15, "all") in told
    for row in rows:
        if row["kind"] != "wrist" and "live" in row:
            assert 0.0 < row["live"]["rms_deg"] < 60.0  # what is true is not what was shown


@pytest.mark.parametrize("begin", [-5, 1000])
def test_seconds_that_a_recording_has_not_are_refused(begin: int) -> None:
    path = data_path("han2018", "trc", "user2_sequence.12_training_dense_right.trc")
    ran = phalanx("bench", "gaps", path, "--from", begin)
    assert ran.code == 1
    assert f"--from {begin}: {path.name} has" in ran.err


def test_a_recording_of_another_layout_is_refused() -> None:
    path = data_path("han2018", "trc", "user2_sequence.12_training_dense_right.trc")
    ran = phalanx("bench", "gaps", path, "--profile", "qualisys13")
    assert ran.code != 0
    assert "qualisys13" in ran.err
