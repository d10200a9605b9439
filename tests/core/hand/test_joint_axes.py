"""What docs/joints.md states of every joint is so: in the shipped hand, and in how angles turn it."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from core.hand.joint_axes import joint_axes
from core.hand.mirror import mirror_transforms
from core.hand.model import template
from core.hand.shape import N_SHAPE, HandShape, shaped_hand
from core.hand.skeleton import DIGIT_DOF_NAMES, DOF_JOINTS, JOINT_NAMES, JOINT_PARENTS, N_DOFS, N_JOINTS, TIP_JOINTS
from core.hand.tips import tips_world
from core.kinematics.forward import joints_world
from tests.some import some

DOCS = Path(__file__).parents[3] / "docs" / "joints.md"
SIDES = ("right", "left")


def vector(values):
    return "" if np.isnan(values).any() else " ".join(f"{value:.3f}" for value in np.round(values, 3) + 0.0)


def stated(side):
    """The rows of the table of one side, from the model."""
    axes = joint_axes(template().skeleton, side)
    off = np.degrees(np.arccos(-axes.bones[:, 2]))
    columns = zip(axes.bones, off, axes.flexion, axes.abduction, strict=True)
    return [
        f"| `{name}` | {vector(bone)} | {angle:.1f} | {vector(flexion)} | {vector(abduction)} |"
        for name, (bone, angle, flexion, abduction) in zip(JOINT_NAMES, columns, strict=True)
    ]


@pytest.mark.parametrize("side", SIDES)
def test_the_table_is_the_models(side):
    text = DOCS.read_text(encoding="utf-8")
    section = text.split(f"### {side.capitalize()} hand\n")[1].split("\n#")[0]
    assert [line for line in section.splitlines() if line.startswith("| `")] == stated(side)


def test_the_table_is_true_of_every_performer():
    """Bones of other lengths and girths lie as the template's do; only the palm's, from the wrist, does not."""
    shape = HandShape(np.exp(np.random.default_rng(4).normal(0.0, 0.12, N_SHAPE)))
    own, shipped = (joint_axes(s, "left") for s in (shaped_hand(template(), shape).skeleton, template().skeleton))
    np.testing.assert_allclose(own.bones[1:], shipped.bones[1:], atol=1e-9)
    np.testing.assert_array_equal(own.flexion, shipped.flexion)
    np.testing.assert_array_equal(own.abduction, shipped.abduction)
    assert np.degrees(np.arccos(own.bones[0] @ shipped.bones[0])) < 3.0


@pytest.mark.parametrize("side", SIDES)
def test_angles_turn_the_joints_about_these_axes(side):
    """Forward kinematics once more, from what the page says alone: the first angle's axis in the parent's frame, the
    second's in the joint's own, both by the right-hand rule."""
    theta = np.zeros(N_DOFS)
    theta[:6] = 0.1, 1.2, -0.3, 0.4, -0.2, 0.9
    theta[6:] = np.random.default_rng(5).uniform(-0.4, 0.9, N_DOFS - 6)
    world = joints_world(template().skeleton, theta)
    if side == "left":
        world = mirror_transforms(world)
    axes = joint_axes(template().skeleton, side)
    by_kind = {"flexion": axes.flexion, "abduction": axes.abduction}
    local = np.tile(np.eye(3), (N_JOINTS, 1, 1))
    for name, joint, angle in zip(DIGIT_DOF_NAMES, DOF_JOINTS, theta[6:], strict=True):
        axis = by_kind[name.rsplit("_", 1)[1]][joint]
        local[joint] = local[joint] @ Rotation.from_rotvec(angle * axis).as_matrix()
    for joint, parent in some(enumerate(JOINT_PARENTS[1:], start=1)):
        np.testing.assert_allclose(world[parent, :3, :3].T @ world[joint, :3, :3], local[joint], atol=1e-9)


@pytest.mark.parametrize("side", SIDES)
def test_bones_lead_to_the_next_joint_or_the_tip(side):
    theta = np.zeros(N_DOFS)
    theta[3:] = np.random.default_rng(6).uniform(-0.3, 0.8, N_DOFS - 3)
    skeleton = template().skeleton
    world = joints_world(skeleton, theta)
    world = mirror_transforms(world) if side == "left" else world
    ends = np.roll(world[:, :3, 3], -1, axis=0)
    ends[0] = world[7, :3, 3]
    ends[list(TIP_JOINTS)] = tips_world(skeleton, side, world, 1.0)
    along = ends - world[:, :3, 3]
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    bones = joint_axes(skeleton, side).bones
    np.testing.assert_allclose(np.einsum("jab,jb->ja", world[:, :3, :3], bones), along, atol=1e-9)


@pytest.mark.parametrize("side", SIDES)
def test_frames_along_the_bones_as_the_page_makes_them(side):
    """A proper rotation whose -Z is the bone, in which flexion turns about X alone as far as its axis is across."""
    axes = joint_axes(template().skeleton, side)
    for joint in range(1, N_JOINTS):
        z = -axes.bones[joint]
        x = -axes.flexion[joint] + (axes.flexion[joint] @ z) * z
        x /= np.linalg.norm(x)
        frame = np.column_stack([x, np.cross(z, x), z])
        assert np.linalg.det(frame) == pytest.approx(1.0)
        assert np.allclose(frame @ (0.0, 0.0, -1.0), axes.bones[joint])
        assert abs(axes.flexion[joint] @ frame[:, 1]) < 1e-9
