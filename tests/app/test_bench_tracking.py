"""`phalanx bench tracking`: what it counts, what it makes, and that it measures it."""

from __future__ import annotations

from dataclasses import replace
from itertools import islice

import numpy as np
import pytest

from app.tracking_bench import cost, glove, ranges, recovery, scene
from app.tracking_bench.gaps import TABLE_3, hidden_as_in, told
from app.tracking_bench.score import (
    GHOST,
    OTHER_HAND,
    SWAPPED,
    UNNAMED,
    Truth,
    Verdict,
    judged,
    tracked,
    wanted_of,
)
from app.tracking_bench.sight import STUDIO, in_the_way, sightings, studio
from app.tracking_bench.wire import received
from core.engine import Engine
from core.frames import NO_POINT, SIDES, MarkerFrame, Times
from core.markers.layout import load_layout
from core.motion.performer import Performer
from core.profile import Profile, load_profile
from core.takes.formats import read_recording
from tests.app.command import phalanx
from tests.data import data_path

PROFILE = load_profile("han19")
M = 19


def frames(n: int, points: int = 2 * M) -> list[MarkerFrame]:
    rows = np.arange(points)
    return [
        MarkerFrame(i, Times(i / 120.0, i / 120.0, i / 120.0), np.zeros((points, 3)), rows, np.zeros(points))
        for i in range(n)
    ]


def verdict(n: int = 10) -> Verdict:
    """Every marker seen and right; rows are the markers' numbers."""
    wanted = np.broadcast_to(np.arange(2 * M).reshape(2, M), (n, 2, M)).copy()
    return Verdict(Truth("made", (PROFILE,), frames(n, 2 * M + 1), wanted), wanted.copy())


def test_a_frame_is_right_only_when_every_marker_is() -> None:
    all_right = verdict()
    assert all_right.right.all()
    assert all_right.stretches() == []
    one = verdict()
    one.truth.wanted[2, 0, 4] = NO_POINT  # hidden, and said so
    one.point[2, 0, 4] = NO_POINT
    one.point[3, 1, 5] = NO_POINT  # seen, not named
    one.point[4, 0, 0], one.point[4, 0, 1] = 1, 0  # exchanged
    one.truth.wanted[5, 1, 2] = NO_POINT  # hidden, a ghost in its place
    one.point[5, 1, 2] = 2 * M
    one.point[8, 0, 3] = M + 3  # the other hand's
    assert one.right.tolist() == [True, True, True, False, False, False, True, True, False, True]
    assert one.stretches() == [(3, 3), (8, 1)]
    assert one.seen_right() == (20 * M - 2 - 4, 20 * M - 2)
    assert one.hidden_right() == (1, 2)
    assert one.causes() == {UNNAMED: 1, SWAPPED: 2, GHOST: 1, OTHER_HAND: 1}
    assert one.side_swaps() == 0
    first, second = one.failures()
    assert (first.first, first.frames, first.time_s) == (3, 3, 3 / 120.0)
    assert set(first.what) == {
        ("right", "IndexPIP", UNNAMED), ("left", "ThumbCMC", SWAPPED), ("left", "ThumbMCP", SWAPPED),
        ("right", "ThumbIP", GHOST),
    }  # fmt: skip
    assert second.what == (("left", "ThumbTip", OTHER_HAND),)


