from __future__ import annotations

from dataclasses import replace
from itertools import permutations
from pathlib import Path

import numpy as np
import pytest

from core.errors import FormatError, PhalanxError
from core.frames import NO_POINT
from core.labelling.marker_features import marker_features
from core.labelling.network import LabelNetwork, Labels, matched, named, shipped_network
from core.markers.layout import MarkerLayout, load_layout
from core.training.clouds import NONE, RIGHT, Clouds, made
from core.training.poses import pool

LAYOUT = load_layout("han19")


@pytest.fixture(scope="module")
def clouds() -> Clouds:
    return made(np.random.default_rng(77), pool(np.random.default_rng(78), 500, 1), [LAYOUT], 40, False)


def points_of(clouds: Clouds, row: int) -> np.ndarray:
    return clouds.points_m[row, clouds.valid[row]].astype(np.float64)


def probabilities(random: np.random.Generator, n: int, m: int) -> Labels:
    label, point = random.dirichlet(np.full(m + 1, 0.4), n), random.dirichlet(np.full(n + 1, 0.4), m)
    return Labels(label, point, np.full(n, 0.5))


def test_no_other_assignment_is_likelier() -> None:
    random = np.random.default_rng(0)
    n, m = 4, 3
    for _ in range(40):
        labels = probabilities(random, n, m)

        def likelihood(point: tuple[int, ...], labels: Labels = labels) -> float:
            total = 0.0
            for marker, chosen in enumerate(point):
                total += np.log(labels.point[marker, n if chosen == NO_POINT else chosen])
            for i in range(n):
                total += np.log(labels.label[i, point.index(i) if i in point else m])
            return float(total)

        every = {
            tuple(i if i < n else NO_POINT for i in chosen) for chosen in permutations(range(n + m), m)
        }  # fmt: skip
        best = max(every, key=likelihood)
        assert tuple(matched(labels)) == best


def test_a_named_hand_says_how_sure_each_name_is() -> None:
    label = np.array([[0.9, 0.05, 0.05], [0.1, 0.1, 0.8]])
    point = np.array([[0.8, 0.1, 0.1], [0.1, 0.2, 0.7]])
    hand = named(Labels(label, point, np.array([0.9, 0.9])), "right")
    assert hand.point.tolist() == [0, NO_POINT] and hand.hidden.tolist() == [0.1, 0.7]
    np.testing.assert_allclose(hand.confidence, [np.sqrt(0.9 * 0.8), 0.7])
    assert hand.certainty == pytest.approx(np.sqrt(np.sqrt(0.9 * 0.8) * 0.7))


def test_sides_are_weighed_by_what_is_a_marker() -> None:
    label = np.array([[0.9, 0.1], [0.0, 1.0]])
    assert Labels(label, np.ones((1, 3)), np.array([0.2, 0.99])).side == ("left", pytest.approx(0.8, abs=1e-5))
    nothing = Labels(np.array([[0.0, 1.0]]), np.ones((1, 2)), np.array([0.1]))
    assert nothing.side == ("right", pytest.approx(0.5))


def test_features_say_where_a_marker_rides() -> None:
    features = marker_features(LAYOUT)
    assert features.shape == (19, 12) and (features[:, 3:9].sum(1) == 1.0).all()
    np.testing.assert_allclose(features[:, :3] * 0.05, LAYOUT.positions_m, atol=1e-7)
    tip, back = LAYOUT.marker_names.index("RingTip"), LAYOUT.marker_names.index("BackHand1")
    assert features[tip, 3:].tolist() == [0, 0, 0, 0, 1, 0, 0, 0, 1] and features[back, 3:].tolist() == [1, *[0] * 8]


def test_order_place_and_direction_of_points_do_not_matter(clouds: Clouds) -> None:
    network, random = shipped_network(), np.random.default_rng(1)
    for row in range(6):
        points = points_of(clouds, row)
        before = network.labels(points, LAYOUT, "right")
        turn = np.linalg.qr(random.normal(size=(3, 3)))[0]
        turn *= np.sign(np.linalg.det(turn))
        order = random.permutation(len(points))
        after = network.labels((points @ turn.T)[order] + (3.0, 1.0, -5.0), LAYOUT, "right")
        np.testing.assert_allclose(after.label, before.label[order], atol=1e-2)
        np.testing.assert_allclose(after.hidden, before.hidden, atol=1e-2)


