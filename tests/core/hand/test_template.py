"""The hand shipped with Phalanx: closed, rightly weighted, of a person's size, and made from its source alone."""

from __future__ import annotations

from importlib.resources import files

import numpy as np
import pytest
import trimesh

from core.hand.mirror import mirror_theta, mirror_transforms, skin_hand
from core.hand.model import HandModel, skin, template
from core.hand.poses import POSE_NAMES, pose
from core.hand.skeleton import DIGIT_DOF_NAMES, DIGITS, DOF_JOINTS, JOINT_PARENTS, N_JOINTS
from core.kinematics.forward import joints_world
from resources.hand.build_template import build
from tests.data import data_path
from tests.some import some

# Buryanov and Kotiuk 2010, means [mm]: phalanges from the palm outwards, the last with its soft tip.
PHALANGES_MM = {
    "thumb": (46.2, 31.6, 27.3),
    "index": (39.8, 22.4, 19.7),
    "middle": (44.6, 26.3, 21.4),
    "ring": (41.4, 25.6, 21.3),
    "pinky": (32.7, 18.1, 19.7),
}


@pytest.fixture(scope="module")
def hand() -> HandModel:
    return template()


@pytest.fixture(scope="module")
def surface(hand: HandModel) -> trimesh.Trimesh:
    return trimesh.Trimesh(hand.vertices_m, hand.faces, process=False)


def theta_of(angles: np.ndarray) -> np.ndarray:
    return np.concatenate([np.zeros(6), angles])


def posed(hand: HandModel, angles: np.ndarray) -> np.ndarray:
    return skin(hand, joints_world(hand.skeleton, theta_of(angles)))


def random_angles(hand: HandModel, count: int) -> np.ndarray:
    low, high = hand.skeleton.limits_rad.T
    return np.random.default_rng(2).uniform(low, high, (count, 20))


def test_surface_is_closed_and_wound_outwards(surface: trimesh.Trimesh) -> None:
    assert surface.is_watertight
    assert surface.is_winding_consistent
    assert surface.body_count == 1
    assert surface.euler_number == 2
    assert 300e-6 < surface.volume < 400e-6  # [m3]; a hand of this length with 36 mm of forearm


def test_surface_is_light_and_without_slivers(hand: HandModel, surface: trimesh.Trimesh) -> None:
    assert len(hand.vertices_m) < 10_000
    assert np.array_equal(np.unique(hand.faces), np.arange(len(hand.vertices_m)))
    assert surface.area_faces.min() > 1e-8  # [m2]
    edges = np.linalg.norm(np.diff(hand.vertices_m[surface.edges_unique], axis=1)[:, 0], axis=1)
    assert edges.min() > 1e-4
    assert edges.max() < 15e-3


def test_weights_are_partitions_of_one(hand: HandModel) -> None:
    assert hand.skin_joints.shape == hand.skin_weights.shape == (len(hand.vertices_m), 4)
    assert hand.skin_weights.min() >= 0.0
    np.testing.assert_allclose(hand.skin_weights.sum(axis=1), 1.0, atol=1e-12)
    assert hand.skin_joints.min() == 0
    assert hand.skin_joints.max() == N_JOINTS - 1
    assert all((np.diff(np.sort(row)) > 0).all() for row in hand.skin_joints)


def test_weights_are_smooth(hand: HandModel, surface: trimesh.Trimesh) -> None:
    dense = np.zeros((len(hand.vertices_m), N_JOINTS))
    np.put_along_axis(dense, hand.skin_joints, hand.skin_weights, axis=1)
    step = np.abs(dense[surface.edges_unique[:, 0]] - dense[surface.edges_unique[:, 1]]).max(axis=1)
    length_mm = surface.edges_unique_length * 1e3
    assert (step / np.maximum(length_mm, 1.0)).max() < 0.4  # no seam: full weight changes over millimetres
    assert (dense.max(axis=0) > 0.999).all()  # every bone has skin of its own


