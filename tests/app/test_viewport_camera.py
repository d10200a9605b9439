import math

import numpy as np
import pytest

from app.viewport.camera import DISTANCE_RANGE_M, OrbitCamera
from tests.some import some

SIZE = (800.0, 600.0)


def test_the_target_is_in_the_middle_at_its_distance():
    camera = OrbitCamera(np.array([0.3, 1.2, -0.4]), 2.0, 1.1, -0.3)
    assert camera.project(camera.target_m[None], SIZE) == pytest.approx(np.array([[400.0, 300.0, 2.0]]))
    assert np.linalg.norm(camera.eye_m() - camera.target_m) == pytest.approx(2.0)


@pytest.mark.parametrize(
    ("azimuth", "elevation", "right", "up"),
    [
        (0.0, 0.0, (1, 0, 0), (0, 1, 0)),  # front
        (math.pi / 2, 0.0, (0, 0, -1), (0, 1, 0)),  # side
        (0.0, math.pi / 2, (1, 0, 0), (0, 0, -1)),  # top
    ],
)
def test_the_named_views_show_the_world_the_usual_way_round(azimuth, elevation, right, up):
    camera = OrbitCamera(np.zeros(3), 1.0, azimuth, elevation)
    x, y = (camera.project(np.array([d], float) * 0.1, SIZE)[0, :2] - (400, 300) for d in (right, up))
    assert x[0] > 50 and x[1] == pytest.approx(0, abs=1e-9)
    assert y[1] < -50 and y[0] == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize("aspect", [0.4, 1.0, 2.5])
def test_fit_brings_every_point_into_view_from_any_side(aspect):
    rng = np.random.default_rng(1)
    points = rng.normal(size=(40, 3)) * (0.3, 0.1, 0.5) + (1.0, 1.0, 0.0)
    size = (500.0 * aspect, 500.0)
    for azimuth, elevation in some(rng.uniform((-math.pi, -math.pi / 2), (math.pi, math.pi / 2), (50, 2))):
        camera = OrbitCamera(azimuth_rad=azimuth, elevation_rad=elevation)
        camera.fit(points, aspect)
        x, y, depth = camera.project(points, size).T
        assert (x >= 0).all() and (x <= size[0]).all() and (y >= 0).all() and (y <= size[1]).all()
        assert (depth > 0).all()


def test_panning_by_the_whole_screen_moves_the_target_to_its_edge():
    camera = OrbitCamera(np.zeros(3), 1.5, 0.7, 0.4)
    before = camera.target_m
    camera.pan(0.0, 0.5)
    x, y, _ = camera.project(before[None], SIZE)[0]
    assert (x, y) == pytest.approx((400.0, 600.0))


def test_turning_and_zooming_stop_at_their_limits():
    camera = OrbitCamera()
    camera.orbit(100.0, 100.0)
    assert camera.elevation_rad == pytest.approx(math.pi / 2) and abs(camera.azimuth_rad) <= math.pi
    for factor, limit in ((1e-9, DISTANCE_RANGE_M[0]), (1e9, DISTANCE_RANGE_M[1])):
        camera.zoom(factor)
        assert camera.distance_m == limit
    assert np.isfinite(camera.projection(1.3) @ camera.view()).all()


def test_the_view_is_a_rigid_motion():
    view = OrbitCamera(azimuth_rad=-2.0, elevation_rad=0.9).view()
    assert view[:3, :3] @ view[:3, :3].T == pytest.approx(np.eye(3))
    assert np.linalg.det(view[:3, :3]) == pytest.approx(1.0)


def test_what_is_behind_the_camera_has_no_positive_depth():
    camera = OrbitCamera(np.zeros(3), 1.0, 0.0, 0.0)
    assert camera.project(np.array([[0.0, 0.0, 3.0]]), SIZE)[0, 2] < 0
