"""Where the numbers of a pose come from, against hands that move as no statistics would have them."""

from __future__ import annotations

from dataclasses import replace
from itertools import islice

import numpy as np
import pytest

from core.engine import Engine
from core.frames import HandFrame, HandState, TrackedFrame
from core.gap_filling import filled
from core.guesses import POINT_NOISE_M
from core.hand.poses import pose
from core.hand.skeleton import DOF_NAMES, N_DOFS, N_ROOT_DOFS
from core.kinematics.solver import HandPose, HandSolver
from core.motion.performer import Performer
from core.motion.stream import MarkerStream
from core.profile import Profile, load_profile
from core.sources import (
    FILLED,
    LIMIT,
    MEASURED,
    PRIOR,
    SOURCES,
    UNKNOWN,
    HandSources,
    Information,
    Sources,
    source_shares,
)
from core.takes.export.turned import solved_to_z_up
from core.track import tracking_solver
from tests.some import some

HAN = load_profile("han19")
STD_NOTHING = np.full(N_DOFS, np.nan)


def solved(solver: HandSolver, made: HandPose, seen: np.ndarray, side: str = "right") -> HandFrame:
    m = len(seen)
    return HandFrame(
        side, HandState.TRACKED, made.theta_rad.copy(), made.joints_world.copy(), made.markers_world_m.copy(),
        np.where(seen, np.arange(m), -1), np.ones(m), STD_NOTHING, np.full(m, np.nan), 0.0,
    )  # fmt: skip


def relaxed(profile: Profile) -> tuple[HandSolver, HandPose]:
    solver = tracking_solver(profile)
    made = HandPose.at_rest(len(profile.layout.joints))
    made.theta_rad[N_ROOT_DOFS:] = pose("relaxed")
    solver.place(made)
    return solver, made


def names(codes: np.ndarray, source: int) -> list[str]:
    return [name for name, code in zip(DOF_NAMES, codes, strict=True) if code == source]


@pytest.mark.parametrize(
    ("layout", "times"), [("han19", 3.0), ("pavllo9", 3.0), ("schroeder8", 1.8), ("schroeder6", 3.0)]
)
def test_measured_angles_follow_postures_that_statistics_do_not_know(layout: str, times: float) -> None:
    """Exact points of digits anywhere within their limits: what is called prior is so many times further off than what
    is called measured, as far as statistics are."""
    profile, random = load_profile(layout), np.random.default_rng(3)
    solver = tracking_solver(profile)
    seen = np.ones(len(profile.layout.joints), dtype=np.bool_)
    low, high = solver.skeleton.limits_rad.T
    off: dict[int, list[float]] = {MEASURED: [], PRIOR: []}
    for _ in range(60):
        true = HandPose.at_rest(len(seen))
        true.theta_rad[N_ROOT_DOFS:] = low + (high - low) * random.uniform(0.15, 0.85, 20)
        solver.place(true)
        found = true.copy()
        solver.solve(found, true.markers_world_m, seen.astype(float), iterations=100, tolerance=1e-12)
        codes = HandSources(solver).of(0.0, solved(solver, found, seen))
        errors = np.abs(found.theta_rad - true.theta_rad)[N_ROOT_DOFS:]
        for source, errors_rad in off.items():
            errors_rad += errors[codes[N_ROOT_DOFS:] == source].tolist()
    rms = {source: np.degrees(np.sqrt(np.mean(np.square(each)))) for source, each in off.items()}
    assert rms[PRIOR] > max(times * rms[MEASURED], 15.0)


def test_an_angle_is_measured_where_the_points_know_more_than_postures_do() -> None:
    """One digit angle moved alone, with all others known to the prior: the very weights of the solver."""
    solver, made = relaxed(HAN)
    information = Information(solver)
    expected = POINT_NOISE_M / np.sqrt(np.diag(solver.prior.precision_m2))
    np.testing.assert_array_equal(information.believed[N_ROOT_DOFS:], expected)
    seen = np.ones(19, dtype=np.bool_)
    told = information.told(made, seen)
    assert (told[N_ROOT_DOFS:] < expected).all()
    # What the points tell is what they tell, whatever is believed: twice the noise, twice as far off.
    np.testing.assert_allclose(information.told(made, seen, 2.0 * POINT_NOISE_M), 2.0 * told, rtol=0.05)


def test_a_finger_of_which_nothing_is_seen_is_prior_and_the_others_are_measured() -> None:
    solver, made = relaxed(HAN)
    seen = np.array([not name.startswith("Index") for name in HAN.layout.marker_names])
    codes = HandSources(solver).of(0.0, solved(solver, made, seen))
    assert names(codes, PRIOR) == [name for name in DOF_NAMES if name.startswith("index")]
    assert names(codes, MEASURED) == [name for name in DOF_NAMES if not name.startswith("index")]


