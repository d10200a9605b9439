import numpy as np
import pytest

from core.errors import FormatError
from core.takes.formats import read_recording
from core.takes.holes import holes_of
from tests.some import some

POINTS = np.array([[[1.5, 2, 3], [104, 205, 306]], [[1, 2, 4], [107, 208, 309]], [[1, 2, 5], [np.nan] * 3]])
METRES = POINTS / 1000
AXES = [f"{name}-{axis}" for name in ("Tip", "Back of hand") for axis in "XYZ"]
RIGHT_ANGLE = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])


NO_UP = "It does not say which axis is up; Y is taken, and nothing is turned."


def rows(leads=("", "", ""), delimiter=",", points=POINTS):
    cells = [["" if np.isnan(value) else f"{value:g}" for value in frame.ravel()] for frame in points]
    return "".join(lead + delimiter.join(row) + "\n" for lead, row in zip(leads, cells, strict=True))


COUNTED = ("7,0.00,", "8,0.02,", "10,0.06,")


def write(folder, text, encoding="utf-8"):
    path = folder / "wide.csv"
    path.write_text(text, encoding=encoding)
    return path


def check(recording, labels=("Tip", "Back of hand")):
    assert recording.labels == labels
    assert np.allclose(recording.points_m, METRES, equal_nan=True)
    assert recording.gaps.total == 1


@pytest.mark.parametrize(
    "title", ["{}-{}", "{}.{}", "{}:{}", "{}_{}", "{} {}", "{} ({})", "{}{}", "{} - {}", '"{}-{}"']
)
@pytest.mark.parametrize("letters", ["XYZ", "xyz"])
def test_every_way_to_write_an_axis(tmp_path, title, letters):
    header = ",".join(title.format(name, axis) for name in ("Tip", "Back of hand") for axis in letters)
    recording = read_recording(write(tmp_path, f"Frame,Time,{header}\n" + rows(COUNTED)))
    check(recording)
    assert recording.frame_numbers.tolist() == [7, 8, 10]
    assert np.allclose(recording.times_s, [0, 0.02, 0.06])
    assert recording.rate_hz == pytest.approx(50.0)


@pytest.mark.parametrize("frame", ["Frame", "frame#", "Frame No.", "#", "Frame Number", "Field #"])
@pytest.mark.parametrize("time", ["Time", "time_s", "Time (Seconds)", "Timestamp", "t", "time (ms)", "Time_us"])
def test_frame_and_time_by_their_names_in_any_order(tmp_path, frame, time):
    second = 1000 if "ms" in time else 1_000_000 if "us" in time else 1
    leads = [f"{seconds * second:g},{number},{number - 1}," for number, seconds in ((7, 3.0), (8, 3.5), (9, 4.0))]
    recording = read_recording(write(tmp_path, f"{time},{frame},Sub Frame,{','.join(AXES)}\n" + rows(leads)))
    check(recording)
    assert recording.frame_numbers.tolist() == [7, 8, 9]
    assert np.allclose(recording.times_s, [0, 0.5, 1.0])
    assert recording.rate_hz == pytest.approx(2.0)


def test_without_frame_and_time_a_rate_is_assumed_and_said(tmp_path):
    recording = read_recording(write(tmp_path, ",".join(AXES) + "\n" + rows()))
    check(recording)
    assert recording.rate_hz == 100.0
    assert np.allclose(recording.times_s, [0, 0.01, 0.02])
    assert "It tells neither its rate nor times; 100 Hz is assumed. A column Time would tell it." in recording.warnings


@pytest.mark.parametrize("line", ["Frame Rate,240", "Rate: 240", "FrameRate;240;Unit;mm", "240", "x,y,Frequency,240"])
def test_a_rate_above_the_header(tmp_path, line):
    recording = read_recording(write(tmp_path, f"{line}\nFrame,{','.join(AXES)}\n" + rows(("1,", "2,", "3,"))))
    check(recording)
    assert recording.rate_hz == 240.0
    assert np.allclose(recording.times_s, np.arange(3) / 240)


