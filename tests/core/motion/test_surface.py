"""The measures by which poses are judged, on cases whose answer is known."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from core.hand.model import template
from core.hand.skeleton import DIGITS
from core.motion.pose_file import Prop
from resources.motion import surface
from tests.some import some

REST = np.zeros(20)


def test_a_hand_at_rest_overlaps_nowhere() -> None:
    assert surface.deepest_overlap(REST)[0] < 1e-4


def test_fingers_that_cross_are_found() -> None:
    crossed = REST.copy()
    crossed[4:6] = np.radians((-25.0, 0.0))  # the index finger through the middle finger's place
    crossed[8:10] = np.radians((20.0, 0.0))
    depth, where = surface.deepest_overlap(crossed)
    assert depth > 4e-3
    assert "index" in where
    assert "middle" in where


def test_places_lie_where_their_names_say() -> None:
    rest, normals = template().vertices_m, surface.surface(REST)[1]
    skeleton = template().skeleton
    for d, digit in enumerate(DIGITS):
        tip = surface.site(f"{digit} tip")
        assert np.linalg.norm(rest[tip] - skeleton.tip_positions_m[d]) < 2e-3
        pad = surface.site(f"{digit} pad")
        assert 2e-3 < np.linalg.norm(rest[pad] - skeleton.tip_positions_m[d]) < 16e-3
        if d == 0:
            continue
        assert normals[pad][1] < -0.7  # palmar
        assert normals[surface.site(f"{digit} middle dorsal")][1] > 0.7
        assert normals[surface.site(f"{digit} proximal radial")][0] < -0.5
        assert normals[surface.site(f"{digit} proximal ulnar")][0] > 0.5
        assert normals[surface.site(f"{digit} palm")][1] < -0.7
    for wrong in ("nose pad", "index", "index nail", "index pad left", "thumb palm"):
        with pytest.raises(KeyError):
            surface.site(wrong)


@pytest.mark.parametrize("shape", ["sphere", "cylinder", "disk", "box"])
def test_distance_to_a_prop(shape: str) -> None:
    """Against points put at a known distance from its surface, along its normal."""
    turn = Rotation.from_rotvec((0.4, -0.7, 0.2)).as_matrix()
    transform = np.eye(4)
    transform[:3, :3], transform[:3, 3] = turn, (0.01, -0.05, -0.09)
    size = {"sphere": (0.06,), "cylinder": (0.04, 0.15), "disk": (0.09, 0.02), "box": (0.06, 0.04, 0.1)}[shape]
    prop = Prop(shape, size, transform)
    surfaces = {
        "sphere": [((0.03, 0, 0), (1, 0, 0)), ((0, -0.018, 0.024), (0, -0.6, 0.8))],
        "cylinder": [((0.012, 0.016, 0.03), (0.6, 0.8, 0)), ((0.005, 0.0, -0.075), (0, 0, -1))],
        "disk": [((-0.045, 0, 0.001), (-1, 0, 0)), ((0.02, 0.01, 0.01), (0, 0, 1))],
        "box": [((0.03, 0.01, -0.02), (1, 0, 0)), ((0.01, -0.02, 0.03), (0, -1, 0))],
    }[shape]
    for point, normal in some(surfaces):
        for distance in (-0.004, 0.0, 0.007):
            at = turn @ (np.asarray(point) + distance * np.asarray(normal)) + transform[:3, 3]
            assert surface.prop_distance(prop, at[None])[0] == pytest.approx(distance, abs=1e-12)
            np.testing.assert_allclose(surface.prop_normals(prop, at[None])[0], turn @ normal, atol=1e-6)


def test_a_corner_is_further_away_than_its_faces() -> None:
    box = Prop("box", (0.02, 0.02, 0.02), np.eye(4))
    assert surface.prop_distance(box, np.array([[0.013, 0.014, 0.01]]))[0] == pytest.approx(0.005)


def test_the_gap_of_a_contact() -> None:
    apart = surface.contact_gap(REST, None, ("thumb pad", "index pad"))
    pads = surface.surface(REST, np.array([surface.site("thumb pad"), surface.site("index pad")]))[0]
    assert 0.0 < apart < np.linalg.norm(pads[0] - pads[1])
    assert surface.contact_gap(REST, None, ("index pad", "thumb pad")) == pytest.approx(apart)
    with pytest.raises(KeyError):
        surface.contact_gap(REST, None, ("index pad", "prop"))
