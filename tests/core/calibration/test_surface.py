from __future__ import annotations

import numpy as np
import trimesh

from core.calibration.surface import surface_normals
from core.hand.model import template
from core.markers.layout import load_layout


def test_normals_are_those_of_the_nearest_faces() -> None:
    """Against trimesh: where the nearest point lies inside a face, the same normal."""
    hand = template()
    mesh = trimesh.Trimesh(hand.vertices_m, hand.faces, process=False)
    random = np.random.default_rng(0)
    on_surface, _ = trimesh.sample.sample_surface(mesh, 40, seed=0)
    points = np.asarray(on_surface) + random.normal(0.0, 0.003, on_surface.shape)
    nearest, _, faces = trimesh.proximity.closest_point_naive(mesh, points)
    bary = trimesh.triangles.points_to_barycentric(mesh.triangles[faces], nearest)
    inside = (bary > 1e-6).all(axis=1)
    assert inside.sum() > 10
    np.testing.assert_allclose(surface_normals(hand, points)[inside], mesh.face_normals[faces][inside], atol=1e-9)


def test_markers_on_the_back_stand_off_dorsally() -> None:
    layout = load_layout("han19")
    normals = surface_normals(template(), layout.positions_m)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0)
    assert normals[[name.startswith("Back") for name in layout.marker_names], 1].min() > 0.9
