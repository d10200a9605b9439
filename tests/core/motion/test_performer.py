"""The synthetic performer moves as a person does, and the same at any rate."""

from __future__ import annotations

from itertools import islice, pairwise

import numpy as np
import pytest
from scipy.interpolate import BSpline

from core.errors import PhalanxError
from core.frames import SIDES
from core.hand.mirror import mirror_theta, mirror_transforms
from core.hand.model import template
from core.hand.poses import pose
from core.kinematics.forward import joints_world, markers_world
from core.markers.layout import load_layout
from core.motion.activities import ACTIVITIES
from core.motion.capsules import Flesh, prop_touches
from core.motion.easing import deepest_m
from core.motion.performer import KNOTS_HZ, PERIOD_S, START_STILL_S, Performer, prop_path
from core.profile import Profile
from tests.some import some

PROFILE = Profile("", load_layout("han19"), SIDES, 0.95)
RATE_HZ = 120.0
TOUCH_M = 0.008
"""The capsules of bones and props are nowhere deeper in each other: two fingertips pressed together."""
SEEDS = {"everyday": (1, 2, 3), "grasping": (1, 2), "hands": (1, 2)}
"""Where bodies meet, several persons."""


@pytest.fixture(scope="module", params=[0, 7])
def performer(request: pytest.FixtureRequest) -> Performer:
    return Performer(PROFILE, request.param)


@pytest.fixture(scope="module")
def thetas(performer: Performer) -> dict[str, np.ndarray]:
    times = np.arange(0.0, PERIOD_S, 1.0 / RATE_HZ)
    return {side: np.stack([performer.theta(side, t) for t in times]) for side in SIDES}


def test_truth_is_of_one_piece(performer: Performer) -> None:
    skeleton = template().skeleton.scaled(0.95)
    for frame in some(islice(performer.frames(7.0), 200)):
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
        assert np.abs(held[:, 6:] - pose("relaxed")).max() < 0.3  # this person's own rest
        assert np.ptp(held[:, 6:], axis=0).max() < 0.06
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
    for theta in some(thetas.values()):
        speed = np.diff(theta, axis=0) * RATE_HZ
        wrist = np.linalg.norm(speed[:, :3], axis=1)
        assert 0.6 < wrist.max() < 1.6  # [m/s]
        assert wrist.mean() > 0.03
        assert 3.5 < np.abs(speed[:, 6:]).max() < 8.5  # [rad/s]
        acceleration = np.abs(np.diff(speed[:, 6:], axis=0)) * RATE_HZ
        assert np.percentile(acceleration, 99.9) < 120.0  # [rad/s2]; 1 rad in 0.27 s has 80
        assert acceleration.max() < 300.0  # where a finger goes around another
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


def test_markers_of_the_two_hands_never_meet_where_hands_keep_apart() -> None:
    for seed in range(4):
        performer = Performer(PROFILE, seed)
        for _, points in some(islice(performer.positions(15.0), int(15 * PERIOD_S))):
            assert np.linalg.norm(points[:19, None] - points[None, 19:], axis=2).min() > 0.01


def test_knots_are_read_as_a_cubic_b_spline(performer: Performer) -> None:
    knots = performer.performance.knots[1]
    n, degree = len(knots), 3
    looped = np.vstack([knots[-1:], knots, knots[:3]])
    spline = BSpline(np.arange(-degree, len(looped) + 1) / KNOTS_HZ, looped, degree)
    for time_s in (0.0, 0.004, 13.37, PERIOD_S / 2.0, (n - 1) / KNOTS_HZ):
        np.testing.assert_allclose(performer.theta("right", time_s), spline(time_s), atol=1e-12)


def test_people_differ_and_stay_themselves() -> None:
    rest = [Performer(PROFILE, seed).theta("right", 0.0)[6:] for seed in range(4)]
    apart = [np.abs(a - b).max() for i, a in enumerate(rest) for b in rest[:i]]
    assert min(apart) > np.radians(1.5)
    one, other = Performer(PROFILE, 2, "free"), Performer(PROFILE, 7, "piano", person=2)
    np.testing.assert_allclose(
        one.theta("right", 0.0)[6:], other.theta("right", 0.0)[6:], atol=0.06
    )  # one person, swaying
    left, right = one.theta("left", 0.0)[6:], one.theta("right", 0.0)[6:]
    assert 1e-3 < np.abs(left - right).max() < 0.2  # a person's hands are alike, not equal


def test_an_unknown_activity_is_named() -> None:
    with pytest.raises(PhalanxError, match=r"No activity 'juggling'.*everyday"):
        Performer(PROFILE, 0, "juggling")


@pytest.mark.parametrize(("activity", "seed"), [(name, seed) for name in ACTIVITIES for seed in SEEDS.get(name, (1,))])
def test_nothing_passes_through_anything(activity: str, seed: int) -> None:
    performer = Performer(PROFILE, seed, activity)
    performance = performer.performance
    flesh = Flesh(PROFILE.hand.skeleton.scaled(0.95), 0.95)
    times = np.arange(performance.knots.shape[1]) / KNOTS_HZ
    paths = [prop_path(prop, own, times) for prop, own in zip(performer.props.values(), performance.holds, strict=True)]
    within, between, props = deepest_m(flesh, performance.knots, paths)
    assert within.min() > -TOUCH_M
    assert between.min() > -TOUCH_M
    assert props.min(initial=np.inf) > -TOUCH_M
    if activity == "hands":
        assert (between < 0.002).mean() > 0.05  # they do meet
    speed = np.diff(performance.knots, axis=1) * KNOTS_HZ
    assert np.abs(speed[..., 6:]).max() < 9.0  # [rad/s]
    assert np.linalg.norm(speed[..., :3], axis=2).max() < 1.6  # [m/s]
    jerk = np.abs(np.diff(speed, n=2, axis=1))[..., 6:] * KNOTS_HZ**2
    assert np.percentile(jerk, 99.0) < (8000.0 if activity == "piano" else 2500.0)  # [rad/s3]: 1 rad in 0.3 s has 2200
    low, high = PROFILE.hand.skeleton.limits_rad.T
    assert (performance.knots[..., 6:] >= low).all()
    assert (performance.knots[..., 6:] <= high).all()


