"""BVH and glTF at a rate that was asked for: motion between the frames, and nothing made up where there are none."""

import csv

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from core.frames import HandKey
from core.gltf import read_glb
from core.takes.export import ExportOptions, export
from core.takes.export.content import look_through
from core.takes.export.gltf_motion import gltf_hands, read_tracks
from core.takes.export.hands import blended_rotations, hand_motion
from core.takes.export.progress import Progress
from core.takes.formats.bvh import read_bvh
from tests.core.export.recordings import RATE, hands_of, solution
from tests.core.export.test_props import with_props

AT_300 = ExportOptions(rate_hz=300.0)


def as_solved(side):
    """Times [s] and joints of the hand in the frames in which it is tracked; (240,) bool of those on the own grid."""
    frames = [frame.sequence - 7000 for frame in solution().solved]
    there = np.zeros(240, dtype=bool)
    joints = np.full((240, 16, 3), np.nan)
    for frame, hand in zip(frames, hands_of(solution(), side), strict=True):
        if hand.state.value == "tracked":
            there[frame], joints[frame] = True, hand.joints_world[:, :3, 3]
    return there, joints


@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize("rate_hz", [300.0, 60.0])
def test_every_place_lies_between_its_frames(tmp_path, side, rate_hz):
    *files, _ = export(solution(), ["bvh", "gltf"], tmp_path, options=ExportOptions(rate_hz=rate_hz))
    index = 0 if side == "left" else 1
    bvh = read_bvh(files[index])
    glb = gltf_hands(read_glb(files[2]))[index]
    assert 1.0 / bvh.frame_time_s == pytest.approx(rate_hz, rel=1e-6)
    n = int(239 / RATE * rate_hz + 1e-6) + 1
    assert len(bvh.values) == n == len(glb.times_s)
    np.testing.assert_allclose(glb.times_s, np.arange(n) / rate_hz, atol=1e-6)
    assert read_glb(files[2]).document["asset"]["extras"]["rate_hz"] == rate_hz
    names = [bvh.names.index(name) for name in glb.joint_names[:16]]
    found = glb.positions_m()[:, :16]
    there, joints = as_solved(side)
    place = np.arange(n) / rate_hz * RATE
    before = np.floor(place + 1e-6).astype(int)
    both = there[before] & there[np.minimum(before + 1, 239)]
    share = np.clip(place - before, 0.0, 1.0)[:, None, None]
    straight = (1.0 - share) * joints[before] + share * joints[np.minimum(before + 1, 239)]
    assert both.sum() > 0.7 * n
    assert np.abs(found[both] - straight[both]).max() < 0.2e-3  # an arc and its chord, one frame long
    settled = both & (before > 20)
    assert np.abs(bvh.positions()[settled][:, names] / 100.0 - found[settled]).max() < 1e-6
    at_frame = there[before] & (np.abs(share[:, 0, 0]) < 1e-5)
    assert at_frame.sum() > 50 and np.abs(found[at_frame] - joints[before[at_frame]]).max() < 1e-6


def test_over_a_lost_hand_and_a_lost_frame_the_pose_is_held_and_said(tmp_path):
    *files, held = export(solution(), ["bvh", "gltf"], tmp_path, options=AT_300)
    values = read_bvh(files[0]).values
    with held.open(newline="") as stream:
        rows = [row for row in csv.DictReader(stream) if row["held"] == "left hand"]
    assert [row["reason"] for row in rows] == ["not found yet", "lost", "no frames"]
    for row in rows:
        part = values[int(row["from_frame"]) - 1 : int(row["to_frame"])]
        assert len(part) == round((float(row["to_s"]) - float(row["from_s"])) * 300.0)
        assert (part == part[0]).all()
    assert (int(rows[1]["from_frame"]), int(rows[1]["to_frame"])) == (76, 150)  # 0.25 s to 0.5 s
    (node,) = [node for node in read_glb(files[2]).document["nodes"] if node["name"] == "left hand"]
    assert [one["reason"] for one in node["extras"]["held"]] == ["not found yet", "lost", "no frames"]


def test_a_rate_so_low_that_no_frame_is_held(tmp_path):
    *_, held = export(
        solution(60, lost=(21,), untracked=(0, 0)), ["bvh"], tmp_path, options=ExportOptions(rate_hz=60.0)
    )
    with held.open(newline="") as stream:
        (row,) = [row for row in csv.DictReader(stream) if row["held"] == "right hand"]
    assert (row["reason"], row["from_frame"], row["to_frame"]) == ("no frames", "", "")


def test_bones_keep_their_length_between_frames(tmp_path):
    content = look_through(solution(), AT_300, False, Progress(None))
    motion = hand_motion(content, HandKey(0, "right"), Progress(None))
    before, after = np.arange(30, 90), np.arange(31, 91)
    moved = motion.between(before, after, np.full(60, 0.4))
    lengths = np.linalg.norm(moved.joints_m[:, 4:7] - moved.joints_m[:, [0, 4, 5]], axis=2)
    np.testing.assert_allclose(lengths / lengths[0], 1.0, atol=1e-9)
    np.testing.assert_array_equal(motion.between(before, after, np.zeros(60)).joints_m, motion.joints_m[before])


def test_rotations_are_blended_as_scipy_blends_them():
    turns = Rotation.random(40, random_state=3)
    start, end = turns.as_quat()[:20], turns.as_quat()[20:]
    share = np.linspace(0.0, 1.0, 20)
    expected = [
        Slerp([0, 1], Rotation.from_quat([a, b]))(s).as_matrix() for a, b, s in zip(start, end, share, strict=True)
    ]
    found = Rotation.from_quat(blended_rotations(start, end, share)).as_matrix()
    np.testing.assert_allclose(found, expected, atol=1e-9)
    np.testing.assert_allclose(blended_rotations(start, start, share), start, atol=1e-12)


def test_props_move_between_frames_too(tmp_path):
    file, _ = export(with_props(), ["gltf"], tmp_path, options=AT_300)
    glb = read_glb(file)
    (number,) = [i for i, node in enumerate(glb.document["nodes"]) if node["name"] == "pen"]
    tracks, times_s = read_tracks(glb)
    own = {f.sequence - 7000: f.props[0].transform_world[:3, 3] for f in with_props().solved if f.props[0].tracked}
    checked = 0
    for time_s, position in zip(times_s, tracks[number, "translation"], strict=True):
        place = time_s * RATE
        low = int(np.floor(place + 1e-4))
        if low in own and low + 1 in own:
            share = place - low
            np.testing.assert_allclose(position, (1 - share) * own[low] + share * own[low + 1], atol=1e-5)
            checked += 1
    assert checked > 300
