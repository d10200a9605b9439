from dataclasses import replace

import ezc3d
import numpy as np
import pytest

from core.errors import ExportError
from core.frames import Times
from core.takes.export import ExportOptions, c3d, export
from core.takes.formats import read_recording
from core.takes.formats.c3d import read_with_residuals
from tests.core.export.recordings import RATE, every_point, hands_of, scaled_hand, solution


def expected_points(recording):
    """(t, m, 3) [m] and kinds (t, m): -1 missing, 0 predicted, 1 measured; on the even grid."""
    first = recording.solved[0].sequence
    n_frames = recording.solved[-1].sequence - first + 1
    m = len(recording.cast[0].layout.marker_names)
    points = np.full((n_frames, 2 * m, 3), np.nan)
    kinds = np.full((n_frames, 2 * m), -1)
    for i, side in enumerate(recording.cast[0].sides):
        for frame, hand in zip(recording.solved, hands_of(recording, side), strict=True):
            if hand.state.value == "tracked":
                points[frame.sequence - first, i * m : (i + 1) * m] = hand.markers_world_m
                kinds[frame.sequence - first, i * m : (i + 1) * m] = hand.observed
    return points, kinds


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    (path,) = export(solution(), ["c3d"], tmp_path_factory.mktemp("c3d"))
    return path


def test_ezc3d_reads_the_same(written):
    recording = solution()
    points, kinds = expected_points(recording)
    assert written.name == "take 1.c3d"
    file = ezc3d.c3d(str(written))
    point = file["parameters"]["POINT"]
    names = recording.cast[0].layout.marker_names
    assert point["LABELS"]["value"] == [f"{side}_{name}" for side in "LR" for name in names]
    assert point["UNITS"]["value"] == ["mm"]
    assert (point["X_SCREEN"]["value"], point["Y_SCREEN"]["value"]) == (["+X"], ["+Y"])
    assert point["RATE"]["value"][0] == RATE and file["header"]["points"]["frame_rate"] == RATE
    assert point["FRAMES"]["value"][0] == len(points) == 240
    assert file["header"]["points"]["last_frame"] == 239  # the library counts from 0
    data = file["data"]["points"][:3].transpose(2, 1, 0)
    assert np.allclose(data / 1000.0, points, atol=1e-6, equal_nan=True)
    invalid = file["data"]["meta_points"]["residuals"][0].T < 0
    assert np.array_equal(invalid, kinds < 0)
    assert np.isnan(points[100:102]).all()  # frames that never arrived


def test_residual_word_as_the_format_defines_it(written):
    data = written.read_bytes()
    start = (int(np.frombuffer(data[16:18], "<u2")[0]) - 1) * 512
    points, kinds = expected_points(solution())
    table = np.frombuffer(data[start : start + points.shape[0] * points.shape[1] * 16], "<f4").reshape(*kinds.shape, 4)
    word = table[:, :, 3].astype(np.int16)
    residual_byte, camera_byte = word & 0xFF, word >> 8
    assert np.array_equal(word < 0, kinds < 0)
    assert np.array_equal(residual_byte[kinds >= 0] > 0, kinds[kinds >= 0] == 1)
    assert not camera_byte[kinds >= 0].any()
    assert not table[:, :, :3][kinds < 0].any()
    assert len(data) % 512 == 0


def test_our_reader_reads_the_same(written):
    recording, residuals = read_with_residuals(written)
    points, kinds = expected_points(solution())
    assert recording.rate_hz == RATE
    assert np.allclose(recording.points_m, points, atol=1e-6, equal_nan=True)
    assert np.array_equal(residuals, kinds)


def test_with_joint_centres(tmp_path):
    (path,) = export(solution(), ["c3d"], tmp_path, options=ExportOptions(joints=True))
    recording = every_point(path)
    labels = recording.labels
    assert labels[38] == "L_wrist_joint" and labels[-1] == "R_pinky_tip_joint" and len(labels) == 38 + 2 * (16 + 5)
    last = np.array([hand.joints_world[15, :3, 3] for hand in hands_of(solution(), "right")])
    arrived = np.r_[0:100, 102:240]
    at = labels.index("R_pinky_dip_joint")
    assert np.allclose(recording.points_m[arrived, at], last, atol=1e-6)
    for side, mirror in (("left", -1.0), ("right", 1.0)):
        hand = hands_of(solution(), side)[200 - 2]
        skeleton = scaled_hand(hand).skeleton
        for k, digit in enumerate(("thumb", "index", "middle", "ring", "pinky")):
            bone = (skeleton.tip_positions_m[k] - skeleton.joint_positions_m[3 * k + 3]) * (mirror, 1.0, 1.0)
            tip = hand.joints_world[3 * k + 3, :3] @ (*bone, 1.0)
            column = labels.index(f"{side[0].upper()}_{digit}_tip_joint")
            assert np.allclose(recording.points_m[200, column], tip, atol=1e-6)


def test_split_at_the_limit_of_the_format(tmp_path, monkeypatch):
    monkeypatch.setattr(c3d, "MAX_FRAMES", 100)
    paths = export(solution(), ["c3d"], tmp_path)
    assert [path.name for path in paths] == ["take 1_part1.c3d", "take 1_part2.c3d", "take 1_part3.c3d"]
    parts = [every_point(path) for path in paths]
    assert [part.n_frames for part in parts] == [100, 100, 40]
    points, _ = expected_points(solution())
    assert np.allclose(np.concatenate([part.points_m for part in parts]), points, atol=1e-6, equal_nan=True)
    own = [ezc3d.c3d(str(path))["parameters"]["PHALANX"] for path in paths]
    assert [(int(o["PART"]["value"][0]), int(o["PARTS"]["value"][0])) for o in own] == [(1, 3), (2, 3), (3, 3)]
    assert own[2]["START_S"]["value"][0] == pytest.approx(200 / RATE)


def test_more_frames_than_one_file_holds(tmp_path):
    some = solution(41, "schroeder6", lost=())
    frames = [
        replace(some.solved[i % 41], sequence=i, times=Times(i / RATE, i / RATE, i / RATE)) for i in range(65_540)
    ]
    first, second = export(replace(some, solved=frames, raw=()), ["c3d"], tmp_path)
    assert ezc3d.c3d(str(second))["parameters"]["POINT"]["FRAMES"]["value"][0] == 5
    assert read_recording(first).n_frames == 65_535
    right = hands_of(some, "right")[65_539 % 41].markers_world_m
    assert np.allclose(every_point(second).points_m[-1, 6:], right, atol=1e-6)


def test_a_file_that_differs_is_named(written, tmp_path, monkeypatch):
    honest = c3d._points

    def damaged(points_m, measured):
        data = bytearray(honest(points_m, measured))
        frame, marker = 150, 20
        at = (frame * 38 + marker) * 16
        data[at : at + 4] = np.float32(123.0).tobytes()
        return bytes(data)

    monkeypatch.setattr(c3d, "_points", damaged)
    with pytest.raises(
        ExportError, match=r"take 1\.c3d did not read back equal: frame 151, R_ThumbMCP: 0\.123 m stands"
    ):
        export(solution(), ["c3d"], tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_a_file_cut_short_is_named(tmp_path, monkeypatch):
    honest = c3d._check

    def cut(path, *rest):
        path.write_bytes(path.read_bytes()[:-4096])
        honest(path, *rest)

    monkeypatch.setattr(c3d, "_check", cut)
    with pytest.raises(ExportError, match=r"take 1\.c3d did not read back equal: it holds 233 x 38 x 3 values"):
        export(solution(), ["c3d"], tmp_path)
