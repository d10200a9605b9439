"""What labels say, and the figures made of them."""

from __future__ import annotations

from dataclasses import replace
from itertools import islice

import numpy as np
import pytest

from app.labels import cast_labels, label_map, marker_of, owned
from app.tracking_figures import figures, frames_and_columns
from core.frames import NO_ID
from core.markers.layout import load_layout
from core.motion.company import Company
from core.motion.performer import Performer
from core.profile import load_profile
from core.recording import Recording
from core.takes.reprocess import solve

HAN19 = load_layout("han19")
INDEX_TIP = HAN19.marker_names.index("IndexTip")
RATE_HZ = 60.0


@pytest.mark.parametrize(
    ("label", "side"),
    [
        ("IndexTip", None),
        ("indextip", None),
        ("glove:IndexTip", None),
        ("left_IndexTip", "left"),
        ("L_IndexTip", "left"),
        ("R-IndexTip", "right"),
        ("Right IndexTip", "right"),
        ("right:IndexTip", "right"),
        ("Anna:L_IndexTip", "left"),
    ],
)
def test_labels_that_name_a_marker(label: str, side: str | None) -> None:
    assert marker_of(label, HAN19) == (side, INDEX_TIP)


@pytest.mark.parametrize("label", ["", "Index", "IndexTip 2", "XIndexTip", "pillow_top", ":", "left_", "lIndexTip"])
def test_labels_that_name_none(label: str) -> None:
    assert marker_of(label, HAN19) is None


def performance(sides: tuple[str, ...], with_side: bool) -> Recording:
    """Two seconds of the performer, with a gap in every marker and one point that is no marker."""
    performer = Performer(load_profile("han19"), seed=4)
    n = int(2 * RATE_HZ)
    samples = [performer.at(i / RATE_HZ).markers_world_m for i in range(n)]
    points = np.stack([np.concatenate([sample[side] for side in sides] + [[[2.0, 1.0, 0.0]]]) for sample in samples])
    for column in range(points.shape[1] - 1):
        points[30 + 2 * column : 34 + 2 * column, column] = np.nan
    labels = [f"{side}_{name}" if with_side else name for side in sides for name in HAN19.marker_names] + ["chair"]
    numbers = np.arange(n)
    return Recording("performance", RATE_HZ, numbers / RATE_HZ, numbers, points, tuple(labels), np.arange(len(labels)))


@pytest.mark.parametrize("side", ["left", "right"])
def test_labels_without_a_side_find_theirs_by_the_shape_of_the_hand(side: str) -> None:
    labels = label_map(performance((side,), with_side=False), load_profile("han19"))
    assert labels == {i: (side, i) for i in range(len(HAN19.marker_names))}


def test_labels_that_name_both_hands() -> None:
    labels = label_map(performance(("left", "right"), with_side=True), load_profile("han19"))
    assert labels is not None
    assert len(labels) == 2 * len(HAN19.marker_names)
    assert {side for side, _ in labels.values()} == {"left", "right"}


def test_labels_of_something_else_are_no_labels() -> None:
    recording = performance(("left",), with_side=False)
    assert label_map(recording, load_profile("qualisys13")) is None


def test_withheld_labels_leave_points_in_random_order_and_without_ids() -> None:
    recording = performance(("right",), with_side=False)
    named, columns = frames_and_columns(recording)
    withheld, origins = frames_and_columns(recording, unlabelled=True)
    assert sum(np.array_equal(a, b) for a, b in zip(columns, origins, strict=True)) < 0.05 * len(columns)
    for i, (a, b) in enumerate(zip(named, withheld, strict=True)):
        assert (b.ids == NO_ID).all()
        np.testing.assert_array_equal(b.points_m, recording.points_m[i, origins[i]])
        np.testing.assert_array_equal(np.sort(origins[i]), columns[i])
        np.testing.assert_array_equal(a.ids, recording.ids[columns[i]])


@pytest.mark.parametrize("unlabelled", [False, True])
def test_figures_of_a_performance_are_those_of_its_truth(unlabelled: bool) -> None:
    recording, profile = performance(("left", "right"), with_side=True), load_profile("han19")
    frames, columns = frames_and_columns(recording, unlabelled)
    labels = None if unlabelled else label_map(recording, profile)
    solved = solve(frames, profile, labels=labels)
    made = figures(recording.name, recording, profile, solved, columns, labels)
    observed = int((~np.isnan(recording.points_m[:, :-1, 0])).sum())
    assert made.labelled_points == observed
    assert made.labels_right > 0.999 if unlabelled else np.isnan(made.labels_right)  # told, it cannot but agree
    assert made.tracked == 1.0
    assert set(made.hands) == {"left", "right"}
    total = len(frames) * (recording.points_m.shape[1] - 1)
    assert made.hands["left"].hidden == pytest.approx(1 - observed / total, abs=0.01)
    assert made.rms_m < 0.001


