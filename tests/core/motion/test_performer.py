"""The synthetic performer moves as a person does, and the same at any rate."""

from __future__ import annotations

from itertools import islice

import numpy as np
import pytest

from core.frames import SIDES
from core.hand.mirror import mirror_theta, mirror_transforms
from core.hand.model import template
from core.hand.poses import pose
from core.kinematics.forward import joints_world, markers_world
from core.markers.layout import load_layout
from core.motion.performer import PERIOD_S, START_STILL_S, Performer
from core.profile import Profile

PROFILE = Profile("", load_layout("han19"), SIDES, 0.95)
RATE_HZ = 120.0


@pytest.fixture(scope="module", params=[0, 7])
def performer(request: pytest.FixtureRequest) -> Performer:
    return Performer(PROFILE, request.param)


@pytest.fixture(scope="module")
def thetas(performer: Performer) -> dict[str, np.ndarray]:
    times = np.arange(0.0, PERIOD_S, 1.0 / RATE_HZ)
    return {side: np.stack([performer.theta(side, t) for t in times]) for side in SIDES}


def test_truth_is_of_one_piece(performer: Performer) -> None:
    skeleton = template().skeleton.scaled(0.95)
    for frame in islice(performer.frames(7.0), 200):
        for side in SIDES:
            theta = frame.theta_rad[side]
            right = mirror_theta(theta) if side == "left" else theta
            expected = joints_world(skeleton, right)
            markers = markers_world(skeleton, right, PROFILE.layout.joints, PROFILE.layout.positions_m * 0.95)
            if side == "left":
                expected, markers = mirror_transforms(expected), markers * (-1.0, 1.0, 1.0)
            np.testing.assert_allclose(frame.joints_world[side], expected, atol=1e-12)
            np.testing.assert_allclose(frame.markers_world_m[side], markers, atol=1e-12)


def test_same_seed_same_motion_at_any_rate() -> None:
    one, two = Performer(PROFILE, 3), Performer(PROFILE, 3)
    slow = list(islice(one.positions(60.0), 50))
    fast = list(islice(two.positions(240.0), 200))[::4]
    for (time_a, points_a), (time_b, points_b) in zip(slow, fast, strict=True):
        assert time_a == time_b
        np.testing.assert_array_equal(points_a, points_b)
    other = next(Performer(PROFILE, 4).positions(60.0))[1]
    assert np.abs(other - slow[0][1]).max() > 1e-4


def test_one_hand_moves_as_it_does_beside_the_other() -> None:
    both, right = Performer(PROFILE, 3), Performer(PROFILE.with_sides(("right",)), 3)
    assert right.labels == both.labels[19:]
    np.testing.assert_array_equal(right.theta("right", 12.3), both.theta("right", 12.3))


def test_begins_relaxed_and_still(performer: Performer) -> None:
    for side in SIDES:
        held = np.stack([performer.theta(side, t) for t in np.linspace(0.0, START_STILL_S, 50)])
        assert np.abs(held[:, 6:] - pose("relaxed")).max() < 0.1
        assert np.ptp(held[:, :3], axis=0).max() < 0.03
    left, right = performer.theta("left", 0.0), performer.theta("right", 0.0)
    assert 0.25 < np.linalg.norm(left[:3] - right[:3]) < 0.45
    assert right[0] > 0.0 > left[0]


def test_loops_without_a_seam(performer: Performer, thetas: dict[str, np.ndarray]) -> None:
    for side in SIDES:
        np.testing.assert_allclose(performer.theta(side, PERIOD_S + 5.25), performer.theta(side, 5.25), atol=1e-12)
        ring = np.vstack([thetas[side][-3:], thetas[side][:3]])
        seam = np.abs(np.diff(ring, n=2, axis=0)).max()
        assert seam < 2e-3  # no jump in position or speed, at 120 Hz


def test_stays_within_the_limits(thetas: dict[str, np.ndarray]) -> None:
    low, high = template().skeleton.limits_rad.T
    for side in SIDES:
        assert (thetas[side][:, 6:] >= low).all()
        assert (thetas[side][:, 6:] <= high).all()


def test_moves_at_a_person_s_pace(thetas: dict[str, np.ndarray]) -> None:
    for theta in thetas.values():
        speed = np.diff(theta, axis=0) * RATE_HZ
        wrist = np.linalg.norm(speed[:, :3], axis=1)
        assert 0.6 < wrist.max() < 1.6  # [m/s]
        assert wrist.mean() > 0.03
        assert 5.0 < np.abs(speed[:, 6:]).max() < 8.5  # [rad/s]
        acceleration = np.abs(np.diff(speed[:, 6:], axis=0)) * RATE_HZ
        assert acceleration.max() < 150.0  # [rad/s2]; smooth, no jumps
        assert np.ptp(theta[:, 6:], axis=0).min() > np.radians(8.0)  # every joint has something to do
        flexions = np.ptp(theta[:, 6:], axis=0)[[5, 6, 9, 10, 13, 14, 17, 18]]
        assert flexions.min() > np.radians(60.0)


def test_hovers_before_the_body_and_hands_keep_apart(thetas: dict[str, np.ndarray]) -> None:
    left, right = (thetas[side][:, :3] for side in SIDES)
    for wrist in (left, right):
        assert 0.8 < wrist[:, 1].min() < wrist[:, 1].max() < 1.3
        assert -0.55 < wrist[:, 2].min() < wrist[:, 2].max() < -0.1
    apart = np.linalg.norm(left - right, axis=1)
    assert 0.22 < apart.min() < 0.33  # now and then they come close
    assert apart.max() < 0.5


def test_markers_of_the_two_hands_never_meet() -> None:
    for seed in range(4):
        performer = Performer(PROFILE, seed)
        for _, points in islice(performer.positions(15.0), int(15 * PERIOD_S)):
            assert np.linalg.norm(points[:19, None] - points[None, 19:], axis=2).min() > 0.01
