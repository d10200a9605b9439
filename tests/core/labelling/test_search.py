from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from core.frames import NO_POINT
from core.hand.mirror import mirror_points
from core.hand.model import template
from core.hand.poses import POSE_NAMES, pose
from core.kinematics.forward import markers_world
from core.kinematics.solver import HandSolver
from core.labelling.finder import LEAST_SHARE
from core.labelling.search import TemplateSearch, directions
from core.markers.layout import load_layout
from tests.some import some

SKELETON = template().skeleton


def markers_of(name: str, layout_name: str, random: np.random.Generator, scale: float = 1.0) -> np.ndarray:
    layout = load_layout(layout_name)
    theta = np.concatenate([random.normal(size=3), Rotation.random(rng=random).as_rotvec(), pose(name)])
    theta[6:] = np.clip(theta[6:] + random.normal(0, 0.05, 20), *SKELETON.limits_rad.T)
    return markers_world(SKELETON.scaled(scale), theta, layout.joints, layout.positions_m * scale)


def test_directions_cover_all_rotations() -> None:
    turns = Rotation.from_matrix(directions(72))
    for turn in some(Rotation.random(200, rng=np.random.default_rng(0))):
        assert np.degrees((turns * turn.inv()).magnitude().min()) < 60.0


@pytest.mark.parametrize("name", [n for n in POSE_NAMES if n not in ("fist", "thumbs_up")])
@pytest.mark.parametrize("layout_name", ["han19", "qualisys13"])
def test_every_pose_is_found_from_any_side_in_any_order(name: str, layout_name: str) -> None:
    random = np.random.default_rng(POSE_NAMES.index(name))
    layout = load_layout(layout_name)
    points = markers_of(name, layout_name, random, scale=0.93)
    order = random.permutation(len(points))
    search = TemplateSearch(SKELETON, layout, HandSolver(SKELETON, layout))
    right, left = search.find(points[order], None), search.find(mirror_points(points[order]), None)
    assert right is not None
    assert right.pose.rms_m < 0.002
    np.testing.assert_array_equal(order[right.point], np.arange(len(points)))
    assert left is None or left.cost_m2 > 2.0 * right.cost_m2  # a right hand is not taken for a left one


def test_hidden_markers_and_ghosts_are_told_apart() -> None:
    random = np.random.default_rng(5)
    layout = load_layout("han19")
    points = markers_of("relaxed", "han19", random)
    hidden = [3, 8, 17]
    cloud = np.vstack([np.delete(points, hidden, axis=0), points.mean(0) + [[0.06, 0.05, 0.0], [-0.05, 0.08, 0.02]]])
    found = TemplateSearch(SKELETON, layout, HandSolver(SKELETON, layout)).find(cloud, None)
    assert found is not None
    want = np.full(19, NO_POINT)
    want[np.delete(np.arange(19), hidden)] = np.arange(16)
    np.testing.assert_array_equal(found.point, want)


def test_a_known_hand_that_jumped_is_found_near() -> None:
    random = np.random.default_rng(2)
    layout = load_layout("han19")
    solver = HandSolver(SKELETON, layout)
    search = TemplateSearch(SKELETON, layout, solver)
    points = markers_of("cup", "han19", random)
    before = search.find(points, None)
    assert before is not None
    turn = Rotation.from_rotvec([0.3, 0.2, -0.2])
    jumped = turn.apply(points - points.mean(0)) + points.mean(0) + (0.03, -0.02, 0.02)
    found = search.find_near(jumped, before.pose)
    assert found is not None
    np.testing.assert_array_equal(found.point, np.arange(19))


@pytest.mark.parametrize("length_m", [0.3, 0.5])
def test_too_few_points_of_a_line_are_named_to_be_taken_for_a_hand(length_m: float) -> None:
    random = np.random.default_rng(1)
    layout = load_layout("han19")
    search = TemplateSearch(SKELETON, layout, HandSolver(SKELETON, layout))
    line = np.linspace([0, 0, 0], [length_m, 0, 0], 19) + random.normal(0, 1e-4, (19, 3))
    found = search.find(line, None)
    assert found is not None  # the best there is; who asked judges it
    assert found.n_labelled < LEAST_SHARE * 19
    hand = search.find(markers_of("relaxed", "han19", random), None)
    assert hand is not None and hand.n_labelled == 19