def test_a_hand_that_carries_the_other_s_points_has_changed_its_side() -> None:
    swapped = verdict(12)
    swapped.point[3:6] = swapped.truth.wanted[3:6, ::-1]
    swapped.point[8:, 0, : M // 2] = NO_POINT
    assert swapped.side_swaps() == 2  # both hands, once each
    assert swapped.stretches() == [(3, 3), (8, 4)]


def test_a_hand_that_is_not_tracked_names_nothing() -> None:
    truth = Truth("empty", (PROFILE,), frames(3, 0), np.full((3, 2, M), NO_POINT))
    seen_nothing = judged(truth, map(Engine(PROFILE).step, truth.frames))
    assert seen_nothing.right.all()
    there = replace(truth, wanted=verdict(3).truth.wanted)
    assert Verdict(there, seen_nothing.point).causes() == {UNNAMED: 3 * 2 * M}


def test_rows_of_markers_come_from_what_the_points_are() -> None:
    wanted = wanted_of([np.array([5, -1, 0, 7]), np.array([], dtype=np.int64)], 2, 3)
    assert wanted[0].tolist() == [[2, NO_POINT, NO_POINT], [NO_POINT, NO_POINT, 0]]  # 7 is a thing's
    assert (wanted[1] == NO_POINT).all()


@pytest.mark.parametrize("kind", TABLE_3)
def test_gaps_are_those_of_table_3_and_where_the_view_is_worst(kind: str) -> None:
    table, random = TABLE_3[kind], np.random.default_rng(1)
    counts = random.integers(10, 17, (7200, 38))
    counts[:, 7] = 1
    hidden = hidden_as_in(table, counts, random)
    had = told(hidden)
    assert had.gaps == round(table.gaps * 7200 / table.frames)
    assert had.mean_frames == pytest.approx(table.mean_frames, rel=0.25)
    assert had.mean_missing == pytest.approx(table.mean_missing, rel=0.25)
    assert hidden[hidden.any(axis=1), 7].all()


def test_cameras_see_the_back_of_a_hand_from_above_only() -> None:
    profile = Profile("", load_layout("han19"), SIDES, 1.0)
    performer = Performer(profile, 3)
    times_s = np.zeros(1)
    markers = next(performer.positions(120.0))[1][None]
    way = in_the_way(performer, times_s)
    middle = markers[0].mean(axis=0)
    overhead = sightings(markers, way, middle + np.array([[0.0, 2.0, 0.0]]))
    assert overhead.all()  # open and relaxed, palms down
    below = sightings(markers, way, middle - np.array([[0.0, 2.0, 0.0]]))
    palms = ("BackHand1", "BackHand3", "IndexMCP", "MiddleMCP")
    backs = [k for k, name in enumerate(performer.labels) if name.endswith(palms)]
    assert len(backs) == 8
    assert not below[0, backs].any()
    around = sightings(markers, way, studio())
    assert around.max() <= STUDIO and around.min() >= 2


@pytest.fixture(scope="module")
def pen() -> scene.Performed:
    return scene.performed("hand-pen", 1, 1.5)


def test_a_performance_comes_with_what_its_points_are(pen: scene.Performed) -> None:
    truth, hidden = pen.truth, pen.hidden
    assert truth.wanted.shape == (180, 2, M)
    np.testing.assert_array_equal((truth.wanted == NO_POINT).reshape(180, 2 * M), hidden)
    performer = Performer(truth.profiles[0], 1, "pen")
    last: dict[int, tuple[int, int]] = {}  # of a marker: its id, and the frame in which it was last seen
    for f, (_, places) in enumerate(islice(performer.positions(120.0), 180)):
        frame, rows = truth.frames[f], truth.wanted[f].ravel()
        seen = rows != NO_POINT
        off_m = np.linalg.norm(frame.points_m[rows[seen]] - places[seen], axis=1)
        assert off_m.max() < 0.003  # noise and skin
        assert len(frame.ids) >= seen.sum() + 2  # and the pen's own
        for marker in np.flatnonzero(seen):
            id_ = int(frame.ids[rows[marker]])
            if marker in last:
                assert (id_ == last[marker][0]) is (last[marker][1] == f - 1)
            last[int(marker)] = (id_, f)


def test_recovery_is_counted_in_frames_of_full_view() -> None:
    made = verdict(40)
    assert recovery.frames_until_right(made, 10, 30) == 1
    made.point[11, 0, 0] = NO_POINT  # right, wrong, right for good
    assert recovery.frames_until_right(made, 10, 30) == 3
    made.point[29, 0, 0] = NO_POINT
    assert recovery.frames_until_right(made, 10, 30) == 21  # one more than there are: never
    found, views = recovery.lost_and_found("all gone", "calibrated", 2, 1)
    ((first, end),) = views
    wanted = found.truth.wanted
    assert (wanted[first:end] != NO_POINT).all()
    unseen = np.flatnonzero((wanted == NO_POINT).all(axis=(1, 2)))
    assert 24 <= len(unseen) <= 240 and unseen[-1] == first - 1
    assert found.right[: unseen[0]].all()
    assert recovery.frames_until_right(found, first, end) == 1


def test_the_glove_is_right_when_it_stays_so() -> None:
    made = verdict(50)
    made.point[7, 0, 0] = NO_POINT
    assert glove.frames_until(made.right, 10, 20) == 8
    assert glove.frames_until(made.right, 6, 20) is None
    made.truth.wanted[7, 0, 0], made.point[7, 0, 0] = NO_POINT, 3
    assert glove.frames_until(made.right, 10, 20) == 8
    assert glove.frames_until(made.seen_all_right, 10, 20) == 0


def test_the_real_glove_from_the_middle_of_its_recording() -> None:
    recording = read_recording(data_path("qualisys_hand", "recording.tsv"))
    seen = glove.from_frame(recording, load_profile(glove.LAYOUT), 3000, 30, 0.0, 0.0, 0)
    assert seen.right[5:].all()
    assert len(seen.truth.frames[0].ids) > 13  # the room's others are there


def test_frames_come_over_the_wire_as_they_were_sent() -> None:
    random = np.random.default_rng(0)
    empty = MarkerFrame(0, Times(0.0, 0.0, 0.0), np.empty((0, 3)), np.empty(0, np.int64), np.empty(0))
    sent = [empty] * 90  # until the client is there
    sent += [
        MarkerFrame(0, Times(0.0, 0.0, 0.0), random.normal(size=(5, 3)), random.permutation(100)[:5] + 1, np.zeros(5))
        for _ in range(20)
    ]
    came = [frame for frame in received(sent, 60.0) if len(frame.ids)]
    assert [frame.sequence for frame in came] == list(range(90, 110))
    for frame in came:
        np.testing.assert_allclose(frame.points_m, sent[frame.sequence].points_m, atol=1e-6)
        np.testing.assert_array_equal(frame.ids, sent[frame.sequence].ids)


def test_steps_that_search_are_timed_apart_from_those_that_follow() -> None:
    truth = ranges.made(ranges.Setting(ghosts=0.0, hidden=0.0), 0, "calibrated", 0.5)
    (profile,), frames_ = truth.profiles, truth.frames
    followed = cost._spent(profile, frames_, searching=False)
    found = cost._spent(profile, frames_)
    assert len(followed) + len(found) == len(frames_) == 60
    assert 1 <= len(found) <= 3
    begun_anew = cost._spent(profile, frames_, anew=20)
    assert 3 <= len(begun_anew) <= 9
    aside = cost._scrambled(frames_, 1)
    moved = np.concatenate([a.points_m - b.points_m for a, b in zip(aside, frames_, strict=True)])
    np.testing.assert_allclose(np.linalg.norm(moved, axis=1), cost.SCRAMBLED_M)
    assert len(cost._spent(load_profile("han19"), aside[:12])) == 12
    assert np.isnan(cost._percentiles([])["p99_ms"])


@pytest.mark.parametrize(
    ("setting", "known"),
    [
        (ranges.Setting(rate_hz=30.0), "calibrated"),
        (ranges.Setting(rate_hz=960.0), "calibrated"),
        (ranges.Setting(clock_s=1.7e9), "calibrated"),
        (ranges.Setting(away_m=100.0), "calibrated"),
        (ranges.Setting(apart_m=5.0), "calibrated"),
        (ranges.Setting(noise_m=0.0005), "calibrated"),
        (ranges.Setting(bodies=10), "calibrated"),
        (ranges.Setting(layout="qualisys13"), "calibrated"),
        (ranges.Setting(size=0.75), "generic"),
        (ranges.Setting(size=1.25), "generic"),
    ],
    ids=str,
)
def test_every_label_is_right_at_the_ends_of_the_ranges(setting: ranges.Setting, known: str) -> None:
    made = replace(setting, ghosts=0.0, size=setting.size or 1.0)
    judged_ = tracked(ranges.made(made, 3, known, 0.75))
    seen = judged_.truth.wanted != NO_POINT
    assert seen.mean() > 0.9
    assert (judged_.good | ~seen)[round(0.25 * made.rate_hz) :].all()


def test_what_is_varied_is_what_the_frames_hold() -> None:
    plain = ranges.made(ranges.Setting(hidden=0.0, ghosts=0.0), 1, "generic", 0.1)
    far = ranges.made(ranges.Setting(hidden=0.0, ghosts=0.0, away_m=50.0, clock_s=7.0, rate_hz=60.0), 1, "generic", 0.1)
    assert len(plain.frames) == 12 and len(far.frames) == 6
    assert far.frames[1].times.device_s == pytest.approx(7.0 + 1 / 60.0)
    apart = ranges.made(ranges.Setting(hidden=0.0, ghosts=0.0, apart_m=3.0), 1, "generic", 0.1)
    left, right = (
        [one.frames[0].points_m[one.wanted[0, hand]].mean(axis=0) for one in (plain, apart)] for hand in (0, 1)
    )
    np.testing.assert_allclose(left[1] - left[0], (-3.0, 0.0, 0.0), atol=1e-9)
    np.testing.assert_allclose(right[1], right[0], atol=1e-9)
    here, there = plain.frames[2].points_m.mean(axis=0), far.frames[1].points_m.mean(axis=0)
    assert np.linalg.norm(there - here) == pytest.approx(50.0, abs=1e-3)
    crowded = ranges.made(ranges.Setting(ghosts=40.0, bodies=5), 1, "generic", 0.2)
    assert len(crowded.frames[-1].ids) > 38 * 0.8 + 20 + 20
    assert plain.profiles[0].scale is None
    assert ranges.made(ranges.Setting(), 1, "calibrated", 0.01).profiles[0].scale == 1.0


def test_the_command_prints_and_returns_the_figures() -> None:
    words = ("--only", "kinds", "--kinds", "single hand", "--conditions", "calibrated", "--seeds", 1, "--seconds", 1)
    ran = phalanx("bench", "tracking", *words, "--failures", 3, "--json")
    assert ran.code == 0, ran.err
    row = ran.figures["kinds"]["calibrated"]["single hand"]
    assert row["frames_right"] == row["labels_right"] == row["hidden_found"] == 100.0
    assert row["side_swaps"] == row["longest_wrong_frames"] == 0
    assert "100.00 |      100.000" in ran.out
    lacking = phalanx("bench", "tracking", "--only", "glove")
    assert lacking.code == 1 and "--data" in lacking.err
