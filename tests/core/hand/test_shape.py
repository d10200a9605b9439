"""A hand's shape: skeleton, surface and markers follow its ratios together, and no hand that people have is torn."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from core.errors import FormatError
from core.frames import SIDES
from core.hand.anthropometry import shape_prior
from core.hand.mirror import mirror_points, mirror_transforms, skin_hand
from core.hand.model import HandModel, skin, template
from core.hand.poses import pose
from core.hand.shape import (
    FIRST_BONE,
    LARGEST,
    N_SHAPE,
    SHAPE_NAMES,
    SMALLEST,
    HandShape,
    bone_maps,
    shaped_hand,
    shaped_points,
    shaped_skeleton,
    unshaped_points,
)
from core.hand.sizes import SIZES
from core.hand.skeleton import DIGITS, JOINT_PARENTS, N_JOINTS
from core.kinematics.forward import joints_world
from core.markers.layout import layout_names, load_layout
from tests.some import some

SKELETON = template().skeleton


def prior_samples(count: int, deviations: float, seed: int = 5) -> list[HandShape]:
    """Random hands, each independent component of the prior within so many standard deviations."""
    prior, rng = shape_prior(), np.random.default_rng(seed)
    axes = np.linalg.cholesky(prior.covariance_log)
    z = np.clip(rng.normal(size=(count, N_SHAPE)) * deviations / 2.0, -deviations, deviations)
    return [HandShape(np.exp(prior.mean_log + axes @ row)) for row in z]


def corners(deviations: float) -> dict[str, HandShape]:
    """One measure alone at its extreme, the others at the mean: far less likely than any random hand."""
    prior = shape_prior()
    std = np.sqrt(np.diag(prior.covariance_log))
    return {
        f"{name} {sign:+d}": HandShape(np.exp(prior.mean_log + sign * deviations * std[i] * np.eye(N_SHAPE)[i]))
        for i, name in enumerate(SHAPE_NAMES)
        for sign in (-1, 1)
    }


def face_normals(hand: HandModel) -> np.ndarray:
    """(f, 3) unit normals; every face has an area."""
    a, b, c = hand.vertices_m[hand.faces].transpose(1, 0, 2)
    normals = np.cross(b - a, c - a)
    areas = np.linalg.norm(normals, axis=1)
    assert areas.min() > 1e-9  # [m2]
    return normals / areas[:, None]


@pytest.mark.parametrize("scale", [0.6, 1.0, 1.4])
def test_uniform_shape_is_the_scaled_template(scale: float) -> None:
    shaped, scaled = shaped_hand(template(), HandShape.uniform(scale)), template().scaled(scale)
    np.testing.assert_allclose(shaped.vertices_m, scaled.vertices_m, atol=1e-12)
    np.testing.assert_allclose(shaped.skeleton.joint_positions_m, scaled.skeleton.joint_positions_m, atol=1e-12)
    np.testing.assert_allclose(shaped.skeleton.tip_positions_m, scaled.skeleton.tip_positions_m, atol=1e-12)
    for name in ("faces", "skin_joints", "skin_weights"):
        assert getattr(shaped, name) is getattr(template(), name)
    layout = load_layout("han19")
    markers = shaped_points(SKELETON, HandShape.uniform(scale), layout.joints, layout.positions_m)
    np.testing.assert_allclose(markers, scale * layout.positions_m, atol=1e-12)


def test_skeleton_surface_and_markers_are_linear_in_the_ratios() -> None:
    first, second = prior_samples(2, 2.0)
    both = HandShape(0.3 * first.ratios + 0.7 * second.ratios)
    layout = load_layout("han19")

    def everything(shape: HandShape) -> np.ndarray:
        hand = shaped_hand(template(), shape)
        markers = shaped_points(SKELETON, shape, layout.joints, layout.positions_m)
        skeleton = hand.skeleton
        return np.vstack([skeleton.joint_positions_m, skeleton.tip_positions_m, hand.vertices_m, markers])

    np.testing.assert_allclose(everything(both), 0.3 * everything(first) + 0.7 * everything(second), atol=1e-12)


def test_bones_are_as_long_as_their_ratios_say_and_keep_their_direction() -> None:
    for shape in some(prior_samples(5, 2.0)):
        skeleton = shaped_skeleton(SKELETON, shape)
        for j in range(1, N_JOINTS):
            ends = [
                s.tip_positions_m[j // 3 - 1] if j % 3 == 0 else s.joint_positions_m[j + 1]
                for s in (SKELETON, skeleton)
            ]
            before, after = ends[0] - SKELETON.joint_positions_m[j], ends[1] - skeleton.joint_positions_m[j]
            np.testing.assert_allclose(after, shape.ratios[FIRST_BONE + j - 1] * before, atol=1e-12)
        in_the_palm = np.asarray(JOINT_PARENTS) == 0
        width, length, thickness = (shape[name] for name in ("palm_width", "palm_length", "palm_thickness"))
        np.testing.assert_allclose(
            skeleton.joint_positions_m[in_the_palm],
            SKELETON.joint_positions_m[in_the_palm] * (width, thickness, length),
            atol=1e-12,
        )
        assert skeleton.axes is SKELETON.axes
        assert skeleton.limits_rad is SKELETON.limits_rad


def test_girth_is_square_to_the_bone() -> None:
    for shape in some(prior_samples(3, 2.0)):
        maps = bone_maps(SKELETON, shape)
        for j in range(1, N_JOINTS):
            values, directions = np.linalg.eigh(maps[j])
            girth = shape[f"{DIGITS[(j - 1) // 3]}_girth"]
            expected = np.sort([girth, girth, shape.ratios[FIRST_BONE + j - 1]])
            np.testing.assert_allclose(values, expected, atol=1e-12)
            np.testing.assert_allclose(directions @ np.diag(values) @ directions.T, maps[j], atol=1e-12)


def test_skin_and_markers_of_one_bone_move_as_one() -> None:
    """A marker glued to skin that one bone carries stays on it to the last bit of rounding."""
    hand = template()
    alone = hand.skin_weights[:, 0] == 1.0
    assert alone.mean() > 0.5
    for shape in [*SIZES.values(), *prior_samples(3, 2.0)]:
        glued = shaped_points(SKELETON, shape, hand.skin_joints[alone, 0], hand.vertices_m[alone])
        np.testing.assert_allclose(shaped_hand(hand, shape).vertices_m[alone], glued, atol=1e-12)


def distances_m(hand: HandModel, points_m: np.ndarray) -> np.ndarray:
    """(m,) distance of points to the surface."""
    corners_m = hand.vertices_m[hand.faces]
    nearest = [trimesh.triangles.closest_point(corners_m, np.broadcast_to(p, (len(corners_m), 3))) for p in points_m]
    return np.asarray([np.linalg.norm(n - p, axis=1).min() for n, p in zip(nearest, points_m, strict=True)])


@pytest.mark.parametrize("name", layout_names())
def test_markers_stand_off_the_skin_as_their_bones_stretch(name: str) -> None:
    """The stand-off goes with the bone's ratios, so never further than those; 1 mm for skin that bones share."""
    layout = load_layout(name)
    before = distances_m(template(), layout.positions_m)
    for shape in (SIZES["XS"], SIZES["XL"], prior_samples(1, 2.0)[0]):
        stretch = np.linalg.svd(bone_maps(SKELETON, shape)[layout.joints], compute_uv=False)
        markers = shaped_points(SKELETON, shape, layout.joints, layout.positions_m)
        after = distances_m(shaped_hand(template(), shape), markers)
        assert (after < stretch.max(axis=1) * before + 1e-3).all()
        assert (after > stretch.min(axis=1) * before - 1e-3).all()


