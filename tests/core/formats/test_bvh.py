"""Rotations of bones out of BVH files: those of a glove's maker, and our own."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from core.errors import FormatError
from core.frames import InertialFrame
from core.hand.skeleton import JOINT_PARENTS
from core.takes.export import ExportOptions, export
from core.takes.export.bone_names import BONE_SCHEMES, bone_names
from core.takes.formats import read_recording
from core.takes.formats.bvh import is_bvh, read_bvh
from core.takes.formats.bvh_frames import frames_of, side_of, stream_of
from core.takes.stream_text import MOST_BONES
from tests.core.export.recordings import RATE, solution
from tests.core.export.test_bvh import held_hands
from tests.data import data_path
from tests.some import some

ARM = """HIERARCHY
ROOT LeftHand
{
\tOFFSET 1 2 3
\tCHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
\tJOINT LeftThumb1
\t{
\t\tOFFSET 0 10 0
\t\tCHANNELS 3 Yrotation Zrotation Xrotation
\t\tJOINT LeftThumb2
\t\t{
\t\t\tOFFSET 0 5 0
\t\t\tCHANNELS 1 Xrotation
\t\t\tEnd Site
\t\t\t{
\t\t\t\tOFFSET 0 2 0
\t\t\t}
\t\t}
\t}
}
MOTION
Frames: 2
Frame Time: 0.01
100 0 0 0 0 0 90 0 0 0
100 20 0 10 20 30 40 50 60 -70
"""


def write(folder: Path, text: str = ARM) -> Path:
    path = folder / "arm.bvh"
    path.write_text(text, encoding="utf-8")
    return path


def matrix(order: str, *degrees: float) -> np.ndarray:
    """Each about the axes that those before have turned: the last one meets the bone first."""
    turned = np.eye(3)
    for axis, angle in some(zip(order, np.radians(degrees), strict=True)):
        i, j = {"X": (1, 2), "Y": (2, 0), "Z": (0, 1)}[axis]
        one = np.eye(3)
        one[i, i] = one[j, j] = math.cos(angle)
        one[i, j], one[j, i] = -math.sin(angle), math.sin(angle)
        turned = turned @ one
    return turned


def test_channels_turn_in_the_order_of_the_file(tmp_path: Path) -> None:
    motion = read_bvh(write(tmp_path))
    assert motion.names == ("LeftHand", "LeftThumb1", "LeftThumb2", "LeftThumb2 end")
    assert motion.parents == (-1, 0, 1, 2) and motion.frame_time_s == 0.01 and motion.warnings == ()
    frames = list(frames_of(motion))
    assert [frame.sequence for frame in frames] == [0, 1]
    assert [frame.times.device_s for frame in frames] == [0.0, 0.01]
    expected = matrix("ZXY", 10, 20, 30), matrix("YZX", 40, 50, 60), matrix("X", -70)
    for frame in frames:
        assert frame.bone_names == ("LeftHand", "LeftThumb1", "LeftThumb2") and frame.side == "left"
        assert np.allclose(np.linalg.norm(frame.rotations_wxyz, axis=1), 1.0, atol=1e-15)
    for wxyz, one in zip(frames[1].rotations_wxyz, expected, strict=True):
        assert np.abs(Rotation.from_quat(wxyz, scalar_first=True).as_matrix() - one).max() < 1e-15
    assert np.allclose(frames[0].rotations_wxyz[1], [math.sqrt(0.5), 0, math.sqrt(0.5), 0])
    # A root's own position stands in place of its offset; lengths are centimetres.
    assert np.array_equal(frames[0].positions_m, [[1.0, 0, 0], [0, 0.1, 0], [0, 0.05, 0]])
    assert np.array_equal(frames[1].positions_m[0], [1.0, 0.2, 0])
    assert np.isnan(frames[0].angular_radps).all() and not frames[0].state.any()


def test_what_is_true_of_all_frames(tmp_path: Path) -> None:
    info = stream_of(read_bvh(write(tmp_path)))
    assert (info.key, info.what, info.rate_hz, info.rotations) == ("inertial", "inertial", 100.0, "parent")
    assert info.bone_names == ("LeftHand", "LeftThumb1", "LeftThumb2") and info.sides == ("left",)


def test_positions_in_the_world(tmp_path: Path) -> None:
    motion = read_bvh(write(tmp_path))
    root, thumb = matrix("ZXY", 10, 20, 30), matrix("YZX", 40, 50, 60)
    at = np.array([100.0, 20, 0])
    expected = [at, at + root @ [0, 10, 0], at + root @ ([0, 10, 0] + thumb @ [0, 5, 0])]
    assert np.abs(motion.positions()[1, :3] - expected).max() < 1e-12


def test_a_suit_of_perception_neuron() -> None:
    """59 bones, 733 frames at 125 Hz, Euler angles Y X Z, every bone with its own place."""
    path = data_path("neuron", "openPerform_freya_edit.bvh")
    assert is_bvh(path)
    motion = read_bvh(path)
    info = stream_of(motion)
    assert (len(info.bone_names), info.rate_hz, info.sides) == (59, 125.0, ("left", "right"))
    assert info.bone_names[:3] == ("Hips", "RightUpLeg", "RightLeg") and info.bone_names[-1] == "LeftHandPinky3"
    frames = list(frames_of(motion))
    assert [frame.sequence for frame in frames] == list(range(733))
    rows = path.read_text().split("Frame Time:")[1].split("\n")[1:]
    for k in some((0, 255, 256, 732)):
        frame, values = frames[k], np.array(rows[k].split(), dtype=float).reshape(59, 6)
        assert frame.side is None and frame.times.host_s == pytest.approx(k / 125)
        assert np.allclose(frame.positions_m, values[:, :3] / 100.0, atol=1e-12)
        turned = np.array([matrix("YXZ", *angles) for angles in values[:, 3:]])
        got = Rotation.from_quat(frame.rotations_wxyz, scalar_first=True).as_matrix()
        assert np.abs(got - turned).max() < 1e-12


@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize(("unit", "up"), [(None, "y"), ("cm", "z")])
def test_our_own_exports_give_back_the_rotations(tmp_path: Path, side: str, unit: str | None, up: str) -> None:
    paths = export(solution(), ["bvh"], tmp_path, options=ExportOptions(unit=unit, up=up))
    path = next(path for path in paths if path.name.endswith(f"_{side}.bvh"))
    frames = list(frames_of(read_bvh(path)))
    held = held_hands(side)
    assert len(frames) == len(held) == 240
    turned_up = Rotation.from_euler("X", 90, degrees=True).as_matrix() if up == "z" else np.eye(3)
    for frame, hand in zip(frames, held, strict=True):
        assert isinstance(frame, InertialFrame) and frame.side == side
        local = Rotation.from_quat(frame.rotations_wxyz, scalar_first=True).as_matrix()
        world = hand.joints_world[:, :3, :3]
        parents = np.array(JOINT_PARENTS[1:])
        assert np.abs(local[0] - turned_up @ world[0]).max() < 1e-8
        assert np.abs(local[1:] - np.swapaxes(world[parents], 1, 2) @ world[1:]).max() < 1e-8
        assert np.abs(frame.positions_m[0] - turned_up @ hand.joints_world[0, :3, 3]).max() < 1e-8
    assert stream_of(read_bvh(path)).rate_hz == pytest.approx(RATE, rel=1e-7)


def test_sides_by_the_names_of_every_program() -> None:
    for scheme in BONE_SCHEMES:
        for side in ("left", "right"):
            names = bone_names(scheme, side)
            assert {side_of(f"{who}{name}") for name in names.joints for who in ("", "Anna_", "Kurt:")} == {side}
    others = ("Hips", "Spine3", "Head", "index_01", "Leftover", "R_L_wrist", "", "lr", "righteous", "Bright")
    assert {side_of(name) for name in others} == {None}
    assert side_of("RightInHandIndex") == side_of("RHand") == side_of("RIGHT_HAND") == "right"


def test_both_hands_are_no_side(tmp_path: Path) -> None:
    for name, side, sides in (("RightThumb2", None, ("left", "right")), ("Tip", None, ("left",))):
        motion = read_bvh(write(tmp_path, ARM.replace("LeftThumb2", name)))
        assert next(frames_of(motion)).side is side and stream_of(motion).sides == sides


def test_names_that_come_again_are_told_apart(tmp_path: Path) -> None:
    info = stream_of(read_bvh(write(tmp_path, ARM.replace("LeftThumb2", "LeftThumb1"))))
    assert info.bone_names == ("LeftHand", "LeftThumb1", "LeftThumb1 2")


@pytest.mark.parametrize(
    ("find", "put", "says"),
    [
        ("HIERARCHY", "HIERARCHIE", r"line 1 has 'HIERARCHIE' where HIERARCHY should stand"),
        ("ROOT", "JOINT", "line 2 has JOINT outside of another joint"),
        ("JOINT LeftThumb2", "ROOT LeftThumb2", "line 10 has ROOT within another joint"),
        ("\t\tJOINT LeftThumb2\n\t\t{", "\t\tJOINT LeftThumb2\n", "where { should stand"),
        ("OFFSET 0 5 0", "", "line 18 ends joint LeftThumb2, which has no OFFSET"),
        ("OFFSET 0 5 0", "OFFSET 0 5", "gives OFFSET as 'CHANNELS'"),
        ("OFFSET 0 5 0", "OFFSET 0 nan 0", "gives OFFSET as 'nan'"),
        ("CHANNELS 1 Xrotation", "CHANNELS 7 Xrotation", "gives a joint '7' channels"),
        ("CHANNELS 1 Xrotation", "CHANNELS 1 Wrotation", "has channels Wrotation"),
        ("CHANNELS 3 Yrotation Zrotation", "CHANNELS 3 Zrotation Zrotation", "has channels Zrotation Zrotation"),
        ("End Site", "Ends Site", "unknown word 'Ends'"),
        ("}\nMOTION", "MOTION", "unknown word 'MOTION', or one out of its place"),
        ("Frames: 2", "Frames: two", "line 22 gives Frames as 'two'"),
        ("Frames: 2", "Frames: 9999999999999999", "gives Frames as"),
        ("Frames: 2", "Frames: 999999999999999", "too many to open at once"),
        ("Frame Time: 0.01", "Frame Time: 0", "says that a frame takes 0 s"),
        ("Frame Time: 0.01", "Frame Time: 1e300", r"says that a frame takes 1e\+300 s"),
        ("Frame Time: 0.01", "Rate: 100", "has 'Rate: 100' where Frame Time should stand"),
        ("60 -70", "60 nan", "frame 2 has no number for Xrotation of LeftThumb2"),
        ("60 -70", "60", "has 9 columns instead of 10"),
        ("60 -70", "60 x", "column 10: 'x' is not a number"),
        (ARM[ARM.index("100 0") :], "", "ends at line 23, before its first frame"),
        (ARM[ARM.index("MOTION") :], "", "before its motion"),
        (ARM[ARM.index("Frame Time") :], "", "before Frame Time"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_said_where(tmp_path: Path, find: str, put: str, says: str) -> None:
    assert find in ARM
    with pytest.raises(FormatError, match=says) as refused:
        read_bvh(write(tmp_path, ARM.replace(find, put, 1)))
    assert str(refused.value).startswith("arm.bvh") and refused.value.action


def test_a_file_that_was_cut_off_keeps_what_is_whole(tmp_path: Path) -> None:
    motion = read_bvh(write(tmp_path, ARM.replace("Frames: 2", "Frames: 3") + "100 20 0 10"))
    assert len(motion.values) == 2
    assert motion.warnings == (
        "Its last line is cut off and was left out.", "Its header promises 3 frames, 2 are there.",
    )  # fmt: skip


def test_no_endless_skeletons(tmp_path: Path) -> None:
    bone = "JOINT a\n{\nOFFSET 0 0 0\n"
    with pytest.raises(FormatError, match="has more than 2,048 joints"):
        read_bvh(write(tmp_path, "HIERARCHY\n" + bone.replace("JOINT", "ROOT") + bone * (2 * MOST_BONES)))
    with pytest.raises(FormatError, match="a skeleton of which no joint moves"):
        read_bvh(write(tmp_path, "HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\n}\nMOTION\nFrames: 1\nFrame Time: 1\n\n"))


def test_who_asks_for_markers_is_told_what_it_is(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match=r"arm\.bvh holds rotations of bones \(BVH\) and no markers"):
        read_recording(write(tmp_path))
    assert not is_bvh(tmp_path) and not is_bvh(tmp_path / "none.bvh")
