"""What is asked for beside formats, read back from the files."""

import csv
import json
from dataclasses import replace

import ezc3d
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from core.errors import ExportError
from core.frames import NO_POINT, Times
from core.takes.export import FORMATS, ExportOptions, export, export_each
from core.takes.export.grid import grid_of
from core.takes.export.timeline import timeline_of
from core.takes.formats import read_recording
from core.takes.formats.c3d import read_with_residuals
from core.takes.holes import NO_HOLES
from core.takes.take import Mark
from tests.core.export.recordings import RATE, START_S, hands_of, solution
from tests.core.export.test_c3d import expected_points

Z_UP = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
NO_SIZE = {"scale": 1.0, "lost": (), "untracked": (0, 0)}


def rows(path):
    with path.open(newline="", encoding="utf-8") as stream:
        return list(csv.DictReader(stream))


def points_of(path):
    """(t, m, 3) as they stand in the file, NaN for gaps, by a reader that is not ours."""
    return ezc3d.c3d(str(path))["data"]["points"][:3].transpose(2, 1, 0)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"up": "x"}, "'x' is no axis to point up"),
        ({"unit": "inch"}, "'inch' is no unit of length here. Choose of mm, cm, m"),
        ({"rate_hz": 0.0}, "0 Hz is no rate"),
        ({"rate_hz": float("nan")}, "nan Hz is no rate"),
        ({"from_s": float("inf")}, "inf s is no time"),
        ({"from_s": 2.0, "to_s": 1.0}, "would end, at 1 s, before it begins, at 2 s"),
    ],
)
def test_what_cannot_be_asked_for(wrong, words):
    with pytest.raises(ExportError, match=words):
        ExportOptions(**wrong)


def test_measured_leaves_out_every_prediction(tmp_path):
    c3d, trc, markers, *_ = export(
        solution(), ["c3d", "trc", "csv"], tmp_path, options=ExportOptions(measured=True, joints=True)
    )
    points, kinds = expected_points(solution())
    measured = np.where(kinds[:, :, None] == 1, points, np.nan)
    assert np.allclose(points_of(c3d)[:, :38] / 1000, measured, atol=1e-6, equal_nan=True)
    assert np.isnan(measured).any() and not np.isnan(points_of(c3d)[200, 38:]).any()
    assert np.array_equal(np.isnan(read_recording(trc).points_m[:, :38]), np.isnan(measured))
    assert {row["source"] for row in rows(markers)} == {"observed"}
    assert len(rows(markers)) == int((kinds == 1).sum())


def test_z_up_turns_every_file(tmp_path):
    formats = ["c3d", "trc", "csv", "points"]
    plain = export(solution(), formats, tmp_path / "y")
    turned = export(solution(), formats, tmp_path / "z", options=ExportOptions(up="z"))
    assert np.allclose(points_of(turned[0]), points_of(plain[0]) @ Z_UP.T, atol=1e-4, equal_nan=True)
    parameters = ezc3d.c3d(str(turned[0]))["parameters"]
    assert parameters["POINT"]["Y_SCREEN"]["value"] == ["+Z"] and parameters["PHALANX"]["UP"]["value"] == ["+Z"]
    assert ezc3d.c3d(str(plain[0]))["parameters"]["PHALANX"]["UP"]["value"] == ["+Y"]
    assert np.allclose(read_recording(turned[0]).points_m, read_recording(plain[0]).points_m, atol=1e-9, equal_nan=True)
    as_written = read_recording(turned[1]).points_m
    assert np.allclose(as_written, read_recording(plain[1]).points_m @ Z_UP.T, atol=1e-12, equal_nan=True)
    for before, after in zip(plain[2:], turned[2:], strict=True):
        if before.name in ("markers.csv", "joints.csv", "points.csv"):
            for one, other in zip(rows(before)[::97], rows(after)[::97], strict=True):
                at, there = ([float(row[f"{axis}_m"]) for axis in "xyz"] for row in (one, other))
                assert np.allclose(there, Z_UP @ at, atol=1e-12)
    for one, other in zip(rows(plain[4])[::53], rows(turned[4])[::53], strict=True):
        before, after = (
            Rotation.from_quat([float(row[q]) for q in ("qw", "qx", "qy", "qz")], scalar_first=True)
            for row in (one, other)
        )
        assert (Rotation.from_matrix(Z_UP) * before * after.inv()).magnitude() < 1e-7
    for one, other in zip(rows(plain[3])[100::53], rows(turned[3])[100::53], strict=True):
        if not one["rms_m"]:
            continue
        before, after = ([float(row[f"wrist_{r}"]) for r in ("rx", "ry", "rz")] for row in (one, other))
        assert np.allclose(
            Rotation.from_rotvec(after).as_matrix(), Z_UP @ Rotation.from_rotvec(before).as_matrix(), atol=1e-7
        )
        assert other["wrist_y_m_std"] == one["wrist_z_m_std"] and other["thumb_cmc_flexion"] == one["thumb_cmc_flexion"]