@pytest.mark.parametrize("number", range(20))
def test_surface_stays_closed_and_unfolded_over_the_prior(number: int) -> None:
    shape = prior_samples(20, 2.0)[number]
    hand = shaped_hand(template(), shape)
    surface = trimesh.Trimesh(hand.vertices_m, hand.faces, process=False)
    assert surface.is_watertight
    assert surface.is_winding_consistent
    assert surface.volume > 0.0
    assert (face_normals(hand) * face_normals(template())).sum(axis=1).min() > 0.5


def test_no_triangle_is_flipped_at_three_deviations_of_any_measure() -> None:
    upright = face_normals(template())
    for name, shape in some(corners(3.0).items()):
        assert (face_normals(shaped_hand(template(), shape)) * upright).sum(axis=1).min() > 0.0, name


def test_skin_stays_smooth_where_measures_jump() -> None:
    """Where digit and palm differ, a triangle's edge turns, but no edge of the skin grows beyond reason."""
    hand = template()
    edges = np.unique(
        np.sort(np.vstack([hand.faces[:, [0, 1]], hand.faces[:, [1, 2]], hand.faces[:, [2, 0]]]), axis=1), axis=0
    )

    def lengths(vertices_m: np.ndarray) -> np.ndarray:
        return np.linalg.norm(vertices_m[edges[:, 0]] - vertices_m[edges[:, 1]], axis=1)

    for shape in some(prior_samples(20, 2.0)):
        growth = lengths(shaped_hand(hand, shape).vertices_m) / lengths(hand.vertices_m)
        assert growth.max() < 1.25 * shape.ratios.max()
        assert growth.min() > 0.6 * shape.ratios.min()


