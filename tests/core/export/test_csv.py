import csv

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from core.errors import ExportError
from core.hand.mirror import mirror_points
from core.hand.skeleton import DOF_NAMES, JOINT_NAMES, TIP_JOINTS, TIP_NAMES
from core.sources import SOURCES, Sources
from core.takes.export import csv_tables, export
from core.takes.formats import read_recording
from tests.core.export.recordings import RATE, START_S, hands_of, scaled_hand, solution

STD_NAMES = [f"{name}_std" for name in DOF_NAMES]
SOURCE_NAMES = [f"{name}_source" for name in DOF_NAMES]
FIXED_NAMES = [f"{name}_std_fixed" for name in DOF_NAMES]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("csv")
    paths = export(solution(), ["csv", "points"], folder)
    assert [path.name for path in paths] == ["markers.csv", "angles.csv", "joints.csv", "points.csv"]
    return folder


def rows(path):
    with path.open(newline="") as stream:
        reader = csv.DictReader(stream)
        return reader.fieldnames, list(reader)


def test_markers(folder):
    header, table = rows(folder / "markers.csv")
    assert ",".join(header) == "frame,time_s,hand,marker,x_m,y_m,z_m,source,point,confidence,std_m,time_source_s"
    recording = solution()
    expected = [
        (frame, hand, i)
        for frame in recording.solved
        for hand in frame.hands
        if hand.state.value == "tracked"
        for i in range(19)
    ]
    assert len(table) == len(expected)
    for row, (frame, hand, i) in zip(table, expected, strict=True):
        assert (int(row["frame"]), row["hand"]) == (frame.sequence, hand.side)
        assert row["marker"] == recording.cast[0].layout.marker_names[i]
        assert float(row["time_s"]) == pytest.approx(frame.times.host_s - START_S, abs=1e-6)
        position = [float(row[axis]) for axis in ("x_m", "y_m", "z_m")]
        assert np.abs(position - hand.markers_world_m[i]).max() < 0.6e-7
        assert int(row["point"]) == hand.point[i]
        assert row["source"] == ("observed" if hand.observed[i] else "predicted")
        assert float(row["confidence"]) == pytest.approx(hand.confidence[i], abs=0.6e-4)
        std_m = float(row["std_m"] or "nan")
        assert std_m == pytest.approx(hand.marker_std_m[i], abs=0.6e-7, nan_ok=True)
    assert {row["std_m"] for row in table} == {"", "0.0007000", "0.0120000"}


def test_angles(folder):
    header, table = rows(folder / "angles.csv")
    assert header == [
        *("frame", "time_s", "hand", "state", "rms_m"), *DOF_NAMES, *STD_NAMES, *FIXED_NAMES, *SOURCE_NAMES,
        "time_source_s",
    ]  # fmt: skip
    recording = solution()
    sources = Sources(recording.cast)
    told = [sources.of(frame) for frame in recording.solved]
    assert len(table) == 2 * len(recording.solved)
    for side in ("left", "right"):
        own = [row for row in table if row["hand"] == side]
        for row, hand, each in zip(own, hands_of(recording, side), told, strict=True):
            assert row["state"] == hand.state.value
            cells = [row[name] for name in DOF_NAMES]
            if row["state"] == "tracked":
                assert np.abs(np.array(cells, dtype=float) - hand.theta_rad).max() < 0.6e-7
                assert float(row["rms_m"]) == pytest.approx(0.0012)
                deviations = np.array([row[name] for name in STD_NAMES], dtype=float)
                assert np.abs(deviations - hand.theta_std).max() < 0.6e-7
                assert [row[name] for name in SOURCE_NAMES] == [SOURCES[k] for k in each[hand.key]]
            else:
                assert {*cells, row["rms_m"], *(row[name] for name in STD_NAMES + FIXED_NAMES + SOURCE_NAMES)} == {""}


