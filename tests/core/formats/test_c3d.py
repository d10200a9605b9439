import struct

import ezc3d
import numpy as np
import pytest

from core.errors import FormatError
from core.takes.formats import read_recording
from core.takes.formats.c3d import read_with_residuals
from tests.core.formats.c3d_bytes import build, trial
from tests.data import case_path


def write_ezc3d(path, points, rate=120.0, residuals=None, **parameters):
    """points (t, m, 3) in the file's unit."""
    t, m = points.shape[:2]
    file = ezc3d.c3d()
    file["parameters"]["POINT"]["RATE"]["value"] = [rate]
    file["parameters"]["POINT"]["LABELS"]["value"] = [f"marker{i}" for i in range(m)]
    file["parameters"]["POINT"]["UNITS"]["value"] = [parameters.pop("UNITS", "mm")]
    for name, value in parameters.items():
        file.add_parameter("POINT", name, [value])
    data = np.ones((4, m, t))
    data[:3] = points.transpose(2, 1, 0)
    file["data"]["points"] = data
    if residuals is not None:
        file["data"]["meta_points"]["residuals"] = residuals.T[None]
    file.write(str(path))
    return path


def test_agrees_with_ezc3d(tmp_path, points):
    residuals = np.zeros((50, 4))
    residuals[7:20, 2] = -1.0
    points[30, 1] = 0.0
    path = write_ezc3d(tmp_path / "hand.c3d", points, 119.88, residuals)
    recording = read_recording(path)
    assert recording.name == "hand"
    assert recording.labels == ("marker0", "marker1", "marker2", "marker3")
    assert recording.rate_hz == pytest.approx(119.88, rel=1e-6)
    assert recording.frame_numbers[0] == 1
    missing = residuals < 0
    missing[30, 1] = True
    assert np.array_equal(np.isnan(recording.points_m).all(axis=2), missing)
    theirs = ezc3d.c3d(str(path))["data"]["points"][:3].transpose(2, 1, 0)
    assert np.allclose(recording.points_m[~missing] * 1000, theirs[~missing], atol=1e-9)
    assert np.allclose(recording.points_m[~missing] * 1000, points[~missing], atol=1e-4)


Y, Z, X = (1, 2, 3), (1, 3, -2), (3, 1, 2)
"""Where (1, 2, 3) goes as the axis that is up becomes Y."""

FLOOR_Z = np.array([[[500.0, 400.0, -4.0], [500, 0, -5], [0, 0, -6], [0, 400, -6]]])
FLOOR_Y = FLOOR_Z[:, :, [0, 2, 1]]


def stating(y_screen="", x_screen="+X", company="", software="", up="", plates=None):
    """Groups of parameters as programs write them."""
    groups = {"POINT": {"UNITS": "m"}}
    if y_screen:
        groups["POINT"] |= {"X_SCREEN": x_screen, "Y_SCREEN": y_screen}
    if company or software:
        groups["MANUFACTURER"] = {"COMPANY": company or " ", "SOFTWARE": software or " "}
    if up:
        groups["PHALANX"] = {"UP": up}
    if plates is not None:
        groups["FORCE_PLATFORM"] = {"USED": len(plates), "CORNERS": plates}
    return groups


@pytest.mark.parametrize(
    ("groups", "expected", "said"),
    [
        (stating("+Y"), Y, ""),
        (stating("+Z"), Z, ""),
        (stating("z"), Z, ""),
        (stating("+Z", "+Y"), Z, ""),  # the heading stays the file's own
        (stating("-Z", "-X"), Z, "shows -Z upwards, which is only a view; Z is taken for up."),
        (stating("-Y", "+X"), Y, "shows -Y upwards, which is only a view; Y is taken for up."),
        (stating("+X", "+Y"), X, "shows +X upwards, which is only a view; X is taken for up."),
        (stating("-Z", "-X", company="Qualisys"), Z, "Z is taken for up."),
        (stating("-Y", "+X", software="Qualisys Track Manager"), Z, "Z is taken for up."),
        (stating("+X", "+Y", company="Vicon"), Z, "Z is taken for up."),
        (stating("+Z", company="Vicon", software="Vicon Nexus"), Z, ""),
        (stating("+Y", company="Qualisys"), Y, "Worlds of Qualisys are Z up, but its screen shows +Y; Y is taken"),
        (stating(company="Qualisys"), Z, "does not say which axis is up; Z is taken, as worlds of Qualisys have it"),
        (stating(), Y, "does not say which axis is up; Y is taken"),
        (stating("up", "left"), Y, "does not say which axis is up; Y is taken"),
        (stating("-Z", "-X", company="Qualisys", plates=FLOOR_Z), Z, ""),
        (stating(plates=FLOOR_Z), Z, ""),
        (stating(plates=FLOOR_Y), Y, ""),
        (stating("+Y", plates=FLOOR_Z), Z, "shows +Y upwards, but its force plates lie across Z; Z is taken for up."),
        (stating("+Z", plates=np.concatenate([FLOOR_Z, FLOOR_Y])), Z, ""),  # one is on a wall: no witness
        (stating("+Z", plates=np.zeros((2, 4, 3))), Z, ""),
        (stating("+Z", plates=np.full((1, 4, 3), np.nan)), Z, ""),
        (stating("+Y", company="Phalanx", up="+Y"), Y, ""),
        (stating("+Z", company="Phalanx", up="+Z"), Z, ""),
        (stating("-Z", up="+Y", plates=FLOOR_Z), Y, ""),
    ],
)
def test_which_axis_is_up(written, groups, expected, said):
    recording = written(84, -0.001, np.tile([1.0, 2.0, 3.0], (2, 1, 1)), groups)
    assert recording.points_m[0, 0] == pytest.approx(expected)
    warnings = [warning for warning in recording.warnings if " up" in warning]
    assert len(warnings) == (1 if said else 0)
    assert said in "".join(warnings)


