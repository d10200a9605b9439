import numpy as np
import pytest

from core.errors import FormatError
from core.takes.formats import read_recording
from core.takes.formats.assemble import unique_labels
from tests.data import case_path, data_path

HEADER = (
    "PathFileType\t4\t(X/Y/Z)\tpinch.trc\n"
    "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames\n"
    "120\t120\t99\t2\t{unit}\t120\t1\t99\n"
    "Frame#\tTime\t{a}\t\t\t{b}\t\t\n"
    "\t\tX1\tY1\tZ1\tX2\tY2\tZ2\n"
)
ROWS = "1\t0.0\t1000\t2000\t-3000\t4\t5\t6\n2\t0.008333\t\t\t\t7\t8\t9\n"


def write(folder, rows=ROWS, unit="mm", a="ThumbTip", b="IndexTip", header=HEADER):
    path = folder / "pinch.trc"
    path.write_text(header.format(unit=unit, a=a, b=b) + rows, encoding="utf-8")
    return path


def test_labels_units_and_gaps(tmp_path):
    recording = read_recording(write(tmp_path))
    assert (recording.name, recording.rate_hz, recording.n_frames) == ("pinch", 120.0, 2)
    assert recording.labels == ("ThumbTip", "IndexTip")
    assert np.allclose(recording.points_m[0], [[1.0, 2.0, -3.0], [0.004, 0.005, 0.006]])
    assert np.isnan(recording.points_m[1, 0]).all()
    assert np.allclose(recording.points_m[1, 1], [0.007, 0.008, 0.009])


@pytest.mark.parametrize(("unit", "metres"), [("mm", 0.001), ("m", 1.0), ("CM", 0.01), ("inches", 0.0254)])
def test_every_unit_becomes_metres(tmp_path, unit, metres):
    recording = read_recording(write(tmp_path, "1\t0\t1\t2\t3\t4\t5\t6\n", unit))
    assert np.allclose(recording.points_m[0].ravel(), np.arange(1, 7) * metres)


def test_same_name_twice_gets_a_number(tmp_path):
    assert read_recording(write(tmp_path, a="Tip", b="Tip")).labels == ("Tip", "Tip 2")


def test_blank_line_after_the_header_and_closing_tabs(tmp_path):
    recording = read_recording(write(tmp_path, "\n" + ROWS.replace("\n", "\t\n")))
    assert recording.n_frames == 2


def test_a_complete_line_may_leave_out_its_last_gaps(tmp_path):
    recording = read_recording(write(tmp_path, ROWS + "3\t0.016667\t1\t2\t3\n4\t0.025\n"))
    assert np.isnan(recording.points_m[2:, :, 0]).tolist() == [[False, True], [True, True]]


def test_decimal_commas(tmp_path):
    recording = read_recording(write(tmp_path, ROWS.replace(".", ",").replace("1000", "1000,5")))
    assert recording.points_m[0, 0, 0] == pytest.approx(1.0005)
    assert recording.times_s[1] == pytest.approx(0.008333)


def test_times_that_do_not_increase_give_way_to_the_rate(tmp_path):
    recording = read_recording(write(tmp_path, "7\t0\t1\t2\t3\t4\t5\t6\n9\t0\t1\t2\t3\t4\t5\t6\n"))
    assert np.allclose(recording.times_s, [0.0, 1 / 120])
    assert recording.frame_numbers.tolist() == [7, 9]
    assert recording.warnings[-1] == "Its times do not increase; frames are spaced by its rate of 120 Hz instead."


def test_byte_order_marks(tmp_path):
    text = write(tmp_path).read_text()
    for encoding in ("utf-8-sig", "utf-16"):
        path = tmp_path / f"{encoding}.trc"
        path.write_text(text, encoding=encoding)
        assert read_recording(path).labels == ("ThumbTip", "IndexTip")


@pytest.mark.parametrize(
    ("rows", "says"),
    [
        ("1\t0\t1\t2\tx3\t4\t5\t6\n", "line 6 column 5: 'x3' is not a number"),
        ("1\t0\t1\t2\t3\t4\t5\n", "line 6 has 7 columns instead of 8"),
        ("1\t0\t1\t2\t3\t4\t5\t6\t7\n", "line 6 has 9 columns instead of 8"),
        ("1\t0\t1\t2\t3", "line 6 has 5 columns instead of 8"),  # cut off at the end of a marker
        ("1\t0\t1\t2\t3\t4\t5\t6\nx\t0\t1\t2\t3\t4\t5\t6\n", "line 7 column 1: 'x' is not a number"),
        ("", "holds no frames"),
        ("1\t0\t1\t2\t1e12\t4\t1e12\t6\n", "ThumbTip at z = 1e+09 m, and most others are as far out"),
        ("1\t0\t1\t2\t1e12\t\t\t\n", "ThumbTip at z = 1e+09 m"),
    ],
)
def test_damage_is_named(tmp_path, rows, says):
    with pytest.raises(FormatError) as error:
        read_recording(write(tmp_path, rows))
    assert str(error.value).startswith("pinch.trc")
    assert says in str(error.value)


