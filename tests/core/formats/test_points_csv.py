import numpy as np
import pytest

from core.errors import FormatError
from core.frames import NO_ID
from core.gaps import Gaps
from core.takes.formats import read_recording

HEADER = "frame,time_s,id,x_m,y_m,z_m\n"


def write(folder, rows):
    path = folder / "points.csv"
    path.write_text(HEADER + rows, encoding="utf-8")
    return path


def test_frames_are_exactly_those_of_the_file(tmp_path):
    rows = "10,2.5,7,1,2,3\n10,2.5,-1,4,5,6\n10,2.5,-1,4,5,7\n11,2.508333,,,,\n13,2.525,9,0.1,0.2,0.3\n"
    recording = read_recording(write(tmp_path, rows))
    assert recording.labels == ()
    assert recording.frame_numbers.tolist() == [10, 11, 13]
    assert recording.rate_hz == pytest.approx(120.0, rel=1e-4)
    first, empty, last = recording.frames()
    assert first.points_m.tolist() == [[1, 2, 3], [4, 5, 6], [4, 5, 7]]
    assert first.ids.tolist() == [7, NO_ID, NO_ID]
    assert first.times.host_s == 0.0 and last.times.host_s == pytest.approx(0.025)
    assert empty.points_m.shape == (0, 3) and empty.ids.shape == (0,)
    assert (last.sequence, last.ids.tolist(), last.points_m.tolist()) == (13, [9], [[0.1, 0.2, 0.3]])


def test_thousands_of_short_lived_ids_stay_small(tmp_path):
    generator = np.random.default_rng(4)
    points = generator.uniform(-1, 1, (3000, 3)).round(6)
    rows = "".join(f"{i // 3},{i // 3 / 120:.6f},{1000 + i},{x},{y},{z}\n" for i, (x, y, z) in enumerate(points))
    recording = read_recording(write(tmp_path, rows))
    assert recording.points_m.shape == (1000, 3, 3)
    assert np.array_equal(np.concatenate([frame.ids for frame in recording.frames()]), np.arange(1000, 4000))
    assert np.array_equal(np.concatenate([frame.points_m for frame in recording.frames()]), points)
    assert recording.rate_hz == pytest.approx(120.0, rel=1e-6)


@pytest.mark.parametrize(
    ("rows", "says"),
    [
        ("1,0,5,1,2\n", "line 2 has 5 columns instead of 6"),
        ("1,0,5,1,2", "line 2 has 5 columns"),
        ("1,0,5,1,2,3\n2,0.01,5,1,2\n", "line 3 has 5 columns"),
        ("1,0,5,1,y,3\n", "line 2 column 5: 'y' is not a number"),
        ("1,0,5.5,1,2,3\n", "column 3: id '5.5' is not an integer"),
        ("1,,5,1,2,3\n", "has frame '1' and time ''"),
        ("1,0.5,5,1,2,3\n2,0.4,5,1,2,3\n", "line 3 column 2: time 0.4 s comes after 0.5 s"),
        ("1,0,5,1,2,3\n", "does not tell its frame rate"),
        ("1,0,5,1,2,3000\n2,1,5,1,2,3000\n2,1,6,1,2,3\n", "point 1 at z = 3000 m"),
        ("1,0,inf,1,2,3\n", "id 'inf'"),
        ("inf,0,1,1,2,3\n", "has frame 'inf'"),
        ("1,inf,1,1,2,3\n2,inf,1,1,2,3\n", "comes after"),
        ("", "holds no frames"),
        ("0,0,5,1,0,2,0,3,0\n", "has 9 columns"),
    ],
)
def test_damage_is_named(tmp_path, rows, says):
    with pytest.raises(FormatError) as error:
        read_recording(write(tmp_path, rows))
    assert "points.csv" in str(error.value)
    assert says in str(error.value)


def test_one_rule_for_what_is_no_point(tmp_path):
    """Zero, far off, lacking a coordinate, or an id without any: gaps, counted and said; the rest is as it was."""
    rows = "1,0,5,1,2,3\n1,0,6,0,0,0\n1,0,7,1e7,0,0\n1,0,8,1,,3\n"
    rows += "2,0.01,5,1,nan,3\n2,0.01,6,,,\n2,0.01,7,4,5,6\n3,0.02,,,,\n"
    recording = read_recording(write(tmp_path, rows))
    assert recording.gaps == Gaps(absent=3, zero=1, far=1)
    assert recording.warnings == (
        "2 points lack a coordinate and are gaps, the first in line 5.",
        "1 point lies beyond 1000 m and is left out as a gap, in frame 1: point 3 at x = 1e+07 m.",
    )
    first, second, third = recording.frames()
    assert (first.ids.tolist(), first.points_m.tolist()) == ([5], [[1, 2, 3]])
    assert (second.ids.tolist(), second.points_m.tolist()) == ([7], [[4, 5, 6]])
    assert third.ids.tolist() == []


@pytest.mark.parametrize(("delimiter", "word"), [(";", "semicolons"), ("\t", "tabs")])
def test_semicolons_and_tabs_are_explained(tmp_path, delimiter, word):
    path = tmp_path / "points.csv"
    path.write_text(HEADER.replace(",", delimiter) + delimiter.join(("1", "0,5", "3", "1,0", "2,0", "3,0")) + "\n")
    with pytest.raises(FormatError, match=f"separates its columns with {word}"):
        read_recording(path)


def test_a_last_number_that_was_cut_off_is_no_number(tmp_path):
    rows = "".join(f"{i},{i / 100:.2f},5,1.000,2.000,3.250\n" for i in range(5))
    recording = read_recording(write(tmp_path, rows + "5,0.05,5,1.000,2.000,3.25"))
    assert recording.n_frames == 5
    assert recording.warnings == ("Its last line is cut off; the frame that it may belong to was left out.",)
    recording = read_recording(write(tmp_path, rows + "5,0.05,5,1.000,2.000,3.250"))
    assert (recording.n_frames, recording.warnings) == (6, ())


def test_a_file_that_would_not_fit_in_memory_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr("core.takes.formats.assemble.MAX_VALUES", 1000)
    rows = "".join(f"{frame},{frame},{i},1,2,3\n" for frame in range(40) for i in range(10))
    with pytest.raises(FormatError, match="40 frames of up to 10 points"):
        read_recording(write(tmp_path, rows))


@pytest.mark.parametrize(
    ("cut", "n_frames"),
    [
        ("3", 2), ("3,0.0", 2), ("3,0.02,7,1", 2), ("3,0.02,7,1,2,-", 2),  # of a new frame: the last one is whole
        ("2", 1), ("2,0.01", 1), ("2,0.01,8,1,2", 1), ("2,0.01,8,1,2,", 1),  # of the last frame: that is not whole
    ],
)  # fmt: skip
def test_a_file_that_was_cut_off_gives_its_whole_frames(tmp_path, cut, n_frames):
    rows = "0,0,5,1,2,3\n1,0.005,5,1,2,3\n1,0.005,6,1,2,3\n2,0.01,7,1,2,3\n2,0.01,9,1,2,3\n"
    recording = read_recording(write(tmp_path, rows + cut))
    assert recording.frame_numbers.tolist() == list(range(n_frames + 1))
    assert [len(frame.points_m) for frame in recording.frames()] == [1, 2, 2][: n_frames + 1]
    assert recording.warnings == ("Its last line is cut off; the frame that it may belong to was left out.",)