def test_a_screen_of_qualisys_is_a_view():
    recording = read_recording(case_path("files", "02-qtm-c3d-upside-down", "qtm_screen.c3d"))
    assert recording.points_m[0, 0, 1] == pytest.approx(1.0)
    assert recording.warnings == ("Its screen shows -Z upwards, which is only a view; Z is taken for up.",)


def test_a_point_beyond_the_room_is_a_gap():
    recording = read_recording(case_path("files", "06-one-wild-point-refuses-all", "outlier.c3d"))
    assert np.argwhere(np.isnan(recording.points_m).any(axis=2))[:, 0].tolist() == [7]
    assert (recording.gaps.far, recording.gaps.total) == (1, 1)
    assert "1 point lies beyond 1000 m and is left out as a gap, in frame 8: A at x = 2000 m." in recording.warnings


def test_a_negative_residual_is_a_gap_wherever_the_point_is(tmp_path):
    for scale in (-0.1, 0.05):
        points = np.full((4, 2, 3), 300.0)
        data = bytearray(build(84, scale, points))
        at, item = len(data) - 2 * 4 * (4 if scale < 0 else 2), 4 if scale < 0 else 2
        data[at + 3 * item : at + 4 * item] = struct.pack("<f", -1.0) if scale < 0 else struct.pack("<h", -1)
        path = tmp_path / "residual.c3d"
        path.write_bytes(data)
        recording = read_recording(path)
        assert np.isnan(recording.points_m[3, 0]).all()
        assert np.allclose(np.delete(recording.points_m.reshape(-1, 3), 6, axis=0), 0.3)
        assert recording.gaps.absent == recording.gaps.total == 1


def test_units(tmp_path, points):
    path = write_ezc3d(tmp_path / "cm.c3d", points, UNITS="cm")
    assert np.allclose(read_recording(path).points_m, points * 0.01, atol=1e-5)
    with pytest.raises(FormatError, match="'parsec'"):
        read_recording(write_ezc3d(tmp_path / "far.c3d", points, UNITS="parsec"))


@pytest.mark.parametrize("processor", [84, 85, 86], ids=["intel", "dec", "mips"])
@pytest.mark.parametrize(("scale", "tolerance"), [(-0.1, 1e-7), (0.05, 2.6e-5)], ids=["real", "integer"])
def test_every_processor_and_number_format(tmp_path, points, processor, scale, tolerance):
    points[3, 2] = np.nan
    path = tmp_path / "old.c3d"
    path.write_bytes(build(processor, scale, points))
    recording = read_recording(path)
    assert recording.labels == ("point_0", "point_1", "point_2", "point_3")
    assert recording.rate_hz == 100.0
    assert np.isnan(recording.points_m[3, 2]).all()
    assert np.allclose(recording.points_m * 1000, points, atol=tolerance * 1000, equal_nan=True)


@pytest.mark.parametrize("split", [(127, 73), (200,), (1, 198, 1), (10,) * 20])
def test_labels_go_on_wherever_they_were_broken_off(written, split):
    names = [f"M{i}" for i in range(200)]
    point, at = {"Y_SCREEN": "+Y"}, 0
    for i, count in enumerate(split):
        point[f"LABELS{i + 1 if i else ''}"] = names[at : at + count]
        at += count
    recording = written(84, -0.1, np.full((2, 200, 3), 7.0), {"POINT": point})
    assert recording.labels == tuple(names)


def test_labels_of_127_and_73():
    path = case_path("files", "11-c3d-labels-continue-before-255", "labels_split127.c3d")
    assert read_recording(path).labels == tuple(f"M{i:03}" for i in range(200))


