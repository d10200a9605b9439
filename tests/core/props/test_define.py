from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from core.errors import PhalanxError
from core.frames import FloatArray, MarkerFrame, RigidBody, Times
from core.props.define import define, modelled, samples_of_body, samples_of_ids, smallest_ball
from core.props.prop import Prop
from core.props.rigid import aligned, mean_shape, moved
from tests.core.props.things import BALL, PEN, SQUARE, apart, frame, path, pose


def shapes_apart_m(one: FloatArray, other: FloatArray) -> float:
    """Largest distance of two marker sets laid onto each other [m]."""
    return float(np.linalg.norm(moved(one, aligned(one, other)) - other, axis=1).max())


def seen_over_time(prop: Prop, n: int, noise_m: float, seed: int = 0) -> FloatArray:
    random = np.random.default_rng(seed)
    placed = np.stack([prop.placed_m(pose(random)) for _ in range(n)])
    return placed + random.normal(0.0, noise_m, placed.shape) if noise_m else placed


def test_alignment_recovers_the_motion_and_never_mirrors() -> None:
    random = np.random.default_rng(0)
    for prop in (PEN, BALL, SQUARE):  # the last two are flat: the mirror image fits as well
        transform = pose(random)
        np.testing.assert_allclose(aligned(prop.markers_m, prop.placed_m(transform)), transform, atol=1e-12)


@pytest.mark.parametrize("prop", [PEN, BALL, SQUARE], ids=lambda prop: prop.name)
def test_the_mean_shape_of_what_is_rigid_is_exact(prop: Prop) -> None:
    shape, errors_m = mean_shape(seen_over_time(prop, 10, 0.0))
    assert shapes_apart_m(prop.markers_m, shape) < 1e-12
    assert errors_m.max() < 1e-12


def test_noise_averages_out() -> None:
    noise_m = 0.0003
    made = define("pen", seen_over_time(PEN, 400, noise_m), "cylinder")
    assert made.frames == 400
    assert shapes_apart_m(PEN.markers_m, made.prop.markers_m) < 4.0 * noise_m * np.sqrt(3.0 / 400.0)
    # Six of the fifteen coordinates are spent on the pose.
    assert made.rms_m == pytest.approx(noise_m * np.sqrt(3.0 * (15 - 6) / 15), rel=0.05)


def test_frames_that_miss_a_marker_are_passed_over() -> None:
    samples = seen_over_time(PEN, 20, 0.0)
    samples[3:9, 2] = np.nan
    assert define("pen", samples, "none").frames == 14
    samples[:, 0] = np.nan
    with pytest.raises(PhalanxError, match="no frame all seen together"):
        define("pen", samples, "none")


def test_frames_in_which_a_point_is_none_are_passed_over() -> None:
    """A device may send one at 0 0 0, NaN or far off; by their ids the markers are then not seen."""
    places = [PEN.placed_m(pose(np.random.default_rng(i))) for i in range(6)]
    for i, wild in enumerate(([0.0, 0.0, 0.0], [1e7, 0.0, 0.0], [np.nan, 0.0, 0.0])):
        places[i][2] = wild
    ids = list(range(1, len(PEN.markers_m) + 1))
    frames = [
        MarkerFrame(i, Times(i / 100, i / 100, i / 100), place, np.array(ids), np.full(len(ids), np.nan))
        for i, place in enumerate(places)
    ]
    np.testing.assert_array_equal(samples_of_ids(frames, ids), np.stack(places[3:]))


def test_what_is_not_rigid_is_refused_with_the_marker_that_strays() -> None:
    samples = seen_over_time(PEN, 50, 0.0)
    samples[:, 3] += np.random.default_rng(3).normal(0.0, 0.01, (50, 3))
    with pytest.raises(PhalanxError, match=r"not rigid.*the 4\. of them"):
        define("pen", samples, "none")


def test_models_are_the_smallest_that_hold_the_markers() -> None:
    random = np.random.default_rng(4)
    corners = 0.5 * np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * [0.05, 0.08, 0.2]
    turned = moved(corners, pose(random))
    markers, box = modelled(turned, "box")
    np.testing.assert_allclose(box.size_m, [0.05, 0.08, 0.2], atol=1e-12)
    np.testing.assert_allclose(np.abs(markers), np.abs(corners), atol=1e-12)
    assert shapes_apart_m(markers, turned) < 1e-12

    around = np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False)
    rod = np.column_stack([0.01 * np.cos(around), 0.01 * np.sin(around), np.linspace(-0.1, 0.1, 12)])
    rod = np.concatenate([rod, rod * [1.0, 1.0, -1.0]])
    markers, cylinder = modelled(moved(rod, pose(random)), "cylinder")
    np.testing.assert_allclose(cylinder.size_m, [0.02, 0.2], rtol=2e-3)
    np.testing.assert_allclose(np.hypot(*markers[:, :2].T), 0.01, rtol=2e-3)

    directions = random.normal(size=(7, 3))
    directions[:, 2] = np.abs(directions[:, 2])  # half a ball
    on_ball = 0.033 * directions / np.linalg.norm(directions, axis=1, keepdims=True)
    markers, sphere = modelled(moved(on_ball, pose(random)), "sphere")
    assert sphere.size_m == pytest.approx((0.066,), abs=1e-9)
    np.testing.assert_allclose(np.linalg.norm(markers, axis=1), 0.033, atol=1e-9)