def test_order_of_markers_does_not_matter(clouds: Clouds) -> None:
    network, order = shipped_network(), np.random.default_rng(2).permutation(19)
    other = replace(
        LAYOUT, marker_names=tuple(LAYOUT.marker_names[k] for k in order), joints=LAYOUT.joints[order],
        positions_m=LAYOUT.positions_m[order],
    )  # fmt: skip
    for row in range(6):
        points = points_of(clouds, row)
        before, after = network.name(points, LAYOUT, "left"), network.name(points, other, "left")
        np.testing.assert_array_equal(after.point, before.point[order])
        np.testing.assert_allclose(after.confidence, before.confidence[order], atol=1e-2)


def test_a_hand_in_the_mirror_is_the_other_hand_with_the_same_names(clouds: Clouds) -> None:
    network = shipped_network()
    for row in range(6):
        points = points_of(clouds, row)
        seen, mirrored = network.labels(points, LAYOUT), network.labels(points * (-1.0, 1.0, 1.0), LAYOUT)
        np.testing.assert_allclose(mirrored.right, 1.0 - seen.right, atol=1e-2)
        np.testing.assert_allclose(mirrored.label, seen.label, atol=1e-2)
        right, left = network.name(points, LAYOUT, "right"), network.name(points * (-1.0, 1.0, 1.0), LAYOUT, "left")
        np.testing.assert_array_equal(right.point, left.point)


def test_most_made_hands_are_named_right_and_confidence_is_the_share_that_is(clouds: Clouds) -> None:
    network = shipped_network()
    right = sides = said = 0.0
    for row in range(40):
        truth = np.full(19, NO_POINT)
        label = clouds.label[row, clouds.valid[row]]
        truth[label[label != NONE]] = np.flatnonzero(label != NONE)
        side = "right" if (clouds.side[row] == RIGHT).any() else "left"
        hand = network.name(points_of(clouds, row), LAYOUT, side)  # type: ignore[arg-type]
        right += float((hand.point == truth).mean()) / 40
        said += float(hand.confidence.mean()) / 40
        sides += (network.name(points_of(clouds, row), LAYOUT).side == side) / 40
    assert right > 0.9 and sides > 0.9 and abs(said - right) < 0.06


def test_no_points_and_few_points_are_answered() -> None:
    hand = shipped_network().name(np.empty((0, 3)), LAYOUT, "right")
    assert (hand.point == NO_POINT).all() and (hand.hidden == 1.0).all()
    one = shipped_network().labels(np.zeros((1, 3)), LAYOUT)
    assert one.label.shape == (1, 20) and one.point.shape == (19, 2)


@pytest.mark.parametrize("points", [np.zeros((3, 2)), np.zeros(3), np.full((4, 3), np.nan), np.zeros((97, 3))])
def test_points_that_are_none_are_refused(points: np.ndarray) -> None:
    with pytest.raises(PhalanxError, match=r"cannot be labelled.*metres"):
        shipped_network().labels(points, LAYOUT)


def test_a_glove_for_one_hand_has_its_side() -> None:
    glove: MarkerLayout = load_layout("qualisys13")
    assert shipped_network().name(glove.positions_m * (-1.0, 1.0, 1.0), glove).side == "right"


def test_a_file_that_is_no_network_is_refused(tmp_path: Path) -> None:
    (tmp_path / "other.onnx").write_bytes(b"nothing of the kind")
    for name in ("other.onnx", "absent.onnx"):
        with pytest.raises(FormatError, match=rf"{name}.*phalanx train labeller"):
            LabelNetwork(tmp_path / name)


def test_the_shipped_network_is_small_and_has_a_card() -> None:
    import json

    from tests.data import ROOT

    path = ROOT / "resources" / "networks" / "labeller.onnx"
    card = json.loads(path.with_suffix(".json").read_text(encoding="utf-8"))
    assert path.stat().st_size <= 1_000_000
    assert {"data", "budget", "seed", "validation", "licence"} <= card.keys()
    assert shipped_network().about["seed"] == card["seed"]


def test_the_network_of_a_profile_is_the_one_named_or_the_shipped_one(tmp_path: Path) -> None:
    from core.labelling.network import network_at
    from tests.data import ROOT

    assert network_at(None) is shipped_network()
    own = tmp_path / "own.onnx"
    own.write_bytes((ROOT / "resources" / "networks" / "labeller.onnx").read_bytes())
    assert network_at(str(own)).about == shipped_network().about
    own.write_bytes(own.read_bytes()[:1000])
    for path in (own, tmp_path / "gone.onnx"):
        with pytest.raises(FormatError, match=rf"{path.name}.*The profile names it.*--network shipped"):
            network_at(str(path))
