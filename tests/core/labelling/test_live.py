"""Hands found, named and mended while they are tracked: Han 2018, 4.2 and 4.4, and what goes beyond."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import multivariate_t

from core.engine import Engine
from core.errors import PhalanxError
from core.frames import NO_ID, NO_POINT, WHY_LOST, HandState, MarkerFrame, TrackedFrame
from core.labelling.continuity import MOST_TOGETHER, TAIL, back_nats, naming_nats, place_nats
from core.labelling.network import NamedHand
from core.labelling.validation import SHOWN_EVERY, TOLD_NATS, Validation
from core.motion.performer import Performer
from core.motion.stream import LabelledFrame, MarkerStream
from core.profile import Profile, load_profile
from tests.some import some

HAN19 = replace(load_profile("han19"), scale=1.0)
RIGHT = HAN19.with_sides(("right",))
NAMES = HAN19.layout.marker_names
M = len(NAMES)


def sent(profile: Profile, n: int, seed: int, activity: str = "free", **dressing: float) -> list[LabelledFrame]:
    stream = MarkerStream(Performer(profile, seed, activity), 120.0, seed, **dressing)
    return list(itertools.islice(stream.labelled(), n))


def kept(frame: MarkerFrame, keep: np.ndarray) -> MarkerFrame:
    return replace(frame, points_m=frame.points_m[keep], ids=frame.ids[keep], residuals_m=frame.residuals_m[keep])


def with_point(frame: MarkerFrame, point_m: np.ndarray, id_: int) -> MarkerFrame:
    return replace(
        frame,
        points_m=np.vstack([frame.points_m, point_m]),
        ids=np.append(frame.ids, id_),
        residuals_m=np.append(frame.residuals_m, 0.0),
    )


def all_right(labelled: LabelledFrame, solved: TrackedFrame, first: int = 0) -> bool:
    """Does every marker carry its own point? first: column of the first hand's first marker."""
    columns = np.arange(len(solved.hands) * M).reshape(-1, M) + first
    return all(
        hand.observed.all() and np.array_equal(labelled.truth[hand.point], column)
        for hand, column in zip(solved.hands, columns, strict=True)
    )


def test_hands_of_two_performers_are_told_apart_by_what_they_wear() -> None:
    other = replace(load_profile("alexanderson13"), scale=1.0)
    theirs, others = sent(HAN19, 60, 3), sent(other, 60, 4)
    engine = Engine([HAN19, other])
    for a, b in zip(theirs, others, strict=True):
        frame = replace(
            a.frame,
            points_m=np.vstack([b.frame.points_m + [1.2, 0.0, 0.0], a.frame.points_m]),
            ids=np.concatenate([b.frame.ids + 10_000, a.frame.ids]),
            residuals_m=np.concatenate([b.frame.residuals_m, a.frame.residuals_m]),
        )
        solved = engine.step(frame)
    assert engine.profiles == (HAN19, other)
    assert [hand.key for hand in solved.hands] == [(0, "left"), (0, "right"), (1, "left"), (1, "right")]
    truth = np.concatenate([b.truth + 1000, a.truth])
    for hand, first, m in zip(solved.hands, (0, 19, 1000, 1013), (19, 19, 13, 13), strict=True):
        assert hand.state is HandState.TRACKED
        np.testing.assert_array_equal(truth[hand.point], first + np.arange(m))


def test_an_engine_needs_a_performer() -> None:
    with pytest.raises(PhalanxError, match="without a performer"):
        Engine([])


@pytest.mark.parametrize("activity", ["free", "hands"])
def test_after_a_total_loss_every_label_is_back_within_two_frames(activity: str) -> None:
    frames = sent(HAN19, 500, 6, activity)
    engine = Engine(HAN19)
    for i, labelled in some(enumerate(frames)):
        gone = i % 125 >= 100
        solved = engine.step(kept(labelled.frame, np.full(len(labelled.truth), not gone)))
        if gone:
            assert all(hand.state is HandState.LOST for hand in some(solved.hands))
            assert all(np.isnan(hand.label_confidence).all() for hand in some(solved.hands))
        elif i % 125 >= 1:
            assert all_right(labelled, solved)
            confidence = np.concatenate([hand.label_confidence for hand in solved.hands])
            assert confidence.min() >= 0.0
            assert confidence.max() <= 1.0
            assert np.median(confidence) > 0.95


