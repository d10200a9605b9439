from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from core.frames import NO_POINT, FloatArray, IntArray
from core.props import kernels
from core.props.prop import Prop
from core.props.tracker import PROOF_FRAMES, Props, PropTracker
from tests.core.props.things import BALL, PEN, SQUARE, apart, path, pose
from tests.some import some

RATE_HZ = 120.0
WAND = Prop("wand", np.array([[0.0, 0, 0], [0.12, 0, 0], [0.03, 0.09, 0], [0.06, 0.02, 0.05]]))


@dataclass
class Sample:
    """truth: marker of the prop that each point is, -1 for what is none."""

    time_s: float
    points_m: FloatArray
    ids: IntArray
    truth: IntArray
    pose: FloatArray
    seen: int


def cloud(
    prop: Prop, n: int, seed: int = 0, hidden: float = 0.0, ghosts: int = 0, others: int = 0, noise_m: float = 0.00003,
    with_ids: bool = True, speed: float = 1.0,
) -> Iterator[Sample]:  # fmt: skip
    """A prop that swings, with markers that go for a while, flickering ghosts and a bag of points that are shaken."""
    random = np.random.default_rng(seed)
    m = len(prop.markers_m)
    gone = np.zeros(m, dtype=int)  # frames for which each marker is still hidden
    ids, next_id = np.arange(m), 1000
    bag = random.uniform(-0.12, 0.12, (others, 3))
    for i in range(n):
        time_s = i / RATE_HZ
        at = path(time_s, speed)
        gone = np.maximum(gone - 1, 0)
        goes = (gone == 0) & (random.random(m) < hidden / 20.0) if i > 20 else np.zeros(m, dtype=bool)
        gone[goes] = random.integers(5, 40, goes.sum())
        back = gone == 1
        ids[back] = next_id + np.arange(back.sum())
        next_id += int(back.sum())
        seen = np.flatnonzero(gone == 0)
        beside = at[:3, 3] + random.normal(0.0, 0.05, (ghosts, 3))
        bag += random.normal(0.0, 0.004, bag.shape)
        points = np.concatenate([prop.placed_m(at)[seen], beside, bag + at[:3, 3]])
        own = np.concatenate([ids[seen], next_id + np.arange(ghosts), 100_000 + np.arange(others)])
        next_id += ghosts
        truth = np.concatenate([seen, np.full(ghosts + others, -1)])
        order = random.permutation(len(points))
        points += random.normal(0.0, noise_m, points.shape) if noise_m else 0.0
        ids_sent = own[order] if with_ids else np.full(len(order), -1)
        yield Sample(time_s, points[order], ids_sent.astype(np.int64), truth[order], at, len(seen))


def track(prop: Prop, samples: Iterator[Sample]) -> Iterator[tuple[Sample, PropTracker]]:
    tracker = PropTracker(prop)
    for sample in samples:
        tracker.step(sample.points_m, sample.ids, np.ones(len(sample.ids), dtype=bool), 1.0 / RATE_HZ)
        yield sample, tracker


@pytest.mark.parametrize("with_ids", [True, False], ids=["ids", "no ids"])
@pytest.mark.parametrize("prop", [PEN, WAND, BALL, SQUARE], ids=lambda prop: prop.name)
def test_a_prop_alone_is_exact_from_its_proof_on(prop: Prop, with_ids: bool) -> None:
    m = len(prop.markers_m)
    needed = PROOF_FRAMES.get(m, 3)
    offset = None
    for i, (sample, tracker) in some(enumerate(track(prop, cloud(prop, 200, noise_m=0.0, with_ids=with_ids)))):
        assert tracker.tracked == (i >= needed - 1)
        if not tracker.tracked:
            assert (tracker.point == NO_POINT).all() and np.isnan(tracker.rms_m)
            continue
        # A square looks the same from eight sides: any is right, as long as it stays.
        turn = np.linalg.inv(tracker.transform_world) @ sample.pose
        offset = turn if offset is None else offset
        np.testing.assert_allclose(turn, offset, atol=1e-9)
        np.testing.assert_allclose(np.sort(tracker.point), np.arange(m))
        assert tracker.rms_m < 1e-12
        if prop in (PEN, WAND):
            np.testing.assert_allclose(turn, np.eye(4), atol=1e-9)
            np.testing.assert_array_equal(sample.truth[tracker.point], np.arange(m))


@pytest.mark.parametrize("with_ids", [True, False], ids=["ids", "no ids"])
@pytest.mark.parametrize("seed", range(4))
def test_a_prop_among_ghosts_and_other_points(seed: int, with_ids: bool) -> None:
    frames = 0
    for i, (sample, tracker) in enumerate(
        track(PEN, cloud(PEN, 600, seed, hidden=0.15, ghosts=4, others=40, with_ids=with_ids))
    ):
        if tracker.tracked:
            way_m, turn_rad = apart(tracker.transform_world, sample.pose)
            assert way_m < 0.001 and turn_rad < np.radians(1.0), i
            seen = tracker.point != NO_POINT
            assert seen.sum() >= 3
            frames += 1
    assert frames > (570 if with_ids else 540)


