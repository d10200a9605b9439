"""A hand that is lost: absent where a format can say so, and said where it cannot."""

from __future__ import annotations

import csv
import json
from dataclasses import replace

import ezc3d
import numpy as np
import pytest

from core.errors import ExportError
from core.frames import HandState
from core.gltf import read_glb
from core.takes.export import ExportOptions, export, held_csv
from core.takes.export.gltf_motion import gltf_hands
from core.takes.export.held import held_spans
from core.takes.export.timeline import timeline_of
from core.takes.formats import read_recording
from core.takes.formats.bvh import read_bvh
from core.takes.holes import Holes
from tests.core.export.recordings import RATE, START_S, every_point, solution
from tests.core.export.test_performers import together
from tests.core.export.test_props import LOST, with_props


def rows(path):
    with path.open(newline="") as stream:
        return list(csv.DictReader(stream))


def spans(path):
    return [
        (row["held"], round(float(row["from_s"]) * RATE, 3), round(float(row["to_s"]) * RATE, 3), row["reason"])
        for row in rows(path)
    ]


def with_a_hole(n_frames=240, out=range(120, 180)):
    """Nothing came for half a second."""
    whole = solution(n_frames, lost=tuple(out))
    hole = Holes(np.array([out.start / RATE]), np.array([out.stop / RATE]), np.array([len(out)]))
    return replace(whole, holes=hole)


def test_the_file_says_who_stands_still_from_when_to_when_and_why(tmp_path):
    *_, held = export(solution(), ["bvh", "gltf"], tmp_path)
    assert held.name == "take 1_held.csv"
    assert held.read_text().splitlines()[0] == "held,from_s,to_s,reason,from_frame,to_frame"
    assert spans(held) == [
        ("left hand", 0.0, 10.0, "not found yet"),
        ("left hand", 30.0, 60.0, "lost"),
        ("left hand", 100.0, 102.0, "no frames"),
        ("right hand", 100.0, 102.0, "no frames"),
    ]


@pytest.mark.parametrize("side", ["left", "right"])
def test_bvh_stands_still_in_these_frames_and_in_no_others(tmp_path, side):
    *files, held, _ = export(with_a_hole(), ["bvh"], tmp_path)
    values = read_bvh(files[0 if side == "left" else 1]).values
    said = np.zeros(240, dtype=bool)
    for row in rows(held):
        if row["held"] == f"{side} hand":
            said[int(row["from_frame"]) - 1 : int(row["to_frame"])] = True
    still = np.zeros(240, dtype=bool)
    still[1:] = (values[1:] == values[:-1]).all(axis=1)
    if side == "left":  # the first pose is held until it comes: the last of its frames is the one that has it
        assert not still[0] and said[0] and still[10]
        still[0], still[10] = True, False
    assert np.array_equal(said, still) and said.sum() == 60 + (40 if side == "left" else 0)


@pytest.mark.parametrize("side", ["left", "right"])
def test_gltf_stands_still_in_these_times_and_says_so_on_the_hands_node(tmp_path, side):
    file, *_ = export(with_a_hole(), ["gltf"], tmp_path)
    glb = read_glb(file)
    (node,) = [node for node in glb.document["nodes"] if node["name"] == f"{side} hand"]
    assert node["extras"]["hand"] == side
    told = [(one["from_s"] * RATE, one["to_s"] * RATE, one["reason"]) for one in node["extras"]["held"]]
    lost = [(0.0, 10.0, "not found yet"), (30.0, 60.0, "lost")] if side == "left" else []
    expected = [*lost, (120.0, 180.0, "no frames")]
    assert [reason for *_, reason in told] == [reason for *_, reason in expected]
    np.testing.assert_allclose([one[:2] for one in told], [one[:2] for one in expected], atol=1e-3)
    hand = gltf_hands(glb)[0 if side == "left" else 1]
    at, world = hand.times_s * RATE, hand.positions_m()
    for begin, end, _ in told:
        inside = world[(at > begin - 1.5) & (at < end - 0.5)]  # the pose that is held, as long as it is
        if begin == 0.0:
            inside = world[at < end + 0.5]
        assert len(inside) >= 2 and np.ptp(inside, axis=0).max() < 1e-7
    assert (np.ptp(world[(at > 61) & (at < 119)], axis=0) > 1e-3).any()


def test_one_frame_that_was_lost_is_held_in_bvh_and_passed_over_in_gltf(tmp_path):
    file, held = export(solution(60, lost=(20,), untracked=(0, 0)), ["gltf"], tmp_path)
    assert ("right hand", 20.0, 21.0, "no frames") in spans(held)
    nodes = {node["name"]: node for node in read_glb(file).document["nodes"]}
    assert "held" not in nodes["right hand"]["extras"]
    assert [one["reason"] for one in nodes["left hand"]["extras"]["held"]] == ["not found yet"]


def test_of_several_performers_the_name_is_said_and_of_a_prop_its_own(tmp_path):
    *_, held = export(together(), ["bvh"], tmp_path / "two")
    assert [(name, reason) for name, _, _, reason in spans(held)] == [
        ("Anna Lena left hand", "not found yet"),
        ("Anna Lena left hand", "lost"),
    ]
    file, held = export(with_props(), ["gltf"], tmp_path / "pen")
    (pen,) = [node for node in read_glb(file).document["nodes"] if node["name"] == "pen"]
    of_pen = [one for one in spans(held) if one[0] == "pen" and one[3] == "lost"]
    times = [frame.times.host_s - START_S for frame in with_props().solved]
    begin, end = times[LOST.start], times[LOST.stop]
    (told,) = [one for one in pen["extras"]["held"] if one["reason"] == "lost"]
    assert (told["from_s"], told["to_s"]) == pytest.approx((begin, end), abs=1e-6)
    assert of_pen[0][1] == pytest.approx(begin * RATE, abs=1e-3)
    assert of_pen[-1][2] == pytest.approx(end * RATE, abs=1e-3)