def test_gltf_stays_y_up_and_says_so(tmp_path):
    exported = export_each(solution(), ["gltf", "c3d"], tmp_path, options=ExportOptions(up="z", unit="cm"))
    assert exported.notes == [
        "glTF is Y up, and so is this file: programs turn it as they read it.",
        "glTF is in metres by definition.",
    ]
    assert [file.name for file in exported.files] == ["take 1.glb", "take 1.c3d", "take 1_held.csv"]
    assert not exported.failed
    assert export_each(solution(), ["gltf"], tmp_path / "m", options=ExportOptions(unit="m")).notes == []


@pytest.mark.parametrize(("unit", "per_m"), [("mm", 1000.0), ("cm", 100.0), ("m", 1.0)])
def test_units(tmp_path, unit, per_m):
    c3d, trc = export(solution(), ["c3d", "trc"], tmp_path, options=ExportOptions(unit=unit))
    points, _ = expected_points(solution())
    assert ezc3d.c3d(str(c3d))["parameters"]["POINT"]["UNITS"]["value"] == [unit]
    assert np.allclose(points_of(c3d), points * per_m, atol=1e-6 * per_m, equal_nan=True)
    assert trc.read_text().splitlines()[2].split("\t")[4] == unit
    assert np.nanmax(np.abs(read_recording(trc).points_m - points)) < 1e-7


def test_csv_keeps_its_units_and_frames(tmp_path):
    exported = export_each(solution(), ["csv"], tmp_path, options=ExportOptions(unit="mm", rate_hz=60.0))
    assert exported.notes == [
        "CSV keeps the recording's own frames, with the time of each, at any rate.",
        "CSV is in metres, as the names of its columns say.",
    ]


def test_another_rate_lies_on_straight_lines_and_crosses_no_gap(tmp_path):
    """At 300 Hz two of five places are frames' own, as 120 and 300 share 60."""
    some = solution(240, scale=1.0)
    (path,) = export(some, ["c3d"], tmp_path, options=ExportOptions(rate_hz=300.0))
    at_frames, kinds = expected_points(some)
    header = ezc3d.c3d(str(path))
    assert header["parameters"]["POINT"]["RATE"]["value"][0] == 300.0
    points = points_of(path) / 1000.0
    assert len(points) == int(239 / RATE * 300.0 + 1e-6) + 1
    place = np.arange(len(points)) / 300.0 * RATE
    before = np.floor(place + 1e-6).astype(int)
    share = np.clip(place - before, 0.0, 1.0)[:, None, None]
    share[share < 1e-6] = 0.0
    after = np.minimum(before + (share[:, 0, 0] > 0.0), 239)
    expected = (1.0 - share) * at_frames[before] + share * at_frames[after]
    assert np.allclose(points, expected, atol=1e-6, equal_nan=True)
    lost = (place > 99 + 1e-6) & (place < 102 - 1e-6)
    assert np.isnan(points[lost]).all() and not np.isnan(points[~lost, 30]).any()
    _, residuals = read_with_residuals(path)  # ezc3d 1.7 reads them from another place
    measured = (kinds[before] == 1) & (kinds[after] == 1) & ~lost[:, None]
    assert np.array_equal(residuals > 0, measured)


def test_no_prediction_goes_into_a_measured_point_between_frames(tmp_path):
    some = solution(120, **NO_SIZE)
    (path,) = export(some, ["trc"], tmp_path, options=ExportOptions(rate_hz=240.0, measured=True))
    seen = np.array([hand.point != NO_POINT for hand in hands_of(some, "right")])
    present = ~np.isnan(read_recording(path).points_m[:, 19:, 0])
    assert np.array_equal(present[::2], seen) and np.array_equal(present[1::2], seen[:-1] & seen[1:])