def test_a_frame_that_saw_nothing_is_a_frame_where_rows_are_not_counted(tmp_path):
    text = ",".join(AXES) + "\n,,,,,\n1,2,3,104,205,306\n,,,,,\n"
    assert np.isnan(read_recording(write(tmp_path, text)).points_m[:, 0, 0]).tolist() == [True, False, True]
    counted = "Frame," + ",".join(AXES) + "\n1,1,2,3,104,205,306\n,,,,,,\n"
    assert read_recording(write(tmp_path, counted)).n_frames == 1


@pytest.mark.parametrize(
    ("titles", "factor"),
    [("{}-{} (mm)", 1e-3), ("{}_{}_m", 1.0), ("{} {} [cm]", 0.01), ("{}.{}(m)", 1.0), ("{}_{}_mm", 1e-3)],
)
def test_the_unit_of_the_titles(tmp_path, titles, factor):
    header = ",".join(titles.format(name, axis) for name in ("Tip", "Back") for axis in "XYZ")
    recording = read_recording(write(tmp_path, f"Frame,Time,{header}\n" + rows(COUNTED)))
    assert recording.labels == ("Tip", "Back")
    assert np.allclose(recording.points_m, POINTS * factor, equal_nan=True)
    assert recording.warnings == (NO_UP,)


def test_the_unit_below_or_above_the_titles(tmp_path):
    header = f"Frame,Time,{','.join(AXES)}\n"
    below = [header + f",{time}" + f",{unit}" * 6 + "\n" for time, unit in (("s", "cm"), ("(s)", "(cm)"), ("", "[CM]"))]
    for text in some([each + rows(COUNTED) for each in (*below, "Units,cm\n" + header)]):
        recording = read_recording(write(tmp_path, text))
        assert np.allclose(recording.points_m, POINTS / 100, equal_nan=True)
        assert recording.warnings == (NO_UP,)


def test_a_unit_that_is_not_told_is_assumed_by_the_size_of_a_frame(tmp_path):
    header = f"Frame,Time,{','.join(AXES)}\n"
    millimetres = read_recording(write(tmp_path, header + rows(COUNTED)))
    metres = read_recording(write(tmp_path, header + rows(COUNTED, points=METRES)))
    assert np.allclose(metres.points_m, millimetres.points_m, equal_nan=True)
    assert millimetres.warnings == (
        "It tells no unit of length; mm is assumed, since the markers of a frame lie within 304 of each other.",
        NO_UP,
    )
    assert metres.warnings == (
        "It tells no unit of length; m is assumed, since the markers of a frame lie within 0.304 of each other.",
        NO_UP,
    )
    # A hand far from the origin, in millimetres beyond 1000, and one wild point:
    far = POINTS + 2500
    far[0, 1] = 9e9
    recording = read_recording(write(tmp_path, header + rows(COUNTED, points=far)))
    assert np.allclose(recording.points_m[1], far[1] / 1000)
    assert recording.gaps.far == 1


@pytest.mark.parametrize(("delimiter", "comma"), [(";", ","), ("\t", ","), ("\t", "."), (";", ".")])
def test_semicolons_tabs_and_decimal_commas(tmp_path, delimiter, comma):
    text = f"Frame,Time,{','.join(AXES)}\n" + rows(COUNTED)
    recording = read_recording(write(tmp_path, text.replace(",", delimiter).replace(".", comma)))
    check(recording)
    assert np.allclose(recording.times_s, [0, 0.02, 0.06])


def test_a_byte_order_mark_and_windows_line_ends(tmp_path):
    text = f"Frame,Time,{','.join(AXES)}\n" + rows(COUNTED)
    check(read_recording(write(tmp_path, text.replace("\n", "\r\n"), "utf-8-sig")))
    check(read_recording(write(tmp_path, text, "utf-16")))


