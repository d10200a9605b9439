"""`phalanx bench labels`: figures that mean what the table says."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from app.bench.labels import TESTS
from app.label_bench import together
from app.label_bench.clouds import Cloud, Score, frames_of, perturbed
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
    tested, sides = frames_of(folder, 3, load_layout("han19"), second=True)
    everything, _ = frames_of(folder, 3, load_layout("han19"))
    seen = {frame.points_m.tobytes() for frame in used}
    held_out = {points.tobytes() for points in tested}
    assert not seen & held_out and held_out >= {frame.points_m.tobytes() for frame in others}
    assert 0.4 < len(tested) / len(everything) < 0.6 and 0.4 < sides.mean() < 0.6


def test_the_shipped_network_passes_the_published_figures_on_hands_it_never_saw() -> None:
    folder = data_path("han2018")
    ran = phalanx("bench", "labels", "--data", folder, "--frames", 40, "--pairs", 1, "--json")
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


def test_people_of_every_size_are_named_as_well_as_those_recorded() -> None:
    ran = phalanx(
        "bench", "labels", "--data", data_path("han2018"), "--frames", 25, "--scales", 0.75, 1, 1.25, "--json"
    )
    assert ran.code == 0, ran.err
    dense, sparse = (ran.figures["scales"][name] for name in ("19 markers", "13 markers"))
    for row in dense.values():
        assert row["labels"] > 0.95 and row["hidden_precision"] > 0.88 and row["sides"] > 0.96
    for row in (*dense.values(), *sparse.values()):
        assert abs(row["against_1"]) < 0.025
        assert row["labels"] == pytest.approx(np.mean(row["by_user"])) and row["worst_user"] == min(row["by_user"])
    assert list(dense) == ["0.75", "1", "1.25"] and dense["1"]["against_1"] == 0.0


def users() -> list[tuple[np.ndarray, np.ndarray]]:
    random = np.random.default_rng(3)
    layout = load_layout("han19")
    points = layout.positions_m + random.normal(0.0, 0.004, (12, 19, 3))
    sides = np.arange(12) % 2
    return [(points * np.where(sides[:, None, None] == 1, 1.0, -1.0), sides)]


@pytest.mark.parametrize("gap_m", together.GAPS_M)
def test_two_hands_lie_as_near_to_each_other_as_the_row_says(gap_m: float) -> None:
    frames, sides = users()[0]
    clouds = list(together.beside(np.random.default_rng(5), users(), gap_m, 20))
    assert len(clouds) == 20
    for cloud in clouds:
        assert cloud.gap_m == pytest.approx(gap_m, abs=1e-12)
        seen = [own != NO_POINT for own in cloud.point]
        left, right = (cloud.points_m[own[own != NO_POINT]] for own in cloud.point)
        assert np.linalg.norm(left[:, None] - right[None], axis=2).min() >= gap_m - 1e-12
        taken = np.concatenate([own[own != NO_POINT] for own in cloud.point])
        assert len(set(taken)) == len(taken) and 0 <= len(cloud.points_m) - len(taken) <= 4
        for side, points in enumerate((left, right)):
            assert 14 <= len(points) <= 19
            apart = np.linalg.norm(points[:, None] - points[None], axis=2)
            of_frames = [frame[seen[side]] for frame in frames[sides == side]]
            errors = [np.abs(np.linalg.norm(f[:, None] - f[None], axis=2) - apart).max() for f in of_frames]
            assert min(errors) < 1e-12  # a frame of this side, turned


def test_hands_that_meet_are_of_people_of_all_sizes() -> None:
    clouds = list(together.performed(np.random.default_rng(1), together.SEEDS, load_layout("han19"), 10))
    widths = []
    for cloud in clouds:
        left, right = (np.array([cloud.points_m[k] if k != NO_POINT else [np.nan] * 3 for k in own])
                       for own in cloud.point)  # fmt: skip
        widths.append(np.nanmean([np.linalg.norm(one[:, None] - one[None], axis=2) for one in (left, right)]))
    small, large = np.mean(widths[1::5]), np.mean(widths[2::5])
    assert 1.3 < large / small < 2.0  # 1.25 against 0.75, each in two postures


def test_two_hands_apart_by_more_than_a_finger_are_told_apart() -> None:
    ran = phalanx(
        "bench", "labels", "--data", data_path("han2018"), "--together", "--pairs", 3, "--users", 1, 2, "--json"
    )
    assert ran.code == 0, ran.err
    rows = ran.figures["together"]
    assert len(rows) == len(together.GAPS_M) + len(together.NEAR_M)
    assert sum(rows[name]["clouds"] for name in rows if name.startswith("meeting")) == 3 * len(together.NEAR_M)
    assert all(0.0 <= rows[name][way] <= 1.0 for name in rows for way in together.WAYS if rows[name]["clouds"])
    assert rows["beside each other, 80 mm"]["engine"] > 0.9