def test_points_without_a_label_are_numbered(written, points):
    recording = written(84, -0.1, points, {"POINT": {"LABELS": ["Tip", "Back"]}})
    assert recording.labels == ("Tip", "Back", "point 3", "point 4")


@pytest.mark.parametrize(
    ("labels", "entries", "kept"),
    [
        (
            ("Tip", "LWristAngles", "Back", "LWristForce"),
            {"ANGLES": ["LWristAngles"], "FORCES": ["LWristForce"]},
            (0, 2),
        ),
        (("A", "B", "C", "D"), {"MOMENTS": ["B"], "POWERS": ["C"], "SCALARS": ["D"]}, (0,)),
        (("A", "B", "C", "D"), {"ANGLES": ["A"], "ANGLES2": ["B"], "ANGLES7": ["D"]}, (2,)),
        (("A", "B", "C", "D"), {"ANGLES": ["a", " c"]}, (1, 3)),
        (("An:Tip", "An:Angle", "Ben:Tip", "Ben:Angle"), {"ANGLES": ["Angle"]}, (0, 2)),
        (("Tip", "Angle", "Back", "Side"), {"ANGLES": ["An:Angle"]}, (0, 2, 3)),
        (("An:Tip", "An:Angle", "Ben:Tip", "Ben:Angle"), {"ANGLES": ["An:Angle"]}, (0, 2, 3)),
        (("Tip", "An:Tip", "Back", "Side"), {"ANGLES": ["An:Tip"]}, (0, 2, 3)),
        (("Tip", "", "Back", ""), {"ANGLES": [" "], "LABELS2": []}, (0, 1, 2, 3)),
        (("Tip", "Back", "Side", "Top"), {"ANGLE_UNITS": ["Tip"]}, (0, 1, 2, 3)),
    ],
)
def test_what_a_model_computed_is_no_marker(tmp_path, points, labels, entries, kept):
    path = tmp_path / "model.c3d"
    points[4, 0] = points[5, 2] = np.nan
    path.write_bytes(build(84, -0.1, points, {"POINT": {"Y_SCREEN": "+Y", "LABELS": list(labels), **entries}}))
    recording, residuals = read_with_residuals(path)
    columns = list(kept)
    assert recording.labels == tuple(labels[i] or f"marker {columns.index(i) + 1}" for i in kept)
    assert recording.points_m * 1000 == pytest.approx(points[:, columns], abs=1e-3, nan_ok=True)
    assert np.array_equal(residuals, np.where(np.isnan(points[:, columns, 0]), -1.0, 1.0))
    n = 4 - len(kept)
    said = {
        0: (),
        1: ("1 column is an angle, force, moment, power or scalar, not a marker, and is left out.",),
    }.get(n, (f"{n} columns are angles, forces, moments, powers or scalars, not markers, and are left out.",))
    if not all(labels):
        said = ("2 markers have no name; they are called marker 2, marker 4, by place.",)
    assert recording.warnings == said


@pytest.mark.parametrize("name", ["vicon_angles", "vicon_model"])
def test_outputs_of_vicons_models_are_left_out(name):
    recording = read_recording(case_path("files", "05-c3d-model-outputs-are-not-markers", f"{name}.c3d"))
    assert recording.labels == ("L:TH1", "L:TH2")
    assert recording.gaps.total == 0
    assert any("left out" in warning for warning in recording.warnings)


def test_a_file_of_angles_only_holds_no_markers(written, points):
    with pytest.raises(FormatError, match="holds no markers"):
        written(84, -0.1, points, {"POINT": {"ANGLES": [f"point_{i}" for i in range(4)]}})


@pytest.mark.parametrize(
    ("damaged", "says"),
    [
        ((2, (100, 200, 200), b"12"), "'ANALOG:GAIN' promises 8000000 bytes, "),
        ((7, (), b"12"), "'ANALOG:GAIN' has type 7 and 0 dimensions, and is left out."),
        ((2, (1,) * 8, b"12"), "'ANALOG:GAIN' has type 2 and 8 dimensions, and is left out."),
    ],
)
def test_damage_beside_the_points_does_not_stop_them(written, points, damaged, says):
    groups = {"ANALOG": {"GAIN": damaged}, "TRIAL": trial(84, 1, 50), "POINT": {"Y_SCREEN": "+Y"}}
    recording = written(84, -0.1, points, groups)
    assert recording.points_m * 1000 == pytest.approx(points, abs=1e-3)
    assert len(recording.warnings) == 1 and says in recording.warnings[0]
    with pytest.raises(FormatError, match="its parameter 'SCALE'"):
        written(84, -0.1, points, {"POINT": {"SCALE": damaged}})


