import struct

import ezc3d
import numpy as np
import pytest

from core.errors import FormatError
from core.takes.formats import read_recording


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


@pytest.fixture
def points():
    return np.random.default_rng(1).uniform(-900, 900, (50, 4, 3))


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


@pytest.mark.parametrize(
    ("x_screen", "y_screen", "expected"),
    [
        ("+X", "+Y", (1, 2, 3)),
        ("+X", "+Z", (1, 3, -2)),
        ("+Y", "+Z", (2, 3, 1)),
        ("-X", "-Z", (-1, -3, -2)),
        ("", "+Z", (1, 3, -2)),
        ("+Z", "-Z", (1, -3, 2)),
        ("", "", (1, 2, 3)),
        ("left", "up", (1, 2, 3)),
    ],
)
def test_the_screen_axes_tell_what_is_up(tmp_path, x_screen, y_screen, expected):
    points = np.tile([1.0, 2.0, 3.0], (2, 1, 1))
    path = write_ezc3d(tmp_path / "up.c3d", points, UNITS="m", X_SCREEN=x_screen or " ", Y_SCREEN=y_screen or " ")
    assert np.allclose(read_recording(path).points_m[0, 0], expected)


def test_units(tmp_path, points):
    path = write_ezc3d(tmp_path / "cm.c3d", points, UNITS="cm")
    assert np.allclose(read_recording(path).points_m, points * 0.01, atol=1e-5)
    with pytest.raises(FormatError, match="'parsec'"):
        read_recording(write_ezc3d(tmp_path / "far.c3d", points, UNITS="parsec"))


def real(processor, value):
    if processor == 85:  # DEC: exponent two higher, halves swapped
        low, high = struct.unpack("<HH", struct.pack("<f", value * 4.0))
        return struct.pack("<HH", high, low)
    return struct.pack(">f" if processor == 86 else "<f", value)


def build(processor, scale, points, trial=None, n_frames=None):
    """The bytes of a C3D file. points (t, m, 3) in mm; a NaN is an invalid point."""
    order = ">" if processor == 86 else "<"
    t, m = points.shape[:2]
    n_frames = t if n_frames is None else n_frames

    def group(number, name):
        return struct.pack("bb", len(name), -number) + name + struct.pack(order + "h", 3) + b"\0"

    def parameter(number, name, kind, dimensions, data):
        body = struct.pack("bB", kind, len(dimensions)) + bytes(dimensions) + data + b"\0"
        return struct.pack("bb", len(name), number) + name + struct.pack(order + "h", len(body) + 2) + body

    section = bytes((1, 80, 2, processor)) + group(1, b"POINT") + group(2, b"TRIAL")
    section += parameter(1, b"SCALE", 4, (), real(processor, scale))
    section += parameter(1, b"RATE", 4, (), real(processor, 100.0))
    section += parameter(1, b"LABELS", -1, (8, m), b"".join(b"point_%-2d" % i for i in range(m)))
    if trial:
        for name, value in zip((b"ACTUAL_START_FIELD", b"ACTUAL_END_FIELD"), trial, strict=True):
            words = struct.pack(order + "HH", value & 0xFFFF, value >> 16)
            section += parameter(2, name, 2, (2,), words)
    section = (section + b"\0\0").ljust(1024, b"\0")
    words = struct.pack(order + "5H", m, 0, 1, min(n_frames, 65535), 10)
    header = bytes((2, 80)) + words + real(processor, scale) + struct.pack(order + "HH", 4, 0) + real(processor, 100.0)
    values = b""
    for frame in points:
        for point in frame:
            if scale < 0:
                fourth = -1.0 if np.isnan(point).any() else 1.0
                values += b"".join(real(processor, v) for v in (*np.nan_to_num(point), fourth))
            else:
                fourth = -1 if np.isnan(point).any() else 1
                values += struct.pack(order + "4h", *(round(v / scale) for v in np.nan_to_num(point)), fourth)
    return header.ljust(512, b"\0") + section + values


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


def test_long_files_count_their_frames_in_trial(tmp_path):
    points = np.zeros((70_000, 1, 3)) + 5.0
    points[:, 0, 0] = np.arange(70_000) % 900
    path = tmp_path / "long.c3d"
    path.write_bytes(build(84, 0.1, points, trial=(1, 70_000)))
    recording = read_recording(path)
    assert recording.n_frames == 70_000
    assert np.allclose(recording.points_m[:, 0, 0] * 1000, points[:, 0, 0], atol=0.1)


@pytest.mark.parametrize(
    ("spoil", "says"),
    [
        (lambda b: b[:-1], "promises 50 frames of 64 bytes from block 4 on, but holds 3199 bytes"),
        (lambda b: b[:1400], "holds 0 bytes there"),
        (lambda b: b[:595], "'LABELS' promises 32 bytes, 14 are left"),
        (lambda b: b[:512], "should start at byte 512, but it has 512 bytes"),
        (lambda b: b[:515] + b"\x07" + b[516:], "processor type is 7"),
        (lambda b: b[:2] + b"\xff\xff" + b[4:], "promises 50 frames of 1048560 bytes"),
        (lambda b: b[:2] + b"\0\0" + b[4:], "holds no 3D points"),
        (lambda b: b[:8] + b"\xff\xff" + b[10:], "promises 65535 frames"),
        (lambda b: b[:16] + b"\xff\xff" + b[18:], "from block 65535 on"),
        (lambda b: b[:8] + b"\0\0" + b[10:], "holds no frames"),
    ],
)
def test_damage_is_named(tmp_path, points, spoil, says):
    path = tmp_path / "broken.c3d"
    path.write_bytes(spoil(build(84, -0.1, points)))
    with pytest.raises(FormatError) as error:
        read_recording(path)
    assert str(error.value).startswith("broken.c3d")
    assert says in str(error.value)
