"""Frames that went by unsolved count: what was hidden, new or nameless grew as old as if they had been seen."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest

from core.engine import Engine
from core.frames import HandState, MarkerFrame
from core.labelling.validation import PROVISIONAL_FRAMES, Validation
from core.motion.performer import Performer
from core.motion.stream import MarkerStream
from core.profile import load_profile
from core.props.marked import marked
from core.props.tracker import PropTracker

HAN19 = load_profile("han19")
AWAY, BACK, GHOST_ID = 20, 90, 777_777


def frames() -> list[MarkerFrame]:
    """Two hands at rest that begin to move; one marker of the right is hidden from AWAY to BACK, a reflection stays."""
    stream = MarkerStream(Performer(HAN19, seed=4), 120.0, 4, noise_m=3e-5)
    hidden = f"right_{HAN19.layout.marker_names[5]}"
    made = []
    for i, sent in enumerate(itertools.islice(stream.labelled(), 120)):
        frame = sent.frame
        named = [stream.labels[t] if t >= 0 else "" for t in sent.truth]
        seen = np.array([not (name == hidden and AWAY <= i < BACK) for name in named])
        points_m = np.vstack([frame.points_m[seen], frame.points_m.mean(axis=0) + [0.0, 0.4, 0.0]])
        ids = np.append(frame.ids[seen], GHOST_ID)
        made.append(replace(frame, points_m=points_m, ids=ids, residuals_m=np.zeros(len(ids))))
    return made


def counts(engine: Engine) -> list[object]:
    """All that counts frames."""
    assert isinstance(engine.validator, Validation)
    doubts = engine.validator._doubts
    return [
        *(track.hidden_frames.tolist() for track in engine._tracks),
        *(np.minimum(one.ages, 10 * PROVISIONAL_FRAMES).tolist() for one in doubts.values()),
        *(track.young.tolist() for track in engine._tracks),
        engine.labeller._nameless.get(GHOST_ID),
    ]


@pytest.mark.parametrize(("at", "skipped"), [(10, 1), (10, 9), *itertools.product((AWAY + 3, BACK + 2), (1, 7, 30))])
def test_what_counts_frames_counts_those_that_were_skipped(at: int, skipped: int) -> None:
    sent = frames()
    every, some = Engine(HAN19), Engine(HAN19)
    stop = min(at + skipped + 1, len(sent) - 1)
    for i, frame in enumerate(sent[:stop]):
        seen = every.step(frame)
        if at <= i < stop - 1:
            some.skip()
        else:
            solved = some.step(frame)
    assert all(hand.state is HandState.TRACKED for hand in (*seen.hands, *solved.hands))
    assert counts(some) == counts(every)


def test_what_vanished_in_skipped_frames_is_hidden_since_it_was_last_seen() -> None:
    sent, engine = frames(), Engine(HAN19)
    for frame in sent[: AWAY - 5]:
        engine.step(frame)
    engine.skip(14)
    engine.step(sent[AWAY + 9])
    right = engine._tracks[1]
    assert right.side == "right" and right.hidden_frames[5] == 15
    assert right.hidden_s[5] == pytest.approx(15 / 120, abs=1e-6)


def test_many_at_once_are_as_many_one_by_one() -> None:
    sent = frames()
    one, other = Engine(HAN19), Engine(HAN19)
    for engine in (one, other):
        for frame in sent[: AWAY + 5]:
            engine.step(frame)
    one.skip(9)
    for _ in range(9):
        other.skip()
    a, b = one.step(sent[AWAY + 14]), other.step(sent[AWAY + 14])
    assert counts(one) == counts(other)
    assert all(x.theta_rad.tobytes() == y.theta_rad.tobytes() for x, y in zip(a.hands, b.hands, strict=True))


def test_numbers_of_the_device_count_nothing() -> None:
    sent = frames()
    odd = [replace(frame, sequence=(2 * i) % 50) for i, frame in enumerate(sent)]  # every second, and begun anew
    one, other = Engine(HAN19), Engine(HAN19)
    for frame, renumbered in zip(sent, odd, strict=True):
        a, b = one.step(frame), other.step(renumbered)
        assert all(x.theta_rad.tobytes() == y.theta_rad.tobytes() for x, y in zip(a.hands, b.hands, strict=True))
    assert counts(one) == counts(other)


def test_a_digit_is_unseen_for_as_long_as_a_pause_lasts() -> None:
    sent = frames()
    engine = Engine(HAN19)
    for frame in sent[:AWAY]:
        engine.step(frame)
    later = sent[AWAY]
    engine.step(replace(later, times=replace(later.times, device_s=later.times.device_s + 0.5)))
    right = engine._tracks[1]
    assert right.side == "right" and right.hidden_s[5] == pytest.approx(0.5 + 1 / 120, abs=1e-6)
    unseen_s = right._unseen_s[right._guessed]
    assert len(unseen_s) == 0 or unseen_s.min() >= 0.5


def test_a_prop_is_proven_by_frames_that_were_skipped_and_one_look_more() -> None:
    performer = Performer(HAN19, 2, "pen")
    name, thing = next(iter(performer.props.items()))
    prop = marked(name, thing, 2)
    points_m = prop.placed_m(np.eye(4)) + [0.0, 1.0, 0.0]
    ids, free = np.arange(len(points_m)), np.ones(len(points_m), dtype=np.bool_)
    looks, jumped = PropTracker(prop), PropTracker(prop)
    n = 0
    while not looks.tracked:
        looks.step(points_m, ids, free, 1 / 120)
        n += 1
    assert n > 2
    jumped.step(points_m, ids, free, 1 / 120)
    jumped.skip(100)
    assert not jumped.tracked
    jumped.step(points_m, ids, free, 101 / 120)
    assert jumped.tracked
