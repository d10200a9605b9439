import numpy as np
import pytest

from core.errors import FormatError
from core.takes.formats import read_recording
from tests.data import case_path

FIRST = (
    "Format Version,1.23,Take Name,pinch,Capture Frame Rate,240.000000,Export Frame Rate,120.000000,"
    "Total Exported Frames,2,Rotation Type,Quaternion,Length Units,Millimeters,Coordinate Space,Global\n"
)


def table(columns, frames, parent=False):
    """columns: (type, name, quantity, axes)."""
    expanded = [(kind, name, quantity, axis) for kind, name, quantity, axes in columns for axis in axes]
    rows = [
        ",Type," + ",".join(c[0] for c in expanded),
        ",Name," + ",".join(c[1] for c in expanded),
        ",ID," + ",".join('"5A"' for _ in expanded),
        *([",Parent," + "," * (len(expanded) - 1)] if parent else []),
        ",," + ",".join(c[2] for c in expanded),
        "Frame,Time (Seconds)," + ",".join(c[3] for c in expanded),
        *(",".join(map(str, frame)) for frame in frames),
    ]
    return FIRST + "\n" + "\n".join(rows) + "\n"


BODY = [
    ("Rigid Body", "Glove", "Rotation", "XYZW"),
    ("Rigid Body", "Glove", "Position", "XYZ"),
    ("Rigid Body", "Glove", "Mean Marker Error", ("",)),
    ("Rigid Body Marker", "Glove:Marker1", "Position", "XYZ"),
    ("Rigid Body Marker", "Glove:Marker1", "Marker Quality", ("",)),
]
BODY_VALUES = [0, 0, 0, 1, 10, 20, 30, 0.1, 11, 21, 31, 1.0]
MARKERS = [("Marker", "Glove:Marker1", "Position", "XYZ"), ("Marker", "Unlabeled 1189", "Position", "XYZ")]


def write(folder, text):
    path = folder / "take.csv"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize("parent", [False, True])
def test_measured_markers_come_before_solved_ones(tmp_path, parent):
    frames = [[0, 0.0, *BODY_VALUES, 1, 2, 3, 4, 5, 6], [1, 0.008333, *BODY_VALUES, 1, 2, 3, "", "", ""]]
    recording = read_recording(write(tmp_path, table(BODY + MARKERS, frames, parent)))
    assert recording.labels == ("Glove:Marker1", "Unlabeled 1189")
    assert (recording.rate_hz, recording.n_frames) == (120.0, 2)
    assert np.allclose(recording.points_m[0], [[0.001, 0.002, 0.003], [0.004, 0.005, 0.006]])
    assert np.isnan(recording.points_m[1, 1]).all()


def test_solved_markers_where_nothing_was_measured(tmp_path):
    recording = read_recording(write(tmp_path, table(BODY, [[0, 0.0, *BODY_VALUES]])))
    assert recording.labels == ("Glove:Marker1",)
    assert np.allclose(recording.points_m[0, 0], (0.011, 0.021, 0.031))


def test_metres_time_code_and_lines_cut_after_the_last_marker_seen(tmp_path):
    text = table(
        [("", "", "", ("TimeCode",)), *MARKERS], [[0, 0.0, "15:26:46:12", 1, 2, 3], [5, 0.5, "", "", "", "", 4, 5, 6]]
    )
    recording = read_recording(write(tmp_path, text.replace("Millimeters", "Meters")))
    assert np.allclose(recording.points_m[0, 0], (1.0, 2.0, 3.0))
    assert np.allclose(recording.points_m[1, 1], (4.0, 5.0, 6.0))
    assert np.isnan(recording.points_m[[0, 1], [1, 0]]).all()
    assert recording.frame_numbers.tolist() == [0, 5]
    assert np.allclose(recording.times_s, [0.0, 0.5])


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (table(MARKERS, [[0, 0.0, 1, 2, 3, 4, "five", 6]]), "line 8 column 7: 'five' is not a number"),
        (table(MARKERS, [[0, 0.0, 1, 2]]).rstrip("\n"), "line 8 has 4 columns instead of 8"),
        (table(MARKERS, []), "holds no frames"),
        (table(BODY[:3], [[0, 0.0, *BODY_VALUES[:8]]]), "without markers"),
        (FIRST, "before the line of axes"),
        (FIRST.replace("Length Units,Millimeters,", ""), "no Length Units"),
        (FIRST.replace("Millimeters", "Parsecs"), "lengths in 'Parsecs'"),
        (FIRST + "\nFrame,Time (Seconds),X,Y,Z\n", "comes before the rows of types and names"),
        (FIRST + '\n,Type,"Marker\n', "broken quotes"),
        (table(MARKERS, [[0, 0.0, 1, 2, 3, 4, 5, 6]]).replace(",", ";"), "semicolons"),
        (table(MARKERS, [[0, 0.0, 1, 2, 3, 4, 5, 6]]).replace(",", "\t"), "separates its columns with tabs"),
    ],
)
def test_damage_is_named(tmp_path, text, says):
    with pytest.raises(FormatError) as error:
        read_recording(write(tmp_path, text))
    assert "take.csv" in str(error.value)
    assert says in str(error.value)


