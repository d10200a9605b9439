"""A performer's own hand, nothing like the template, leaves in glTF and BVH as it was solved."""

import re
from dataclasses import replace

import numpy as np
import pygltflib
import pytest

from core.hand.mirror import mirror_points, skin_hand
from core.hand.model import template
from core.hand.shape import HandShape
from core.hand.skeleton import JOINT_PARENTS
from core.takes.export import export
from tests.core.export.recordings import hands_of, solution
from tests.core.export.test_gltf import Player, mesh_nodes

RATIOS = np.exp(np.random.default_rng(8).normal(0.05, 0.12, 23))


@pytest.fixture(scope="module")
def shaped():
    """The recording, performed by other hands: same rotations, bones of another length, size found on top."""
    before = solution(n_frames=60, lost=(), untracked=(0, 0))
    profile = replace(before.cast[0], shape=HandShape(RATIOS))
    return replace(
        before,
        profiles=profile,
        solved=tuple(
            replace(
                frame, hands=tuple(replace(hand, joints_world=rechained(hand, profile.hand)) for hand in frame.hands)
            )
            for frame in before.solved
        ),
    )


def rechained(hand, model):
    """(16, 4, 4), the hand's rotations on another hand's bones."""
    rest = model.skeleton.scaled(hand.scale).joint_positions_m
    if hand.side == "left":
        rest = mirror_points(rest)
    joints = hand.joints_world.copy()
    for joint, parent in enumerate(JOINT_PARENTS[1:], start=1):
        joints[joint, :3, 3] = joints[parent, :3, 3] + joints[parent, :3, :3] @ (rest[joint] - rest[parent])
    return joints


@pytest.fixture(scope="module")
def folder(shaped, tmp_path_factory):
    folder = tmp_path_factory.mktemp("shaped")
    export(shaped, ["gltf", "bvh"], folder)
    return folder


@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize("key", [12, 59])
def test_gltf_plays_joints_and_skin_of_that_hand(shaped, folder, side, key):
    file = pygltflib.GLTF2().load(str(folder / "take 1.glb"))
    player, index = Player(file), 0 if side == "left" else 1
    hand = hands_of(shaped, side)[key]
    world = np.array([player.world(joint, key) for joint in file.skins[index].joints[:16]])
    assert np.abs(world[:, :3, 3] - hand.joints_world[:, :3, 3]).max() < 1e-6
    model = shaped.cast[0].hand.scaled(hand.scale)
    skinned = player.skinned(mesh_nodes(file)[index], key)
    assert np.abs(skinned - skin_hand(model, side, hand.joints_world)).max() < 1e-6
    generic = skin_hand(template().scaled(hand.scale), side, hand.joints_world)
    assert np.abs(skinned - generic).max() > 5e-3  # this shape is told from the template


@pytest.mark.parametrize("side", ["left", "right"])
def test_bvh_has_the_bones_and_tips_of_that_hand(shaped, folder, side):
    head = (folder / f"take 1_{side}.bvh").read_text().split("MOTION")[0]
    lengths = np.linalg.norm(np.array([m.split() for m in re.findall(r"OFFSET (.*)", head)], float), axis=1) / 100.0
    skeleton = shaped.cast[0].hand.skeleton.scaled(hands_of(shaped, side)[-1].scale)
    expected = list(skeleton.bone_lengths_m[1:])
    for d in range(5):  # the end site follows the last joint of its digit
        tip = np.linalg.norm(skeleton.tip_positions_m[d] - skeleton.joint_positions_m[3 + 3 * d])
        expected.insert(3 + 4 * d, tip)
    np.testing.assert_allclose(lengths[1:], expected, atol=1e-7)
