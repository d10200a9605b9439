"""What is one physical marker: followed by ids or by motion, and cut where it becomes another."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from core.frames import NO_ID, MarkerFrame, Times
from core.motion.performer import Performer
from core.motion.stream import LabelledFrame, MarkerStream
from core.profile import load_profile
from core.relabel.cloud import Cloud
from core.relabel.names import NOBODY, UNKNOWN
from core.relabel.tracklets import TrackletBuilder, cut
from core.relabel.votes import mirrored

RATE_HZ = 120.0


def cloud_of(frames: list[MarkerFrame]) -> Cloud:
    builder = TrackletBuilder()
    for frame in frames:
        builder.push(frame)
    return builder.cloud()


def frame_at(i: int, points: list[tuple[float, float, float]], ids: list[int]) -> MarkerFrame:
    times = Times(i / RATE_HZ, i / RATE_HZ, i / RATE_HZ)
    return MarkerFrame(i, times, np.array(points).reshape(-1, 3), np.array(ids, dtype=np.int64), np.zeros(len(ids)))


def unnamed(cloud: Cloud) -> tuple[np.ndarray, np.ndarray]:
    nothing = np.full(len(cloud.tracklet), UNKNOWN, dtype=np.int16)
    return nothing, nothing


def mixtures(cloud: Cloud, truth: np.ndarray) -> int:
    """Tracklets that are more than one thing."""
    pairs = np.unique(np.stack([cloud.tracklet, truth]), axis=1)
    return int(pairs.shape[1]) - cloud.n_tracklets


@pytest.fixture(scope="module")
def performed() -> list[LabelledFrame]:
    stream = MarkerStream(Performer(load_profile("han19"), 4, "hands"), RATE_HZ, 4, hidden=0.2, ghosts=2.0)
    frames = stream.labelled()
    return [next(frames) for _ in range(480)]


def test_ids_are_followed_and_nothing_is_cut_without_need(performed: list[LabelledFrame]) -> None:
    cloud = cloud_of([one.frame for one in performed])
    ids = np.concatenate([one.frame.ids for one in performed])
    same = np.unique(np.stack([cloud.tracklet, ids]), axis=1)
    assert same.shape[1] == cloud.n_tracklets == len(np.unique(ids))
    again = cut(cloud, unnamed(cloud))
    moving = cloud.step_m[np.isfinite(cloud.step_m)]
    assert moving.max() > 0.004, "a hand at rest would prove little"
    assert again.n_tracklets == cloud.n_tracklets


def test_without_ids_no_tracklet_is_a_mixture_and_most_last_as_long_as_a_marker_is_seen(
    performed: list[LabelledFrame],
) -> None:
    loose = [replace(one.frame, ids=np.full(len(one.truth), NO_ID)) for one in performed]
    cloud = cloud_of(loose)
    truth = np.concatenate([one.truth for one in performed])
    assert mixtures(cloud, truth) == 0
    with_ids = cloud_of([one.frame for one in performed])
    assert cloud.n_tracklets < 2.0 * with_ids.n_tracklets


def test_time_may_run_either_way(performed: list[LabelledFrame]) -> None:
    frames = [one.frame for one in performed]
    there, back = cloud_of(frames), cloud_of([mirrored(frame) for frame in reversed(frames)])
    there, back = cut(there, unnamed(there)), cut(back, unnamed(back))
    begin = there.first[:-1]
    for i in range(len(frames)):
        ours = there.tracklet[begin[i] : there.first[i + 1]]
        theirs = back.tracklet[back.rows(len(frames) - 1 - i)]
        if i == 0:
            match = {}
        for a, b in zip(ours.tolist(), theirs.tolist(), strict=True):
            assert match.setdefault(a, b) == b
    assert len(set(match.values())) == len(match) == there.n_tracklets


def test_an_id_that_jumps_is_two_tracklets_and_a_clap_is_one() -> None:
    speed_m = 0.010  # per frame, and then at rest: 1.2 m/s
    clap = [(min(i, 20) * speed_m, 0.0, 0.0) for i in range(40)]
    jump = [(i * 0.002 + (0.02 if i >= 20 else 0.0), 1.0, 0.0) for i in range(40)]
    cloud = cloud_of([frame_at(i, [clap[i], jump[i]], [7, 8]) for i in range(40)])
    assert cloud.n_tracklets == 2
    after = cut(cloud, unnamed(cloud))
    assert after.n_tracklets == 3
    first, last = (after.tracklet[after.rows(i)] for i in (19, 20))
    assert first[0] == last[0] and first[1] != last[1]


def test_an_id_far_away_at_once_is_another_marker() -> None:
    cloud = cloud_of([frame_at(0, [(0, 0, 0)], [7]), frame_at(1, [(0.5, 0, 0)], [7])])
    assert cloud.n_tracklets == 2


def test_an_id_that_two_points_carry_says_nothing() -> None:
    cloud = cloud_of([frame_at(i, [(0, 0, 0), (0.2, 0, 0)], [7, 7]) for i in range(3)])
    assert cloud.n_tracklets == 6


def test_points_that_are_nowhere_belong_to_nothing() -> None:
    nan = float("nan")
    cloud = cloud_of([frame_at(i, [(nan, 0, 0), (0.2, 0, 0)], [NO_ID, 8]) for i in range(3)])
    assert cloud.n_tracklets == 4
    assert cut(cloud, unnamed(cloud)).n_tracklets == 4


def test_two_passes_that_agree_on_one_name_and_then_another_cut_at_the_longest_step() -> None:
    """An id taken over by the neighbour, too slowly to be a jump."""
    step = [0.001 if i != 20 else 0.009 for i in range(40)]
    place = np.cumsum(step)
    cloud = cloud_of([frame_at(i, [(place[i], 0.0, 0.0)], [7]) for i in range(40)])
    assert cut(cloud, unnamed(cloud)).n_tracklets == 1
    forward = np.array([3] * 26 + [5] * 14, dtype=np.int16)  # each pass holds to its name for a while
    backward = np.array([3] * 15 + [5] * 25, dtype=np.int16)
    after = cut(cloud, (forward, backward))
    assert after.tracklet.tolist() == [0] * 20 + [1] * 20
    backward[:] = NOBODY
    assert cut(cloud, (forward, backward)).n_tracklets == 1


def test_frames_without_points_and_no_frames() -> None:
    assert cloud_of([]).n_tracklets == 0
    cloud = cloud_of(
        [frame_at(0, [], []), frame_at(1, [(0, 0, 0)], [1]), frame_at(2, [], []), frame_at(3, [(0, 0, 0)], [1])]
    )
    assert cloud.tracklet.tolist() == [0, 1], "an id that was gone is no longer what it was"
    assert cut(cloud, unnamed(cloud)).tracklet.tolist() == [0, 1]
    assert [span.tolist() for span in cloud.spans()] == [[1, 3], [1, 3]]
