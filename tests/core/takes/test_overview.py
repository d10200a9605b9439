"""What a recording holds and whether it is what it should be."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from core.recording import Recording
from core.takes.formats import read_recording
from core.takes.formats.assemble import assemble
from core.takes.overview import MarkerGaps, findings, overview, warnings_of
from tests.data import data_path

RATE_HZ = 100.0


def recording(n: int = 100, **changed: object) -> Recording:
    """Three markers that move within a metre; B is not seen in frames 10 to 29 and 50, C from 90 on."""
    points = np.random.default_rng(1).uniform(0.2, 1.0, (n, 3, 3))
    points[10:30, 1] = np.nan
    points[50, 1] = 0.0
    points[90:, 2] = np.nan
    options: dict[str, object] = {"labels": ("A", "B", "C"), **changed}
    return assemble("walk.trc", RATE_HZ, points, **options)  # type: ignore[arg-type]


def texts(one: Recording, level: str = "warning") -> list[str]:
    return [finding.text for finding in findings(one, overview(one)) if finding.level == level]


def test_gaps_of_each_marker_the_worst_first() -> None:
    one = recording()
    seen = overview(one)
    assert [(marker.name, marker.share) for marker in seen.markers] == [("B", 0.21), ("C", 0.1)]
    assert [marker.longest_s for marker in seen.markers] == pytest.approx([0.2, 0.1])
    assert seen.points == (2, 3, 3) and seen.empty == 0 and len(seen.holes) == 0
    np.testing.assert_array_equal(seen.reach_m[0], np.nanmin(one.points_m, axis=(0, 1)))
    assert texts(one) == []
    assert texts(one, "note") == ["31 gaps (1 at 0 0 0), 10.3 % of its points."]
    assert one.span_s == pytest.approx(1.0)


def test_a_gap_lasts_through_time_without_frames() -> None:
    times_s = np.arange(100) / RATE_HZ
    times_s[20:] += 3.0
    one = recording(times_s=times_s, frame_numbers=np.arange(100.0) + 300.0 * (np.arange(100) >= 20))
    seen = overview(one)
    assert seen.markers[0].longest_s == pytest.approx(3.2)
    assert texts(one) == [
        "3.0 s without frames, about 300, the longest 3.00 s.",
        "Its frame numbers skip 300 frames, first after frame 19.",
    ]
    assert one.span_s == pytest.approx(4.0)


def test_every_second_frame_is_no_skip() -> None:
    assert texts(recording(frame_numbers=np.arange(0.0, 200.0, 2.0))) == []


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"times_s": np.arange(100) / 120.0}, "Its rate is stated as 100 Hz and is 120 Hz by its times."),
        ({"times_s": np.zeros(100)}, "Its times do not increase; frames are spaced by its rate of 100 Hz instead."),
        ({"frame_numbers": np.zeros(100)}, "Its frame numbers do not increase; frames are counted instead."),
        ({"labels": ("A", "B", "A")}, "A is the name of several markers: from the second on they get a number."),
        ({"warnings": ["Its header promises 900 frames."]}, "Its header promises 900 frames."),
    ],
)
def test_what_is_amiss(changed: dict[str, object], words: str) -> None:
    assert texts(recording(**changed)) == [words]


def test_times_with_few_decimals_are_of_the_rate_they_were_made_of() -> None:
    assert texts(recording(times_s=np.round(np.arange(100) / RATE_HZ + 0.0033, 2))) == []
    assert texts(replace(recording(60), rate_hz=60.0, times_s=np.round(np.arange(60) / 60.0, 2))) == []


def test_units_that_cannot_be_right() -> None:
    one = recording()
    assert "m from the origin: check the unit" in texts(replace(one, points_m=one.points_m * 100.0))[0]
    assert "mm: check the unit" in texts(replace(one, points_m=one.points_m * 0.001))[0]


def test_markers_and_frames_without_points() -> None:
    points = np.random.default_rng(2).uniform(0.2, 1.0, (50, 8, 3))
    points[:, 1:] = np.nan
    points[5] = np.nan
    one = assemble("walk.trc", RATE_HZ, points, list("ABCDEFGH"))
    assert texts(one) == ["Never seen: B, C, D, E, F and 2 more."]
    assert texts(one, "note")[0] == "1 frame is without any point."
    assert overview(one).markers[0] == MarkerGaps("B", 1.0, pytest.approx(0.5))


def test_a_recording_without_any_point() -> None:
    one = assemble("walk.trc", RATE_HZ, np.full((3, 2, 3), np.nan), ["A", "B"])
    assert texts(one) == ["It holds no point at all.", "Never seen: A, B."]
    assert np.isnan(overview(one).reach_m).all()


# Places where nothing can be.


def body(n: int = 200, markers: int = 20) -> np.ndarray:
    """(n, markers, 3) [m]: markers that move within a metre, each near itself a frame before."""
    rng = np.random.default_rng(3)
    return rng.uniform(0.2, 1.0, (1, markers, 3)) + np.cumsum(rng.normal(0.0, 1e-3, (n, 1, 3)), axis=0)


def named(points: np.ndarray, **changed: object) -> Recording:
    return assemble("walk.trc", RATE_HZ, points, [f"M{k}" for k in range(points.shape[1])], **changed)  # type: ignore[arg-type]


@pytest.mark.parametrize("code_m", [-9.99999, 99.999, -999.0])
def test_a_code_for_missing_is_no_place(code_m: float) -> None:
    """However many points it stands for: here most of them."""
    points = body()
    points[50:, ::2] = code_m
    points[100:, 1::2] = code_m
    (text,) = texts(named(points))
    n = int((points[:, :, 0] == code_m).sum())
    assert f"{n:,} points stand at exactly {code_m:.9g} {code_m:.9g} {code_m:.9g} m ({1000 * code_m:.9g} in mm)" in text
    (turned,) = texts(named(points, to_y_up=np.array([[1.0, 0, 0], [0, 0, 1.0], [0, -1.0, 0]])))
    assert turned.startswith(f"{n:,} points stand at exactly {code_m:.9g} {code_m:.9g} {-code_m:.9g} m")


def test_a_point_that_leaps_away_is_said_with_its_place() -> None:
    points = body()
    points[30, 4] = (50.0, 1.0, 0.3)
    assert texts(named(points, frame_numbers=np.arange(200.0) + 1000)) == [
        "1 point leaps far away from all others, in frame 1030: M4 at 50 1 0.3 m."
    ]
    points[90:95, 7] = (0.0, 6.5, -9.0)  # where a program left it
    assert texts(named(points)) == ["6 points leap far away from all others, the first in frame 30: M4 at 50 1 0.3 m."]
    ids = np.broadcast_to(np.arange(1, 21), points.shape[:2])
    one = assemble("points.csv", RATE_HZ, points, (), ids=ids)
    assert texts(one) == ["6 points leap far away from all others, the first in frame 30: point 5 at 50 1 0.3 m."]


def test_what_is_far_and_stays_or_goes_there_is_no_leap() -> None:
    points = body(400)
    points[:, 0] = (9.0, 9.1, 9.2)  # a marker on the wall, of a made recording
    points[:, 1] += np.linspace(0.0, 20.0, 400)[:, None]  # one that is carried away
    points[100:200, 1] = np.nan
    points[:, 2] = points[:, 3] + 1e-9
    assert texts(named(points)) == []
    two = body()
    two[:, 10:] += 30.0  # two performers in a large hall
    assert texts(named(two)) == []


@pytest.mark.parametrize(
    "name",
    [
        "public/opensim/std_walking5_markers.trc", "public/opensim/markers_walk.trc", "public/opensim/walking5.c3d",
        "public/opensim/subject01_synthetic_marker_data.trc", "public/ezc3d/Qualisys.c3d", "public/ezc3d/Vicon.c3d",
        "public/ezc3d/Optotrak.c3d", "qualisys_hand/recording.tsv",
        "han2018/trc/user1_sequence.13_training_dense_left.trc",
    ],
)  # fmt: skip
def test_nothing_is_wild_in_real_recordings(name: str) -> None:
    assert warnings_of(read_recording(data_path(*name.split("/")))) == ()
