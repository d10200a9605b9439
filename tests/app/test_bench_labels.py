"""`phalanx bench labels`: figures that mean what the table says."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from app.bench.labels import TESTS, Cloud, Score, _frames, perturbed
from app.reconstruction.han_shapes import sequences
from core.frames import NO_POINT
from core.labelling.network import NamedHand
from core.markers.layout import load_layout
from tests.app.command import phalanx
from tests.data import data_path


def hand(point: list[int], side: str = "right") -> NamedHand:
    return NamedHand(side, np.array(point), np.full(len(point), 0.5), np.zeros(len(point)))  # type: ignore[arg-type]


def test_scores_count_labels_hidden_markers_and_ghosts() -> None:
    cloud = Cloud(np.zeros((4, 3)), np.array([2, NO_POINT, 0, 1]), "right")  # point 3 is a ghost
    score = Score()
    score.add(cloud, hand([2, NO_POINT, 0, 1]))
    score.add(cloud, hand([2, 3, NO_POINT, 1], "left"))  # the ghost taken for marker 1, marker 2 lost
    figures = score.figures()
    assert figures["labels"] == 6 / 8 and figures["frames"] == 0.5 and figures["sides"] == 0.5
    assert figures["hidden_recall"] == 0.5 and figures["hidden_precision"] == 0.5
    assert figures["ghost_recall"] == 0.5 and figures["ghost_precision"] == 0.5
    assert figures["confidence"] == 0.5 and math.isnan(Score().figures()["labels"])


@pytest.mark.parametrize("test", TESTS)
def test_clouds_hide_and_add_what_the_test_says(test: str) -> None:
    most_hidden, most_ghosts = TESTS[test]
    points = np.random.default_rng(1).normal(0.0, 0.05, (20, 19, 3))
    made = list(perturbed(np.random.default_rng(2), points, np.ones(20, dtype=np.int64), 300, most_hidden, most_ghosts))
    hidden = [int((cloud.point == NO_POINT).sum()) for cloud in made]
    ghosts = [len(cloud.points_m) - 19 + gone for cloud, gone in zip(made, hidden, strict=True)]
    assert set(hidden) == set(range(most_hidden + 1)) and set(ghosts) == set(range(most_ghosts + 1))
    for cloud in made:
        shown = cloud.point != NO_POINT
        frame = np.abs(points[:, shown] - cloud.points_m[cloud.point[shown]]).max(axis=(1, 2)).argmin()
        np.testing.assert_array_equal(points[frame, shown], cloud.points_m[cloud.point[shown]])


def test_no_data_is_said_in_a_line(tmp_path: Path) -> None:
    ran = phalanx("bench", "labels", "--data", tmp_path)
    assert ran.code == 1 and "han_user1.npz" in ran.err and "--data" in ran.err


def test_no_frame_is_named_by_a_calibration_that_has_seen_it() -> None:
    folder = data_path("han2018")
    used, others = sequences(folder / "han_user3.npz")
    tested, sides = _frames(folder, 3, load_layout("han19"), second=True)
    everything, _ = _frames(folder, 3, load_layout("han19"))
    seen = {frame.points_m.tobytes() for frame in used}
    held_out = {points.tobytes() for points in tested}
    assert not seen & held_out and held_out >= {frame.points_m.tobytes() for frame in others}
    assert 0.4 < len(tested) / len(everything) < 0.6 and 0.4 < sides.mean() < 0.6


def test_the_shipped_network_passes_the_published_figures_on_hands_it_never_saw() -> None:
    folder = data_path("han2018")
    ran = phalanx("bench", "labels", "--data", folder, "--frames", 40, "--json")
    assert ran.code == 0, ran.err
    for test, published in (
        ("nothing hidden", 0.9776),
        ("hidden", 0.9351),
        ("ghosts", 0.9530),
        ("hidden and ghosts", 0.8581),
    ):
        row = ran.figures["19 markers"][test]
        assert row["labels"] > published, (test, row)
    both = ran.figures["19 markers"]["hidden and ghosts"]
    assert both["hidden_precision"] > 0.7395 and both["hidden_recall"] > 0.6464
    assert both["ghost_precision"] > 0.5621 and both["ghost_recall"] > 0.3977
    assert ran.figures["19 markers"]["nothing hidden"]["sides"] > 0.99
    for rows in ran.figures["calibrated"].values():
        assert rows["hidden and ghosts"]["labels"] > 0.9
