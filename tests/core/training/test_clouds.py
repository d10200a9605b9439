from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from core.markers.layout import MarkerLayout, load_layout
from core.motion.library import Prop
from core.training import clouds as clouds_module
from core.training import kernels
from core.training.clouds import LEFT, NONE, RIGHT, Clouds, Scenes, gathered, hidden_of, made, prop_capsules, scenes
from core.training.layouts import drawn, made_up, varied
from core.training.poses import Pool, pool
from core.training.supply import supply


@cache
def few() -> Pool:
    return pool(np.random.default_rng(1), 400, 1)


def some(seed: int, both: bool, names: tuple[str, ...] = ("han19", "alexanderson13")) -> Clouds:
    return made(np.random.default_rng(seed), few(), [load_layout(name) for name in names], 24, both)


@pytest.mark.parametrize("both", [False, True])
def test_truth_is_whole(both: bool) -> None:
    clouds = some(5, both)
    hands = clouds.label != NONE
    assert (hands == (clouds.side != NONE)).all() and not (hands & ~clouds.valid).any()
    assert (clouds.points_m[~clouds.valid] == 0.0).all() and np.isfinite(clouds.points_m).all()
    for row in range(len(clouds.layout)):
        m = len(clouds.layouts[clouds.layout[row]].joints)
        for side in (LEFT, RIGHT):
            names = clouds.label[row, clouds.side[row] == side]
            assert len(set(names)) == len(names) and (names < m).all()
        sides = set(clouds.side[row]) - {NONE}
        assert sides == {LEFT, RIGHT} if both else len(sides) == 1
        # The valid ones stand first.
        assert (np.diff(clouds.valid[row].astype(int)) <= 0).all()
    assert {LEFT, RIGHT} <= set(clouds.side.ravel())


def test_a_seed_makes_the_same_clouds_and_another_makes_others() -> None:
    one, same, other = some(5, True), some(5, True), some(6, True)
    assert np.array_equal(one.points_m, same.points_m) and np.array_equal(one.label, same.label)
    assert one.points_m.shape != other.points_m.shape or not np.array_equal(one.points_m, other.points_m)
    first, second = supply(3, few()), supply(3, few())
    for _ in range(3):
        a, b = next(first), next(second)
        assert np.array_equal(a.points_m, b.points_m) and np.array_equal(a.layout, b.layout)


def test_points_lie_where_their_markers_are_and_hidden_markers_have_none() -> None:
    random, layout = np.random.default_rng(2), load_layout("han19")
    scene = scenes(random, few(), layout, 64, False)
    hidden = hidden_of(random, scene, len(layout.joints))
    shown = scene.there & ~hidden
    clouds = gathered(random, [layout], [(scene, shown)])
    for row in range(64):
        named = clouds.label[row] != NONE
        truth = np.flatnonzero(shown[row] & (scene.label[row] != NONE))
        assert sorted(clouds.label[row, named]) == sorted(scene.label[row, truth])
        places = scene.markers_m[row, clouds.label[row, named]]
        assert np.abs(clouds.points_m[row, named] - places).max() < 0.009  # jitter of 4 mm and noise


def known_as(shares: dict[str, float]) -> Scenes:
    """600 hands of which so much is known."""
    with pytest.MonkeyPatch.context() as patch:
        for name, share in shares.items():
            patch.setattr(clouds_module, name, share)
        return scenes(np.random.default_rng(3), few(), load_layout("han19"), 600, False)


def test_of_calibrated_hands_the_places_of_markers_are_known_and_of_others_the_layout() -> None:
    layout = load_layout("han19")
    # Distances among markers of the palm, which no posture changes.
    back = np.flatnonzero(layout.joints == 0)[:3]

    def off_m(scene: Scenes) -> float:
        there, told = (
            np.linalg.norm(places[:, back] - places[:, np.roll(back, 1)], axis=2)
            for places in (scene.markers_m, scene.told_m)
        )
        return float(np.sqrt(np.square(there - told).mean()))

    calibrated, sized = known_as({"CALIBRATED": 1.0}), known_as({"CALIBRATED": 0.0, "SIZED": 1.0})
    unknown = known_as({"CALIBRATED": 0.0, "SIZED": 0.0})
    np.testing.assert_allclose(unknown.told_m, np.tile(layout.positions_m, (600, 1, 1)), atol=1e-12)
    ratios = sized.told_m / unknown.told_m
    np.testing.assert_allclose(ratios, np.broadcast_to(ratios[:, :1, :1], ratios.shape), rtol=1e-9)  # larger or smaller
    assert np.linalg.norm(calibrated.told_m - layout.positions_m, axis=2).std() > 0.5 * clouds_module.OWN_M
    assert off_m(calibrated) < 0.6 * off_m(sized) < 0.6 * off_m(unknown)


def test_hands_are_of_any_size_a_childs_as_often_as_a_large_ones() -> None:
    layout = load_layout("han19")
    back = np.flatnonzero(layout.joints == 0)  # does not bend
    hands = scenes(np.random.default_rng(8), few(), layout, 600, False).markers_m[:, back]
    at_rest = layout.positions_m[back]
    spread_m = np.linalg.norm(hands - hands.mean(axis=1, keepdims=True), axis=(1, 2))
    sizes = spread_m / np.linalg.norm(at_rest - at_rest.mean(axis=0))
    low, middle, high = np.quantile(sizes, [0.05, 0.5, 0.95])
    assert low < 0.78 and 0.96 < middle < 1.08 and high > 1.24
    counts = np.histogram(sizes, [0.75, 0.88, 1.01, 1.14, 1.27])[0]
    assert counts.min() > 0.75 * counts.mean()


