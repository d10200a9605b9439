import re

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from core.errors import ExportError
from core.hand.mirror import mirror_points
from core.hand.model import template
from core.hand.skeleton import JOINT_NAMES, JOINT_PARENTS
from core.takes.export import ExportOptions, bvh, export
from core.takes.formats.bvh import read_bvh
from tests.core.export.recordings import RATE, hands_of, solution
from tests.data import data_path


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("bvh")
    paths = export(solution(), ["bvh"], folder)
    assert [path.name for path in paths] == ["take 1_left.bvh", "take 1_right.bvh", "take 1_held.csv"]
    return folder


def held_hands(side):
    """The hand on the even grid of 240 frames, as last tracked; before that, as first tracked."""
    frames = {
        frame.sequence - 7000: hand for frame, hand in zip(solution().solved, hands_of(solution(), side), strict=True)
    }
    first = next(hand for hand in frames.values() if hand.state.value == "tracked")
    last, held = first, []
    for i in range(240):
        if i in frames and frames[i].state.value == "tracked":
            last = frames[i]
        held.append(last)
    return held


@pytest.mark.parametrize("side", ["left", "right"])
def test_the_file_evaluates_to_the_joints(folder, side):
    """Evaluated here by scipy, along the tree that the file's nesting tells."""
    text = (folder / f"take 1_{side}.bvh").read_text()
    head, motion = text.split("MOTION\n")
    names = re.findall(r"(?:ROOT|JOINT) (\w+)", head)
    offsets = np.array([line.split() for line in re.findall(r"OFFSET (.*)", head)], dtype=float)
    ends = [m.start() for m in re.finditer("End Site", head)]
    own = [m.start() for m in re.finditer("OFFSET", head)]
    is_joint = [head.rfind("{", 0, at) not in [head.find("{", end) for end in ends] for at in own]
    assert names == [f"{side[0].upper()}_{name}" for name in JOINT_NAMES]
    assert head.count("{") == head.count("}") == 16 + 5
    assert set(re.findall(r"CHANNELS \d (.*)", head)) == {
        "Xposition Yposition Zposition Zrotation Yrotation Xrotation", "Zrotation Yrotation Xrotation"
    }  # fmt: skip
    frames, frame_time, *rows = motion.strip().split("\n")
    assert frames == "Frames: 240"
    assert 1.0 / float(frame_time.removeprefix("Frame Time: ")) == pytest.approx(RATE, rel=1e-7)
    values = np.array([row.split() for row in rows], dtype=float)
    held = held_hands(side)
    final = held[-1].scale

    world = Rotation.from_euler("ZYX", values[:, 3:].reshape(-1, 3), degrees=True).as_matrix().reshape(240, 16, 3, 3)
    positions = np.empty((240, 16, 3))
    positions[:, 0] = values[:, :3]
    joint_offsets = offsets[is_joint]
    for joint in range(1, 16):
        parent = JOINT_PARENTS[joint]
        positions[:, joint] = positions[:, parent] + world[:, parent] @ joint_offsets[joint]
        world[:, joint] = world[:, parent] @ world[:, joint]
    joints = np.array([hand.joints_world[:, :3, 3] for hand in held])
    sizes = np.array([hand.scale for hand in held])[:, None, None] / final
    expected = joints[:, :1] + (joints - joints[:, :1]) / sizes
    assert np.abs(positions / 100.0 - expected).max() < 1e-6
    assert np.abs(world - np.array([hand.joints_world[:, :3, :3] for hand in held])).max() < 1e-8
    settled = sizes.ravel() == 1.0  # from there on the bones are the hand's own
    assert settled.sum() > 200
    assert np.abs(positions / 100.0 - joints)[settled].max() < 1e-6

    tips = template().skeleton.scaled(final).tip_positions_m
    rest = template().skeleton.scaled(final).joint_positions_m[3::3]
    sites = offsets[~np.array(is_joint)] / 100.0
    assert np.allclose(sites, mirror_points(tips - rest) if side == "left" else tips - rest, atol=1e-8)