def test_columns_beside_the_markers_are_passed_over(tmp_path):
    header = "Frame,Time,Tip-X,Tip-Y,Tip-Z,Tip-Residual,Back-X,Back-Y,Back-Z,Note"
    text = f"{header}\n1,0,1,2,3,x,104,205,306,good\n2,0.5,1,2,3,,107,208,309\n"
    recording = read_recording(write(tmp_path, text))
    assert recording.labels == ("Tip", "Back")
    assert np.allclose(recording.points_m[:, 1] * 1000, [[104, 205, 306], [107, 208, 309]])


@pytest.mark.parametrize("times", ["Time", "time_s"])
@pytest.mark.parametrize("middle", [False, True])
def test_frame_and_time_wherever_they_stand(tmp_path, times, middle):
    tail = [f"{7 + i},{i / 50:.2f}" for i in range(3)]
    header = [*AXES[:3], "Frame", times, *AXES[3:]] if middle else [*AXES, "Frame", times]
    text = ",".join(header) + "\n"
    for row, counted in zip(rows().splitlines(), tail, strict=True):
        cells = row.split(",")
        text += ",".join([*cells[:3], counted, *cells[3:]] if middle else [*cells, counted]) + "\n"
    recording = read_recording(write(tmp_path, text))
    check(recording)
    assert recording.frame_numbers.tolist() == [7, 8, 9]
    assert np.allclose(recording.times_s, [0, 0.02, 0.04])
    assert recording.rate_hz == 50.0


@pytest.mark.parametrize(
    "titles",
    ["RB-RX,RB-RY,RB-RZ", "RB_rot_x,RB_rot_y,RB_rot_z", "RB Rotation X,RB Rotation Y,RB Rotation Z",
     "RBQuat.X,RBQuat.Y,RBQuat.Z", "Tip-Velocity-X,Tip-Velocity-Y,Tip-Velocity-Z", "Tip-RX,Tip-RY,Tip-RZ",
     "Tip_acc_x (m),Tip_acc_y (m),Tip_acc_z (m)"],
)  # fmt: skip
@pytest.mark.parametrize("before", [False, True])
def test_columns_that_are_no_places_are_left_out(tmp_path, titles, before):
    header = f"Frame,Time,{titles},{','.join(AXES)}" if before else f"Frame,Time,{','.join(AXES)},{titles}"
    leads = [f"{lead}9,9,9," for lead in COUNTED] if before else COUNTED
    body = rows(leads) if before else rows(leads).replace("\n", ",9,9,9\n")
    recording = read_recording(write(tmp_path, f"{header}\n{body}"))
    check(recording)
    name = titles.partition(",")[0].replace(" (m)", "")[:-1].rstrip("-_. ")
    assert recording.warnings[0] == (
        f"1 set of columns holds rotations, velocities or the like, no positions, and is left out: {name}."
    )


def test_units_of_columns_that_are_no_places_say_nothing(tmp_path):
    header = f"Frame,Time,RB-RX,RB-RY,RB-RZ,{','.join(AXES)}\n,s,deg,deg,deg{',mm' * 6}\n"
    check(read_recording(write(tmp_path, header + rows([f"{lead}9,9,9," for lead in COUNTED]))))


def test_all_of_a_quaternion_is_left_out(tmp_path):
    header = f"Frame,Time,RB-QW,RB-QX,RB-QY,RB-QZ,RB-RX,RB-RY,RB-RZ,{','.join(AXES)}"
    recording = read_recording(write(tmp_path, header + "\n" + rows([lead + "1,0,0,0,3,4,5," for lead in COUNTED])))
    check(recording)
    assert recording.warnings[0] == (
        "2 sets of columns hold rotations, velocities or the like, no positions, and are left out: RB-Q, RB-R."
    )