@pytest.mark.parametrize(
    "case", ["14-motive-notes-with-commas/mot_notes.csv", "14-motive-notes-with-commas/mot_notesnl.csv",
             "14-motive-notes-with-commas/mot_takecomma.csv", "08-text-in-the-code-page-of-windows/mot_gbk.csv"]
)  # fmt: skip
def test_reported_files(case):
    recording = read_recording(case_path("files", *case.split("/")))
    assert recording.labels == ("RB:Marker1", "Unlabeled 1005")
    assert (recording.rate_hz, recording.n_frames) == (120.0, 3)
    assert np.allclose(recording.points_m[:, 0], (0.011, 0.021, 0.031))
    assert np.isnan(recording.points_m[:, 1]).all() and recording.gaps.absent == 3
    assert len(recording.warnings) == (1 if "gbk" in case else 0)


@pytest.mark.parametrize(
    "notes",
    [
        "a, b, and c",
        '"quoted, as it should be"',
        '"over\nthree\n\nlines, and commas"',
        "over\ntwo lines, not quoted",
        'an odd " quote',
        '"an open quote, and more',
        "Length Units,Feet,Export Frame Rate,10",
        "Take Name",
        ",,,,",
    ],
)
@pytest.mark.parametrize("key", ["Take Name", "Take Notes"])
def test_whatever_a_take_is_called(tmp_path, key, notes):
    text = table(MARKERS, [[0, 0.0, 1, 2, 3, 4, 5, 6], [1, 0.008333, 1, 2, 3, 4, 5, 6]])
    text = text.replace("Take Name,pinch,", f"{key},{notes},")
    recording = read_recording(write(tmp_path, text))
    assert recording.labels == ("Glove:Marker1", "Unlabeled 1189")
    assert (recording.rate_hz, recording.warnings) == (120.0, ())
    assert np.allclose(recording.points_m, np.arange(1, 7).reshape(2, 3) / 1000)


def test_keys_of_the_first_line_may_come_in_any_order(tmp_path):
    cells = FIRST.strip().split(",")
    pairs = list(zip(cells[::2], cells[1::2], strict=True))
    text = table(MARKERS, [[0, 0.0, 1, 2, 3, 4, 5, 6]])
    for turned in (pairs[::-1], pairs[1:]):
        first = ",".join(f"{key},{value}" for key, value in turned) + "\n"
        recording = read_recording(write(tmp_path, text.replace(FIRST, first)))
        assert recording.rate_hz == 120.0
        assert np.allclose(recording.points_m[0, 1], (0.004, 0.005, 0.006))
        assert recording.warnings == ("Its header promises 2 frames, 1 is there.",)


def test_a_file_that_was_cut_off_gives_its_whole_frames(tmp_path):
    text = table(MARKERS, [[0, 0.0, 1, 2, 3, 4, 5, 6.125], [1, 0.008333, 1, 2, 3, 4, 5, 6.125]]).rstrip("\n")
    text = text.replace("Total Exported Frames,2", "Total Exported Frames,3")
    for length in range(1, len("1,0.008333,1,2,3,4,5,6.125")):
        recording = read_recording(write(tmp_path, text[:-length]))
        assert (recording.n_frames, recording.rate_hz) == (1, 120.0)
        assert recording.warnings == (
            "Its last line is cut off and was left out.",
            "Its header promises 3 frames, 1 is there.",
        )
    assert read_recording(write(tmp_path, text)).n_frames == 2