@pytest.mark.parametrize(
    ("header", "says"),
    [
        (HEADER.replace("{unit}", "furlong"), "line 3 gives lengths in 'furlong'"),
        (HEADER.replace("{unit}", ""), "line 3 gives no value for Units"),
        (HEADER.replace("Frame#", "Number"), "starts with 'Number'"),
        (HEADER.replace("{b}", "{b}\tThird"), "8 columns where 3 names in the header need 11"),
        (HEADER.replace("{a}\t\t\t{b}", ""), "line 4 names no markers"),
        (HEADER.replace("Units", "Lengths"), "line 3 gives no value for Units"),
        (HEADER.replace("120\t120\t99", "fast\t120\t99"), "column 1: 'fast' is not a number"),
        ("".join(HEADER.splitlines(True)[:3]), "before the marker names"),
    ],
)
def test_damaged_header_is_named(tmp_path, header, says):
    with pytest.raises(FormatError) as error:
        read_recording(write(tmp_path, ROWS if "Frame#" in header or "Number" in header else "", header=header))
    assert says in str(error.value)


SOUND = [[0.001, 0.002, 0.003], [0.004, 0.005, 0.006]]


@pytest.mark.parametrize(
    "case", ["07-trc-names-laid-out-otherwise/trc_notabs.trc", "07-trc-names-laid-out-otherwise/trc_onetab.trc",
             "07-trc-names-laid-out-otherwise/trc_padvalues.trc", "07-trc-names-laid-out-otherwise/trc_spacecols.trc",
             "15-trc-without-axes-line/trc_noblank_xyz.trc"]
)  # fmt: skip
def test_reported_layouts(case):
    recording = read_recording(case_path("files", *case.split("/")))
    assert recording.labels == ("A", "B")
    assert recording.rate_hz == 100.0
    assert np.allclose(recording.points_m, [SOUND] * 3)
    assert np.allclose(recording.times_s, [0.0, 0.01, 0.02])
    assert recording.frame_numbers.tolist() == [1, 2, 3]
    assert recording.warnings == ()


@pytest.mark.parametrize(
    ("case", "gaps"), [("03-trc-zero-is-a-gap/trc_zero6.trc", (0, 1, 0)),
                       ("06-one-wild-point-refuses-all/trc_999.trc", (0, 0, 1))]
)  # fmt: skip
def test_reported_gaps(case, gaps):
    recording = read_recording(case_path("files", *case.split("/")))
    assert np.isnan(recording.points_m[1, 0]).all()
    assert np.allclose(recording.points_m[[0, 2]], [SOUND] * 2)
    assert np.allclose(recording.points_m[1, 1], SOUND[1])
    assert (recording.gaps.absent, recording.gaps.zero, recording.gaps.far) == gaps
    assert recording.warnings == (
        ("1 point lies beyond 1000 m and is left out as a gap, in frame 2: A at x = 10000 m.",) if gaps[2] else ()
    )


NAMES = {
    "one per three columns": "Frame#\tTime\tA\t\t\tB\t\t\tC\t\t",
    "a cell late": "Frame#\tTime\t\tA\t\t\tB\t\t\tC",
    "a cell late, two tabs": "Frame#\tTime\t\tA\t\tB\t\tC",
    "one tab": "Frame#\tTime\tA\tB\tC",
    "spaces": "Frame#  Time  A  B  C",
    "frame in small letters": "frame #\ttime\tA\t\t\tB\t\t\tC",
}
AXES = {
    "under the names": "\t\tX1\tY1\tZ1\tX2\tY2\tZ2\tX3\tY3\tZ3\n",
    "at the edge": "X1\tY1\tZ1\tX2\tY2\tZ2\tX3\tY3\tZ3\n\n",
    "spaces": "X1 Y1 Z1 X2 Y2 Z2 X3 Y3 Z3\n\t\t\t\n",
    "none": "",
    "none, but an empty line": "\n",
}
THREE = [[1, 2, 3], [4, 5, 6], [7, 8, 9]]


