"""What is shown of hidden fingers and lost hands: smooth, within the limits, and never at the cost of what was seen."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from core.frames import SIDES, HandFrame, HandState, MarkerFrame, Side, Times, TrackedFrame
from core.gap_filling import BEFORE_FRAMES, EASE_S, MAX_LOST_S, OFFLINE_S, GapFiller, filled, right_pose
from core.guesses import Guesses
from core.hand.mirror import mirror_theta, mirror_transforms
from core.kinematics.forward import joints_world
from core.kinematics.gaps import VELOCITY_FRAMES
from core.motion.performer import Performer
from core.motion.stream import LabelledFrame, MarkerStream
from core.profile import load_profile
from core.takes.reprocess import solve, solve_each
from core.track import tracking_solver
from tests.some import some

RATE_HZ = 120.0
HAN19 = replace(load_profile("han19"), scale=1.0)
PERFORMER = Performer(HAN19, seed=7)
NAMES = HAN19.layout.marker_names
INDEX = [f"right_{name}" for name in ("IndexMCP", "IndexPIP", "IndexTip")]


def sent(n: int, first_s: float = 0.0, **dressing: float) -> tuple[tuple[str, ...], list[LabelledFrame]]:
    stream = MarkerStream(PERFORMER, RATE_HZ, 7, **dressing)
    first = round(first_s * RATE_HZ)
    return stream.labels, list(itertools.islice(stream.labelled(), first, first + n))


def hidden(labels: tuple[str, ...], frames: list[LabelledFrame], gone: Callable[[int, str], bool]) -> list[MarkerFrame]:
    """The frames without the markers of which gone(frame, label) says so."""
    out = []
    for i, labelled in enumerate(frames):
        frame = labelled.frame
        keep = np.array([not gone(i, labels[t]) for t in labelled.truth])
        out.append(
            replace(frame, points_m=frame.points_m[keep], ids=frame.ids[keep], residuals_m=frame.residuals_m[keep])
        )
    return out


def busiest_s() -> float:
    """A second before the right index finger moves most in 0.3 s."""
    starts = np.arange(1.0, 50.0, 0.1)
    moves = [np.abs(PERFORMER.theta("right", t + 0.3) - PERFORMER.theta("right", t))[10:14].max() for t in starts]
    return float(starts[np.argmax(moves)]) - 1.0


BUSY_S = busiest_s()


def hands(frames: list[TrackedFrame], side: Side) -> list[HandFrame]:
    return [next(hand for hand in frame.hands if hand.side == side) for frame in frames]


def theta(frames: list[TrackedFrame], side: Side = "right") -> np.ndarray:
    return np.array([hand.theta_rad for hand in hands(frames, side)])


def pushed(frames: list[TrackedFrame], look_ahead_s: float) -> list[TrackedFrame]:
    filler = GapFiller(HAN19, look_ahead_s)
    out = [one for frame in frames for one in filler.push(frame)]
    return out + filler.flush()


def guessed(frames: list[TrackedFrame], side: Side = "right") -> np.ndarray:
    """(n, 20), by the rule alone."""
    guesses = Guesses(tracking_solver(HAN19))
    return np.array([guesses.of(right_pose(hand), hand.observed).copy() for hand in hands(frames, side)])


@pytest.fixture(scope="module")
def flickering() -> list[TrackedFrame]:
    """Two hands, every marker hidden a tenth of the time."""
    _, frames = sent(500, hidden=0.1, skin_m=0.0005)
    return solve([labelled.frame for labelled in frames], HAN19)


@pytest.fixture(scope="module")
def one_gap() -> tuple[list[TrackedFrame], range]:
    """The right index finger without its markers for 0.3 s while it moves."""
    labels, frames = sent(240, first_s=BUSY_S)
    gap = range(120, 156)
    return solve(hidden(labels, frames, lambda i, label: i in gap and label in INDEX), HAN19), gap


def test_without_gaps_every_frame_is_the_very_one() -> None:
    _, frames = sent(60)
    solved = solve([labelled.frame for labelled in frames], HAN19)
    for look_ahead_s in (0.0, 0.1, OFFLINE_S):
        assert all(a is b for a, b in some(zip(pushed(solved, look_ahead_s), solved, strict=True)))


@pytest.mark.parametrize("side", SIDES)
def test_only_guesses_are_touched_bit_for_bit(flickering: list[TrackedFrame], side: Side) -> None:
    whole = list(filled(flickering, HAN19))
    before, after = theta(flickering, side), theta(whole, side)
    changed = before.view(np.int64) != after.view(np.int64)
    guesses = guessed(flickering, side)
    assert not changed[:, :6].any()
    assert not (changed[:, 6:] & ~guesses).any()
    assert changed[:, 6:].sum() > 0.9 * guesses.sum()
    for a, b in zip(hands(flickering, side), hands(whole, side), strict=True):
        assert a.point.tobytes() == b.point.tobytes()
        assert a.markers_world_m[a.observed].tobytes() == b.markers_world_m[a.observed].tobytes()
        assert a.rms_m == b.rms_m
        assert a.theta_std[:6].tobytes() == b.theta_std[:6].tobytes()


@pytest.mark.parametrize("side", SIDES)
def test_joints_and_hidden_markers_follow_the_angles(flickering: list[TrackedFrame], side: Side) -> None:
    whole = list(filled(flickering, HAN19))
    limits = HAN19.hand.skeleton.limits_rad
    moved = 0
    for a, b in zip(hands(flickering, side), hands(whole, side), strict=True):
        right = mirror_theta(b.theta_rad) if side == "left" else b.theta_rad
        joints = joints_world(HAN19.hand.skeleton, right)
        joints = mirror_transforms(joints) if side == "left" else joints
        np.testing.assert_allclose(b.joints_world, joints, atol=1e-12)
        assert (b.theta_rad[6:] >= limits[:, 0]).all()
        assert (b.theta_rad[6:] <= limits[:, 1]).all()
        moved += not np.array_equal(a.markers_world_m, b.markers_world_m)
        for k in np.flatnonzero(~a.observed):  # where the marker sits on its bone is what it was
            joint = HAN19.layout.joints[k]
            on_bone = [np.linalg.solve(h.joints_world[joint], [*h.markers_world_m[k], 1.0]) for h in (a, b)]
            np.testing.assert_allclose(*on_bone, atol=1e-9)
        assert np.isfinite(b.theta_std).all()
        assert np.isfinite(b.marker_std_m).all()
        assert ((b.confidence >= 0.0) & (b.confidence <= 1.0)).all()
    assert moved > 100


def test_a_filled_gap_has_the_values_and_velocities_of_its_ends(one_gap: tuple[list[TrackedFrame], range]) -> None:
    solved, gap = one_gap
    whole = theta(list(filled(solved, HAN19)))[:, 6:]
    raw = theta(solved)[:, 6:]
    truth = np.array([PERFORMER.theta("right", BUSY_S + i / RATE_HZ) for i in range(len(solved))])[:, 6:]
    index = slice(4, 8)
    around = slice(gap.start - 3, gap.stop + 3)
    bend = np.abs(np.diff(whole[around, index], 2, axis=0)).max()
    assert np.abs(np.diff(raw[around, index], 2, axis=0)).max() > np.radians(4.0)  # what must not be seen
    assert bend < 1.5 * np.abs(np.diff(truth[around, index], 2, axis=0)).max() + np.radians(0.3)
    np.testing.assert_array_equal(whole[: gap.start], raw[: gap.start])
    np.testing.assert_array_equal(whole[gap.stop :], raw[gap.stop :])
    error = np.sqrt(np.mean((whole - truth)[gap, index] ** 2))
    assert error < 0.5 * np.sqrt(np.mean((raw - truth)[gap, index] ** 2))


def test_what_is_filled_says_how_sure_it_is(one_gap: tuple[list[TrackedFrame], range]) -> None:
    solved, gap = one_gap
    whole = hands(list(filled(solved, HAN19)), "right")
    tip = NAMES.index("IndexTip")
    live_std = [hand.marker_std_m[tip] for hand in hands(solved, "right")]
    std = np.array([hand.marker_std_m[tip] for hand in whole])
    middle = (gap.start + gap.stop) // 2
    assert whole[middle].point[tip] == -1
    assert std[gap.start] < std[middle] > std[gap.stop - 1]
    assert std[gap.stop - 1] < 0.5 * live_std[gap.stop - 1]  # live does not know that the finger is about to be seen


@pytest.mark.parametrize("side", SIDES)
def test_a_filled_angle_is_no_surer_than_what_its_curve_rests_on(flickering: list[TrackedFrame], side: Side) -> None:
    """Neither surer than both ends of its gap nor than the carried pose: one of them must speak for it."""
    whole = list(filled(flickering, HAN19))
    guesses = guessed(flickering, side)
    live, shown = (np.array([h.theta_std[6:] for h in hands(one, side)]) for one in (flickering, whole))
    checked = 0
    for column in range(20):
        for is_guess, run in itertools.groupby(enumerate(guesses[:, column]), key=lambda row: bool(row[1])):
            rows = [row for row, _ in run]
            if is_guess and rows[0] > 0 and rows[-1] + 1 < len(guesses):
                ends = shown[[rows[0] - 1, rows[-1] + 1], column].min()
                assert (shown[rows, column] >= np.minimum(live[rows, column], ends) * (1.0 - 1e-9)).all()
                checked += len(rows)
    assert checked > 500


@pytest.fixture(scope="module")
def slid() -> tuple[list[TrackedFrame], range]:
    """The marker on the index fingertip slides 4 mm a frame off its place, three frames long, and is then hidden."""
    labels, frames = sent(150, first_s=BUSY_S)
    gap, tip = range(60, 84), labels.index("right_IndexTip")
    joint = HAN19.layout.joints[NAMES.index("IndexTip")]
    sliding = []
    for i, labelled in enumerate(frames):
        frame = labelled.frame
        keep = np.array([not (i in gap and t == tip) for t in labelled.truth])
        points_m = frame.points_m.copy()
        if gap.start - 3 <= i < gap.start:
            out = PERFORMER.at(frame.times.device_s).joints_world["right"][joint, :3, 1]
            points_m[labelled.truth == tip] += 0.004 * (i - gap.start + 4) * out
        ids, residuals_m = labelled.truth[keep], frame.residuals_m[keep]
        sliding.append(replace(frame, points_m=points_m[keep], ids=ids, residuals_m=residuals_m))
    sides: dict[int, tuple[Side, int]] = {
        k: ("left" if label.startswith("left") else "right", NAMES.index(label.split("_", 1)[1]))
        for k, label in enumerate(labels)
    }
    return solve(sliding, HAN19, labels=sides), gap


def test_a_marker_that_slides_off_does_not_throw_the_curve(slid: tuple[list[TrackedFrame], range]) -> None:
    solved, gap = slid
    pip = 12  # bent backwards by it
    truth = np.array([PERFORMER.theta("right", BUSY_S + i / RATE_HZ)[pip] for i in range(len(solved))])
    raw, whole = theta(solved)[:, pip], theta(list(filled(solved, HAN19)))[:, pip]
    last = gap.start - 1
    wrong = raw[last] - truth[last]
    assert wrong < np.radians(-20.0)
    assert (raw[last] - raw[last - 2]) * RATE_HZ / 2.0 < -10.0  # [rad/s], which must not be believed
    assert abs((whole[gap.start] - whole[last]) * RATE_HZ) < 2.5
    off = (whole - truth)[gap.start : gap.stop]
    assert off.min() > wrong - np.radians(2.5)
    assert np.abs(off[-3:]).max() < np.radians(3.0)


def test_looking_ahead_fills_what_ends_in_sight_as_offline(flickering: list[TrackedFrame]) -> None:
    look_ahead_s = 0.25
    offline, live = list(filled(flickering, HAN19)), pushed(flickering, look_ahead_s)
    longest = round(look_ahead_s * RATE_HZ) - VELOCITY_FRAMES
    same = longer = 0
    for side in SIDES:
        guesses = guessed(flickering, side)
        a, b = theta(offline, side)[:, 6:], theta(live, side)[:, 6:]
        for column in range(20):
            numbered = enumerate(guesses[:, column])
            for is_guess, run in itertools.groupby(numbered, key=lambda row: bool(row[1])):
                rows = [row for row, _ in run]
                if is_guess and len(rows) <= longest and rows[0] > 0 and rows[-1] < len(guesses) - VELOCITY_FRAMES:
                    # Its ends may themselves be what a longer gap before it has left.
                    before = range(max(rows[0] - BEFORE_FRAMES, 0), rows[0])
                    if np.array_equal(a[before, column], b[before, column]):
                        np.testing.assert_array_equal(a[rows, column], b[rows, column])
                        same += 1
                elif is_guess:
                    longer += 1
    assert same > 20
    assert longer > 5


@pytest.mark.parametrize("look_ahead_s", [0.0, 0.05, 0.1, 0.2])
def test_frames_come_once_in_order_and_so_much_later(flickering: list[TrackedFrame], look_ahead_s: float) -> None:
    filler = GapFiller(HAN19, look_ahead_s)
    out: list[TrackedFrame] = []
    for frame in flickering:
        due = filler.push(frame)
        out += due
        for one in due:
            late_s = frame.times.device_s - one.times.device_s
            assert look_ahead_s - 1e-9 <= late_s < look_ahead_s + 1.5 / RATE_HZ
    out += filler.flush()
    assert [frame.sequence for frame in out] == [frame.sequence for frame in flickering]


@pytest.mark.parametrize("look_ahead_s", [0.0, 0.05, 0.1, 0.2])
def test_live_a_gap_too_long_ends_without_a_step(
    one_gap: tuple[list[TrackedFrame], range], look_ahead_s: float
) -> None:
    solved, gap = one_gap
    raw, live = theta(solved)[:, 6:], theta(pushed(solved, look_ahead_s))[:, 6:]
    truth = np.array([PERFORMER.theta("right", BUSY_S + i / RATE_HZ) for i in range(len(solved))])[:, 6:]
    step, bend = (np.abs(np.diff(raw, n, axis=0)).max() for n in (1, 2))
    assert step > np.radians(5.0)
    shown_step = np.abs(np.diff(live, axis=0) - np.diff(truth, axis=0)).max()
    assert shown_step < 0.35 * step
    assert np.abs(np.diff(live, 2, axis=0)).max() < 0.35 * bend
    settled = gap.stop + round(EASE_S * RATE_HZ) + 2
    np.testing.assert_array_equal(live[settled:], raw[settled:])
    np.testing.assert_array_equal(live[: gap.start], raw[: gap.start])
    seen = [d for d in range(20) if d not in range(4, 8) and not guessed(solved)[:, d].any()]
    np.testing.assert_array_equal(live[:, seen], raw[:, seen])


@pytest.mark.parametrize("side", SIDES)
def test_a_hand_lost_for_a_moment_goes_on_its_way(side: Side) -> None:
    labels, frames = sent(200, first_s=BUSY_S)
    gap = range(80, 110)
    solved = solve(hidden(labels, frames, lambda i, label: i in gap and label.startswith(side)), HAN19)
    lost = [i for i, hand in enumerate(hands(solved, side)) if hand.state is HandState.LOST]
    assert set(gap) <= set(lost)
    assert len(lost) < MAX_LOST_S * RATE_HZ
    whole = hands(list(filled(solved, HAN19)), side)
    truth = np.array([PERFORMER.theta(side, BUSY_S + i / RATE_HZ) for i in range(len(solved))])
    shown = np.array([hand.theta_rad for hand in whole])
    for i in lost:
        assert whole[i].state is HandState.TRACKED
        assert (whole[i].point == -1).all()
        assert np.isnan(whole[i].rms_m)
        assert np.isfinite(whole[i].theta_std).all()
        assert whole[i].marker_std_m.min() > 0.0
    held = hands(solved, side)[lost[0]].theta_rad[:3]
    filled_error = np.linalg.norm(shown[lost, :3] - truth[lost, :3], axis=1).max()
    assert filled_error < 0.5 * np.linalg.norm(held - truth[lost, :3], axis=1).max()
    jerk = np.linalg.norm(np.diff(shown[lost[0] - 2 : lost[-1] + 4, :3], 2, axis=0), axis=1).max()
    assert jerk < 0.001  # [m] of change of step: 14 m/s^2


def test_a_hand_that_comes_back_without_a_finger_was_on_its_way_all_the_same() -> None:
    labels, frames = sent(220, first_s=BUSY_S)
    gone = range(80, 105)

    def is_hidden(i: int, label: str) -> bool:
        return (i in gone and label.startswith("right")) or (gone.stop <= i < 200 and label in INDEX)

    solved = solve(hidden(labels, frames, is_hidden), HAN19)
    lost = [i for i, hand in enumerate(hands(solved, "right")) if hand.state is HandState.LOST]
    assert lost
    for look_ahead_s in (0.4, OFFLINE_S):
        whole = hands(pushed(solved, look_ahead_s), "right")
        assert all(whole[i].state is HandState.TRACKED for i in lost)
        assert all(np.isfinite(whole[i].theta_std).all() and np.isfinite(whole[i].marker_std_m).all() for i in lost)
        wrist = np.array([hand.theta_rad[:3] for hand in whole])
        jerk = np.linalg.norm(np.diff(wrist[lost[0] - 2 : lost[-1] + 4], 2, axis=0), axis=1).max()
        assert jerk < 0.001


def test_a_hand_lost_for_long_stays_lost() -> None:
    labels, frames = sent(200, first_s=BUSY_S)
    gap = range(60, 60 + round((MAX_LOST_S + 0.1) * RATE_HZ))
    solved = solve(hidden(labels, frames, lambda i, label: i in gap and label.startswith("left")), HAN19)
    for look_ahead_s in (0.1, OFFLINE_S):
        out = pushed(solved, look_ahead_s)
        assert [h.state for h in hands(out, "left")] == [h.state for h in hands(solved, "left")]
        lost = [i for i, hand in enumerate(hands(solved, "left")) if hand.state is HandState.LOST]
        assert all(hands(out, "left")[i] is hands(solved, "left")[i] for i in lost)


@pytest.mark.parametrize("wrong_s", [0.0, 1.0, float("nan")])
def test_a_clock_that_runs_back_ends_what_is_held(flickering: list[TrackedFrame], wrong_s: float) -> None:
    filler = GapFiller(HAN19, 0.2)
    frames = list(flickering)
    frames[300] = replace(frames[300], times=Times(wrong_s, wrong_s, wrong_s))
    out = [one for frame in frames for one in filler.push(frame)] + filler.flush()
    assert [frame.sequence for frame in out] == [frame.sequence for frame in frames]
    assert all(np.isfinite(hand.theta_rad).all() for frame in out for hand in frame.hands)


def test_solving_with_gaps_filled_keeps_points_and_poses_together() -> None:
    labels, frames = sent(150, first_s=BUSY_S)
    raw = hidden(labels, frames, lambda i, label: 60 <= i < 80 and label in INDEX)
    pairs = list(solve_each(raw, HAN19, fill=True))
    assert all(a is b for (a, _), b in zip(pairs, raw, strict=True))
    assert [a.sequence for a, _ in pairs] == [b.sequence for _, b in pairs]
    expected = list(filled(solve(raw, HAN19), HAN19))
    np.testing.assert_array_equal(theta([b for _, b in pairs]), theta(expected))


def test_every_performer_is_filled_as_alone(flickering: list[TrackedFrame]) -> None:
    """The same motion a moment later as a second person's: neither leads the other's fingers."""
    later = flickering[50:]
    both = [
        replace(one, hands=(*one.hands, *(replace(hand, performer=1) for hand in other.hands)))
        for one, other in zip(flickering, later, strict=False)
    ]
    alone = list(filled(flickering[: len(later)], HAN19)), list(filled(later, HAN19))
    for i, frame in some(enumerate(filled(both, (HAN19, HAN19)))):
        assert [hand.key for hand in frame.hands] == [(0, "left"), (0, "right"), (1, "left"), (1, "right")]
        for performer, whole in enumerate(alone):
            own = frame.hands[2 * performer : 2 * performer + 2]
            for hand, expected in some(zip(own, whole[i].hands, strict=True)):
                np.testing.assert_allclose(hand.theta_rad, expected.theta_rad, atol=1e-9)
