"""How many frames a C3D file holds, how long each is and at what rate: header, parameters and bytes weighed."""

import numpy as np
import pytest

from core.takes.formats import read_recording
from tests.core.formats.c3d_bytes import build, long_words, trial
from tests.data import case_path


@pytest.fixture(scope="module")
def long_points():
    points = np.full((70_000, 1, 3), 5.0)
    points[:, 0, 0] = 1 + np.arange(70_000) % 900
    return points


@pytest.mark.parametrize(
    ("groups", "header", "warnings"),
    [
        ({"TRIAL": trial(84, 1, 70_000)}, {}, 0),
        ({"TRIAL": {"ACTUAL_START_FIELD": 1.0, "ACTUAL_END_FIELD": 70_000.0}}, {}, 0),
        ({"TRIAL": {"ACTUAL_START_FIELD": [1.0, 0.0], "ACTUAL_END_FIELD": [4464.0, 1.0]}}, {}, 0),
        ({"POINT": {"LONG_FRAMES": 70_000.0, "FRAMES": 65_535}}, {}, 0),
        ({"POINT": {"FRAMES": 70_000.0}}, {}, 0),
        ({"POINT": {"FRAMES": long_words(70_000)}}, {}, 0),
        ({"POINT": {"FRAMES": 65_535}}, {}, 0),  # only the file's length tells
        ({"POINT": {"FRAMES": 70_000 - 65_536}}, {"last": 70_000 - 65_536}, 1),  # the word has overflowed
        ({}, {"first": 0, "last": 0}, 1),
    ],
)
@pytest.mark.parametrize("filled", [False, True])
def test_long_files(written, long_points, groups, header, warnings, filled):
    point = {"Y_SCREEN": "+Y", **groups.get("POINT", {})}
    recording = written(84, 0.1, long_points, {**groups, "POINT": point}, filled=filled, **header)
    assert recording.n_frames == 70_000
    assert np.allclose(recording.points_m[:, 0, 0] * 1000, long_points[:, 0, 0], atol=0.1)
    assert len(recording.warnings) == warnings


def test_a_long_file_of_qualisys():
    recording = read_recording(case_path("files", "04-c3d-more-than-65535-frames", "long_frames.c3d"))
    assert (recording.n_frames, recording.frame_numbers[-1]) == (66_000, 66_000)
    assert not np.isnan(recording.points_m).any()


def test_a_full_word_of_frames_is_not_lengthened(written, long_points):
    groups = {"POINT": {"Y_SCREEN": "+Y", "FRAMES": 65_535}}
    recording = written(84, 0.1, long_points[:65_535], groups, filled=True)
    assert recording.n_frames == 65_535
    assert recording.warnings == ()


def test_the_first_frame_of_a_long_recording_is_in_trial(written, points):
    groups = {"POINT": {"Y_SCREEN": "+Y"}, "TRIAL": trial(84, 70_001, 70_050)}
    recording = written(84, -0.1, points, groups, first=1, last=50)
    assert recording.frame_numbers.tolist() == list(range(70_001, 70_051))


@pytest.mark.parametrize("processor", [84, 85, 86], ids=["intel", "dec", "mips"])
@pytest.mark.parametrize(
    ("groups", "header", "says"),
    [
        ({}, {}, None),
        ({}, {"first": 0, "last": 49}, None),
        ({"POINT": {"FRAMES": 50}}, {"first": 0, "last": 0}, "Its header promises 0 frames, 50 are there."),
        ({"POINT": {"FRAMES": 50.0}}, {"first": 1, "last": 1}, "Its header promises 1 frame, 50 are there."),
        ({"POINT": {"FRAMES": 10}}, {}, "Its POINT:FRAMES promises 10 frames, 50 are there."),
        ({"POINT": {"FRAMES": 1000}}, {}, "Its POINT:FRAMES promises 1,000 frames, 50 are there."),
        ({"TRIAL": "1..900"}, {}, "Its TRIAL promises 900 frames, 50 are there."),
        (
            {"TRIAL": "1..900", "POINT": {"LONG_FRAMES": 50.0, "FRAMES": 900}},
            {"last": 40},
            "Its TRIAL and POINT:FRAMES promise 900 frames, its header promises 40 frames, 50 are there.",
        ),
        ({}, {"first": 0, "last": 0}, "It does not say how many frames it holds; by its length they are 50."),
        ({}, {"first": 1, "last": 0}, "It does not say how many frames it holds; by its length they are 50."),
        ({"POINT": {"FRAMES": float("nan")}}, {}, None),
        ({"POINT": {"LONG_FRAMES": -1.0}}, {}, None),
    ],
)
@pytest.mark.parametrize("filled", [False, True], ids=["bare", "filled"])
def test_the_largest_count_that_the_bytes_allow(written, points, processor, groups, header, says, filled):
    groups = {**groups, "POINT": {"Y_SCREEN": "+Y", **groups.get("POINT", {})}}
    if "TRIAL" in groups:
        groups["TRIAL"] = trial(processor, 1, 900)
    recording = written(processor, -0.1, points, groups, filled=filled, **header)
    assert recording.points_m * 1000 == pytest.approx(points, abs=1e-3)
    assert list(recording.warnings) == ([] if says is None else [says])


