import numpy as np
import pytest

from core.errors import FormatError
from core.takes.formats import read_recording

HEADER = "NO_OF_FRAMES\t3\nNO_OF_MARKERS\t2\nFREQUENCY\t100\nDATA_INCLUDED\t3D\nMARKER_NAMES\ttip\tback\n"
TITLES = "Frame\tTime\ttip X\ttip Y\ttip Z\tback X\tback Y\tback Z\n"


def write(folder, text):
    path = folder / "room.tsv"
    path.write_text(text, encoding="utf-8")
    return path


def test_z_up_millimetres_become_y_up_metres(tmp_path):
    recording = read_recording(write(tmp_path, HEADER + TITLES + "1\t0\t1\t2\t3\t4\t5\t6\n2\t0.01\t1\t2\t3\t4\t5\t6\n"))
    assert np.allclose(recording.points_m[0], [[0.001, 0.003, -0.002], [0.004, 0.006, -0.005]])


@pytest.mark.parametrize("gap", ["nan\tnan\tnan", "\t\t", "0.000\t0.000\t0.000", "NULL\tNULL\tNULL"])
def test_every_way_to_write_a_gap(tmp_path, gap):
    recording = read_recording(write(tmp_path, HEADER + TITLES + f"1\t0\t1\t2\t3\t{gap}\n2\t0.01\t{gap}\t4\t5\t6\n"))
    assert np.isnan(recording.points_m).all(axis=2).tolist() == [[False, True], [True, False]]


@pytest.mark.parametrize(
    ("lead", "numbers", "end"), [("", [0, 1], ""), ("{}\t", [5, 6], ""), ("{}\t0.0{}\t", [5, 6], "\t")]
)
def test_with_and_without_frame_and_time(tmp_path, lead, numbers, end):
    rows = "".join(lead.format(n, n) + f"1\t2\t3\t4\t5\t6{end}\n" for n in (5, 6))
    titles = TITLES if end else ""
    recording = read_recording(write(tmp_path, HEADER + titles + rows))
    assert recording.frame_numbers.tolist() == numbers
    assert np.allclose(recording.times_s, [0.0, 0.01])
    assert np.allclose(recording.points_m[1, 1], (0.004, 0.006, -0.005))


def test_time_code_after_the_time_is_not_read(tmp_path):
    titles = TITLES.replace("Time", "Time\tSMPTE")
    recording = read_recording(write(tmp_path, HEADER + titles + "1\t0\t15:26:46:12\t1\t2\t3\t4\t5\t6\n"))
    assert np.allclose(recording.points_m[0, 0], (0.001, 0.003, -0.002))


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (HEADER + TITLES + "1\t0\t1\t2\t3\t4\t5\n", "line 7 has 7 columns instead of 8"),
        (HEADER + TITLES + "1\t0\t1\t2\t3\t4\t5\t6\n2\t0.01\t1\t2", "line 8 has 4 columns instead of 8"),
        (HEADER + TITLES + "1\t0\t1\t2\t3\t4\tfive\t6\n", "line 7 column 7: 'five' is not a number"),
        (HEADER + TITLES + "1\t0\t1\t2\t3\t4\t1e400\t6\n", "frame 1: back at y = inf m"),
        (HEADER + TITLES, "holds no frames"),
        (HEADER, "holds no frames"),
        (HEADER.replace("MARKER_NAMES\ttip\tback\n", "") + TITLES, "before the line MARKER_NAMES"),
        ("NO_OF_FRAMES\t1\n1\t2\t3\n", "line 2 holds numbers, but no MARKER_NAMES"),
        (HEADER.replace("MARKER_NAMES", "BODY_NAMES"), "rigid bodies"),
        (HEADER + "1\t2\t3\n", "line 6 has 3 columns, which do not fit the 2 MARKER_NAMES"),
        (HEADER + "text\n" * 2000, "is still no row of numbers"),
    ],
)
def test_damage_is_named(tmp_path, text, says):
    with pytest.raises(FormatError) as error:
        read_recording(write(tmp_path, text))
    assert "room.tsv" in str(error.value)
    assert says in str(error.value)