def test_what_is_not_known_of_a_tracked_hand_is_an_empty_cell_and_what_is_unbounded_is_inf(tmp_path):
    recording = solution(n_frames=12)
    hand = recording.solved[-1].hands[-1]
    hand.theta_std[:] = np.nan
    hand.theta_std[25] = np.inf
    export(recording, ["csv"], tmp_path)
    _, table = rows(tmp_path / "angles.csv")
    assert table[-1]["wrist_x_m"] != "" and table[-1]["hand"] == hand.side
    assert [table[-1][name] for name in STD_NAMES] == [""] * 25 + ["inf"]


def test_joints(folder):
    header, table = rows(folder / "joints.csv")
    assert ",".join(header) == "frame,time_s,hand,joint,x_m,y_m,z_m,qw,qx,qy,qz,time_source_s"
    own = [row for row in table if row["hand"] == "left"]
    tracked = [hand for hand in hands_of(solution(), "left") if hand.state.value == "tracked"]
    assert [row["joint"] for row in own[:21]] == [*JOINT_NAMES, *TIP_NAMES]
    positions = np.array([[float(row[k]) for k in ("x_m", "y_m", "z_m")] for row in own]).reshape(-1, 21, 3)
    xyzw = np.array([[float(row[k]) for k in ("qx", "qy", "qz", "qw")] for row in own])
    turned = Rotation.from_quat(xyzw).as_matrix().reshape(-1, 21, 3, 3)
    joints = np.array([hand.joints_world for hand in tracked])
    assert np.abs(positions[:, :16] - joints[:, :, :3, 3]).max() < 0.6e-7
    assert np.abs(turned[:, :16] - joints[:, :, :3, :3]).max() < 1e-8
    for k, (tip, joint) in enumerate(zip(TIP_NAMES, TIP_JOINTS, strict=True)):  # as the last joint carries it
        at = np.array([scaled_hand(hand).skeleton.tip_positions_m[k] for hand in tracked])
        at -= [scaled_hand(hand).skeleton.joint_positions_m[joint] for hand in tracked]
        expected = joints[:, joint, :3, 3] + np.einsum("tab,tb->ta", joints[:, joint, :3, :3], mirror_points(at))
        assert np.abs(positions[:, 16 + k] - expected).max() < 0.6e-7, tip
        assert np.array_equal(turned[:, 16 + k], turned[:, joint])
    assert (xyzw[:, 3] >= 0).all()


def test_points_are_the_raw_frames_again(folder):
    recording = read_recording(folder / "points.csv")
    assert recording.rate_hz == pytest.approx(RATE, rel=1e-6)
    for read, sent in zip(recording.frames(), solution().raw, strict=True):
        assert read.sequence == sent.sequence
        assert read.times.host_s == pytest.approx(sent.times.host_s - START_S, abs=1e-6)
        assert np.array_equal(read.ids, sent.ids)
        assert np.abs(read.points_m - sent.points_m).max() < 0.6e-7


@pytest.mark.parametrize(
    ("find", "put", "says"),
    [
        (",right,", ",left,", r"frame 7000, hand: 'left' stands where 'right' was written"),
        (",observed,", ",predicted,", r"frame 7000, source: 'predicted' stands where 'observed'"),
        ("frame,", "fram,", "its header line differs"),
        ("0.9877", "0.9878", r"frame 7000, confidence: '0\.9878' stands where 0\.98765 was written"),
    ],
)
def test_a_file_that_differs_is_named(tmp_path, monkeypatch, find, put, says):
    honest = csv_tables._check

    def damaged(table, path, *rest):
        path.write_text(path.read_text().replace(find, put, 1))
        honest(table, path, *rest)

    monkeypatch.setattr(csv_tables, "_check", damaged)
    with pytest.raises(ExportError, match=r"markers\.csv did not read back equal: .*" + says):
        export(solution(), ["csv"], tmp_path)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(("cut", "says"), [(-40, "cells instead of|stands where"), (0, "")])
def test_a_file_cut_short_is_named(tmp_path, monkeypatch, cut, says):
    honest = csv_tables._check

    def damaged(table, path, *rest):
        text = path.read_text()
        path.write_text(text[:cut] if cut else text + "7,7\n")
        honest(table, path, *rest)

    monkeypatch.setattr(csv_tables, "_check", damaged)
    with pytest.raises(ExportError, match=says or "goes on after its last line"):
        export(solution(), ["csv"], tmp_path)
