"""Angles that were read off a hand, as a file."""

from __future__ import annotations

import numpy as np
import pytest

from core.calibration.goniometer import read_angles
from core.errors import FormatError
from core.hand.skeleton import DIGIT_DOF_NAMES


def read(tmp_path, text, encoding="utf-8"):
    path = tmp_path / "read.csv"
    path.write_bytes(text.encode(encoding))
    return read_angles(path)


def test_what_is_not_named_was_held_at_0(tmp_path):
    angles = read(tmp_path, "angle,degrees\r\nindex_pip_flexion, 12.5\r\n\r\nthumb_cmc_abduction,-40\r\n", "utf-8-sig")
    assert angles.given == {"left": 2, "right": 2} and angles.warnings == ()
    angles.check(("left", "right"))
    for side in ("left", "right"):
        told = dict(zip(DIGIT_DOF_NAMES, np.degrees(angles.angles_rad[side]).round(9), strict=True))
        assert {name: value for name, value in told.items() if value} == {
            "index_pip_flexion": 12.5, "thumb_cmc_abduction": -40.0,
        }  # fmt: skip
    assert not any(values.any() for values in read_angles(None).angles_rad.values())
    read_angles(None).check(("left", "right"))


def test_hands_may_have_columns_of_their_own(tmp_path):
    angles = read(tmp_path, "Angle,Right_Degrees,left_degrees\nring_dip_flexion,5,\npinky_pip_flexion,6,7\n")
    ring, pinky = (DIGIT_DOF_NAMES.index(name) for name in ("ring_dip_flexion", "pinky_pip_flexion"))
    assert np.degrees(angles.angles_rad["right"][[ring, pinky]]) == pytest.approx([5.0, 6.0])
    assert np.degrees(angles.angles_rad["left"][[ring, pinky]]) == pytest.approx([0.0, 7.0])
    assert angles.given == {"left": 1, "right": 2}
    assert angles.empty == {"left": ("ring_dip_flexion",), "right": ()}


@pytest.mark.parametrize(
    "text", ["angle,left_degrees\nring_dip_flexion,5\n", "angle,right_degrees,left_degrees\nring_dip_flexion,,5\n"]
)
def test_a_hand_of_which_nothing_is_given_has_no_angles(tmp_path, text):
    alone = read(tmp_path, text)
    ring = DIGIT_DOF_NAMES.index("ring_dip_flexion")
    assert np.degrees(alone.angles_rad["left"][ring]) == pytest.approx(5.0) and not alone.angles_rad["right"].any()
    alone.check(("left",))
    with pytest.raises(FormatError, match=r"gives no angle of the right hand, .* only of the left one.*--side left"):
        alone.check(("left", "right"))


@pytest.mark.parametrize(
    ("values", "most"),
    [((0.5, -1.57), "1.57"), ((5.5, 0.5), None), ((0, 0), None), ((2, -3), None), ((3.21, 0.1), None)],
)
def test_values_that_may_be_radians_are_told(tmp_path, values, most):
    rows = zip(("ring_dip_flexion", "pinky_pip_flexion"), values, strict=True)
    angles = read(tmp_path, "angle,degrees\n" + "".join(f"{name},{value}\n" for name, value in rows))
    told = (f"No angle is larger than {most}: are these radians? They were read as degrees.",)
    assert angles.warnings == (told if most else ())


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "first line is empty"),
        ("angle,radians\nring_dip_flexion,0.1\n", r"angle, radians.*Units are degrees"),
        ("angle;degrees\nring_dip_flexion;5\n", "line 1: its cells are separated by semicolons .* by commas"),
        ("angle\tdegrees\nring_dip_flexion\t5\n", "line 1: its cells are separated by tabs"),
        ("angle,degrees\nring_dip_flexion;5\n", "line 2: its cells are separated by semicolons"),
        ("angle,left_degrees,right_degrees\nring_dip_flexion,,\n", "gives no value"),
        ("angle,degrees,left_degrees\nring_dip_flexion,5,5\n", "first line is angle, degrees, left_degrees"),
        ("angle,degrees\n", "names no angle"),
        ("angle,degrees\nring DIP flexion,5\n", "line 2: there is no angle 'ring DIP flexion'. Is it ring_dip_flexion"),
        ("angle,degrees\nelbow,5\n", "no angle 'elbow'. Names are those of angles.csv"),
        ("angle,degrees\nwrist_rx,5\n", "wrist_rx has no zero"),
        ("angle,degrees\nring_dip_flexion,5\nring_dip_flexion,6\n", "line 3: ring_dip_flexion comes twice"),
        ("angle,degrees\nring_dip_flexion,five\n", "line 2, degrees: 'five' is no number"),
        ("angle,degrees\nring_dip_flexion,\n", "'' is no number"),
        ("angle,degrees\nring_dip_flexion,nan\n", "nan degrees"),
        ("angle,degrees\nring_dip_flexion,151\n", "151 degrees. No joint goes beyond 150"),
        ("angle,degrees\nring_dip_flexion,5,5\n", "3 cells where the first line has 2"),
        ("angle,degrees\n" + "ring_dip_flexion,5\n" * 5000, "95,014 bytes, more than the 65,536"),
    ],
)
def test_what_is_wrong_is_told(tmp_path, text, told):
    with pytest.raises(FormatError, match=told):
        read(tmp_path, text)


def test_a_file_that_cannot_be_read_is_told(tmp_path):
    with pytest.raises(FormatError, match="cannot be read"):
        read_angles(tmp_path / "none.csv")
    with pytest.raises(FormatError, match="cannot be read"):
        read(tmp_path, "angle,degrés\n", "latin-1")
