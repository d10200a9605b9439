"""What a recording holds and whether it is what it should be."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from core.recording import Recording
from core.takes.formats.assemble import assemble
from core.takes.overview import MarkerGaps, findings, overview

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
        ({"times_s": np.arange(100) / 120.0}, "Its times are those of 120 Hz, and its rate is 100 Hz."),
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