def test_unshaped_points_are_the_way_back() -> None:
    layout = load_layout("han19")
    for shape in some([*SIZES.values(), *prior_samples(5, 2.0)]):
        there = shaped_points(SKELETON, shape, layout.joints, layout.positions_m)
        back = unshaped_points(SKELETON, shape, layout.joints, there)
        np.testing.assert_allclose(back, layout.positions_m, atol=1e-14)


def test_a_shaped_left_hand_is_the_mirror_image_of_the_right() -> None:
    hand = shaped_hand(template(), prior_samples(1, 2.0)[0])
    theta = np.concatenate([[0.1, 0.2, 0.3, 0.4, -0.2, 0.3], pose("grasp")])
    joints = joints_world(hand.skeleton, theta)
    np.testing.assert_allclose(
        skin_hand(hand, "left", mirror_transforms(joints)), mirror_points(skin(hand, joints)), atol=1e-15
    )
    assert SIDES == ("left", "right")


def test_shape_keeps_its_dictionary() -> None:
    shape = prior_samples(1, 2.0)[0]
    again = HandShape.from_dict(shape.to_dict())
    np.testing.assert_allclose(again.ratios, shape.ratios, atol=5e-7)
    assert tuple(shape.to_dict()) == SHAPE_NAMES
    assert again.to_dict() == shape.to_dict()


@pytest.mark.parametrize("value", [SMALLEST - 0.01, LARGEST + 0.01, float("nan"), "1.0", None, True, [1.0]])
def test_a_ratio_that_no_hand_has_is_named(value: object) -> None:
    data = HandShape.generic().to_dict() | {"ring_girth": value}
    with pytest.raises(FormatError, match="ring_girth") as caught:
        HandShape.from_dict(data, "Profile ada.json: shape")
    assert repr(value) in str(caught.value)
    assert "Profile ada.json" in str(caught.value)


@pytest.mark.parametrize("data", [None, [], {}, {"palm_width": 1.0}, HandShape.generic().to_dict() | {"nose": 1.0}])
def test_a_shape_names_every_measure_once(data: object) -> None:
    with pytest.raises(FormatError, match="must name every measure once"):
        HandShape.from_dict(data)
