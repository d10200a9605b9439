"""Both hands of a performer in one crowd: each is asked about without the other's points."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from core.engine import Engine
from core.frames import NO_POINT, SIDES, HandState, IntArray, MarkerFrame, Times
from core.hand.mirror import mirror_points
from core.labelling.clusters import SPARE_POINTS, groups
from core.labelling.in_turn import MOST_TURNS, in_turn
from core.labelling.network import NamedHand, named, shipped_network
from core.labelling.sizes import told_of
from core.motion.performer import Performer
from core.profile import load_profile

PROFILE = load_profile("han19")
N = len(PROFILE.layout.joints)
REACH_M, HIDDEN = 0.02, 3


def answer(point: list[int]) -> NamedHand:
    return NamedHand("right", np.array(point), np.ones(len(point)), np.zeros(len(point)))


class Told:
    """Answers in turn, and what was asked."""

    def __init__(self, *answers: NamedHand | None) -> None:
        self.left, self.asked = list(answers), []

    def __call__(self, hand: int, rows: IntArray) -> NamedHand | None:
        self.asked.append((hand, rows.tolist()))
        return self.left.pop(0)


def test_each_hand_is_asked_about_among_the_points_that_the_other_left() -> None:
    tell = Told(answer([0, 1, NO_POINT]), answer([0, NO_POINT]), answer([1, 2, 0]), answer([0, NO_POINT]))
    shares = in_turn(tell, 5)
    assert tell.asked == [(0, [0, 1, 2, 3, 4]), (1, [2, 3, 4]), (0, [0, 1, 3, 4]), (1, [2, 4])]
    assert shares is not None
    assert [share.rows.tolist() for share in shares] == [[0, 1, 3, 4], [2, 4]]
    assert [share.named.tolist() for share in shares] == [[1, 3, 0], [2]]


def test_a_question_whose_answer_is_known_is_not_asked_again() -> None:
    # The second hand has no names: the first would be asked about the same points.
    tell = Told(answer([0, 1]), answer([NO_POINT]))
    shares = in_turn(tell, 3)
    assert len(tell.asked) == 2 < MOST_TURNS
    assert shares is not None and shares[0].named.tolist() == [0, 1] and shares[1].named.tolist() == []


def test_where_questions_run_out_the_last_answers_stand() -> None:
    shares = in_turn(Told(answer([0]), answer([0]), None), 3)
    assert shares is not None and shares[0].named.tolist() == [0] and shares[1].named.tolist() == [1]
    assert in_turn(Told(answer([0]), None), 3) is None
    assert in_turn(Told(None), 3) is None


def meetings() -> list[tuple[np.ndarray, IntArray]]:
    """Points of two hands turned anyhow and put beside each other, so that each reaches
    REACH_M past the other's outermost marker, HIDDEN markers of each gone, in random order;
    (2, m) the true point of each marker."""
    random, found = np.random.default_rng(3), []
    performer = Performer(PROFILE, seed=9)
    for k in range(12):
        seen = performer.at(3.0 + 1.7 * k).markers_world_m
        turned = [(seen[side] - seen[side].mean(axis=0)) @ Rotation.random(rng=random).as_matrix() for side in SIDES]
        apart = np.array([turned[0][:, 0].max() - REACH_M - turned[1][:, 0].min(), 0.0, 0.0])
        shown = [np.sort(random.permutation(N)[HIDDEN:]) for _ in SIDES]
        points = np.concatenate([turned[0][shown[0]], turned[1][shown[1]] + apart])
        order = random.permutation(len(points))
        point = np.full((2, N), NO_POINT)
        for hand, place in enumerate(np.argsort(order).reshape(2, -1)):
            point[hand, shown[hand]] = place
        found.append((points[order], point))
    return found


def test_hands_beside_each_other_are_named_better_in_turn_than_at_once() -> None:
    network, told = shipped_network(), told_of(PROFILE)
    at_once, turns = [], []
    for points, truth in meetings():
        seen_by = [mirror_points(points), points]

        def ask(hand: int, rows: IntArray, seen_by: list[np.ndarray] = seen_by) -> NamedHand:
            return named(network.labels(seen_by[hand][rows], told, "right"), "right")

        at_once.append(np.mean([ask(hand, np.arange(len(points))).point == truth[hand] for hand in (0, 1)]))
        shares = in_turn(ask, len(points))
        assert shares is not None

        turns.append(np.mean([shares[hand].point == truth[hand] for hand in (0, 1)]))
    assert np.mean(turns) > np.mean(at_once) + 0.05


def test_the_engine_tells_hands_that_are_cut_apart_wrongly() -> None:
    right = []
    for points, truth in meetings():
        assert any(len(group) > N + SPARE_POINTS for group in groups(points, N))
        engine, ids = Engine(PROFILE), np.arange(len(points)) + 1
        for number in range(12):
            time_s = number / 120.0
            solved = engine.step(
                MarkerFrame(number, Times(time_s, time_s, time_s), points, ids, np.full(len(points), np.nan))
            )
        right += [
            (hand.state is HandState.TRACKED) * np.mean(hand.point == truth[SIDES.index(hand.side)])
            for hand in solved.hands
        ]
    assert np.mean(right) > 0.9  # 0.86 where each hand is asked about among all points
