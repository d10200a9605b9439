"""Hands and props in one cloud: the whole pipeline on the performer who handles things."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import islice

import numpy as np
import pytest

from core.engine import Engine
from core.errors import PhalanxError
from core.frames import HandState, MarkerFrame, TrackedFrame
from core.motion.performer import Performer
from core.motion.stream import LabelledFrame, MarkerStream
from core.profile import Profile, load_profile
from core.props.marked import marked
from core.props.prop import Prop, check_markers
from tests.core.props.things import PEN, apart
from tests.some import some

HAN19 = load_profile("han19")
RATE_HZ = 120.0
N = 900


def handled(seed: int) -> tuple[Performer, tuple[Prop, ...]]:
    performer = Performer(HAN19, seed, "grasping")
    return performer, tuple(marked(name, thing, seed) for name, thing in performer.props.items())


def solved(profile: Profile, frames: Sequence[MarkerFrame]) -> list[TrackedFrame]:
    engine = Engine(profile)
    return [engine.step(frame) for frame in frames]


def hand_labels(stream: MarkerStream, sent: LabelledFrame, hands: TrackedFrame) -> tuple[int, int, int]:
    """Of the points of hands in a frame: how many carry their label, how many a wrong one; and how many there are."""
    n_hands = len(stream.source.labels)
    names = HAN19.layout.marker_names
    right = wrong = 0
    for hand in hands.hands:
        if hand.state is not HandState.TRACKED:
            continue
        for k in np.flatnonzero(hand.observed):
            truth = int(sent.truth[hand.point[k]])
            good = truth >= 0 and stream.labels[truth] == f"{hand.side}_{names[k]}"
            right, wrong = right + good, wrong + (not good)
    return right, wrong, int(((sent.truth >= 0) & (sent.truth < n_hands)).sum())


@pytest.mark.parametrize(("seed", "hidden", "ghosts"), [(1, 0.0, 0.0), (2, 0.05, 2.0), (3, 0.1, 2.0)])
def test_props_and_hands_in_one_cloud(seed: int, hidden: float, ghosts: float) -> None:
    performer, props = handled(seed)
    profile = replace(HAN19, props=props)
    dressing = {"seed": seed, "hidden": hidden, "ghosts": ghosts}
    stream = MarkerStream(performer, RATE_HZ, props=props, **dressing)
    sent = list(islice(stream.labelled(), N))
    frames = solved(profile, [one.frame for one in sent])
    plain_stream = MarkerStream(performer, RATE_HZ, **dressing)
    plain_sent = list(islice(plain_stream.labelled(), N))
    plain = solved(HAN19, [one.frame for one in plain_sent])

    due = tracked = 0
    counts, without = np.zeros(3, dtype=int), np.zeros(3, dtype=int)
    for i, (one, frame, plain_one, plain_frame) in enumerate(zip(sent, frames, plain_sent, plain, strict=True)):
        counts += hand_labels(stream, one, frame)
        without += hand_labels(plain_stream, plain_one, plain_frame)
        truth_world = performer.props_world(i / RATE_HZ)
        found = {prop.name: prop for prop in frame.props}
        first = len(stream.source.labels)
        for prop in props:
            own = np.arange(first, first + len(prop.markers_m))
            first += len(prop.markers_m)
            enough = np.isin(one.truth, own).sum() >= 3
            due += enough
            if prop.name not in found or not found[prop.name].tracked:
                continue
            tracked += enough
            way_m, turn_rad = apart(found[prop.name].transform_world, truth_world[prop.name])
            assert way_m < 0.001 and turn_rad < np.radians(1.0), (i, prop.name)
            seen = np.flatnonzero(found[prop.name].point >= 0)
            np.testing.assert_array_equal(one.truth[found[prop.name].point[seen]], own[seen])
    assert tracked / due > (0.99 if hidden < 0.1 else 0.95)
    assert counts[0] / counts[2] >= without[0] / without[2] - 0.002
    assert counts[1] / counts[2] <= without[1] / without[2] + 0.002


def test_a_profile_without_props_gives_the_same_bits() -> None:
    """With nothing but hands in the cloud, and whether props are looked for or not."""
    performer, props = handled(1)
    frames = list(islice(MarkerStream(performer, RATE_HZ, 1, hidden=0.05, ghosts=1.0).frames(), 200))
    plain, looking = solved(HAN19, frames), solved(replace(HAN19, props=props), frames)
    for one, other in some(zip(plain, looking, strict=True)):
        assert one.props == () and "props" not in one.stage_s
        assert other.props == () and next(iter(other.stage_s)) == "props"
        for a, b in some(zip(one.hands, other.hands, strict=True)):
            assert a.state is b.state and a.point.tobytes() == b.point.tobytes()
            assert a.theta_rad.tobytes() == b.theta_rad.tobytes()
            assert a.markers_world_m.tobytes() == b.markers_world_m.tobytes()


def test_a_reset_forgets_props() -> None:
    performer, props = handled(1)
    frames = list(islice(MarkerStream(performer, RATE_HZ, props=props).frames(), 30))
    engine = Engine(replace(HAN19, props=props))
    first = [engine.step(frame).props for frame in frames]
    assert len(first[-1]) == len(props)
    engine.reset()
    again = [engine.step(frame).props for frame in frames]
    assert [len(found) for found in first] == [len(found) for found in again]


def test_markers_of_handled_things_make_props() -> None:
    for seed in range(4):
        _, props = handled(seed)
        for prop in some(props):
            check_markers(prop.markers_m, prop.name)
            assert len(prop.markers_m) == 5


def test_only_what_is_handled_can_be_sent() -> None:
    with pytest.raises(PhalanxError, match="Nobody handles a 'pen'"):
        MarkerStream(handled(1)[0], RATE_HZ, props=(PEN,))
    with pytest.raises(PhalanxError, match="It has no props"):
        MarkerStream(Performer(HAN19, 0, "free"), RATE_HZ, props=(PEN,))
