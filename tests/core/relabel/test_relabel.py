"""Names from the whole of a recording: better than live, never two alike, and the same from both ends of time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import islice

import numpy as np
import pytest

from core.cast import cast_of
from core.engine import Engine
from core.errors import CancelledError
from core.frames import NO_POINT, HandState, MarkerFrame, TrackedFrame
from core.motion.performer import Performer
from core.motion.stream import GHOST, LabelledFrame, MarkerStream
from core.profile import Profile, load_profile
from core.relabel.names import NOBODY, Naming
from core.relabel.relabel import Relabelled, relabel
from core.relabel.settling import Settling
from core.relabel.teller import Teller
from core.relabel.tracklets import TrackletBuilder
from core.relabel.votes import FULL, mirrored
from core.takes.reprocess import relabelled, relabelled_each, solve
from tests.some import some

RATE_HZ = 120.0
RIGHT = replace(load_profile("han19").with_sides(("right",)), scale=1.0)
NAMING = Naming.of(cast_of(RIGHT))
N_FRAMES = 180


def performed(
    hidden: float, ghosts: float, seed: int = 3, first: int = 0, n: int = N_FRAMES, activity: str = "everyday"
) -> list[LabelledFrame]:
    stream = MarkerStream(Performer(RIGHT, seed, activity), RATE_HZ, seed, hidden=hidden, ghosts=ghosts, skin_m=0.0006)
    return list(islice(stream.labelled(), first, first + n))


def raw(sent: Sequence[LabelledFrame]) -> list[MarkerFrame]:
    return [one.frame for one in sent]


def names_of(solved: TrackedFrame, n_points: int) -> np.ndarray:
    return NAMING.given(solved, n_points)


def frames_right(sent: Sequence[LabelledFrame], names: Sequence[np.ndarray]) -> int:
    return sum(np.array_equal(one.truth, name) for one, name in zip(sent, names, strict=True))


def all_names(result: Relabelled, n: int) -> list[np.ndarray]:
    return [result.of_frame(i) for i in range(n)]


@pytest.fixture(scope="module")
def hard() -> list[LabelledFrame]:
    """A third of the markers hidden, ghosts in every frame, from the first frame on."""
    return performed(0.3, 1.5, first=360)


@pytest.fixture(scope="module")
def hard_names(hard: list[LabelledFrame]) -> Relabelled:
    return relabel(raw(hard), RIGHT)


def test_it_is_better_than_live(hard: list[LabelledFrame], hard_names: Relabelled) -> None:
    frames = raw(hard)
    sizes = [len(frame.points_m) for frame in frames]
    live = [names_of(solved, n) for solved, n in zip(solve(frames, RIGHT), sizes, strict=True)]
    now = frames_right(hard, all_names(hard_names, len(hard)))
    assert now > frames_right(hard, live)
    assert now >= 0.95 * len(hard)


def test_no_marker_has_two_points_and_every_tracklet_one_name(
    hard: list[LabelledFrame], hard_names: Relabelled
) -> None:
    for names in all_names(hard_names, len(hard)):
        given = names[names != NOBODY]
        assert len(np.unique(given)) == len(given)
    assert ((hard_names.sure >= 0.0) & (hard_names.sure <= 1.0)).all()


def test_names_that_are_sure_are_right(hard: list[LabelledFrame], hard_names: Relabelled) -> None:
    right = np.concatenate([one.truth for one in hard]) == hard_names.name[hard_names.cloud.tracklet]
    sure = hard_names.sure[hard_names.cloud.tracklet]
    assert (sure > 0.95).mean() > 0.5
    assert right[sure > 0.95].mean() >= 0.99


def test_from_the_other_end_of_time_the_names_are_the_same(hard: list[LabelledFrame], hard_names: Relabelled) -> None:
    reverse = relabel([mirrored(frame) for frame in reversed(raw(hard))], RIGHT)
    for i, names in some(enumerate(all_names(hard_names, len(hard)))):
        np.testing.assert_array_equal(reverse.of_frame(len(hard) - 1 - i), names)


def test_where_live_is_right_nothing_changes() -> None:
    sent = performed(0.05, 0.0, n=120)
    frames = raw(sent)
    live = solve(frames, RIGHT)
    names = [names_of(solved, len(frame.points_m)) for solved, frame in zip(live, frames, strict=True)]
    assert frames_right(sent, names) == len(sent), "this is no take that is right live"
    result = relabel(frames, RIGHT)
    for i, name in enumerate(names):
        np.testing.assert_array_equal(result.of_frame(i), name)
    for before, after in zip(live, relabelled(frames, RIGHT), strict=True):
        assert np.array_equal(before.hands[0].point, after.hands[0].point)


def test_ghosts_beside_a_hand_that_is_seen_whole_stay_without_a_name() -> None:
    sent = performed(0.0, 3.0, n=90)
    assert sum((one.truth == GHOST).sum() for one in sent) > 2 * len(sent)
    assert frames_right(sent, all_names(relabel(raw(sent), RIGHT), len(sent))) == len(sent)


def test_the_first_frames_are_named_by_what_comes_after() -> None:
    """With five markers a hand is not found live."""
    sent = performed(0.0, 0.0, n=90)
    few = [name for name in range(19) if name % 4 == 0]  # too few for a search
    start = 50
    frames = [
        replace(
            one.frame,
            points_m=one.frame.points_m[keep],
            ids=one.frame.ids[keep],
            residuals_m=one.frame.residuals_m[keep],
        )
        for i, one in enumerate(sent)
        for keep in [np.isin(one.truth, few) | (i >= start)]
    ]
    truth = [one.truth[np.isin(one.truth, few) | (i >= start)] for i, one in enumerate(sent)]
    live = Engine(RIGHT).step(frames[0])
    assert live.hands[0].state is not HandState.TRACKED
    solved = relabelled(frames, RIGHT)
    for one, true in zip(solved, truth, strict=True):
        assert one.hands[0].state is HandState.TRACKED
        np.testing.assert_array_equal(names_of(one, len(true)), true)


def test_a_recording_solved_with_them_has_these_names_and_says_how_sure_they_are(
    hard: list[LabelledFrame], hard_names: Relabelled
) -> None:
    frames, told = raw(hard), list[float]()
    pairs = list(relabelled_each(frames, RIGHT, lambda share, text: told.append(share), fill=True))
    assert told == sorted(told) and 0.0 < told[0] < 0.05 and 0.95 < told[-1] <= 1.0
    assert all(one is two for (one, _), two in zip(pairs, frames, strict=True))
    for i, (frame, solved) in enumerate(pairs):
        hand, names = solved.hands[0], hard_names.of_frame(i)
        assert hand.state is HandState.TRACKED
        left_out = names_of(solved, len(frame.points_m)) != names  # it cannot be: only of names that are wrong
        assert (names_of(solved, len(frame.points_m))[left_out] == NOBODY).all()
        assert (hard[i].truth[left_out] != names[left_out]).all()
        seen = hand.observed
        np.testing.assert_array_equal(hand.markers_world_m[seen], frame.points_m[hand.point[seen]])
        np.testing.assert_array_equal(hand.label_confidence[seen], hard_names.sure_of_frame(i)[hand.point[seen]])
        assert np.isnan(hand.label_confidence[hand.point == NO_POINT]).all()
        assert (solved.sequence, solved.times) == (frame.sequence, frame.times)


@pytest.mark.parametrize("weight", [FULL, FULL // 3])
def test_the_bones_have_a_word_where_both_passes_are_wrong(weight: int) -> None:
    """Both say the tips of two fingers for each other: the hand does not bend so. weight: how sure they say it."""
    sent = performed(0.0, 0.5, seed=5)
    tips = [RIGHT.layout.marker_names.index(name) for name in ("IndexTip", "MiddleTip")]
    frames, builder = [], TrackletBuilder()
    for i, one in enumerate(sent):  # their ids break twice
        ids = one.frame.ids + np.where(np.isin(one.truth, tips), 1000 * ((i >= 60) + (i >= 120)), 0)
        frames.append(replace(one.frame, ids=ids))
        builder.push(frames[-1])
    cloud = builder.cloud()
    begin, end = cloud.spans()
    truth = np.empty(cloud.n_tracklets, dtype=np.int64)
    truth[cloud.tracklet] = np.concatenate([one.truth for one in sent])
    said, weights = truth.copy(), np.full(len(truth), FULL)
    between = (begin == 60) & np.isin(truth, tips)
    assert between.sum() == 2
    said[between], weights[between] = sum(tips) - truth[between], weight
    votes = np.zeros((cloud.n_tracklets, NAMING.n_names + 1), dtype=np.int64)
    votes[np.arange(len(said)), said] = 2 * weights * (end - begin + 1)  # NOBODY is the last
    settling = Settling(frames, cast_of(RIGHT), NAMING, cloud, votes, (1.0,), Teller(None, len(frames)))
    name, _ = settling.run()
    np.testing.assert_array_equal(name, truth)


def test_hands_of_two_performers_keep_their_own_names() -> None:
    other = replace(RIGHT, performer="other")
    sent, far = performed(0.1, 0.0, n=60), performed(0.1, 0.0, seed=8, n=60)
    m = len(RIGHT.layout.marker_names)
    frames = [
        replace(
            one.frame,
            points_m=np.concatenate([one.frame.points_m, two.frame.points_m + [1.5, 0.0, 0.0]]),
            ids=np.concatenate([one.frame.ids, two.frame.ids + 10_000]),
            residuals_m=np.concatenate([one.frame.residuals_m, two.frame.residuals_m]),
        )
        for one, two in zip(sent, far, strict=True)
    ]
    result = relabel(frames, (RIGHT, other))
    whose = set()
    for i, (one, two) in enumerate(zip(sent, far, strict=True)):
        names = result.of_frame(i)
        ours, theirs = names[: len(one.truth)], names[len(one.truth) :]
        np.testing.assert_array_equal(ours % m, one.truth)
        np.testing.assert_array_equal(theirs % m, two.truth)
        whose.add((tuple(np.unique(ours // m)), tuple(np.unique(theirs // m))))
    assert whose in ({((0,), (1,))}, {((1,), (0,))})


def test_nothing_and_nobody() -> None:
    assert relabelled([], RIGHT) == []
    bare = [replace(one.frame, points_m=np.empty((0, 3)), ids=np.empty(0, np.int64), residuals_m=np.empty(0))
            for one in performed(0.0, 0.0, n=3)]  # fmt: skip
    assert [one.hands[0].state for one in relabelled(bare, RIGHT)] == [HandState.SEARCHING] * 3


@pytest.mark.parametrize("stop", [0.01, 0.3])
def test_it_can_be_cancelled(hard: list[LabelledFrame], stop: float) -> None:
    with pytest.raises(CancelledError):
        relabel(raw(hard)[:60], RIGHT, lambda share, text: share < stop)


def test_profiles_need_not_know_the_size(hard: list[LabelledFrame], hard_names: Relabelled) -> None:
    unsized: Profile = replace(RIGHT, scale=None)
    result = relabel(raw(hard)[:90], unsized)
    same = [np.array_equal(result.of_frame(i), hard_names.of_frame(i)) for i in range(90)]
    assert np.mean(same) >= 0.9