def test_a_ghost_beside_a_hidden_marker_of_the_palm_is_no_marker_and_the_marker_is_back_at_once() -> None:
    frames = sent(RIGHT, 140, 5)
    hidden = NAMES.index("BackHand1")
    engine = Engine(RIGHT)
    for i, labelled in some(enumerate(frames)):
        frame, truth = labelled.frame, labelled.truth
        if 100 <= i < 110:
            place = frame.points_m[truth == hidden][0]
            frame = with_point(kept(frame, truth != hidden), place + [0.0, 0.007, 0.0], 90_000)
        elif i >= 110:
            frame = replace(frame, ids=np.where(truth == hidden, 90_001, frame.ids))  # a new id after the gap
        hand = engine.step(frame).hands[0]
        if 100 <= i < 110:
            assert np.flatnonzero(~hand.observed).tolist() == [hidden]
        else:
            np.testing.assert_array_equal(truth[hand.point], np.arange(M))


def test_a_point_that_was_there_before_a_marker_vanished_is_not_that_marker() -> None:
    frames = sent(RIGHT, 130, 5)
    tip = NAMES.index("IndexTip")
    engine = Engine(RIGHT)
    for i, labelled in some(enumerate(frames)):
        place = labelled.frame.points_m[labelled.truth == tip][0] + [0.0, 0.0, 0.012]
        frame = labelled.frame
        if i >= 110:
            frame = kept(frame, labelled.truth != tip)
        if i >= 90:
            frame = with_point(frame, place, 90_000)
        hand = engine.step(frame).hands[0]
        assert bool(hand.observed[tip]) == (i < 110)
        assert np.delete(hand.observed, tip).all()


def test_a_marker_that_comes_back_beside_a_ghost_with_its_name_gets_it_back_at_once() -> None:
    frames = sent(RIGHT, 130, 5)
    tip = NAMES.index("IndexTip")
    engine = Engine(RIGHT)
    taken = 0
    for i, labelled in enumerate(frames):
        frame, truth = labelled.frame, labelled.truth
        if 100 <= i < 104:  # the ghost is where the marker would be but for 4 mm
            ghost = frame.points_m[truth == tip][0] + [0.0, 0.0, 0.004]
            frame = with_point(kept(frame, truth != tip), ghost, 90_000)
        elif i >= 104:
            frame = with_point(replace(frame, ids=np.where(truth == tip, 90_001, frame.ids)), ghost, 90_000)
        hand = engine.step(frame).hands[0]
        taken += 100 <= i < 104 and bool(hand.observed[tip])
        if i < 100 or i >= 105:
            np.testing.assert_array_equal(truth[hand.point], np.arange(M))
    assert taken  # or this tests nothing


def test_a_point_that_stays_gets_its_name_unless_it_long_stood_beside_the_seen_marker() -> None:
    engine = Engine(RIGHT)
    engine.step(sent(RIGHT, 1, 5)[0].frame)
    (track,) = engine._tracks
    track.sure_nats[:] = 8.0

    def cost(together: int, hidden: int) -> float:
        track.hidden_frames[:] = hidden
        track.nameless = np.array([together + hidden])
        return float(back_nats(track, np.array([0]))[0, 0])

    assert cost(3, 1) > cost(0, 1) + 4.0  # seen elsewhere a moment ago: rather not
    assert cost(3, 90) < cost(3, 1) - 10.0
    assert cost(MOST_TOGETHER + 1, 90) == cost(MOST_TOGETHER + 1, 1)


def test_fingers_that_bear_each_others_names_get_their_own_back_within_two_frames() -> None:
    frames = sent(RIGHT, 260, 8)
    index = [NAMES.index(name) for name in ("IndexPIP", "IndexTip")]
    middle = [NAMES.index(name) for name in ("MiddlePIP", "MiddleTip")]
    engine = Engine(RIGHT)
    swapped = 0
    for i, labelled in some(enumerate(frames)):
        if i in (150, 200, 240):
            (track,) = engine._tracks
            track.ids[index], track.ids[middle] = track.ids[middle], track.ids[index]
            swapped = i
        solved = engine.step(labelled.frame)
        if i < 150 or i >= swapped + 2:
            assert all_right(labelled, solved)