def test_a_wrong_label_is_counted_wrong() -> None:
    recording, profile = performance(("right",), with_side=False), load_profile("han19")
    frames, columns = frames_and_columns(recording)
    solved = solve(frames, profile, labels=label_map(recording, profile))
    swapped = [column.copy() for column in columns]
    for column in swapped:  # the truth of two markers exchanged: both are wrong wherever they are seen
        column[np.isin(column, (0, 1))] = 1 - column[np.isin(column, (0, 1))]
    made = figures(recording.name, recording, profile, solved, swapped)
    wrong = int((~np.isnan(recording.points_m[:, :2, 0])).sum())
    assert round((1 - made.labels_right) * made.labelled_points) == wrong


ANNA, BEN = (replace(load_profile(layout), performer=name) for layout, name in (("han19", "Anna Lena"), ("han19", "")))


@pytest.mark.parametrize(
    ("label", "whose"),
    [
        ("Anna_Lena:L_IndexTip", (0, "L_IndexTip")),
        ("anna lena_IndexTip", (0, "IndexTip")),
        ("1_left_IndexTip", (0, "left_IndexTip")),
        ("2:R_IndexTip", (1, "R_IndexTip")),
        ("IndexTip", (None, "IndexTip")),
        ("Anna:R_IndexTip", (None, "Anna:R_IndexTip")),
        ("22:R_IndexTip", (None, "22:R_IndexTip")),
    ],
)
def test_whose_marker_a_label_names(label: str, whose: tuple[int | None, str]) -> None:
    assert owned(label, (ANNA, BEN)) == whose
    assert owned(label, (ANNA,)) == (0, label)


def test_the_longest_name_counts() -> None:
    cast = tuple(replace(ANNA, performer=name) for name in ("Anna", "Anna 2"))
    assert owned("Anna_2:L_IndexTip", cast) == (1, "L_IndexTip")


def duet(names: tuple[str, str]) -> tuple[Recording, list[tuple[tuple[int, str], int] | None]]:
    """A second of two performers, labels beginning with `names`, and what each column truly is."""
    company = Company([Performer(load_profile("han19"), seed) for seed in (4, 5)])
    points = np.stack([positions for _, positions in islice(company.positions(RATE_HZ), round(RATE_HZ))])
    labels, truth = [], []
    for label in company.labels:
        number, side, marker = label.split("_")
        labels.append(f"{names[int(number) - 1]}{side[0].upper()}_{marker}")
        truth.append(((int(number) - 1, side), HAN19.marker_names.index(marker)))
    numbers = np.arange(len(points))
    return Recording("duet", RATE_HZ, numbers / RATE_HZ, numbers, points, tuple(labels), np.arange(len(labels))), truth


def test_labels_of_two_performers() -> None:
    recording, truth = duet(("Anna_Lena:", "2:"))
    assert cast_labels(recording, (ANNA, BEN)) == dict(enumerate(truth))
    assert cast_labels(duet(("", ""))[0], (ANNA, BEN)) is None
    labels = cast_labels(recording, (ANNA, BEN))
    frames, columns = frames_and_columns(recording)
    made = figures(recording.name, recording, (ANNA, BEN), solve(frames, (ANNA, BEN), labels=labels), columns, labels)
    assert list(made.hands) == ["Anna Lena left", "Anna Lena right", "2 left", "2 right"]
    assert all(hand.tracked == 1.0 and hand.rms_m < 0.001 and hand.hidden == 0.0 for hand in made.hands.values())
    assert np.isnan(made.labels_right) and made.labelled_points == len(frames) * 76
    unnamed = figures(recording.name, recording, (ANNA, BEN), solve(frames, (ANNA, BEN), labels=labels), columns)
    assert unnamed.labels_right == 1.0


def test_labels_of_the_other_performer_are_wrong() -> None:
    recording, _ = duet(("Anna_Lena:", "2:"))
    frames, columns = frames_and_columns(recording)
    labels = cast_labels(duet(("2:", "Anna_Lena:"))[0], (ANNA, BEN))
    made = figures(recording.name, recording, (ANNA, BEN), solve(frames, (ANNA, BEN), labels=labels), columns)
    assert made.labels_right == 0.0 and made.labelled_points == len(frames) * 76
