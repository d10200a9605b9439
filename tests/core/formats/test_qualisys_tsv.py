import numpy as np
import pytest

from core.errors import FormatError
from core.takes.formats import read_recording
from tests.data import case_path

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
        (HEADER + TITLES + "1\t0\t1\t2", "line 7 has 4 columns instead of 8"),
        (HEADER + TITLES + "1\t0\t1\t2\t3\t4\tfive\t6\n", "line 7 column 7: 'five' is not a number"),
        (HEADER + TITLES + "1\t0\t1e8\t2\t3\t4\t1e400\t6\n", "frame 1: tip at x = 100000 m"),
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


ROWS = "".join(f"{i + 1}\t{i / 100:.5f}\t1\t2\t3\t4\t5\t6\n" for i in range(3))
SOUND = [[0.001, 0.003, -0.002], [0.004, 0.006, -0.005]]


@pytest.mark.parametrize(
    "case", ["01-qtm-tsv-file-version/qtm_v2.tsv", "08-text-in-the-code-page-of-windows/qtm_latin.tsv",
             "09-qtm-external-timebase/qtm_ext.tsv"]
)  # fmt: skip
def test_reported_files(case):
    recording = read_recording(case_path("files", *case.split("/")))
    assert (recording.n_frames, recording.rate_hz) == (3, pytest.approx(100.0))
    assert recording.labels == ("pouce_\xe9" if "latin" in case else "A", "B")
    assert np.allclose(recording.points_m, SOUND)
    assert np.allclose(recording.times_s, [0.0, 0.01, 0.02])
    assert recording.gaps.total == 0


def test_keys_may_come_in_any_order(tmp_path):
    lines = [
        "NEW_KEY\t5",
        "FILE_VERSION\t2.0.0",
        "EVENT\tstart\t1\t0.0",
        *HEADER.splitlines(),
        "TRAJECTORY_TYPES\tMeasured\tMixed",
    ]
    generator = np.random.default_rng(1)
    for _ in range(20):
        header = "\n".join(generator.permutation(lines)) + "\n"
        recording = read_recording(write(tmp_path, header + TITLES + ROWS))
        assert recording.labels == ("tip", "back")
        assert recording.rate_hz == 100.0
        assert np.allclose(recording.points_m, SOUND)
        assert recording.warnings == ()


def test_external_timebase_without_times_has_no_rate(tmp_path):
    text = HEADER.replace("\t100\n", "\tEXT\n") + "1\t2\t3\t4\t5\t6\n"
    with pytest.raises(FormatError, match="does not tell its frame rate"):
        read_recording(write(tmp_path, text))


def test_names_between_empty_cells(tmp_path):
    header = HEADER.replace("tip\tback", "\ttip\t\tback\t")
    recording = read_recording(write(tmp_path, header + TITLES + ROWS))
    assert recording.labels == ("tip", "back")
    assert np.allclose(recording.points_m, SOUND)


def test_a_first_frame_that_saw_nothing(tmp_path):
    for gap in ("\t\t\t\t\t", "nan\tnan\tnan\tnan\tnan\tnan", "NULL\tNULL\tNULL\tNULL\tNULL\tNULL"):
        recording = read_recording(write(tmp_path, HEADER + f"{gap}\n1\t2\t3\t4\t5\t6\n{gap}\n"))
        assert np.isnan(recording.points_m[:, :, 0]).tolist() == [[True, True], [False, False], [True, True]]


@pytest.mark.parametrize("cut", ["3", "3\t0.02", "3\t0.02\t1\t2", "3\t0.02\t1\t2\t3\t4\t5\t-"])
def test_a_file_that_was_cut_off_gives_its_whole_frames(tmp_path, cut):
    whole = "".join(ROWS.splitlines(True)[:2])
    recording = read_recording(write(tmp_path, HEADER + TITLES + whole + cut))
    assert np.allclose(recording.points_m, SOUND) and recording.n_frames == 2
    assert recording.warnings == (
        "Its last line is cut off and was left out.",
        "Its header promises 3 frames, 2 are there.",
    )