@pytest.mark.parametrize("unit", ["mm", "cm", "m"])
@pytest.mark.parametrize("up", ["y", "z"])
def test_another_unit_and_another_axis_up(folder, tmp_path, unit, up):
    """Only the root turns; with Z up x, y, z of the file are x, -z, y of the world."""
    path, *_ = export(solution(), ["bvh"], tmp_path, options=ExportOptions(up=up, unit=unit))
    read, plain = read_bvh(path), read_bvh(folder / "take 1_left.bvh")
    per_cm = {"mm": 10.0, "cm": 1.0, "m": 0.01}[unit]
    expected = plain.positions() * per_cm
    if up == "z":
        expected = np.stack([expected[..., 0], -expected[..., 2], expected[..., 1]], axis=-1)
    np.testing.assert_allclose(read.positions(), expected, atol=1e-4 * per_cm)  # 1 um
    np.testing.assert_allclose(read.offsets, plain.offsets * per_cm, atol=1e-6 * max(per_cm, 0.1))
    np.testing.assert_array_equal(read.values[:, 6:], plain.values[:, 6:])


def test_angles_do_not_jump():
    """A wrist that turns around and around through every singularity."""
    angles = np.linspace(0.0, 6 * np.pi, 2000)
    axis = np.array([[0.2, 1.0, 0.1]]) / np.linalg.norm([0.2, 1.0, 0.1])
    rotations = Rotation.from_rotvec(angles[:, None] * axis)
    quaternions = np.repeat(rotations.as_quat()[:, None], 16, axis=1)
    euler = bvh._smooth_euler(quaternions)
    assert np.abs(Rotation.from_euler("ZYX", euler[:, 3]).as_matrix() - rotations.as_matrix()).max() < 1e-9
    assert np.degrees(np.abs(np.diff(euler, axis=0)).max()) < 10.0
    plain = rotations.as_euler("ZYX")
    assert np.degrees(np.abs(np.diff(plain, axis=0)).max()) > 100.0


def test_right_through_the_singularity():
    turn = Rotation.from_euler("Y", np.linspace(60, 120, 61)[:, None], degrees=True)
    euler = bvh._smooth_euler(np.repeat(turn.as_quat()[:, None], 16, axis=1))
    assert np.abs(Rotation.from_euler("ZYX", euler[:, 0]).as_matrix() - turn.as_matrix()).max() < 1e-7
    assert np.allclose(np.degrees(euler[:, 0, 1]), np.linspace(60, 120, 61), atol=1e-3)


@pytest.mark.parametrize("name", ["sojamo_axis-streamer_test.bvh", "openPerform_freya_edit.bvh"])
def test_the_reader_reads_files_of_other_programs(name):
    read = read_bvh(data_path("neuron", name))
    assert read.parents[0] == -1 and all(-1 < parent < i for i, parent in enumerate(read.parents) if i)
    positions = read.positions()
    assert positions.shape == (len(read.values), len(read.names), 3)
    assert np.isfinite(positions).all()
    still = [
        i for i, c in enumerate(read.channels) if len(c) == 3 or not c
    ]  # bones without positions keep their length
    lengths = np.linalg.norm(positions[:, still] - positions[:, [read.parents[i] for i in still]], axis=2)
    assert np.allclose(lengths, np.linalg.norm(read.offsets[still], axis=1), atol=1e-6)


@pytest.mark.parametrize(
    ("find", "put", "says"),
    [
        ("Frames: 240", "Frames: 241", "it is not sound"),
        ("JOINT L_index_pip", "JOINT L_index_pop", "it holds the joints"),
        ("Frame Time: 0.0083", "Frame Time: 0.0084", r"its frame time is 0\.0084"),
        ("End Site", "Ends Site", "unknown word 'Ends'"),
    ],
)
def test_a_file_that_differs_is_named(tmp_path, monkeypatch, find, put, says):
    honest = bvh._check

    def damaged(path, *rest):
        path.write_text(path.read_text().replace(find, put, 1))
        honest(path, *rest)

    monkeypatch.setattr(bvh, "_check", damaged)
    with pytest.raises(ExportError, match=r"take 1_left\.bvh did not read back equal: .*" + says):
        export(solution(), ["bvh"], tmp_path)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(("joint", "name"), [(5, "L_index_dip"), (15, "L_pinky_dip end")])
def test_a_wrong_angle_is_named(tmp_path, monkeypatch, joint, name):
    honest = bvh._smooth_euler

    def wrong(rotations):
        angles = honest(rotations)
        angles[200, joint, 2] += 1e-3
        return angles

    monkeypatch.setattr(bvh, "_smooth_euler", wrong)
    with pytest.raises(ExportError, match=rf"frame 201, {name}: .* m stands where"):
        export(solution(), ["bvh"], tmp_path)