@pytest.mark.parametrize("space", ["\t", "  "])
@pytest.mark.parametrize("axes", AXES)
@pytest.mark.parametrize("names", NAMES)
def test_every_layout_reads_the_same(tmp_path, names, axes, space):
    fields = "DataRate\tNumFrames\tNumMarkers\tUnits\n 100.0\t\t2\t3\t m\t\n"
    rows = "".join(space.join(map(str, [i, i / 100, *range(1, 10)])) + "\n" for i in (1, 2))
    path = tmp_path / "layout.trc"
    path.write_text(f"PathFileType  4\t(X/Y/Z) C:\\x\n{fields}{NAMES[names]}\n{AXES[axes]}{rows}")
    recording = read_recording(path)
    assert recording.labels == ("A", "B", "C")
    assert recording.points_m.tolist() == [THREE, THREE]
    assert (recording.rate_hz, recording.frame_numbers.tolist(), recording.warnings) == (100.0, [1, 2], ())


def test_a_marker_without_a_name_keeps_its_columns(tmp_path):
    header = HEADER.replace("{a}\t\t\t{b}", "{a}\t\t\t\t\t\t{b}")
    recording = read_recording(write(tmp_path, "1\t0\t1\t2\t3\t4\t5\t6\t7\t8\t9\n", header=header))
    assert recording.labels == ("ThumbTip", "marker 2", "IndexTip")
    assert np.allclose(recording.points_m[0] * 1000, THREE)
    assert recording.warnings[-1] == "A marker has no name; it is called marker 2, by its place."


def test_fields_are_found_by_name_and_lines_may_be_missing(tmp_path):
    first, names, values, *rest = HEADER.format(unit="cm", a="A", b="B").splitlines(True)
    columns = list(zip(names.split(), values.split(), strict=True))[::-1]
    turned = "\t".join(name for name, _ in columns) + "\n" + "\t".join(value for _, value in columns) + "\n"
    path = tmp_path / "turned.trc"
    for head in (first + turned, turned, "\n" + first + "\n" + turned, "# by hand\n" + first + turned):
        path.write_text(head + "".join(rest) + "1\t0\t1\t2\t3\t4\t5\t6\n")
        recording = read_recording(path)
        assert np.allclose(recording.points_m, np.multiply(SOUND, 10))
        assert recording.rate_hz == 120.0


@pytest.mark.parametrize("values", [" 120\t\t120\t\t 9\t\t2\t\tcm\t", "120\t120\t9\t2\tcm", "120 120 9 2 cm 120 1 9"])
def test_values_that_are_padded_or_not_all_there(tmp_path, values):
    header = HEADER.splitlines(True)
    header[2] = values + "\n"
    recording = read_recording(write(tmp_path, "1\t0\t1\t2\t3\t4\t5\t6\n", header="".join(header)))
    assert recording.rate_hz == 120.0
    assert np.allclose(recording.points_m, np.multiply(SOUND, 10))
    assert recording.warnings == ("Its header promises 9 frames, 1 is there.",)


def test_header_counts_that_differ_are_said(tmp_path):
    recording = read_recording(write(tmp_path, ROWS, header=HEADER.replace("99\t2\t", "1900\t3\t")))
    assert recording.n_frames == 2
    assert recording.warnings == (
        "Its header promises 1,900 frames, 2 are there.",
        "Its header promises 3 markers, 2 are there.",
    )


@pytest.mark.parametrize("cut", ["3", "3\t0.01", "3\t0.016667\t1\t2\t3", "3\t0.016667\t1\t2\t3\t4\t5\t-"])
def test_a_file_that_was_cut_off_gives_its_whole_frames(tmp_path, cut):
    recording = read_recording(write(tmp_path, ROWS + cut))
    assert recording.n_frames == 2
    assert "Its last line is cut off and was left out." in recording.warnings


TENS = [f"{n}\t{n / 120:.5f}\t1\t2\t3\t4\t5\t-33{n % 10}.310000\n" for n in range(1, 13)]
CUT_OFF = "Its last line is cut off and was left out."


def read_rows(folder, rows):
    return read_recording(write(folder, rows, header=HEADER.replace("99\t2", "12\t2")))


@pytest.mark.parametrize("end", ["-33", "-332", "-332.", "-332.3", "-332.31000", "-", "-3"])
def test_a_last_number_that_was_cut_off_is_no_number_whatever_the_header_promises(tmp_path, end):
    last = TENS[11].rpartition("\t")[0] + "\t" + end
    recording = read_rows(tmp_path, "".join(TENS[:11]) + last)
    assert recording.n_frames == 11
    assert recording.warnings == (CUT_OFF, "Its header promises 12 frames, 11 are there.")