def test_much_damage_is_counted(written, points):
    groups = {"ANALOG": {f"P{i}": (7, (), b"") for i in range(40)}, "POINT": {"Y_SCREEN": "+Y"}}
    recording = written(84, -0.1, points, groups)
    assert [warning.split()[2] for warning in recording.warnings[:3]] == ["'ANALOG:P0'", "'ANALOG:P1'", "'ANALOG:P2'"]
    assert recording.warnings[3:] == ("So are 37 more of its parameters.",)


def test_a_parameter_that_leads_out_of_the_file(tmp_path, points):
    data = build(84, -0.1, points, {"POINT": {"Y_SCREEN": "+Y"}, "EVENT": {"USED": 0, "LAST": 0}})
    path = tmp_path / "away.c3d"
    at = data.index(b"LAST") + 4
    path.write_bytes(data[:at] + b"\xff\x7f" + data[at + 2 :])
    recording = read_recording(path)
    assert recording.points_m * 1000 == pytest.approx(points, abs=1e-3)
    assert len(recording.warnings) == 1 and "run past its end at byte" in recording.warnings[0]


def test_a_scale_that_is_none_is_the_headers(written, points):
    for scale in (0.0, float("nan"), None):
        recording = written(84, -0.1, points, {"POINT": {"SCALE": scale}})
        assert recording.points_m * 1000 == pytest.approx(points, abs=1e-3)
    with pytest.raises(FormatError, match="POINT:SCALE is 0"):
        written(84, 0.0, points[:0], {"POINT": {"SCALE": 0.0}})


@pytest.mark.parametrize(
    ("spoil", "says"),
    [
        (lambda b: b[: 1536 + 63], "promises 50 frames of 64 bytes from block 4 on, but holds 63 bytes"),
        (lambda b: b[:1400], "holds 0 bytes there"),
        (lambda b: b[: b.index(b"LABELS") + 20], "'LABELS' promises 28 bytes, 8 are left"),
        (lambda b: b[:512], "should start at byte 512, but it has 512 bytes"),
        (lambda b: b[:515] + b"\x07" + b[516:], "processor type is 7"),
        (lambda b: b[:2] + b"\xff\xff" + b[4:], "promises 50 frames of 1048560 bytes"),
        (lambda b: b[:2] + b"\0\0" + b[4:], "holds no 3D points"),
        (lambda b: b[:16] + b"\xff\xff" + b[18:], "from block 65535 on"),
        (lambda b: b[:8] + b"\0\0" + b[10:1536], "holds no frames"),
    ],
)
def test_damage_is_named(tmp_path, points, spoil, says):
    path = tmp_path / "broken.c3d"
    path.write_bytes(spoil(build(84, -0.1, points)))
    with pytest.raises(FormatError) as error:
        read_recording(path)
    assert str(error.value).startswith("broken.c3d")
    assert says in str(error.value)


def test_damaged_bytes_of_a_full_file(tmp_path, points):
    """A recording or one FormatError, whatever is damaged of what decides about frames, rate, up and markers."""
    groups = {
        "POINT": {
            "USED": 4, "FRAMES": 50, "LONG_FRAMES": 50.0, "DATA_START": 5, "Y_SCREEN": "+Z", "X_SCREEN": "+X",
            "LABELS": ["A", "B"], "LABELS2": ["C", "D"], "ANGLES": ["D"], "UNITS": ["mm"],
        },
        "TRIAL": {**trial(84, 1, 50), "CAMERA_RATE": 100.0},
        "ANALOG": {"USED": 2, "RATE": 200.0},
        "FORCE_PLATFORM": {"USED": 1, "CORNERS": FLOOR_Z},
        "MANUFACTURER": {"COMPANY": "Vicon"},
    }  # fmt: skip
    sound = np.frombuffer(build(84, -0.1, points, groups, analog=4, filled=True, samples=2), np.uint8)
    path, generator = tmp_path / "damaged.c3d", np.random.default_rng(6)
    path.write_bytes(sound.tobytes())
    assert read_recording(path).warnings == (
        "1 column is an angle, force, moment, power or scalar, not a marker, and is left out.",
    )
    n_read = 0
    for _ in range(600):
        data = sound.copy()
        where = generator.integers(0, 1600, generator.integers(1, 6))
        data[where] = generator.integers(0, 256, len(where))
        path.write_bytes(data.tobytes())
        try:
            recording = read_recording(path)
        except FormatError as error:
            assert "damaged.c3d" in str(error) and error.action
        else:
            n_read += 1
            assert recording.n_frames > 0 and recording.rate_hz > 0
            assert len(recording.labels) == recording.points_m.shape[1]
    assert n_read > 100