def test_a_count_in_the_parameters_only():
    recording = read_recording(case_path("files", "12-c3d-frame-count-only-in-header", "hdr_frames0.c3d"))
    assert recording.n_frames == 50
    assert "Its header promises 0 frames, 50 are there." in recording.warnings


@pytest.mark.parametrize("scale", [-0.1, 0.05], ids=["real", "integer"])
@pytest.mark.parametrize("groups", [{}, {"FRAMES": 50}, {"FRAMES": 50.0, "LONG_FRAMES": 50.0}])
def test_a_file_that_is_cut_off_gives_its_whole_frames(tmp_path, points, scale, groups):
    whole = build(84, scale, points, {"POINT": {"Y_SCREEN": "+Y", **groups}}, analog=6)
    frame_bytes = (4 * 4 + 6) * (4 if scale < 0 else 2)
    path = tmp_path / "cut.c3d"
    for lost in (1, frame_bytes - 1, frame_bytes, 20 * frame_bytes + 3, 49 * frame_bytes):
        path.write_bytes(whole[:-lost])
        recording = read_recording(path)
        there = 50 - -(-lost // frame_bytes)
        assert recording.points_m * 1000 == pytest.approx(points[:there], abs=0.03)
        assert len(recording.warnings) == 1
        assert recording.warnings[0].endswith(f"50 frames, {there} {'is' if there == 1 else 'are'} there.")


def test_what_follows_the_frames_is_not_read_and_said(tmp_path, points):
    path = tmp_path / "more.c3d"
    path.write_bytes(build(84, -0.1, points, {"POINT": {"Y_SCREEN": "+Y"}}, filled=True) + bytes(1024))
    recording = read_recording(path)
    assert recording.n_frames == 50
    assert recording.warnings == ("After its 50 frames follow 1,408 bytes that it says nothing of; they are not read.",)


@pytest.mark.parametrize(
    ("groups", "header", "says"),
    [
        ({"ANALOG": {"USED": 3}}, {"samples": 4}, None),
        ({"ANALOG": {"USED": 3, "RATE": 400.0}}, {"samples": 0}, None),
        ({"ANALOG": {"USED": 9}}, {"samples": 4}, None),  # the header's fits
        ({"ANALOG": {"USED": 3}}, {"samples": 4, "n_analog": 0}, "analog values per frame (0, 12); 12 fits"),
        ({"ANALOG": {"USED": 3, "RATE": 400.0}}, {"n_analog": 3}, "analog values per frame (3, 12); 12 fits"),
        ({"POINT": {"USED": 4}}, {"n_points": 5}, "number of its points (5, 4); 4 fits"),
        ({"POINT": {"USED": 4}}, {"n_points": 0}, "number of its points (0, 4); 4 fits"),
        ({"POINT": {"USED": 9}}, {}, None),
        ({"POINT": {"DATA_START": 4}}, {"block": 9}, "block its points begin at (9, 4); 4 fits"),
        ({"POINT": {"DATA_START": 4}}, {"block": 0}, "block its points begin at (0, 4); 4 fits"),
        ({"POINT": {"DATA_START": 0}}, {}, None),
    ],
)
def test_words_per_frame_and_first_block_are_those_that_fit_the_length(written, points, groups, header, says):
    groups = {**groups, "POINT": {"Y_SCREEN": "+Y", **groups.get("POINT", {})}}
    recording = written(84, -0.1, points, groups, analog=12, filled=True, **header)
    assert recording.points_m * 1000 == pytest.approx(points, abs=1e-3)
    assert len(recording.warnings) == (says is not None)
    assert (says or "") in "".join(recording.warnings)


@pytest.mark.parametrize(
    ("point", "header", "camera", "rate_hz", "says"),
    [
        (120.0, 120.0, 120.0, 120.0, None),
        (120, 120.0, None, 120.0, None),
        (119.88, 119.88, None, 119.88, None),
        (0.0, 120.0, None, 120.0, "Its rate is 120 Hz by its header, but 0 Hz by POINT:RATE."),
        (None, 120.0, None, 120.0, None),
        (120.0, 60.0, None, 120.0, "Its rate is 120 Hz by POINT:RATE, but 60 Hz by its header."),
        (120.0, 120.0, 240.0, 120.0, "Its rate is 120 Hz by POINT:RATE, but 240 Hz by TRIAL:CAMERA_RATE."),
        (None, 0.0, 240.0, 240.0, "Its rate is 240 Hz by TRIAL:CAMERA_RATE, but 0 Hz by its header."),
        (float("inf"), 120.0, None, 120.0, "Its rate is 120 Hz by its header, but inf Hz by POINT:RATE."),
    ],
)
def test_the_rate(written, points, point, header, camera, rate_hz, says):
    groups = {"POINT": {"Y_SCREEN": "+Y", "RATE": point}}
    if camera is not None:
        groups["TRIAL"] = {"CAMERA_RATE": camera}
    recording = written(84, -0.1, points, groups, rate=header)
    assert recording.rate_hz == pytest.approx(rate_hz, rel=1e-6)
    assert list(recording.warnings) == ([] if says is None else [says])


def test_a_rate_in_the_header_only():
    recording = read_recording(case_path("files", "10-c3d-rate-only-in-header", "rate0.c3d"))
    assert recording.rate_hz == 120.0
    assert recording.n_frames == 50