def test_a_whole_last_line_needs_no_line_break(tmp_path):
    recording = read_rows(tmp_path, "".join(TENS).rstrip("\n"))
    assert (recording.n_frames, recording.warnings) == (12, ())
    whole = [row.replace(".310000", "") for row in TENS]  # whole numbers, down to one with fewer digits
    whole[11] = whole[11].replace("-332", "-99")
    whole[:11] = [row.replace("-33", "-10") for row in whole[:11]]
    recording = read_rows(tmp_path, "".join(whole).rstrip("\n"))
    assert (recording.n_frames, recording.warnings) == (12, ())


@pytest.mark.parametrize("gap", ["\t\t", "0\t0\t0", "nan\tnan\tnan"])
def test_a_gap_that_ends_a_file_is_not_cut_off(tmp_path, gap):
    recording = read_rows(tmp_path, "".join(TENS[:11]) + "12\t0.1\t1\t2\t3\t" + gap)
    assert (recording.n_frames, recording.warnings) == (12, ())
    assert np.isnan(recording.points_m[11, 1]).all()


def test_where_zeros_are_left_out_a_shorter_last_number_is_kept_and_said(tmp_path):
    trimmed = [f"{n}\t{n / 120:.5f}\t1\t2\t3\t4\t5\t{5 + n / 16:g}\n" for n in range(1, 12)]
    for last, n_frames, warnings in (
        ("5.7", 12, ()),
        ("6", 12, ("Its last line ends without a line break and may be cut off in its last number, 6.",)),
        ("6\n", 12, ()),
    ):
        rows = "".join(row for row in trimmed if not row.endswith("\t6\n"))
        recording = read_rows(tmp_path, rows + f"12\t0.1\t1\t2\t3\t4\t5\t{last}")
        assert recording.n_frames == n_frames
        assert recording.warnings == warnings


def test_a_whole_number_that_lost_a_digit_is_cut_off(tmp_path):
    rows = "".join(row.replace(".310000", "") for row in TENS[:11])
    assert read_rows(tmp_path, rows + "12\t0.1\t1\t2\t3\t4\t5\t-33").warnings[0] == CUT_OFF


@pytest.mark.parametrize(("delimiter", "word"), [(",", "commas"), (";", "semicolons")])
def test_another_delimiter_is_named_where_it_is(tmp_path, delimiter, word):
    text = (HEADER.format(unit="mm", a="A", b="B") + ROWS).replace("\t", delimiter)
    with pytest.raises(FormatError, match=rf"line 2 separates its columns with {word}; TRC has tabs"):
        read_recording(write(tmp_path, "", header=text))
    with pytest.raises(FormatError, match=rf"line 6 separates its columns with {word}; TRC has tabs"):
        read_recording(write(tmp_path, ROWS.replace("\t", delimiter)))


@pytest.mark.parametrize(
    ("rate", "decimals", "rows", "found"),
    [(120, 5, 60, 120.0), (120, 3, 60, 120.0), (25, 2, 60, 25.0), (59.94, 6, 2000, 59.94), (30, 4, 40, 30.0)],
)
def test_the_rate_of_times_is_as_plain_as_they_tell(tmp_path, rate, decimals, rows, found):
    text = "".join(f"{i + 1}\t{i / rate:.{decimals}f}\t1\t2\t3\t4\t5\t6\n" for i in range(rows))
    header = HEADER.replace("120\t120\t99\t2", f"250\t250\t{rows}\t2")
    recording = read_recording(write(tmp_path, text, header=header))
    assert recording.rate_hz == found
    assert recording.warnings == (f"Its header says 250 Hz, its times {found:g} Hz; the times are taken.",)


@pytest.mark.parametrize("header_hz", [120, 60])
def test_times_in_milliseconds(tmp_path, header_hz):
    text = "".join(f"{i + 1}\t{1000 * i / 120:.1f}\t1\t2\t3\t4\t5\t6\n" for i in range(60))
    header = HEADER.replace("120\t120\t99\t2", f"{header_hz}\t{header_hz}\t60\t2")
    recording = read_recording(write(tmp_path, text, header=header))
    assert recording.rate_hz == 120.0
    assert np.allclose(recording.times_s, np.arange(60) / 120, atol=1e-4)
    assert recording.warnings[0].startswith("Its times are read in milliseconds, for ")


def test_skipped_numbers_without_times_are_a_hole(tmp_path):
    text = "".join(f"{n}\t\t1\t2\t3\t4\t5\t6\n" for n in (1, 2, 3, 9, 10))
    recording = read_recording(write(tmp_path, text, header=HEADER.replace("99\t2", "5\t2")))
    assert np.allclose(recording.times_s, np.array([0, 1, 2, 8, 9]) / 120)
    assert recording.warnings == ()


