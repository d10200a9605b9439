from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from core.errors import CancelledError
from core.frames import HandKey, HandState, Side
from core.motion.company import Company
from core.motion.performer import Performer
from core.motion.stream import MarkerStream
from core.profile import load_profile
from core.takes.reprocess import given_engine, solve
from tests.some import some

HAN19 = load_profile("han19")


def labelled_frames(n: int) -> tuple[list, dict[int, tuple[Side, int]]]:
    """Frames of both hands whose ids are the columns of the performer, and what each id means."""
    performer = Performer(HAN19, seed=1)
    stream = MarkerStream(performer, 120.0, 1, hidden=0.1)
    frames = []
    for sent, _ in zip(stream.labelled(), range(n), strict=False):
        frames.append(replace(sent.frame, ids=sent.truth))
    labels: dict[int, tuple[Side, int]] = {}
    for column, label in enumerate(performer.labels):
        side, name = label.split("_", 1)
        labels[column] = ("left" if side == "left" else "right", HAN19.layout.marker_names.index(name))
    return frames, labels


def test_given_labels_are_kept_to_the_letter() -> None:
    frames, labels = labelled_frames(120)
    for frame, solved in some(zip(frames, solve(frames, HAN19, labels=labels), strict=True)):
        for hand in some(solved.hands):
            assert hand.state is HandState.TRACKED
            assert hand.rms_m < 0.001
            for k, point in some(enumerate(hand.point)):
                present = [row for row, id_ in enumerate(frame.ids) if labels[int(id_)] == (hand.side, k)]
                assert [point] == (present or [-1])


def test_a_hand_with_fewer_than_four_points_is_no_hand() -> None:
    frames, labels = labelled_frames(3)
    few = {column: label for column, label in labels.items() if label[0] == "right" or label[1] < 3}
    engine = given_engine(HAN19, few)
    left, right = engine.step(frames[0]).hands
    assert (left.state, right.state) == (HandState.SEARCHING, HandState.TRACKED)


def test_progress_and_cancel() -> None:
    frames, _ = labelled_frames(450)
    told: list[float] = []
    solve(frames, HAN19, lambda share, text: told.append(share))
    np.testing.assert_allclose(told, [200 / 450, 400 / 450])
    with pytest.raises(CancelledError):
        solve(frames, HAN19, lambda share, text: False)


def test_labels_of_several_performers_are_told_apart() -> None:
    """Two people, the second with another layout: every point goes to the hand that its id names, nobody else's."""
    cast = (HAN19, load_profile("qualisys13"))
    company = Company([Performer(profile, seed) for seed, profile in enumerate(cast)])
    labels: dict[int, tuple[HandKey, int]] = {}
    for column, label in enumerate(company.labels):
        number, side, name = label.split("_", 2)
        performer = int(number) - 1
        hand = HandKey(performer, "left" if side == "left" else "right")
        labels[column] = hand, cast[performer].layout.marker_names.index(name)
    stream = MarkerStream(company, 120.0, 1, hidden=0.1)
    frames = [replace(sent.frame, ids=sent.truth) for sent, _ in zip(stream.labelled(), range(60), strict=False)]
    for frame, solved in some(zip(frames, solve(frames, cast, labels=labels), strict=True)):
        assert [hand.key for hand in solved.hands] == [(0, "left"), (0, "right"), (1, "right")]
        for hand in some(solved.hands):
            assert hand.state is HandState.TRACKED and hand.rms_m < 0.001
            rows = np.flatnonzero(hand.observed)
            assert {int(frame.ids[hand.point[k]]): (hand.key, k) for k in rows} == {
                int(identity): labels[int(identity)] for identity in frame.ids if labels[int(identity)][0] == hand.key
            }