def test_a_given_size_stays_and_a_flat_box_is_not_nothing() -> None:
    assert modelled(PEN.markers_m, "cylinder", (0.012, 0.16))[1].size_m == (0.012, 0.16)
    assert modelled(SQUARE.markers_m * [1.0, 0.5, 1.0], "box")[1].size_m == pytest.approx((0.005, 0.03, 0.06))
    with pytest.raises(PhalanxError, match="It takes 2"):
        modelled(PEN.markers_m, "cylinder", (0.012,))


def test_the_smallest_ball_touches_two_points_of_a_line() -> None:
    centre, radius = smallest_ball(np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.3, 0.2, 0.0]]))
    np.testing.assert_allclose(centre, [0.5, 0.0, 0.0], atol=2e-3)
    assert radius == pytest.approx(0.5, abs=2e-3)


def test_a_stretch_about_a_time_ends_where_an_id_does() -> None:
    frames = []
    for i in range(60):
        ids = np.array([7, 3, 9, 5, 1])[: 4 if 20 <= i < 30 else 5]  # id 1 is gone for a while
        frames.append(frame(i, PEN.placed_m(path(i / 120.0))[: len(ids)], ids))
    assert samples_of_ids(frames, [3, 9, 1]).shape == (50, 3, 3)
    first, second = (samples_of_ids(frames, [3, 9, 1], at_s) for at_s in (0.1, 0.4))
    np.testing.assert_array_equal(first, [f.points_m[[1, 2, 4]] for f in frames[:20]])
    np.testing.assert_array_equal(second, [f.points_m[[1, 2, 4]] for f in frames[30:]])
    with pytest.raises(PhalanxError, match=r"all seen together at 0.2 s"):
        samples_of_ids(frames, [3, 9, 1], 0.2)
    with pytest.raises(PhalanxError, match="The points 3, 4"):
        samples_of_ids(frames, [3, 4])


def body_frames(n: int, speed: float) -> list[MarkerFrame]:
    """A pen that the device tracks, in a frame of its own, among points that stand and points that fly."""
    random, frames = np.random.default_rng(5), []
    offset, standing = pose(random, 0.03), random.uniform(-0.3, 0.3, (6, 3)) + path(0.0)[:3, 3]
    for i in range(n):
        placed = path(i / 120.0, speed)
        body = placed @ offset
        flying = random.uniform(-0.5, 0.5, (4, 3)) + placed[:3, 3]
        seen = random.random(5) > 0.1 if i else np.ones(5, dtype=bool)
        points = random.permutation(np.concatenate([PEN.placed_m(placed)[seen], standing, flying]))
        quaternion = Rotation.from_matrix(body[:3, :3]).as_quat(scalar_first=True)
        frames.append(
            frame(i, points, np.full(len(points), -1), (RigidBody(4, "stylus", body[:3, 3], quaternion, i % 7 != 6),))
        )
    return frames


def test_a_body_of_the_device_becomes_a_prop() -> None:
    made = define("stylus", samples_of_body(body_frames(200, 1.0), "stylus"), "cylinder")
    assert len(made.prop.markers_m) == 5
    found = made.prop.markers_m
    order = np.argsort(found[:, 2])
    straight, turned = found[order], found[order[::-1]]
    assert min(shapes_apart_m(straight, PEN.markers_m), shapes_apart_m(turned, PEN.markers_m)) < 1e-9


def test_a_body_that_is_not_there_or_does_not_move_is_told() -> None:
    with pytest.raises(PhalanxError, match=r"No rigid body 'wand'.*It holds: stylus"):
        samples_of_body(body_frames(10, 1.0), "wand")
    with pytest.raises(PhalanxError, match="moved only"):
        samples_of_body(body_frames(30, 0.0), "stylus")


def test_apart_measures_what_it_says() -> None:
    one = np.eye(4)
    other = np.eye(4)
    other[:3, :3] = Rotation.from_rotvec([0.0, 0.2, 0.0]).as_matrix()
    other[:3, 3] = [0.0, 0.003, 0.004]
    assert apart(one, other) == pytest.approx((0.005, 0.2))