def test_a_mirrored_cloud_is_the_other_hand() -> None:
    clouds = some(7, False)
    rows = np.arange(len(clouds.layout)) % 2 == 0
    mirrored = clouds.mirrored(rows)
    np.testing.assert_array_equal(mirrored.label, clouds.label)
    np.testing.assert_array_equal(mirrored.points_m[~rows], clouds.points_m[~rows])
    np.testing.assert_array_equal(mirrored.points_m[rows] * [-1, 1, 1], clouds.points_m[rows])
    hands = clouds.side != NONE
    assert (mirrored.side[rows][hands[rows]] == 1 - clouds.side[rows][hands[rows]]).all()
    again = mirrored.mirrored(rows)
    np.testing.assert_array_equal(again.points_m, clouds.points_m)
    np.testing.assert_array_equal(again.side, clouds.side)


def sampled_gap_m(origin: np.ndarray, to: np.ndarray, scene: Scenes, row: int) -> float:
    """How deep the way from origin to `to` gets into any capsule, by brute force; negative: into one."""
    along = np.linspace(0.0, 1.0, 20_001)[:, None] ** 3
    way = origin + along * (to - origin)
    gap = np.inf
    for start, end, radius in zip(scene.starts_m[row], scene.ends_m[row], scene.radii_m[row], strict=True):
        if radius <= 0.0:
            continue
        axis = end - start
        s = np.clip((way - start) @ axis / max(axis @ axis, 1e-12), 0.0, 1.0)
        distance = np.linalg.norm(way - start - s[:, None] * axis, axis=1)
        if distance[0] <= radius:
            if distance[1] < distance[0]:
                return -1.0
            continue
        gap = min(gap, float(distance.min() - radius))
    return gap


def test_a_marker_is_hidden_from_a_camera_only_where_flesh_is_in_between() -> None:
    random = np.random.default_rng(4)
    scene = scenes(random, few(), load_layout("schroeder17"), 12, True)
    hidden = checked = 0
    for row in range(12):
        for marker in range(0, 34, 3):
            origin = scene.markers_m[row, marker]
            camera = random.normal(0.0, 1.0, 3)
            camera *= 2.0 / np.linalg.norm(camera)
            reach = float(np.linalg.norm(camera - origin))
            told = kernels.blocked(
                origin, (camera - origin) / reach, reach, scene.starts_m[row], scene.ends_m[row], scene.radii_m[row]
            )
            gap = sampled_gap_m(origin, camera, scene, row)
            if abs(gap) > 2e-4:
                assert told == (gap < 0.0)
                checked += 1
                hidden += told
    assert checked > 100 and hidden > 20


def test_least_cameras_see_what_is_seen() -> None:
    ball = np.zeros((1, 1, 3)), np.zeros((1, 1, 3)), np.full((1, 1), 0.05)
    cameras = np.array([[[2.0, 0.0, 0.0], [-2.0, 0.0, 0.0], [0.0, 2.0, 0.0]]])
    points = np.array([[[0.06, 0.0, 0.0], [0.06, 0.06, 0.0], [-0.06, 0.0, 0.0]]])
    for least, expected in ((1, [True, True, True]), (2, [True, True, True]), (3, [False, True, False])):
        seen = np.empty((1, 3), dtype=np.bool_)
        kernels.seen(points, cameras, np.array([3]), *ball, np.array([least]), seen)
        assert seen[0].tolist() == expected
    seen = np.empty((1, 3), dtype=np.bool_)
    kernels.seen(points, cameras[:, :2], np.array([2]), *ball, np.array([2]), seen)
    assert seen[0].tolist() == [False, True, False]  # over the ball's edge both are seen


@pytest.mark.parametrize(
    ("shape", "size", "spread"),
    [
        ("sphere", (0.06,), 0.06), ("cylinder", (0.03, 0.2), 0.2), ("disk", (0.1, 0.01), 0.1),
        ("box", (0.02, 0.1, 0.04), 0.1),
    ],
)  # fmt: skip
def test_capsules_of_a_thing_are_as_long_as_it(shape: str, size: tuple[float, ...], spread: float) -> None:
    starts, ends, radii = prop_capsules(Prop(shape, size, np.eye(4)))
    longest = np.linalg.norm(ends - starts, axis=1) + 2.0 * radii
    assert longest.max() == pytest.approx(spread)


def test_made_up_layouts_are_layouts() -> None:
    random = np.random.default_rng(8)
    for layout in (made_up(random), varied(random, load_layout("han19")), drawn(random), drawn(random)):
        again = MarkerLayout.from_dict(layout.to_dict())
        assert again.marker_names == layout.marker_names and len(layout.joints) >= 7
        np.testing.assert_allclose(again.positions_m, layout.positions_m, atol=1e-6)
    own = load_layout("schroeder17")
    assert drawn(random, own) is own


def test_postures_are_within_the_limits_and_pairs_are_near() -> None:
    from core.hand.model import template

    low, high = template().skeleton.limits_rad.T
    assert (few().angles_rad >= low - 1e-9).all() and (few().angles_rad <= high + 1e-9).all()
    left, right = few().pairs[:, 0, :3] * (-1.0, 1.0, 1.0), few().pairs[:, 1, :3]
    assert len(few().pairs) > 50 and np.linalg.norm(left - right, axis=1).max() < 0.2
