import numpy as np
import pytest

from core.errors import FormatError
from core.takes.formats import read_recording

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


def test_times_that_do_not_increase_give_way_to_the_rate(tmp_path, caplog):
    recording = read_recording(write(tmp_path, "7\t0\t1\t2\t3\t4\t5\t6\n9\t0\t1\t2\t3\t4\t5\t6\n"))
    assert np.allclose(recording.times_s, [0.0, 1 / 120])
    assert recording.frame_numbers.tolist() == [7, 9]
    assert "times do not increase" in caplog.text


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
        ("1\t0\t1\t2\t3\t4\t5\n", "line 6 has 7 columns where 2 markers need 8"),
        ("1\t0\t1\t2\t3\t4\t5\t6\t7\n", "line 6 has 9 columns where 2 markers need 8"),
        (ROWS + "3\t0.016667\t1\t2\t3", "line 8 has 5 columns"),  # cut off at the end of a marker
        ("", "holds no frames"),
        ("1\t0\t1\t2\t1e12\t4\t5\t6\n", "ThumbTip at z = 1e+09 m"),
        ("1\t0\t1\t2\tinf\t4\t5\t6\n", "ThumbTip at z = inf m"),
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
        (HEADER.replace("{a}\t\t\t", "{a}\t"), "not one per three columns"),
        (HEADER.replace("120\t120\t99", "fast\t120\t99"), "column 1: 'fast' is not a number"),
        ("".join(HEADER.splitlines(True)[:3]), "before the marker names"),
    ],
)
def test_damaged_header_is_named(tmp_path, header, says):
    with pytest.raises(FormatError) as error:
        read_recording(write(tmp_path, ROWS if "Frame#" in header or "Number" in header else "", header=header))
    assert says in str(error.value)
