"""One hand let go of and found anew, while the other is followed on."""

from __future__ import annotations

from itertools import islice

import numpy as np

from core.engine import Engine
from core.frames import HandKey, HandState
from core.motion.performer import Performer
from core.motion.stream import MarkerStream
from core.profile import load_profile


def test_searching_one_hand_again_leaves_the_other_alone() -> None:
    profile = load_profile("han19")
    frames = list(islice(MarkerStream(Performer(profile, 1), 120.0, 1).frames(), 60))
    engine, untouched = Engine(profile), Engine(profile)
    for frame in frames[:30]:
        engine.step(frame)
        before = untouched.step(frame)
    assert all(hand.state is HandState.TRACKED for hand in before.hands)
    engine.search(HandKey(0, "left"))
    engine.search(HandKey(3, "left"))  # whom there is not
    for i, frame in enumerate(frames[30:]):
        hands = {hand.side: hand for hand in engine.step(frame).hands}
        right = next(hand for hand in untouched.step(frame).hands if hand.side == "right")
        assert hands["right"].state is HandState.TRACKED
        np.testing.assert_array_equal(hands["right"].theta_rad, right.theta_rad)
        np.testing.assert_array_equal(hands["right"].point, right.point)
        if i >= 5:
            assert hands["left"].state is HandState.TRACKED
            assert not set(hands["left"].point[hands["left"].observed]) & set(right.point[right.observed])
    assert engine.step(frames[0]).hands[0].side == "left", "hands keep their order"
