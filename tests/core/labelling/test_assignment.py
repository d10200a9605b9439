from __future__ import annotations

import itertools

import numpy as np
import pytest

from core.frames import NO_POINT
from core.hand.model import template
from core.hand.poses import POSE_NAMES, pose
from core.kinematics.forward import markers_world
from core.labelling.assignment import assign
from core.labelling.clusters import clusters
from core.markers.layout import load_layout


def brute_force(predicted: np.ndarray, points: np.ndarray, gate: float) -> float:
    """The least sum of squared distances, a marker left out counting its gate squared, by trying everything."""
    best = np.inf
    options = [*range(len(points)), NO_POINT]
    for choice in itertools.product(options, repeat=len(predicted)):
        used = [c for c in choice if c != NO_POINT]
        if len(set(used)) < len(used):
            continue
        best = min(best, cost(predicted, points, gate, choice))
    return best


def cost(predicted: np.ndarray, points: np.ndarray, gate: float, choice: tuple[int, ...]) -> float:
    return sum(
        gate**2 if c == NO_POINT else float(((predicted[k] - points[c]) ** 2).sum()) for k, c in enumerate(choice)
    )


@pytest.mark.parametrize("seed", range(12))
def test_assignment_is_the_best_of_all(seed: int) -> None:
    random = np.random.default_rng(seed)
    predicted = random.normal(0, 0.02, (random.integers(1, 6), 3))
    points = random.normal(0, 0.02, (random.integers(0, 6), 3))
    found = assign(predicted, points, 0.03)
    used = found[found != NO_POINT]
    assert len(set(used)) == len(used)
    assert cost(predicted, points, 0.03, tuple(found)) == pytest.approx(brute_force(predicted, points, 0.03))


def test_nothing_beyond_its_own_gate() -> None:
    predicted, points = np.zeros((2, 3)), np.array([[0.01, 0, 0], [0.03, 0, 0]])
    predicted[1, 1] = 1.0
    assert assign(predicted, points, np.array([0.005, 0.005])).tolist() == [NO_POINT, NO_POINT]
    assert assign(predicted, points, np.array([0.02, 0.005])).tolist() == [0, NO_POINT]


def test_two_hands_and_stray_points_fall_apart() -> None:
    random = np.random.default_rng(0)
    left, right = random.uniform(-0.05, 0.05, (19, 3)), random.uniform(-0.05, 0.05, (19, 3)) + (0.4, 0, 0)
    stray = random.uniform(-2, 2, (10, 3)) + (0, 5, 0)
    found = clusters(np.vstack([left, stray, right]), 19)
    assert [group.tolist() for group in sorted(found, key=lambda g: g[0])] == [list(range(19)), list(range(29, 48))]


def test_a_fog_of_points_is_passed_over() -> None:
    random = np.random.default_rng(0)
    assert clusters(random.uniform(0, 0.3, (1500, 3)), 19) == []
    assert clusters(random.uniform(0, 9.0, (100_000, 3)), 19) == []
    assert clusters(np.empty((0, 3)), 19) == []


@pytest.mark.parametrize("name", ["schroeder6", "schroeder8", "han19"])
@pytest.mark.parametrize("size", [0.65, 1.0, 1.25])
def test_the_markers_of_a_hand_of_any_size_are_one_cluster(name: str, size: float) -> None:
    """A few markers are far apart: fingertips and wrist, and further on a large hand."""
    layout = load_layout(name)
    for of in POSE_NAMES:
        hand = size * markers_world(
            template().skeleton, np.append(np.zeros(6), pose(of)), layout.joints, layout.positions_m
        )
        assert [group.tolist() for group in clusters(hand, len(hand))] == [list(range(len(hand)))], of


def test_hands_of_a_few_markers_fall_apart() -> None:
    layout = load_layout("schroeder6")
    both = np.concatenate([1.25 * layout.positions_m, 1.25 * layout.positions_m + (0.45, 0.0, 0.0)])
    assert sorted(group.tolist() for group in clusters(both, 6)) == [list(range(6)), list(range(6, 12))]