def test_a_hand_says_why_it_is_not_tracked() -> None:
    frames = sent(RIGHT, 40, 9)
    engine = Engine(RIGHT)
    whys = []
    for i, labelled in enumerate(frames):
        keep = np.isin(labelled.truth, np.arange(M)) if i < 20 else labelled.truth < (0 if i < 30 else 3)
        whys.append(engine.step(kept(labelled.frame, keep)).hands[0].why)
    assert set(whys) <= set(WHY_LOST)
    assert set(whys[:20]) == {""}
    assert whys[25] in ("no points", "left the volume")
    assert whys[35] == "too few markers"
    random = np.random.default_rng(2)
    still = replace(
        frames[0].frame, points_m=random.uniform(0.0, 0.16, (M, 3)), ids=np.full(M, NO_ID), residuals_m=np.zeros(M)
    )
    engine.reset()
    assert engine.step(still).hands[0].why == "searching"
    for _ in range(12):
        hand = engine.step(still).hands[0]
    assert hand.state is HandState.SEARCHING
    assert hand.why == "out of shape"


def test_a_marker_that_is_sure_of_its_place_takes_no_point_far_from_it() -> None:
    places = np.zeros((2, 3))
    cov_m2 = np.square([0.001, 0.008])[:, None, None] * np.eye(3)
    points = np.array([[d, 0.0, 0.0] for d in (0.0, 0.002, 0.005, 0.010, 0.015, 0.060)])
    nats = naming_nats(points, places, cov_m2, cov_m2, np.zeros((2, 6)))
    assert (np.diff(nats, axis=1) > 0.0).all()
    np.testing.assert_array_equal(nats[0] < 0.0, [True, True, True, False, False, False])
    np.testing.assert_array_equal(nats[1] < 0.0, [True, True, True, True, True, False])
    assert nats[0, 0] < nats[1, 0]  # the surer, the better


def test_a_marker_may_be_further_off_where_its_digit_bends_than_beside_it() -> None:
    random = np.random.default_rng(6)
    turn = np.linalg.qr(random.normal(size=(3, 3)))[0]
    cov_m2 = (turn @ np.diag(np.square([0.012, 0.004, 0.002])) @ turn.T)[None]
    along, beside = turn[:, 0] * 0.015, turn[:, 2] * 0.009
    points = np.concatenate([[along, beside], random.normal(0.0, 0.006, (20, 3))])
    nats = place_nats(points, np.zeros((1, 3)), cov_m2, 1e8 * cov_m2)[0]
    assert nats[0] < nats[1] - 2.0
    student = multivariate_t(np.zeros(3), cov_m2[0], df=TAIL)
    np.testing.assert_allclose(np.diff(nats), -np.diff(student.logpdf(points)), rtol=1e-6, atol=1e-9)


def test_what_the_network_says_of_frames_far_apart_adds_up() -> None:
    frames = sent(RIGHT, 8, 5)
    engine = Engine([RIGHT])
    for one in frames:
        assert all_right(one, engine.step(one.frame))
    (track,) = engine._tracks
    validation = engine.validator
    assert isinstance(validation, Validation)
    doubts = validation._doubts_of(track)
    doubts.against[:] = 0.0
    points = frames[-1].frame.points_m
    said = NamedHand("right", track.point.copy(), np.full(M, 0.9), np.zeros(M))
    said.point[3] = NO_POINT  # it calls the fourth marker hidden, three times
    for looks, frames_between in ((1, SHOWN_EVERY), (2, SHOWN_EVERY), (2, SHOWN_EVERY - 1), (3, 1)):
        doubts.since_counted += frames_between
        validation._take_note(doubts, track, points, said)
        assert doubts.against[3] == pytest.approx(looks * np.log(9.0))
        np.testing.assert_allclose(np.delete(doubts.against, 3), -min(looks * np.log(9.0), TOLD_NATS))
    track.carried[3] = False  # another point bears the name
    validation._take_note(doubts, track, points, None)
    assert doubts.against[3] == 0.0 and doubts.against[4] == -TOLD_NATS


@pytest.mark.parametrize(
    ("off_m", "std_m", "provisional"),
    [(0.004, 0.0005, False), (0.006, 0.0005, True), (0.006, 0.002, False), (0.008, 0.002, True), (0.0, 0.0045, True)],
)
def test_a_name_given_far_off_or_where_the_place_was_unsure_needs_proof(
    off_m: float, std_m: float, provisional: bool
) -> None:
    frames = sent(RIGHT, 8, 5)
    engine = Engine([RIGHT])
    for one in frames:
        engine.step(one.frame)
    (track,) = engine._tracks
    validation = engine.validator
    assert isinstance(validation, Validation)
    track.carried[5] = False
    track.off_m[5] = (0.0, off_m, 0.0)
    track.cov_m2[5] = std_m**2 * np.eye(3)
    validation._take_note(validation._doubts_of(track), track, frames[-1].frame.points_m, None)
    assert bool(track.provisional[5]) is provisional and track.young[5]