def rows_of(path):
    """The numbers of a file's rows, read as plainly as can be."""
    rows = []
    for line in path.read_text(encoding="utf-8").splitlines()[4:]:
        cells = line.rstrip("\n").split("\t")
        if cells[0].strip().isdigit():
            rows.append([float(cell) if cell.strip().lower() not in ("", "nan") else np.nan for cell in cells])
    return rows


OPENSIM = {
    "dataWithBlanksForMissingMarkers": (464, 40, 15005),
    "dataWithEformat": (5, 14, 0),
    "dataWithNaNsOfDifferentCases": (5, 14, 5),
    "exampleFormat": (5, 3, 2),
    "futureMarkerPreviewData": (73, 31, 0),
    "futureOrientationInverseKinematics": (1202, 2, 0),
    "gait10dof18musc_walk_CRLF_line_ending": (10, 41, 0),
    "init100": (120, 22, 0),
    "markers_walk": (238, 41, 0),
    "std_walking5_markers": (112, 40, 2077),
    "subject01_synthetic_marker_data": (73, 31, 0),
    "test_walking": (806, 40, 10455),
}


@pytest.mark.parametrize("name", OPENSIM)
def test_files_of_opensim(name):
    path = data_path("public", "opensim", f"{name}.trc")
    recording = read_recording(path)
    assert (*recording.points_m.shape[:2], recording.gaps.total) == OPENSIM[name]
    unit = 1.0 if path.read_text().splitlines()[2].split()[4] == "m" else 0.001
    n_values = 3 * len(recording.labels)
    rows = rows_of(path)
    start_s = rows[0][1]
    for row, time_s, points in zip(rows, recording.times_s, recording.points_m, strict=True):
        given = np.full(n_values, np.nan)
        given[: min(len(row) - 2, n_values)] = row[2 : 2 + n_values]
        given = given.reshape(-1, 3) * unit
        given[np.isnan(given).any(axis=1) | ~given.any(axis=1)] = np.nan
        assert np.array_equal(points, given, equal_nan=True)
        assert time_s == pytest.approx(row[1] - start_s, abs=1e-9)
    words = path.read_text().splitlines()[3].split("\t")
    assert list(recording.labels) == [word for word in words[2:] if word.strip()]


def test_files_of_opensim_have_one_rate():
    for name, rate_hz in (("futureOrientationInverseKinematics", 100.0), ("std_walking5_markers", 25.0)):
        assert read_recording(data_path("public", "opensim", f"{name}.trc")).rate_hz == rate_hz


def test_files_of_opensim_whose_header_errs_say_so():
    said = {name: read_recording(data_path("public", "opensim", f"{name}.trc")).warnings for name in OPENSIM}
    assert {name: warnings for name, warnings in said.items() if warnings} == {
        "futureOrientationInverseKinematics": (
            "Its header promises 1,203 frames, 1,202 are there.",
            "Its header says 60 Hz, its times 100 Hz; the times are taken.",
        ),
        "std_walking5_markers": ("Its header says 250 Hz, its times 25 Hz; the times are taken.",),
    }


def test_a_trc_equals_the_c3d_of_the_same_walk():
    trc = read_recording(data_path("public", "opensim", "test_walking.trc"))
    c3d = read_recording(data_path("public", "opensim", "test_walking.c3d"))
    assert trc.labels == c3d.labels[: len(trc.labels)]
    assert trc.points_m.shape[:2] == c3d.points_m.shape[:2] and trc.points_m[:, :, 0].size == 32_240
    assert trc.gaps.total == c3d.gaps.total == 10_455
    seen = ~np.isnan(trc.points_m[:, :, 0])
    assert np.array_equal(seen, ~np.isnan(c3d.points_m[:, :, 0]))
    # Only the C3D says which axis is up, so it alone is turned: by a rotation of whole right angles.
    turn = np.linalg.lstsq(trc.points_m[seen], c3d.points_m[seen], rcond=None)[0].T
    assert np.allclose(turn, np.round(turn), atol=1e-9)
    assert np.linalg.det(turn) == pytest.approx(1.0)
    assert np.abs(trc.points_m[seen] - c3d.points_m[seen] @ np.round(turn)).max() < 1e-9


def test_thousands_of_markers_of_one_name_are_told_apart_at_once() -> None:
    """Counting through those before, for each, would take minutes."""
    labels = unique_labels(["a"] * 65_000 + ["a 2", "b"])
    assert labels[:3] == ("a", "a 2", "a 3") and labels[-3:] == ("a 65000", "a 2 2", "b")
    assert len(set(labels)) == len(labels)
