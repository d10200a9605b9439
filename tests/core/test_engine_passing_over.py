"""Frames left out by choice: ids that last through them keep their names, and whatever counts frames counts them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import islice

import numpy as np
import pytest

from core.engine import Engine
from core.frames import NO_ID, HandFrame, HandState, MarkerFrame
from core.labelling.validation import PROVISIONAL_FRAMES
from core.motion.performer import Performer
from core.motion.stream import GHOST, LabelledFrame, MarkerStream
from core.profile import load_profile
from core.props.marked import marked
from core.props.tracker import PropTracker
from core.track import HandTrack
from tests.core.test_engine_skipping import AWAY, BACK, GHOST_ID, counts, frames
from tests.some import some

HAN19 = load_profile("han19")
NAMES = HAN19.layout.marker_names
RIGHT = 1
SETTLED = 16
"""Frames after which all that is said of a hand at rest is proven."""


def passed(engine: Engine, sent: list[MarkerFrame], n: int) -> None:
    """Every n-th is solved, the first and the last among them."""
    assert (len(sent) - 1) % n == 0
    for i, frame in enumerate(sent):
        if i % n:
            engine.pass_over(frame)
        else:
            solved = engine.step(frame)
    assert all(hand.state is HandState.TRACKED for hand in solved.hands)


def proven(engine: Engine) -> list[object]:
    """All that counts frames, ages up to where they count: a name is given in a frame that is solved."""
    ages = slice(len(engine._tracks), 2 * len(engine._tracks))
    told = counts(engine)
    told[ages] = [np.minimum(one, PROVISIONAL_FRAMES).tolist() for one in told[ages]]
    return told


def right_of(engine: Engine) -> HandTrack:
    return engine._tracks[RIGHT]


@pytest.mark.parametrize("n", [2, 4, 8])
def test_what_counts_frames_counts_those_that_were_left_out(n: int) -> None:
    sent = frames()
    for last in (SETTLED, AWAY + 20, BACK + 22):  # before, while and after a marker is hidden
        last = last // n * n
        every, nth = Engine(HAN19), Engine(HAN19)
        for frame in sent[: last + 1]:
            every.step(frame)
        passed(nth, sent[: last + 1], n)
        assert proven(nth) == proven(every)
        assert right_of(nth).hidden_frames[5] == (last + 1 - AWAY if AWAY <= last < BACK else 0)


def test_one_that_is_last_seen_in_a_frame_left_out_is_hidden_from_then_on() -> None:
    sent, engine = frames(), Engine(HAN19)
    passed(engine, sent[: AWAY - 3], 4)
    for frame in sent[AWAY - 3 : AWAY + 2]:
        engine.pass_over(frame)
    track = right_of(engine)
    assert track.hidden_frames[5] == 2 and track.ids[5] == NO_ID
    assert (np.delete(track.hidden_frames, 5) == 0).all() and (np.delete(track.ids, 5) != NO_ID).all()
    engine.step(sent[AWAY + 2])
    assert track.hidden_frames[5] == 3


def rewritten(frame: MarkerFrame, ids: dict[int, int]) -> MarkerFrame:
    """With other ids; NO_ID: without these points."""
    kept = np.array([ids.get(one) != NO_ID for one in frame.ids.tolist()])
    new = np.array([ids.get(one, one) for one in frame.ids[kept].tolist()])
    return replace(frame, points_m=frame.points_m[kept], ids=new, residuals_m=frame.residuals_m[kept])


def test_an_id_that_lasts_keeps_its_name_and_one_that_comes_back_elsewhere_does_not() -> None:
    sent = frames()
    lasting, back = Engine(HAN19), Engine(HAN19)
    for engine in (lasting, back):
        passed(engine, sent[:17], 4)
    a, b = NAMES.index("MiddlePIP"), NAMES.index("RingPIP")  # nearer than an id is believed to have jumped
    own = {k: int(right_of(lasting).ids[k]) for k in (a, b)}
    there = {id_: marker for marker, id_ in own.items()}
    # In three frames both are gone, then each bears the other's id: nothing but those frames tells.
    gone, exchanged = dict.fromkeys(own.values(), NO_ID), {own[a]: own[b], own[b]: own[a]}
    for frame in sent[17:20]:
        lasting.pass_over(frame)
        back.pass_over(rewritten(frame, gone))
    lasting.step(sent[20])
    assert right_of(lasting).carried.sum() == len(NAMES) - 1  # AWAY hides one
    last = rewritten(sent[20], exchanged)
    (hand,) = (hand for hand in back.step(last).hands if hand.side == "right")
    assert not right_of(back).carried[[a, b]].any() and right_of(back).carried.sum() == len(NAMES) - 3
    assert [there[int(sent[20].ids[hand.point[k]])] for k in (a, b)] == [a, b]
    assert hand.rms_m < 0.001


def test_a_reflection_that_comes_between_is_new_and_one_that_stays_grows_older() -> None:
    sent, engine = frames(), Engine(HAN19)
    late = 555_555
    passed(engine, sent[:17], 4)
    for i, frame in enumerate(sent[17:20]):
        engine.pass_over(rewritten(frame, {GHOST_ID: late}) if i else frame)
    nameless = engine.labeller._nameless
    assert nameless == {late: 2}
    solved = rewritten(sent[20], {GHOST_ID: late})
    engine.step(solved)
    row = solved.ids.tolist().index(late)
    assert right_of(engine).newcomer[row] and right_of(engine).nameless[row] == 2


def test_points_without_ids_are_nobody_s_in_frames_left_out() -> None:
    bare = [replace(frame, ids=np.full(len(frame.ids), NO_ID)) for frame in frames()]
    over, skipped = Engine(HAN19), Engine(HAN19)
    for engine in (over, skipped):
        for frame in bare[:9]:
            engine.step(frame)
    for frame in bare[9:12]:
        over.pass_over(frame)
        skipped.skip()
    a, b = over.step(bare[12]), skipped.step(bare[12])
    assert counts(over) == counts(skipped)
    assert all(x.theta_rad.tobytes() == y.theta_rad.tobytes() for x, y in some(zip(a.hands, b.hands, strict=True)))


def test_points_that_are_none_are_not_there(n: int = 4) -> None:
    sent, engine = frames(), Engine(HAN19)
    passed(engine, sent[:17], n)
    own = int(right_of(engine).ids[3])
    points_m = sent[17].points_m.copy()
    points_m[sent[17].ids == own] = np.nan
    engine.pass_over(replace(sent[17], points_m=points_m))
    assert right_of(engine).ids[3] == NO_ID and right_of(engine).hidden_frames[3] == 1


def test_before_any_hand_is_found_and_after_a_reset_there_is_nothing_to_tell() -> None:
    sent, engine, fresh = frames(), Engine(HAN19), Engine(HAN19)
    engine.pass_over(sent[0])
    passed(engine, sent[:9], 4)
    engine.reset()
    for frame in sent[:2]:
        engine.pass_over(frame)
    a, b = engine.step(sent[2]), fresh.step(sent[2])
    assert all(x.theta_rad.tobytes() == y.theta_rad.tobytes() for x, y in some(zip(a.hands, b.hands, strict=True)))


def test_a_prop_is_proven_by_frames_left_out_and_gives_up_ids_that_are_gone() -> None:
    performer = Performer(HAN19, 2, "pen")
    name, thing = next(iter(performer.props.items()))
    prop = marked(name, thing, 2)
    points_m = prop.placed_m(np.eye(4)) + [0.0, 1.0, 0.0]
    ids, free = np.arange(len(points_m)), np.ones(len(points_m), dtype=np.bool_)
    tracker = PropTracker(prop)
    tracker.step(points_m, ids, free, 1 / 120)
    for _ in range(100):
        tracker.pass_over(frozenset(ids.tolist()))
    tracker.step(points_m, ids, free, 101 / 120)
    assert tracker.tracked and tracker._ids.tolist() == ids.tolist()
    tracker.pass_over(frozenset(ids[1:].tolist()))
    tracker.pass_over(frozenset(ids.tolist()))
    assert tracker._ids.tolist() == [NO_ID, *ids[1:].tolist()]


@pytest.fixture(scope="module")
def fast() -> tuple[MarkerStream, list[LabelledFrame]]:
    """Two seconds at 480 Hz of hands that move, with gaps and reflections."""
    stream = MarkerStream(Performer(HAN19, 3), 480.0, 3, hidden=0.05, ghosts=1.0, noise_m=3e-5)
    return stream, list(islice(stream.labelled(), 960))


def wrong(stream: MarkerStream, sent: LabelledFrame, hands: tuple[HandFrame, ...]) -> Iterator[str]:
    names = [stream.labels[t] if t != GHOST else "ghost" for t in sent.truth]
    for hand in hands:
        for k in np.flatnonzero(hand.observed):
            if names[hand.point[k]] != f"{hand.side}_{NAMES[k]}":
                yield f"{hand.side}_{NAMES[k]} is {names[hand.point[k]]}"


@pytest.mark.parametrize("n", [4, 8])
def test_names_and_poses_of_moving_hands_are_those_of_every_frame(fast, n: int) -> None:
    stream, sent = fast
    every, nth, apart_m, faults = Engine(HAN19), Engine(HAN19), [], []
    for i, one in enumerate(sent):
        solved = every.step(one.frame)
        if i % n:
            nth.pass_over(one.frame)
            continue
        own = nth.step(one.frame)
        faults += wrong(stream, one, own.hands)
        for a, b in zip(own.hands, solved.hands, strict=True):
            if i > 48 and (a.point == b.point).all():
                assert a.state is b.state is HandState.TRACKED
                apart_m.append(np.linalg.norm(a.joints_world[:, :3, 3] - b.joints_world[:, :3, 3], axis=1).max())
    assert len(faults) <= 0.002 * 38 * len(sent) / n
    assert np.median(apart_m) < 0.0005 and np.percentile(apart_m, 95) < 0.003
    assert len(apart_m) > 0.9 * 2 * (len(sent) - 48) / n