@pytest.mark.parametrize("names", [("Thumb_R", "Thumb_L"), ("ThumbR", "Index"), ("Q", "R"), ("Rotor", "Excel")])
@pytest.mark.parametrize("title", ["{}{}", "{}-{}"])
def test_a_right_hand_is_no_rotation(tmp_path, names, title):
    header = ",".join(title.format(name, axis) for name in names for axis in "XYZ")
    assert read_recording(write(tmp_path, f"Frame,Time,{header}\n" + rows(COUNTED))).labels == names
    above = f",,{names[0]},,,{names[1]},,\nFrame,Time,X,Y,Z,X,Y,Z\n" + rows(COUNTED)
    assert read_recording(write(tmp_path, above)).labels == names


def test_times_in_another_unit(tmp_path):
    def read(title, unit, lead=""):
        leads = [f"{1 + i},{i / 120 * unit:.6g}," for i in range(3)]
        return read_recording(write(tmp_path, f"{lead}Frame,{title},{','.join(AXES)}\n" + rows(leads)))

    for unit, word, wrong in ((1e3, "milliseconds", "0.12"), (1e6, "microseconds", "0.00012")):
        recording = read("Time", unit)
        assert recording.rate_hz == 120.0
        assert np.allclose(recording.times_s, np.arange(3) / 120, atol=1e-5)
        assert f"Its times are read in {word}, for in seconds they would mean {wrong} Hz." in recording.warnings
        recording = read("Time (s)", unit, "Rate,120\n")
        assert np.allclose(recording.times_s, np.arange(3) / 120, atol=1e-5)
        assert f"Its times are read in {word}, for its header says 120 Hz." in recording.warnings
    assert read("Time (s)", 1e3).rate_hz == pytest.approx(0.12)  # it says so
    recording = read("Time (ms)", 1.0)
    assert recording.rate_hz == 120.0
    assert "Its times are read in seconds, for in the unit of their title they would mean 120,000 Hz." in (
        recording.warnings
    )


def test_decimal_commas_between_commas_are_named(tmp_path):
    text = f"Frame,Time,{','.join(AXES)}\n" + "".join(f"{i},0,0{i},1,5,2,5,3,5,4,5,5,5,6,5\n" for i in range(3))
    with pytest.raises(FormatError, match="line 2 has 15 columns instead of 8: its numbers seem to have decimal"):
        read_recording(write(tmp_path, text))


def test_a_wide_frame_is_said_in_plain_numbers(tmp_path):
    far = POINTS.copy()
    far[:, 1] += 1500
    warnings = read_recording(write(tmp_path, f"Frame,Time,{','.join(AXES)}\n" + rows(COUNTED, points=far))).warnings
    assert "lie within 1,804 of each other" in warnings[0]


def test_skipped_frame_numbers_are_a_hole(tmp_path):
    text = VICON.partition("5,0,")[0]
    text += "".join(f"{n},0,1,2,3,4,5,6\n" for n in (*range(1, 16), *range(26, 40)))
    recording = read_recording(write(tmp_path, text))
    assert np.allclose(recording.times_s, np.array([*range(15), *range(25, 39)]) / 100)
    holes = holes_of(recording.times_s, recording.rate_hz)
    assert (len(holes), holes.missing) == (1, 10)
    assert holes.from_s[0] == pytest.approx(0.15) and holes.to_s[0] == pytest.approx(0.25)


@pytest.mark.parametrize("step", [2, 10])
def test_numbers_that_step_by_more_than_one_frame(tmp_path, step):
    numbers = [n * step for n in (*range(1, 16), *range(26, 40))]
    text = VICON.partition("5,0,")[0] + "".join(f"{n},0,1,2,3,4,5,6\n" for n in numbers)
    recording = read_recording(write(tmp_path, text))
    assert np.allclose(recording.times_s, np.array([*range(15), *range(25, 39)]) / 100)


def test_a_wild_frame_number_leaves_no_hours(tmp_path):
    text = VICON.partition("5,0,")[0] + "".join(f"{n},0,1,2,3,4,5,6\n" for n in (1, 2, 3, 5, 900_000, 900_001))
    recording = read_recording(write(tmp_path, text))
    assert np.allclose(recording.times_s, np.array([0, 1, 2, 4, 5, 6]) / 100)
    assert recording.warnings == (
        "Its frame numbers jump from 5 to 900000, more than 10 minutes; no time is left between.",
    )


