"""Files of Qualisys, Vicon, NDI and others, as ezc3d reads them."""

import ezc3d
import numpy as np
import pytest

from core.errors import FormatError
from core.takes.formats import read_recording
from tests.data import data_path

TO_Y_UP = {
    "as written": np.eye(3),
    "z up": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]),
}
FILES = {
    ("ezc3d", "FP_Type3.c3d"): ("z up", ()),
    ("ezc3d", "Optotrak.c3d"): (
        "as written",
        (
            "Its POINT:FRAMES and header promise 1,149 frames, 29 are there.",
            "It does not say which axis is up; Y is taken, and nothing is turned.",
        ),
    ),
    ("ezc3d", "Qualisys.c3d"): ("z up", ()),
    ("ezc3d", "Vicon.c3d"): ("z up", ()),
    ("ezc3d", "read_NOTworking2.c3d"): ("z up", ()),
    ("opensim", "test_walking.c3d"): ("z up", ()),
    ("opensim", "walking5.c3d"): ("z up", ()),
}


@pytest.mark.parametrize("parts", FILES, ids="/".join)
def test_as_ezc3d_reads_it(parts):
    turned, warnings = FILES[parts]
    path = data_path("public", *parts)
    recording, theirs = read_recording(path), ezc3d.c3d(str(path))
    point = theirs["parameters"]["POINT"]
    assert recording.labels == tuple(point["LABELS"]["value"])
    assert recording.rate_hz == point["RATE"]["value"][0]
    points = theirs["data"]["points"][:3].transpose(2, 1, 0) / 1000.0 @ TO_Y_UP[turned].T
    assert recording.points_m.shape == points.shape
    gaps = np.isnan(recording.points_m).any(axis=2)
    assert np.array_equal(gaps, np.isnan(points).any(axis=2) | ~points.any(axis=2))
    assert np.allclose(recording.points_m[~gaps], points[~gaps], rtol=1e-14, atol=1e-15)
    assert recording.gaps.total == gaps.sum()
    assert recording.warnings == warnings


def test_a_file_without_points():
    with pytest.raises(FormatError, match="holds no 3D points"):
        read_recording(data_path("public", "ezc3d", "C3DRotationExample.c3d"))


@pytest.mark.parametrize(
    ("parts", "heads", "feet"),
    [
        (("ezc3d", "Qualisys.c3d"), ("L_HDF", "R_HDF", "L_HDB", "R_HDB"), ("L_FM1", "R_FM1", "L_FM5", "R_FM5")),
        (("ezc3d", "FP_Type3.c3d"), ("LPSIS", "RPSIS", "LASIS", "RASIS"), ("LFL", "RFL", "LH", "RH")),
        (("ezc3d", "read_NOTworking2.c3d"), ("LFHD", "RFHD", "LBHD", "RBHD"), ("LASI", "RASI")),
        (("opensim", "test_walking.c3d"), ("C7", "CLAV"), ("LCAL", "RCAL", "LMT1", "RMT1")),
        (("opensim", "walking5.c3d"), ("C7", "CLAV"), ("LCAL", "RCAL", "LMT1", "RMT1")),
    ],
    ids=lambda value: "/".join(value) if value[-1].endswith(".c3d") else "",
)
def test_people_stand_upright(parts, heads, feet):
    recording = read_recording(data_path("public", *parts))
    above = dict(zip(recording.labels, np.nanmedian(recording.points_m, axis=0)[:, 1], strict=True))
    assert min(above[label] for label in heads) - max(above[label] for label in feet) > 0.5
    assert min(above[label] for label in feet) > 0.0


def test_walking_is_the_same_in_trc():
    trc = read_recording(data_path("public", "opensim", "test_walking.trc"))
    c3d = read_recording(data_path("public", "opensim", "test_walking.c3d"))
    assert c3d.points_m.shape[0] * c3d.points_m.shape[1] == 32_240
    assert trc.gaps.total == c3d.gaps.total == 10_455
    columns = [c3d.labels.index(label) for label in trc.labels]
    as_written = c3d.points_m[:, columns] @ TO_Y_UP["z up"]  # turned back
    assert np.allclose(trc.points_m, as_written, atol=1e-6, equal_nan=True)