@pytest.mark.parametrize("activity", ["everyday", "grasping"])
def test_a_prop_moves_with_the_hand_that_holds_it_and_never_jumps(activity: str) -> None:
    passed = 0
    for seed in range(1, 4):
        performer = Performer(PROFILE, seed, activity)
        assert set(performer.at(0.0).props_world) == set(performer.props)
        times = np.arange(0.0, PERIOD_S, 1.0 / 50.0)
        frames = [performer.at(t) for t in times]
        for name, holds in zip(performer.props, performer.performance.holds, strict=True):
            placed = np.stack([frame.props_world[name] for frame in frames])
            steps = np.linalg.norm(np.diff(np.vstack([placed, placed[:1]])[:, :3, 3], axis=0), axis=1)
            assert steps.max() < 1.6 / 50.0
            ends = [hold.begin_s for hold in holds[1:]] + [PERIOD_S]
            for hold, end_s in zip(holds, ends, strict=True):
                before, after = (performer.props_world(hold.begin_s + dt)[name] for dt in (-1e-6, 1e-6))
                np.testing.assert_allclose(before, after, atol=2e-4)  # [m]
                during = (times > hold.begin_s) & (times < end_s)
                if hold.holder is None:
                    np.testing.assert_array_equal(
                        placed[during], np.broadcast_to(holds[0].transform, placed[during].shape)
                    )
                    continue
                wrists = np.stack([frame.joints_world[SIDES[hold.holder]][0] for frame in frames])[during]
                held = np.linalg.inv(wrists) @ placed[during]
                np.testing.assert_allclose(held, np.broadcast_to(held[0], held.shape), atol=1e-9)
            passed += sum(a.holder is not None and b.holder is not None for a, b in pairwise(holds))
    if activity == "grasping":
        assert passed >= 2  # from hand to hand and back


def test_a_held_prop_is_touched() -> None:
    """While a prop is held, fingers lie on it."""
    performer = Performer(PROFILE, 2, "grasping")
    performance = performer.performance
    flesh = Flesh(PROFILE.hand.skeleton.scaled(0.95), 0.95)
    times = np.arange(performance.knots.shape[1]) / KNOTS_HZ
    gaps = []
    for prop, holds in zip(list(performer.props.values())[:2], performance.holds, strict=False):
        for hold, after in pairwise(holds):
            if hold.holder is None:
                continue
            rows = np.flatnonzero((times > hold.begin_s) & (times < after.begin_s - 0.4))
            theta = performance.knots[hold.holder][rows].copy()
            theta[:, :6] = 0.0
            transforms = np.broadcast_to(hold.transform, (len(rows), 4, 4))
            gaps.append(prop_touches(flesh.posed(theta), flesh.radii_m, prop, transforms).gap_m[:, :15].min(axis=1))
    assert gaps
    assert np.concatenate(gaps).max() < 0.006


def test_a_pen_s_tip_comes_to_the_markers_of_the_other_hand() -> None:
    """As near as a marker stands above the skin, again and again, and the hand that writes is on the pen meanwhile."""
    performer = Performer(PROFILE, 1, "pen")
    ((name, prop),) = performer.props.items()
    nib = np.array([0.0, 0.0, -prop.size_m[1] / 2.0, 1.0])
    other = "left" if name.endswith("right") else "right"
    nearest = [
        np.linalg.norm(frame.markers_world_m[other] - (frame.props_world[name] @ nib)[:3], axis=1).min()
        for frame in islice(performer.frames(20.0), int(20 * PERIOD_S))
    ]
    near = np.array(nearest) < 0.015
    assert (np.diff(near.astype(int)) == 1).sum() >= 5
    held = [hold for hold in performer.performance.holds[0] if hold.holder is not None]
    assert {hold.holder for hold in held} == {SIDES.index("right" if other == "left" else "left")}


def test_a_controller_stays_in_the_hand_and_its_trigger_is_pulled() -> None:
    performer = Performer(PROFILE, 1, "controller")
    placed = [performer.at(time_s) for time_s in np.arange(0.0, PERIOD_S, 0.1)]
    ((name, holds),) = zip(performer.props, performer.performance.holds, strict=True)
    side = SIDES[holds[-1].holder]
    grips = np.stack([np.linalg.inv(one.joints_world[side][0]) @ one.props_world[name] for one in placed])
    np.testing.assert_allclose(grips, np.broadcast_to(grips[0], grips.shape), atol=1e-9)
    bends = np.degrees([one.theta_rad[side][[12, 20]] for one in placed])  # PIP of index and ring
    assert np.ptp(bends[:, 0]) > 15.0 > 5.0 > np.ptp(bends[:, 1])
