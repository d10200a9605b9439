"""The whole pipeline on the performer and on real recordings."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest

from core.engine import Engine
from core.frames import NO_ID, HandState, MarkerFrame, Times, TrackedFrame
from core.hand.mirror import mirror_points, mirror_theta, mirror_transforms
from core.hand.model import template
from core.hand.skeleton import JOINT_PARENTS
from core.motion.performer import Performer
from core.motion.stream import LabelledFrame, MarkerStream, RecordingMotion
from core.profile import Profile, load_profile
from core.takes.formats import read_recording
from core.takes.reprocess import solve
from tests.data import data_path
from tests.some import some

HAN19 = load_profile("han19")


def labels_right(
    profile: Profile, labels: tuple[str, ...], sent: LabelledFrame, solved: TrackedFrame
) -> tuple[int, int]:
    """How many observed hand markers of a frame carry their true label, and how many there are."""
    names = [f"{side}_{n}" for side in ("left", "right") for n in profile.layout.marker_names]
    known = set(names) | set(profile.layout.marker_names)
    truth = [labels[t] if t >= 0 else "" for t in sent.truth]
    right = 0
    for hand in solved.hands:
        for k in np.flatnonzero(hand.observed):
            name = profile.layout.marker_names[k]
            right += truth[hand.point[k]] in (name, f"{hand.side}_{name}")
    return right, sum(t in known for t in truth)


def performer_frames(n: int, **dressing: float) -> tuple[MarkerStream, list[LabelledFrame]]:
    stream = MarkerStream(Performer(HAN19, seed=4), 120.0, 4, **dressing)
    return stream, list(itertools.islice(stream.labelled(), n))


def same_bits(a: TrackedFrame, b: TrackedFrame) -> bool:
    return all(
        x.side == y.side and x.state == y.state and x.theta_rad.tobytes() == y.theta_rad.tobytes()
        and x.joints_world.tobytes() == y.joints_world.tobytes() and x.point.tobytes() == y.point.tobytes()
        and x.markers_world_m.tobytes() == y.markers_world_m.tobytes()
        for x, y in zip(a.hands, b.hands, strict=True)
    )  # fmt: skip


def test_two_hands_every_label_right_from_the_first_frame() -> None:
    stream, frames = performer_frames(600, noise_m=3e-5)
    engine = Engine(HAN19)
    for sent in some(frames):
        solved = engine.step(sent.frame)
        assert [hand.state for hand in solved.hands] == [HandState.TRACKED] * 2
        right, present = labels_right(HAN19, stream.labels, sent, solved)
        assert (right, present) == (38, 38)
        assert max(hand.rms_m for hand in solved.hands) < 0.001


def test_bones_keep_their_length_and_angles_their_limits() -> None:
    _, frames = performer_frames(240, hidden=0.15, ghosts=1.0, skin_m=0.0007)
    engine = Engine(replace(HAN19, scale=1.0))
    lengths = template().skeleton.bone_lengths_m[1:]
    limits = template().skeleton.limits_rad
    parents = list(JOINT_PARENTS[1:])
    for sent in some(frames):
        for hand in some(engine.step(sent.frame).hands):
            if hand.state is HandState.TRACKED:
                bones = np.linalg.norm(hand.joints_world[1:, :3, 3] - hand.joints_world[parents, :3, 3], axis=1)
                np.testing.assert_allclose(bones, lengths, atol=1e-12)
                np.testing.assert_allclose(np.linalg.det(hand.joints_world[:, :3, :3]), 1.0, atol=1e-9)
                np.testing.assert_array_equal(hand.joints_world[:, 3], np.tile([0.0, 0.0, 0.0, 1.0], (16, 1)))
                assert np.all(hand.theta_rad[6:] >= limits[:, 0])
                assert np.all(hand.theta_rad[6:] <= limits[:, 1])


def test_hidden_markers_ghosts_and_other_bodies_are_survived() -> None:
    stream, frames = performer_frames(1200, hidden=0.08, ghosts=0.5, skin_m=0.0007, bodies=2)
    engine = Engine(HAN19)
    right = present = tracked = 0
    for sent in frames:
        solved = engine.step(sent.frame)
        counts = labels_right(HAN19, stream.labels, sent, solved)
        right, present = right + counts[0], present + counts[1]
        tracked += sum(hand.state is HandState.TRACKED for hand in solved.hands)
    assert right / present > 0.985
    assert tracked / (2 * len(frames)) > 0.99


def test_equal_frames_give_equal_bits_live_and_offline() -> None:
    _, frames = performer_frames(300, hidden=0.1, ghosts=0.5)
    sent = [labelled.frame for labelled in frames]
    engine = Engine(HAN19)
    live = [engine.step(frame) for frame in sent]
    assert all(same_bits(a, b) for a, b in some(zip(live, solve(sent, HAN19), strict=True)))
    engine.reset()
    assert all(same_bits(a, engine.step(frame)) for a, frame in some(zip(live, sent, strict=True)))


def test_a_left_hand_is_solved_as_the_mirror_of_a_right_one() -> None:
    _, frames = performer_frames(120)
    right_only, left_only = HAN19.with_sides(("right",)), HAN19.with_sides(("left",))
    engines = Engine(right_only), Engine(left_only)
    for labelled in some(frames):
        frame = labelled.frame
        seen = replace(frame, points_m=mirror_points(frame.points_m))
        (a,), (b,) = engines[0].step(frame).hands, engines[1].step(seen).hands
        assert a.state == b.state
        np.testing.assert_array_equal(a.point, b.point)
        np.testing.assert_allclose(mirror_theta(a.theta_rad), b.theta_rad, atol=1e-12)
        np.testing.assert_allclose(mirror_transforms(a.joints_world), b.joints_world, atol=1e-12)


def test_a_hand_that_leaves_is_lost_and_found_again_by_itself() -> None:
    stream, frames = performer_frames(480)
    engine = Engine(HAN19)
    left = {i for i, label in enumerate(stream.labels) if label.startswith("left")}
    for i, sent in some(enumerate(frames)):
        frame = sent.frame
        if 100 <= i < 300:
            keep = np.array([t not in left for t in sent.truth])
            frame = replace(
                frame, points_m=frame.points_m[keep], ids=frame.ids[keep], residuals_m=frame.residuals_m[keep]
            )
        hands = {hand.side: hand for hand in engine.step(frame).hands}
        assert hands["right"].state is HandState.TRACKED
        if 100 <= i < 300:
            assert hands["left"].state is HandState.LOST
            assert not hands["left"].observed.any()
            assert np.isnan(hands["left"].rms_m)
        if i >= 300 + 13:  # the finder's longest pause
            assert hands["left"].state is HandState.TRACKED
            assert hands["left"].observed.all()


@pytest.mark.parametrize(
    "points",
    [
        np.empty((0, 3)),
        np.full((30, 3), np.nan),
        np.zeros((40, 3)),
        np.full((20, 3), 1e300),
        np.random.default_rng(0).uniform(-3, 3, (5000, 3)),
        np.random.default_rng(0).uniform(0, 0.1, (1000, 3)),
        np.linspace([0, 0, 0], [0.2, 0, 0], 19),
        np.vstack([np.random.default_rng(0).uniform(0, 0.1, (30, 3)), [[np.inf, 0, 0]]]),
    ],
)
def test_no_frame_raises_and_tracking_goes_on(points: np.ndarray) -> None:
    _, frames = performer_frames(60)
    engine = Engine(HAN19)
    for sent in frames[:30]:
        engine.step(sent.frame)
    for i in range(3):
        bad = MarkerFrame(
            30 + i, Times(0.25, 0.25, 0.25), points, np.full(len(points), NO_ID), np.full(len(points), np.nan)
        )
        solved = engine.step(bad)
        assert all(np.isfinite(hand.theta_rad).all() for hand in some(solved.hands))
        assert all(hand.state is not HandState.TRACKED for hand in some(solved.hands))
    for sent in frames[33:]:
        solved = engine.step(sent.frame)
    assert all(hand.state is HandState.TRACKED and hand.observed.all() for hand in some(solved.hands))


def test_time_that_stands_still_or_runs_back_is_survived() -> None:
    _, frames = performer_frames(90)
    engine = Engine(HAN19)
    for i, sent in some(enumerate(frames)):
        t = {30: 0.0, 31: float("nan"), 40: -5.0, 41: 1e9}.get(i, sent.frame.times.device_s)
        solved = engine.step(replace(sent.frame, times=Times(t, t, t)))
        assert all(hand.state is HandState.TRACKED for hand in some(solved.hands))


def test_qualisys_glove_keeps_its_labels_through_every_gap() -> None:
    """The real glove with the room's other markers, unlabelled, ids broken at the recording's own gaps."""
    recording = read_recording(data_path("qualisys_hand", "recording.tsv"))
    profile = load_profile("qualisys13")
    stream = MarkerStream(RecordingMotion(recording), 100.0, 0, noise_m=0.0)
    engine = Engine(profile)
    right = present = 0
    for sent in stream.labelled():
        solved = engine.step(sent.frame)
        assert solved.hands[0].state is HandState.TRACKED
        counts = labels_right(profile, stream.labels, sent, solved)
        right, present = right + counts[0], present + counts[1]
    assert present == 77387
    assert right / present >= 0.999
    assert 0.95 < solved.hands[0].scale < 1.15


@pytest.mark.parametrize("user", [1, 2, 3, 4])
def test_han_hands_without_ids(user: int) -> None:
    """Real poses at about 30 Hz, every frame shuffled and without ids."""
    file = next(data_path("han2018", "trc").glob(f"user{user}_*left.trc"))
    recording = read_recording(file)
    random = np.random.default_rng(user)
    engine = Engine(HAN19)
    right = present = 0
    for frame in recording.frames():
        order = random.permutation(len(frame.ids))
        t = frame.sequence / 30.0
        hidden = MarkerFrame(
            frame.sequence, Times(t, t, t), frame.points_m[order], np.full(len(order), NO_ID), frame.residuals_m
        )
        solved = engine.step(hidden)
        truth = [recording.labels[i] for i in np.flatnonzero(np.isin(recording.ids, frame.ids))[order]]
        present += len(truth)
        for hand in solved.hands:
            if hand.side == "left":
                right += sum(
                    truth[hand.point[k]] == HAN19.layout.marker_names[k] for k in np.flatnonzero(hand.observed)
                )
    assert right / present > 0.97


@pytest.mark.parametrize("turned_deg", [40, 60, 120, 150])
def test_a_reset_forgets_when_it_last_searched(turned_deg: float) -> None:
    """A hand turned at a stroke takes a search everywhere, however lately the engine searched before its reset."""
    _, frames = performer_frames(1)
    first = frames[0].frame
    angle = np.radians(turned_deg)
    turn = np.array([[np.cos(angle), -np.sin(angle), 0.0], [np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]])
    hand = first.points_m[[t < 19 for t in frames[0].truth]]
    middle = hand.mean(axis=0)
    unnamed = np.full(len(hand), NO_ID)
    stills = [
        MarkerFrame(i, Times(i / 120, i / 120, i / 120), points, unnamed, np.full(len(hand), np.nan))
        for i, points in enumerate((hand, (hand - middle) @ turn.T + middle))
    ]
    engine = Engine(HAN19.with_sides(("left",)))
    before = [engine.step(frame) for frame in stills]
    engine.reset()
    after = [engine.step(frame) for frame in stills]
    assert all(same_bits(a, b) for a, b in zip(before, after, strict=True))
    assert after[-1].hands[0].observed.all()