def test_a_square_never_flips_though_markers_go() -> None:
    offset = None
    for sample, tracker in some(track(SQUARE, cloud(SQUARE, 1500, 7, hidden=0.1, ghosts=2))):
        if not tracker.tracked:
            continue
        turn = np.linalg.inv(tracker.transform_world) @ sample.pose
        offset = turn if offset is None else offset
        way_m, turn_rad = apart(turn, offset)
        assert way_m < 0.001 and turn_rad < np.radians(2.0)


def test_no_prop_is_found_where_there_is_none() -> None:
    """Points of something that is not rigid, crowded as two hands are."""
    for prop in (PEN, WAND, BALL):
        random = np.random.default_rng(11)
        tracker = PropTracker(prop)
        points = random.uniform(-0.1, 0.1, (40, 3))
        for _ in range(1200):
            points += random.normal(0.0, 0.001, points.shape)
            tracker.step(points, np.arange(40), np.ones(40, dtype=bool), 1.0 / RATE_HZ)
            assert not tracker.tracked and (tracker.point == NO_POINT).all()


def test_with_too_few_markers_it_is_lost_where_it_was_and_keeps_what_bears_its_ids() -> None:
    samples = list(cloud(PEN, 140))
    tracker = PropTracker(PEN)
    last = np.eye(4)
    for i, sample in some(enumerate(samples)):
        away = 40 <= i < 80
        keep = sample.truth < 2 if away else np.ones(len(sample.truth), dtype=bool)
        tracker.step(sample.points_m[keep], sample.ids[keep], np.ones(keep.sum(), dtype=bool), 1.0 / RATE_HZ)
        if i == 39:
            last = tracker.transform_world.copy()
        if away:
            assert not tracker.tracked
            np.testing.assert_array_equal(tracker.transform_world, last)
            np.testing.assert_array_equal(np.sort(sample.truth[keep][tracker.point[:2]]), [0, 1])
        elif i >= 82 or 10 < i < 40:
            assert tracker.tracked
            np.testing.assert_allclose(tracker.transform_world, sample.pose, atol=2e-2)


def test_a_prop_that_jumps_is_found_again() -> None:
    tracker, random = PropTracker(PEN), np.random.default_rng(2)
    for _ in range(5):
        at = pose(random)
        for _ in range(12):
            tracker.step(PEN.placed_m(at), np.full(5, -1), np.ones(5, dtype=bool), 1.0 / RATE_HZ)
        assert tracker.tracked
        np.testing.assert_allclose(tracker.transform_world, at, atol=1e-9)


def test_two_props_share_a_cloud() -> None:
    props = Props([WAND, PEN])
    random = np.random.default_rng(3)
    for i in range(60):
        time_s = i / RATE_HZ
        one, other = path(time_s), path(time_s + 0.4)
        points = np.concatenate([WAND.placed_m(one), PEN.placed_m(other), random.uniform(-1, 1, (3, 3))])
        free = props.step(points, np.full(len(points), -1), 1.0 / RATE_HZ)
    np.testing.assert_array_equal(np.flatnonzero(free), [9, 10, 11])
    wand, pen = props.frames(points, np.arange(len(points)))
    assert (wand.name, wand.tracked, pen.name, pen.tracked) == ("wand", True, "pen", True)
    np.testing.assert_allclose(wand.transform_world, one, atol=1e-9)
    np.testing.assert_allclose(pen.transform_world, other, atol=1e-9)


def test_what_was_never_seen_is_not_reported() -> None:
    props = Props([PEN])
    props.step(np.zeros((0, 3)), np.zeros(0, dtype=np.int64), 0.01)
    assert props.frames(np.zeros((0, 3)), np.zeros(0, dtype=np.int64)) == ()


def test_hidden_markers_decide_only_what_the_seen_ones_leave_open() -> None:
    """Three markers on a line do not show the turn about it: it stays as expected."""
    line = np.array([[0.0, 0, -0.05], [0, 0, 0.0], [0, 0, 0.06], [0.03, 0, 0.01]])
    expected, fitted = pose(np.random.default_rng(5)), np.empty((4, 4))
    anchors = line @ expected[:3, :3].T + expected[:3, 3]
    point = np.array([0, 1, 2, -1])
    shift = 0.01 * expected[:3, 2]
    rms_m = kernels.fit(line, anchors[:3] + shift, point, anchors, 1e-4, fitted)
    assert rms_m < 2e-5
    assert Rotation.from_matrix(fitted[:3, :3].T @ expected[:3, :3]).magnitude() < 1e-3
    np.testing.assert_allclose(fitted[:3, 3], expected[:3, 3] + shift, atol=2e-5)