def test_the_grid_by_the_frames_own_times():
    """A device that says 120 Hz and sends 119: the places of another rate lie where the frames truly were."""
    frames = [
        replace(frame, times=Times(i / 119.0, START_S + i / 119.0, START_S + i / 119.0))
        for i, frame in enumerate(solution(240, lost=()).raw)
    ]
    timeline = timeline_of(frames, RATE)
    grid = grid_of(timeline, 100.0)
    assert len(grid) == int(239 / 119.0 * 100.0) + 1 and grid.present.all()
    times = (1 - grid.share) * timeline.times_s[grid.before] + grid.share * timeline.times_s[grid.after]
    assert np.allclose(times, grid.times_s, atol=1e-9)
    own = grid_of(timeline)
    assert len(own) == 240 and own.place_s(timeline.times_s[120]) * own.rate_hz == pytest.approx(120)


def test_a_rate_that_falls_in_mid_take_is_no_gap():
    """From 120 to 60 Hz, no frame lost; then one is."""
    seconds = np.concatenate([np.arange(120) / 120.0, 1.0 + np.arange(60) / 60.0])
    frames = [
        replace(frame, sequence=7000 + i + (i >= 150), times=Times(t, START_S + t, START_S + t))
        for i, (frame, t) in enumerate(zip(solution(240, lost=()).raw, seconds + (seconds >= 1.5) / 60.0, strict=False))
    ]
    grid = grid_of(timeline_of(frames, RATE), 100.0)
    gap = (grid.times_s > 1.0 + 29 / 60.0 + 1e-6) & (grid.times_s < 1.0 + 31 / 60.0 - 1e-6)
    assert gap.any() and np.array_equal(grid.present, ~gap)


def test_a_part_counts_from_its_first_frame(tmp_path):
    marked = replace(
        solution(lost=()), marks=(Mark(0.5, "before"), Mark(1.25, 'a, "b"\nc'), Mark(1.75, "after")), holes=NO_HOLES
    )
    options = ExportOptions(from_s=1.0, to_s=1.5)
    c3d, markers, *_, marks = export(marked, ["c3d", "csv"], tmp_path, options=options)
    points, _ = expected_points(solution(lost=()))
    assert np.allclose(points_of(c3d) / 1000, points[120:181], atol=1e-6, equal_nan=True)
    assert rows(markers)[0]["frame"] == "7120" and rows(markers)[0]["time_s"] == "0.000000"
    assert rows(marks) == [{"time_s": "0.250000", "frame": "7150", "text": r'a, "b"\nc', "time_source_s": "1.250000"}]
    assert json.loads((tmp_path / "take 1_export.json").read_text())["files"][0]["from_s"] == 1.0
    with pytest.raises(ExportError, match=r"no frames from 9 s to its end: its frames are from 0 to 1\.992 s"):
        export(marked, ["c3d"], tmp_path, options=ExportOptions(from_s=9.0))


def test_one_format_that_fails_does_not_stop_the_others(tmp_path, monkeypatch):
    def fails(content, paths, progress):
        paths[0].write_text("half")
        raise ExportError("TRC went wrong.", "Do this.")

    monkeypatch.setitem(FORMATS, "trc", replace(FORMATS["trc"], write=fails))
    exported = export_each(solution(), ["trc", "c3d"], tmp_path)
    assert [path.name for path in exported.files] == ["take 1.c3d"]
    assert list(exported.failed) == ["trc"] and exported.error.what == "TRC went wrong."
    assert sorted(path.name for path in tmp_path.iterdir()) == ["take 1.c3d", "take 1_export.json"]
    with pytest.raises(ExportError, match="TRC went wrong"):
        export(solution(), ["trc", "c3d"], tmp_path, overwrite=True)


def test_warnings_of_the_times_are_told(tmp_path):
    """A device that says 120 Hz and sends 100."""
    some = solution(240, lost=())

    def slower(frame):
        t = START_S + (frame.sequence - 7000) / 100.0
        return replace(frame, times=Times(t, t, t))

    slow = replace(some, raw=tuple(map(slower, some.raw)), solved=tuple(map(slower, some.solved)))
    exported = export_each(slow, ["c3d"], tmp_path)
    of_times, of_poses = exported.warnings
    assert "120 Hz" in of_times and "100 Hz" in of_times
    assert of_poses == "Frames without a pose, of 240: left hand 40."
    record = json.loads((tmp_path / "take 1_export.json").read_text(encoding="utf-8"))
    assert record["recording"]["warnings"] == exported.warnings
    assert record["files"][0]["rate_hz"] == pytest.approx(100.0, abs=1e-3)