def test_proportions(hand: HandModel) -> None:
    skeleton = hand.skeleton
    for d, digit in enumerate(DIGITS):
        first = 1 + 3 * d
        ends = np.vstack([skeleton.joint_positions_m[first : first + 3], skeleton.tip_positions_m[d]])
        lengths_mm = np.linalg.norm(np.diff(ends, axis=0), axis=1) * 1e3
        np.testing.assert_allclose(lengths_mm, PHALANGES_MM[digit], atol=0.01)
    assert -skeleton.tip_positions_m[2, 2] == pytest.approx(0.186, abs=0.001)
    knuckles = np.abs(hand.vertices_m[:, 2] + 0.08) < 0.003
    knuckles &= np.isin(hand.skin_joints[:, 0], (0, 4, 7, 10, 13))
    assert np.ptp(hand.vertices_m[knuckles, 0]) == pytest.approx(0.083, abs=0.002)


def test_fingertips_lie_on_the_surface(hand: HandModel) -> None:
    for d in range(5):
        distal = hand.skin_joints[:, 0] == 3 + 3 * d
        bone = hand.skeleton.tip_positions_m[d] - hand.skeleton.joint_positions_m[3 + 3 * d]
        reach = (hand.vertices_m[distal] - hand.skeleton.tip_positions_m[d]) @ (bone / np.linalg.norm(bone))
        assert abs(reach.max()) < 2e-4


def test_axes_are_unit_and_close_the_hand(hand: HandModel) -> None:
    skeleton = hand.skeleton
    np.testing.assert_allclose(np.linalg.norm(skeleton.axes, axis=1), 1.0, atol=1e-12)
    for dof, name in enumerate(DIGIT_DOF_NAMES):
        digit = dof // 4
        tip = skeleton.tip_positions_m[digit]
        arm = tip - skeleton.joint_positions_m[DOF_JOINTS[dof]]
        moved = np.cross(skeleton.axes[dof], arm)
        if name == "thumb_cmc_abduction":
            assert moved[1] < -0.02  # palmar
        elif name == "thumb_cmc_flexion":
            assert moved[0] > 0.02  # across the palm
        elif name.startswith("thumb"):
            assert moved[0] > 0.0 > moved[1]
        elif name.endswith("flexion"):
            assert moved[1] < -0.9 * np.linalg.norm(arm)
        else:
            outwards = {1: -1.0, 2: -1.0, 3: 1.0, 4: 1.0}[digit]
            assert moved[0] * outwards > 0.9 * np.linalg.norm(arm)


def test_flexion_is_square_to_the_bone(hand: HandModel) -> None:
    skeleton = hand.skeleton
    for d in range(5):
        ends = np.vstack([skeleton.joint_positions_m[1 + 3 * d : 4 + 3 * d], skeleton.tip_positions_m[d]])
        for dof in some(range(4 * d + (2 if d == 0 else 1), 4 * d + 4)):
            bone = np.diff(ends, axis=0)[DOF_JOINTS[dof] - 1 - 3 * d]
            cosine = abs(skeleton.axes[dof] @ bone) / np.linalg.norm(bone)
            assert cosine < np.sin(np.radians(5.01))  # PIP and DIP converge by up to 5 degrees


def test_limits_contain_rest_and_every_named_pose(hand: HandModel) -> None:
    low, high = hand.skeleton.limits_rad.T
    assert (low < 0.0).all()
    assert (high > 0.0).all()
    for name in POSE_NAMES:
        assert (pose(name) >= low).all() and (pose(name) <= high).all(), name


