from __future__ import annotations

import math
from dataclasses import replace

from app.live_numbers import SolverNumbers
from app.losses import RECENT_S, Losses
from app.session import SessionNumbers
from app.solver_thread import CHANGED
from app.stream_figures import StreamFigures
from app.take_summary import RecordingNumbers
from core.frames import Standstill
from devices.device import Health, Level


def numbers(poses: int = 0, why: str = "skipped to stay live", taken: dict[str, int] | None = None) -> SessionNumbers:
    solver = SolverNumbers(dropped={why: poses} if poses else {})
    recording = None
    if taken is not None:
        figures = StreamFigures(100, 90, taken)
        recording = RecordingNumbers("take", None, 1.0, 90, 1, 1.0, 1, math.inf, 0, 0, streams={"": figures})
    return SessionNumbers(True, "", solver, 0, 240, recording, ())


def of(health: Health, connected_s: float = 0.0) -> dict[tuple[str, float], Health]:
    """One stream that was connected then."""
    return {("natnet-1/markers", connected_s): health}


def test_nothing_lost_is_green():
    losses = Losses()
    losses.take(5.0, numbers(taken={}), of(Health(Level.GOOD)))
    assert (losses.total, losses.level(5.0), losses.tip(5.0, True)) == (0, Level.GOOD, "Nothing was lost.")
    assert math.isinf(losses.age_s(5.0))


def test_poses_are_amber_for_a_minute_and_their_count_stays():
    losses = Losses()
    for now_s, n in ((10.0, 1000), (20.0, 1870), (30.0, 1870)):
        losses.take(now_s, numbers(n), of(Health()))
    assert losses.level(30.0) is Level.WARNING
    tip = losses.tip(30.0, False)
    assert tip.startswith("1,870 poses not solved, skipped to stay live (since 20 s, the last 10 s ago).")
    assert "close other programs" in tip and "solve it again" not in tip
    assert "solve it again in review" in losses.tip(30.0, True)
    later = 20.0 + RECENT_S
    assert losses.level(later) is Level.GOOD and losses.total == 1870 and losses.age_s(later) == RECENT_S
    assert losses.tip(later, False) == "1,870 poses not solved, skipped to stay live (earlier, the last 60 s ago)."


def test_frames_are_red_whether_recorded_or_not():
    for now, health in (
        (numbers(), Health(lost=2)),
        (numbers(), Health(rejected=1)),
        (numbers(taken={"disk error": 4}), Health()),
    ):
        losses = Losses()
        losses.take(1.0, now, of(health))
        assert losses.level(1.0) is Level.PROBLEM
        assert "\n" in losses.tip(1.0, True)


def test_what_was_lost_because_nobody_read_is_told_apart():
    losses = Losses()
    losses.take(1.0, numbers(), of(Health(lost=12, standstills=(Standstill(1.0, 3.0, 2.0, 9),))))
    assert losses.total == 12 and losses.level(1.0) is Level.PROBLEM
    tip = losses.tip(1.0, True)
    assert "9 frames lost while Phalanx stood still" in tip and "3 frames lost before this machine" in tip
    assert "Keep the computer awake" in tip
    losses.take(2.0, numbers(), of(Health(), 1.5))
    losses.take(3.0, numbers(), of(Health(lost=4, standstills=(Standstill(9.0, 9.9, 0.9, 4),)), 1.5))
    assert losses.total == 16 and losses.tip(3.0, True).startswith("4 frames lost while Phalanx stood still")
    assert "Before it was last connected: 9 frames lost while Phalanx stood still" in losses.tip(3.0, True)


def test_red_goes_before_amber():
    losses = Losses()
    losses.take(1.0, numbers(5), of(Health(lost=3)))
    assert losses.level(2.0) is Level.PROBLEM and losses.total == 8
    losses.take(50.0, numbers(9), of(Health(lost=3)))
    assert losses.level(1.5 + RECENT_S) is Level.WARNING