def test_a_joint_at_its_limit_says_so_and_one_just_inside_does_not() -> None:
    solver, made = relaxed(HAN)
    low, high = solver.skeleton.limits_rad.T
    made.theta_rad[N_ROOT_DOFS + 7], made.theta_rad[N_ROOT_DOFS + 10] = high[7], low[10]
    made.theta_rad[N_ROOT_DOFS + 6] = high[6] - 1e-3
    solver.place(made)
    codes = HandSources(solver).of(0.0, solved(solver, made, np.ones(19, dtype=np.bool_)))
    assert names(codes, LIMIT) == ["index_dip_flexion", "middle_pip_flexion"]


def test_what_was_filled_is_filled_even_at_a_limit() -> None:
    solver, made = relaxed(HAN)
    made.theta_rad[N_ROOT_DOFS + 7] = solver.skeleton.limits_rad[7, 1]
    solver.place(made)
    hand = solved(solver, made, np.ones(19, dtype=np.bool_))
    curve = np.isin(np.arange(N_DOFS), [3, N_ROOT_DOFS + 6, N_ROOT_DOFS + 7])
    codes = HandSources(solver).of(0.0, replace(hand, filled=curve))
    assert names(codes, FILLED) == ["wrist_rx", "index_pip_flexion", "index_dip_flexion"]
    assert names(codes, LIMIT) == []


def test_motion_carried_on_outweighs_few_points_at_first_and_not_for_long() -> None:
    """Without the marker in its middle a finger is told less well by the two others than by where it was just seen;
    after a second that is long ago."""
    solver, made = relaxed(HAN)
    seen = np.array([name != "IndexPIP" for name in HAN.layout.marker_names])
    sources = HandSources(solver)
    sources.of(0.0, solved(solver, made, np.ones(19, dtype=np.bool_)))
    k = DOF_NAMES.index("index_pip_flexion")
    codes = [sources.of(i / 100, solved(solver, made, seen))[k] for i in range(1, 201)]
    assert codes[0] == PRIOR and codes[-1] == MEASURED
    assert np.count_nonzero(np.diff(codes)) == 1
    fresh = HandSources(solver)  # nothing is carried on where nothing was before
    assert fresh.of(0.0, solved(solver, made, seen))[k] == MEASURED


def test_a_hand_that_is_not_tracked_has_none() -> None:
    solver, made = relaxed(HAN)
    hand = replace(solved(solver, made, np.ones(19, dtype=np.bool_)), state=HandState.LOST)
    assert (HandSources(solver).of(0.0, hand) == UNKNOWN).all()


@pytest.fixture(scope="module")
def recording() -> tuple[list[TrackedFrame], list[TrackedFrame]]:
    """As solved live, and with its gaps filled."""
    engine = Engine(HAN)
    live = [engine.step(frame) for frame in islice(MarkerStream(Performer(HAN), 120.0, hidden=0.1).frames(), 300)]
    return live, list(filled(live, HAN))


def test_what_filling_changed_and_nothing_else_is_filled(
    recording: tuple[list[TrackedFrame], list[TrackedFrame]],
) -> None:
    live, shown = recording
    changed = 0
    for before, after in zip(live, shown, strict=True):
        for one, two in zip(before.hands, after.hands, strict=True):
            assert len(one.filled) == 0
            different = one.theta_rad != two.theta_rad
            assert set(np.flatnonzero(different)) <= set(np.flatnonzero(two.filled))
            changed += int(different.sum())
    assert changed > 1000


def test_left_hands_and_z_up_are_told_as_right_hands_and_y_up(
    recording: tuple[list[TrackedFrame], list[TrackedFrame]],
) -> None:
    _, shown = recording
    upright, turned = Sources(HAN), Sources(HAN)
    for frame in some(shown):
        here, there = upright.of(frame), turned.of(solved_to_z_up(frame))
        for key, codes in some(here.items()):
            np.testing.assert_array_equal(codes[N_ROOT_DOFS:], there[key][N_ROOT_DOFS:])


def test_shares_count_every_value_of_every_tracked_hand(
    recording: tuple[list[TrackedFrame], list[TrackedFrame]],
) -> None:
    live, shown = recording
    tracked = sum(hand.state is HandState.TRACKED for frame in shown for hand in frame.hands)
    told, live_told = source_shares(shown, HAN), source_shares(live, HAN)
    assert told.counts.shape == (N_DOFS, len(SOURCES))
    np.testing.assert_array_equal(told.counts.sum(axis=1), tracked)
    assert list(told.shares) == list(SOURCES) and sum(told.shares.values()) == pytest.approx(1.0)
    assert told.counts[:, FILLED].sum() == sum(hand.filled.sum() for frame in shown for hand in frame.hands)
    assert live_told.shares["filled"] == 0.0 and live_told.shares["prior"] > told.shares["prior"]
    for name, row in zip(DOF_NAMES, told.counts, strict=True):
        assert list(told.by_angle[name].values()) == pytest.approx(row / tracked)
    assert source_shares([], HAN).shares == {}