def test_where_nothing_is_held_there_is_no_file(tmp_path):
    one = solution(40, lost=(), untracked=(0, 0))
    always = tuple(
        replace(frame, hands=tuple(replace(hand, state=HandState.TRACKED) for hand in frame.hands))
        for frame in one.solved
    )
    names = [path.name for path in export(replace(one, solved=always), ["bvh", "gltf"], tmp_path)]
    assert names == ["take 1_left.bvh", "take 1_right.bvh", "take 1.glb"]
    assert [path.name for path in export(solution(), ["c3d"], tmp_path)] == ["take 1.c3d"]


def test_lost_until_the_end_is_held_until_after_the_last_frame():
    timeline = timeline_of(solution(60, lost=()).solved, RATE)
    tracked = np.arange(60) < 50
    (span,) = held_spans(tracked, timeline)
    assert (span.first, span.last, span.reason) == (51, 60, "lost")
    assert (span.from_s, span.to_s) == pytest.approx((50 / RATE, 60 / RATE), abs=1e-9)
    assert held_spans(np.zeros(60, dtype=bool), timeline) == ()


def test_a_file_that_differs_is_named(tmp_path, monkeypatch):
    honest = held_csv.csv.reader
    monkeypatch.setattr(held_csv.csv, "reader", lambda stream: list(honest(stream))[1:])
    with pytest.raises(ExportError, match=r"take 1_held\.csv did not read back equal: it differs"):
        export(solution(), ["bvh"], tmp_path)


def absent_left():
    """(240,) bool, frames of the even grid in which the left hand is not there."""
    absent = np.zeros(240, dtype=bool)
    absent[:10] = absent[30:60] = absent[100:102] = True
    return absent


@pytest.mark.parametrize("joints", [False, True])
@pytest.mark.parametrize("name", ["c3d", "trc"])
def test_files_of_markers_have_no_point_of_a_lost_hand(tmp_path, name, joints):
    (file,) = export(solution(), [name], tmp_path, options=ExportOptions(joints=joints))
    recording = every_point(file)
    left = np.array([label.startswith("L_") for label in recording.labels])
    assert left.sum() > 19 if joints else left.sum() == 19
    there = ~np.isnan(recording.points_m[:, left, 0])
    assert not there[absent_left()].any()
    assert there[~absent_left()].any(axis=1).all()
    if joints:
        assert there[~absent_left()][:, 19:].all()


def test_c3d_gives_a_lost_hand_the_residual_of_a_missing_point(tmp_path):
    (file,) = export(solution(), ["c3d"], tmp_path, options=ExportOptions(joints=True))
    data = ezc3d.c3d(str(file))
    labels = data["parameters"]["POINT"]["LABELS"]["value"]
    left = [i for i, label in enumerate(labels) if label.startswith("L_")]
    residuals = data["data"]["meta_points"]["residuals"][0][left]
    assert (residuals[:, absent_left()] == -1.0).all()
    assert np.isnan(data["data"]["points"][:3, left][:, :, absent_left()]).all()


def test_csv_has_no_line_of_a_lost_hand(tmp_path):
    markers, angles, joints = export(solution(), ["csv"], tmp_path)
    absent = {7000 + i for i in np.flatnonzero(absent_left())}
    frames = {int(row["frame"]) for row in rows(angles)}
    for path in (markers, joints):
        left = {int(row["frame"]) for row in rows(path) if row["hand"] == "left"}
        assert left == frames - absent
    cells = [row for row in rows(angles) if row["hand"] == "left" and int(row["frame"]) in absent]
    assert {row["state"] for row in cells} == {"searching", "lost"}
    assert {row["wrist_x_m"] for row in cells} == {""}


@pytest.mark.parametrize("name", ["c3d", "trc", "csv"])
def test_a_lost_prop_is_absent_too(tmp_path, name):
    files = export(with_props(), [name], tmp_path, options=ExportOptions(joints=True))
    frames = [with_props().solved[i].sequence for i in LOST]
    if name == "csv":
        assert not {int(row["frame"]) for row in rows(files[3])} & set(frames)
        return
    recording = read_recording(files[0])
    pen = [i for i, label in enumerate(recording.labels) if label.startswith("pen")]
    assert len(pen) == 5
    points = recording.points_m[:, pen]
    assert np.isnan(points[[frame - 7000 for frame in frames]]).all()
    assert not np.isnan(points[:60]).all(axis=(1, 2)).any()


def test_what_an_earlier_export_said_is_gone_with_its_files(tmp_path):
    export(with_a_hole(), ["bvh", "gltf", "csv"], tmp_path)
    (tmp_path / "take 1_notes.txt").write_text("mine")
    export(
        with_a_hole(), ["c3d"], tmp_path, overwrite=True
    )  # BVH and glTF of the earlier one stay, and so does what they need
    assert (tmp_path / "take 1_held.csv").exists()
    again = with_a_hole()
    files = export(again, ["bvh"], tmp_path, overwrite=True, options=ExportOptions(from_s=0.6, to_s=0.9))
    assert {file.suffix for file in files} == {".bvh"}
    left = {path.name for path in tmp_path.iterdir()}
    assert not left & {"take 1_held.csv", "take 1_holes.csv"}
    assert left >= {"take 1_left.bvh", "take 1.glb", "markers.csv", "take 1.c3d", "take 1_notes.txt"}
    record = json.loads((tmp_path / "take 1_export.json").read_text(encoding="utf-8"))
    assert {entry["file"] for entry in record["files"]} == left - {"take 1_notes.txt", "take 1_export.json"}