def test_bones_keep_their_length_and_skin_stays_at_its_bone(hand: HandModel) -> None:
    """Over random poses within the limits: as far from the joint that carries it most as at rest, or nearly so."""
    skeleton = hand.skeleton
    parents = np.asarray(JOINT_PARENTS[1:])
    rest_m = np.linalg.norm(hand.vertices_m - skeleton.joint_positions_m[hand.skin_joints[:, 0]], axis=1)
    for angles in some(random_angles(hand, 50)):
        joints = joints_world(skeleton, theta_of(angles))
        lengths = np.linalg.norm(joints[1:, :3, 3] - joints[parents, :3, 3], axis=1)
        np.testing.assert_allclose(lengths, skeleton.bone_lengths_m[1:], atol=1e-12)
        vertices = skin(hand, joints)
        distance_m = np.linalg.norm(vertices - joints[hand.skin_joints[:, 0], :3, 3], axis=1)
        assert np.abs(distance_m - rest_m).max() < 0.025
        carried_alone = hand.skin_weights[:, 0] == 1.0
        np.testing.assert_allclose(distance_m[carried_alone], rest_m[carried_alone], atol=1e-9)


def test_volume_survives_every_named_pose(hand: HandModel, surface: trimesh.Trimesh) -> None:
    for name in POSE_NAMES:
        volume = trimesh.Trimesh(posed(hand, pose(name)), hand.faces, process=False).volume
        assert volume / surface.volume == pytest.approx(1.0, abs=0.06), name


def test_rest_pose_is_the_template(hand: HandModel) -> None:
    np.testing.assert_allclose(posed(hand, pose("rest")), hand.vertices_m, atol=1e-12)


@pytest.mark.parametrize(("name", "finger"), [("pinch_index", 1), ("ok", 1), ("pinch_middle", 2)])
def test_pinch_touches(hand: HandModel, name: str, finger: int) -> None:
    vertices = posed(hand, pose(name))
    thumb, tip = (vertices[hand.skin_joints[:, 0] == joint] for joint in (3, 3 + 3 * finger))
    gap_m = np.linalg.norm(thumb[:, None] - tip[None], axis=2).min()
    assert gap_m < 0.003


def test_fist_converges(hand: HandModel) -> None:
    """The fingertips of a fist lie closer together than those of the open hand, and proximal of the PIP joints."""

    def tips(name: str) -> np.ndarray:
        joints = joints_world(hand.skeleton, theta_of(pose(name)))
        local = hand.skeleton.tip_positions_m[1:] - hand.skeleton.joint_positions_m[6::3]
        return np.einsum("jab,jb->ja", joints[6::3, :3, :3], local) + joints[6::3, :3, 3]

    fist, rest = tips("fist"), tips("rest")
    assert np.ptp(fist[:, 0]) < 0.65 * np.ptp(rest[:, 0])
    assert (np.diff(fist[:, 0]) > 0.008).all()  # side by side, none inside another
    assert (fist[:, 2] > hand.skeleton.joint_positions_m[[5, 8, 11, 14], 2] + 0.03).all()


def test_left_is_the_mirror_image(hand: HandModel) -> None:
    theta = np.concatenate([[0.1, 1.0, -0.2, 0.3, -0.4, 0.5], pose("ok")])
    right = joints_world(hand.skeleton, theta)
    left = mirror_transforms(right)
    np.testing.assert_allclose(mirror_transforms(left), right, atol=0.0)
    np.testing.assert_allclose(mirror_theta(mirror_theta(theta)), theta, atol=0.0)
    assert np.linalg.det(left[:, :3, :3]) == pytest.approx(np.ones(N_JOINTS))
    mirrored = skin_hand(hand, "left", left)
    np.testing.assert_allclose(mirrored * (-1.0, 1.0, 1.0), skin_hand(hand, "right", right), atol=1e-12)


def test_scaled_hand_is_the_same_hand(hand: HandModel) -> None:
    large = hand.scaled(1.2)
    np.testing.assert_allclose(posed(large, pose("cup")), 1.2 * posed(hand, pose("cup")), atol=1e-12)


def test_the_script_makes_the_shipped_file() -> None:
    source = data_path("hands", "makehuman_hand", "makehuman_left_hand_raw.npz")
    made = build(source)
    with (files("resources") / "hand" / "template.npz").open("rb") as stream, np.load(stream) as shipped:
        assert sorted(shipped.files) == sorted(made)
        for name, values in made.items():
            np.testing.assert_allclose(values, shipped[name], rtol=0.0, atol=1e-12, err_msg=name)