VICON = (
    "Trajectories\n100\n,,Anna:Tip,,,Anna:Back of hand,,\nFrame,Sub Frame,X,Y,Z,X,Y,Z\n,,mm,mm,mm,mm,mm,mm\n"
    + rows(("5,0,", "6,0,", "8,0,"))
)
DEVICES = "Devices\n1000\n,,Plate - Force,,\nFrame,Sub Frame,Fx,Fy,Fz\n,,N,N,N\n" + "1,0,1,2,3\n" * 3000 + "\n"
JOINTS = "\nModel Outputs\n100\n,,Anna:Wrist,,\nFrame,Sub Frame,X,Y,Z\n,,deg,deg,deg\n5,0,1,2,3\n6,0,1,2,3\n8,0,1,2,3\n"


@pytest.mark.parametrize("text", [VICON, VICON + "\n", DEVICES + VICON, VICON + JOINTS, JOINTS.lstrip() + "\n" + VICON])
def test_trajectories_of_vicon_are_z_up(tmp_path, text):
    recording = read_recording(write(tmp_path, text))
    assert recording.labels == ("Anna:Tip", "Anna:Back of hand")
    assert np.allclose(recording.points_m, METRES @ RIGHT_ANGLE.T, equal_nan=True)
    assert (recording.rate_hz, recording.frame_numbers.tolist(), recording.warnings) == (100.0, [5, 6, 8], ())


@pytest.mark.parametrize(
    "names", [",,Tip,,,Back of hand", ",,Tip,Tip,Tip,Back of hand,Back of hand,Back of hand", ",,,Tip,,,Back of hand"]
)
def test_names_above_the_axes(tmp_path, names):
    text = f"{names}\nFrame,Time,X,Y,Z,X,Y,Z\n" + rows(COUNTED)
    check(read_recording(write(tmp_path, text)))


@pytest.mark.parametrize("cut", ["3", "3,0.", "3,0.02,1,2,3,4,5", "3,0.02,1,2,3,4,5,-", '3,0.02,1,2,3,4,5,"6'])
def test_a_file_that_was_cut_off_gives_its_whole_frames(tmp_path, cut):
    recording = read_recording(write(tmp_path, f"Frame,Time,{','.join(AXES)}\n" + rows(COUNTED) + cut))
    check(recording)
    assert recording.warnings[0] == "Its last line is cut off and was left out."


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (f"Frame,Time,{','.join(AXES)}\n1,0,1,2,3,4,five,6\n", "line 2 column 7: 'five' is not a number"),
        (f"Frame,Time,{','.join(AXES)}\n1,0,1,2,3,4,5\n", "line 2 has 7 columns instead of 8"),
        (f"Frame,Time,{','.join(AXES)}\n", "holds no frames"),
        (f"Frame,Time,{','.join(AXES)}\n,,px,px,px,px,px,px\n1,0,1,2,3,4,5,6\n", "line 2 gives lengths in 'px'"),
        (f"Frame,Time,{','.join(AXES)}\n,,mm,mm,mm,m,m,m\n1,0,1,2,3,4,5,6\n", "gives lengths in 'm/mm'"),
        (DEVICES, "no header with three columns per marker"),
        ("frame,time_s,hand,marker,x_m,y_m,z_m\n1,0,left,Tip,1,2,3\n", "which no known motion file does"),
        ("marker,pos.x,pos.y,pos.z\nA,1,2,3\n", "which no known motion file does"),
        ("Frame,Tip-X,Tip-Z\n1,2,3\n", "or have columns such as Name-X,Name-Y,Name-Z"),
        ("X,Y,Z\n1,2,3\n", "which no known motion file does"),
    ],
)
def test_damage_is_named(tmp_path, text, says):
    with pytest.raises(FormatError) as error:
        read_recording(write(tmp_path, text))
    assert "wide.csv" in str(error.value)
    assert says in str(error.value)