def test_counters_that_begin_anew_add_up():
    losses = Losses()
    for now_s, lost in ((1.0, 5), (2.0, 0), (3.0, 2)):  # disconnected, then connected again
        losses.take(now_s, numbers(), of(Health(lost=lost)))
    assert losses.total == 7
    for now_s, taken in ((4.0, {"disk error": 3}), (5.0, None), (6.0, {"disk error": 3}), (7.0, {"disk error": 4})):
        losses.take(now_s, numbers(taken=taken), of(Health(lost=2)))
    assert losses.total == 14


def test_it_counts_from_the_last_change_of_profile_and_of_a_device_from_its_connect_and_keeps_the_rest_in_words():
    losses = Losses()
    losses.take(1.0, numbers(5), of(Health(lost=3)))
    assert losses.total == 8 and losses.level(1.0) is Level.PROBLEM
    changed = replace(numbers(5), changes=1)
    losses.take(2.0, changed, of(Health(lost=3)))
    assert losses.total == 0 and losses.level(2.0) is Level.GOOD and math.isinf(losses.age_s(2.0))
    tip = losses.tip(2.0, False)
    assert tip.startswith("Nothing was lost.\nBefore the last change of profile: ")
    assert "5 poses not solved, skipped to stay live" in tip and "3 frames lost before this machine" in tip
    losses.take(3.0, replace(numbers(7), changes=1), of(Health(lost=4)))
    assert losses.total == 3
    assert {line.split(" (")[0] for line in losses.tip(3.0, False).splitlines()[:2]} == {
        "2 poses not solved, skipped to stay live", "1 frames lost before this machine",
    }  # fmt: skip
    # Another device, whose counter is already further than the one before was.
    losses.take(4.0, replace(numbers(7), changes=1), of(Health(lost=6), 1.0))
    assert losses.total == 2 + 1 + 6
    *present, _, earlier, before = losses.tip(4.0, False).splitlines()
    assert {line.split(" (")[0] for line in present[:2]} == {
        "2 poses not solved, skipped to stay live", "6 frames lost before this machine",
    }  # fmt: skip
    assert earlier == "Before it was last connected: 1 frames lost before this machine."
    assert before.startswith("Before the last change of profile: ") and "3 frames lost before" in before
    # Connected again, and nothing was lost since.
    losses.take(5.0, replace(numbers(7), changes=1), of(Health(), 2.0))
    assert losses.total == 2 + 1 + 6 and losses.level(5.0) is Level.WARNING, "of the poses"


def test_frames_left_out_for_another_profile_are_no_loss():
    losses = Losses()
    losses.take(1.0, numbers(4, why=CHANGED), of(Health()))
    assert (losses.total, losses.level(1.0)) == (0, Level.GOOD)


def test_of_several_streams_each_loss_is_said_of_its_own_and_counts_by_itself():
    losses, one, two = Losses(), ("natnet-1/markers", 0.0), ("glove-1/right", 1.0)
    losses.take(1.0, numbers(), {one: Health(lost=3)})
    assert losses.tip(1.0, False).startswith("3 frames lost before this machine (since")
    losses.take(2.0, numbers(), {one: Health(lost=3), two: Health(lost=1)})
    assert losses.total == 3 + 1, "another device beside begins no count anew"
    losses.take(3.0, numbers(), {one: Health(lost=5), two: Health(lost=1, rejected=4)})
    assert losses.total == 5 + 1 + 4
    tip = losses.tip(3.0, False)
    assert "5 frames lost before this machine (natnet-1/markers) (since" in tip
    assert "1 frames lost before this machine (glove-1/right) (since" in tip
    assert "4 packets not understood (glove-1/right)" in tip
    assert "Before" not in tip
    figures = {key: StreamFigures(9, 7, {"disk error": 2}) for key, _ in (one, two)}
    taken = replace(numbers(taken={}).recording, streams=figures)
    losses.take(4.0, replace(numbers(), recording=taken), {one: Health(lost=5), two: Health(lost=1, rejected=4)})
    assert losses.total == 5 + 1 + 4 + 4