def test_a_last_number_that_was_cut_off_is_no_number(tmp_path):
    whole, last = ROWS.replace("6\n", "6.125\n"), "4\t0.03\t1\t2\t3\t4\t5\t6"
    header = HEADER.replace("NO_OF_FRAMES\t3", "NO_OF_FRAMES\t9")
    assert read_recording(write(tmp_path, header + TITLES + whole + last)).n_frames == 3
    assert read_recording(write(tmp_path, header + TITLES + whole + last + ".125")).n_frames == 4


def test_times_that_contradict_the_header_are_taken(tmp_path):
    rows = "".join(f"{i + 1}\t{i / 25:.2f}\t1\t2\t3\t4\t5\t6\n" for i in range(20))
    recording = read_recording(write(tmp_path, HEADER.replace("\t3\n", "\t20\n", 1) + TITLES + rows))
    assert recording.rate_hz == pytest.approx(25.0)
    assert recording.warnings == ("Its header says 100 Hz, its times 25 Hz; the times are taken.",)


def test_missing_frames_are_no_other_rate(tmp_path):
    rows = "".join(f"{i + 1}\t{i / 100:.2f}\t1\t2\t3\t4\t5\t6\n" for i in range(0, 80, 4))
    recording = read_recording(write(tmp_path, HEADER.replace("\t3\n", "\t20\n", 1) + TITLES + rows))
    assert (recording.rate_hz, recording.warnings) == (100.0, ())


@pytest.mark.parametrize(("delimiter", "comma"), [(";", "."), (";", ","), (",", "."), ("\t", ",")])
@pytest.mark.parametrize("padded", [False, True])
def test_saved_by_a_spreadsheet(tmp_path, delimiter, comma, padded):
    text = HEADER + "TIME_STAMP\t2021-08-26\n" + TITLES + ROWS.replace("\t6\n", "\t6.5\n")
    text = text.replace(".", comma).replace("\t", delimiter)
    if padded:
        text = "".join(line + delimiter * (7 - line.count(delimiter)) + "\n" for line in text.splitlines())
    recording = read_recording(write(tmp_path, text))
    assert (recording.format, recording.labels, recording.rate_hz) == ("Qualisys TSV", ("tip", "back"), 100.0)
    assert np.allclose(recording.points_m, [[0.001, 0.003, -0.002], [0.004, 0.0065, -0.005]])
    assert np.allclose(recording.times_s, [0, 0.01, 0.02])
    assert recording.warnings == ()


def test_decimal_commas_between_commas_are_named(tmp_path):
    rows = "".join(f"{i + 1}\t0.0{i}\t1.5\t2.5\t3.5\t4.5\t5.5\t6.5\n" for i in range(3)).replace(".", ",")
    text = (HEADER + TITLES + rows).replace("\t", ",")
    with pytest.raises(FormatError, match="15 columns instead of 8: its numbers seem to have decimal commas"):
        read_recording(write(tmp_path, text))


def test_skipped_numbers_without_times_are_a_hole(tmp_path):
    rows = "".join(f"{n}\t1\t2\t3\t4\t5\t6\n" for n in (1, 2, 3, 9, 10))
    recording = read_recording(write(tmp_path, HEADER.replace("\t3\n", "\t5\n", 1) + rows))
    assert np.allclose(recording.times_s, np.array([0, 1, 2, 8, 9]) / 100)


@pytest.mark.parametrize("rate", ["EXT", None])
def test_without_rate_and_times_no_rate_is_named(tmp_path, rate):
    header = HEADER.replace("FREQUENCY\t100\n", f"FREQUENCY\t{rate}\n" if rate else "")
    with pytest.raises(FormatError) as error:
        read_recording(write(tmp_path, header + "1\t2\t3\t4\t5\t6\n"))
    said = "does not tell its frame rate, and has no times that would. Export it again with its times or its rate."
    assert str(error.value) == f"room.tsv {said}"
