"""One verdict on a take: what is red, what amber, and in which words."""

from dataclasses import replace

import numpy as np
import pytest

from core.frames import Standstill
from core.level import Level
from core.takes.holes import Holes
from core.takes.take import BY_CHOICE, TakeCounts
from core.takes.verdict import Account, verdict_of


def account(frames=6000, solved=None, seconds=50.0, holes=(), **counts):
    """holes: (begin [s], end [s], frames) of each."""
    solved = frames if solved is None else solved
    dropped = counts.pop("dropped", {})
    received = frames + sum(dropped.values())
    begin, end, missing = zip(*holes, strict=True) if holes else ((), (), ())
    return Account(
        frames, solved, TakeCounts(received, frames, dropped, solved=solved, **counts),
        Holes(np.array(begin), np.array(end), np.array(missing, dtype=np.int64)), seconds,
    )  # fmt: skip


def test_a_good_take_is_green():
    verdict = verdict_of(account(tracked={"left": 6000, "right": 0}))
    assert (verdict.level, verdict.headline, verdict.texts) == (Level.GOOD, "6,000 frames, none lost", ())


def test_frames_left_out_by_choice_are_said_and_not_held_against_a_take():
    verdict = verdict_of(account(6000, 1500, unsolved={BY_CHOICE: 4500}))
    assert (verdict.level, verdict.texts, verdict.whole) == (Level.GOOD, (), True)
    assert verdict.headline == "6,000 frames, none lost, 4,500 without a pose by choice"
    mixed = verdict_of(account(6000, 1480, unsolved={BY_CHOICE: 4500, "skipped to stay live": 20}))
    assert mixed.texts == ("20 of 1,500 frames have no pose (skipped to stay live: 20). Solve it again in review.",)
    part = verdict_of(account(532, 459, unsolved={"skipped to stay live": 222}))  # of a take that was cut
    why = "of the whole recording: skipped to stay live: 222"
    assert part.texts == (f"73 of 532 frames have no pose ({why}). Solve it again in review.",)
    short = verdict_of(account(2, 0, unsolved={BY_CHOICE: 2}))  # of a take shorter than from one to the next
    assert (short.level, short.texts) == (Level.GOOD, ())
    counted = verdict_of(replace(account(90, 22, unsolved={BY_CHOICE: 75}, dropped={"writer queue full": 10})))
    assert counted.headline == "10 dropped"  # some of those left out were dropped: no more are without a pose than are


@pytest.mark.parametrize(
    ("level", "headline", "told"),
    [
        (Level.PROBLEM, "34.4 s without frames, about 3,440", account(1260, 1260, 47.0, [(5.0, 39.4, 3440)])),
        (Level.PROBLEM, "0.60 s without frames, about 60", account(100_000, 100_000, 1000.0, [(5.0, 5.6, 60)])),
        (Level.WARNING, "0.06 s without frames, about 6", account(100_000, 100_000, 1000.0, [(5.0, 5.06, 6)])),
        (Level.WARNING, "not solved", account(431, 0)),
        (Level.WARNING, "12 without a pose", account(431, 419, unsolved={"skipped to stay live": 12})),
        (Level.WARNING, "12 without a pose", account(431, 100, unsolved={BY_CHOICE: 319, "skipped to stay live": 12})),
        (Level.WARNING, "not solved", account(431, 0, unsolved={"solver starting": 431})),
        (Level.WARNING, "no hand tracked", account(431, tracked={"left": 0, "right": 0})),
        (Level.WARNING, "3 never arrived", account(lost=3)),
        (Level.PROBLEM, "600 never arrived", account(lost=600)),
        (Level.PROBLEM, "3 dropped", account(dropped={"disk error": 3})),
        (Level.WARNING, "2 unreadable", account(rejected=2)),
        (Level.WARNING, "12 of unknown time", replace(account(), untimed=12)),
        (Level.PROBLEM, "no frames, 5.0 s without frames", account(0, 0, 5.0, [(0.0, 5.0, 0)])),
        (Level.WARNING, "not sealed", Account(100, 100, None, sealed=False)),
        (Level.PROBLEM, "damaged, not sealed", Account(100, 100, None, sealed=False, damage=("The file is damaged.",))),
        (Level.PROBLEM, "recording failed", Account(100, 100, None, problem="The disk failed.")),
        (Level.PROBLEM, "counts do not balance", Account(100, 100, TakeCounts(101, 100, solved=100))),
    ],
)
def test_what_is_wrong_is_said_the_gravest_first(level, headline, told):
    verdict = verdict_of(told)
    assert (verdict.level, verdict.headline) == (level, headline)
    assert verdict.texts and all(text[0].isupper() or text[0].isdigit() for text in verdict.texts)
    order = [finding.level is Level.PROBLEM for finding in verdict.findings]
    assert order == sorted(order, reverse=True)


def test_frames_that_the_file_lost_are_not_blamed_on_the_device():
    hole = Holes(np.array([1.0]), np.array([41.0]), np.array([4800]), came=np.array([True]))
    verdict = verdict_of(Account(120, 120, None, hole, 42.0, False, ("Cut.",), 4700, 4700))
    assert verdict.level is Level.PROBLEM and "without frames" not in verdict.headline
    assert "4,700 raw and 4,700 solved frames cannot be read." in verdict.texts


def test_frames_that_a_cut_file_lost_are_not_blamed_on_the_device_either():
    told = account(120, 120, 42.0, [(0.0, 1.0, 120)], dropped={"damaged file": 130})
    verdict = verdict_of(replace(told, holes=replace(told.holes, came=np.array([True]))))
    assert verdict.level is Level.PROBLEM and "without frames" not in verdict.headline


@pytest.mark.parametrize(
    ("told", "text"),
    [
        (
            Account(0, 0, TakeCounts(0, 0)),
            "It holds no frames. Check in Devices that they come in, then record it again.",
        ),
        (
            Account(0, 0, TakeCounts(600, 0, {"damaged file": 600})),
            "None of the 600 frames that came is in it. Record it again.",
        ),
        (Account(0, 0, None, sealed=False, damage=("Cut.",)), "No frame of it can be read. Record it again."),
    ],
)
def test_why_there_are_no_frames_and_what_to_do_is_said(told, text):
    verdict = verdict_of(told)
    assert text in verdict.texts and not verdict.readable and not verdict.whole


@pytest.mark.parametrize(
    ("told", "whole"),
    [
        (account(), True),
        (account(431, 0), True),  # poses can be made again
        (account(431, 419, unsolved={"skipped to stay live": 12}), True),
        (account(lost=1), False),
        (account(rejected=1), False),
        (account(dropped={"disk error": 1}), False),
        (account(holes=[(5.0, 5.06, 6)]), False),
        (Account(100, 100, None, sealed=False), False),
        (Account(100, 100, TakeCounts(100, 100, solved=100), faults=("A mark is out of order.",)), False),
    ],
)
def test_whole_is_a_take_of_which_nothing_is_lost_for_good(told, whole):
    verdict = verdict_of(told)
    assert verdict.readable and verdict.whole == whole


def test_frames_of_a_standstill_are_counted_once_and_with_one_reason():
    still = Standstill(8.0, 20.0, 12.0, 1200)
    counts = TakeCounts(3600, 3600, lost=1203, solved=3600, standstills=(still,))
    holes = Holes(np.array([10.0, 40.0]), np.array([20.0, 42.0]), np.array([1200, 240])).owned([still])
    verdict = verdict_of(Account(3600, 3600, counts, holes, 60.0))
    assert verdict.texts == (
        "Phalanx stood still for 12.0 s (the computer slept, or the program was halted): 1,200 frames of that time are "
        "lost. Keep the computer awake while it captures.",
        "2.0 s without frames, about 240, in one piece: nothing came from the device.",
        "3 frames were lost on the network before this machine.",
    )
    assert verdict.level is Level.PROBLEM
    assert verdict.headline == (
        "Phalanx stood still for 12.0 s, 1,200 frames lost, 2.0 s without frames, about 240, 3 never arrived"
    )


def test_a_standstill_that_took_nothing_is_no_fault_of_the_take():
    counts = TakeCounts(3600, 3600, solved=3600, standstills=(Standstill(8.0, 9.0, 1.0),))
    assert verdict_of(Account(3600, 3600, counts, length_s=30.0)).level is Level.GOOD


def test_where_a_device_has_no_numbers_the_clock_tells_what_a_standstill_took():
    still = Standstill(8.0, 20.0, 12.0)
    counts = TakeCounts(3600, 3600, solved=3600, standstills=(still, Standstill(50.0, 51.0, 1.0)))
    holes = Holes(np.array([10.0]), np.array([20.0]), np.array([1200])).owned([still])
    (text,) = verdict_of(Account(3600, 3600, counts, holes, 60.0)).texts
    assert text.startswith("Phalanx stood still 2 times, for 13.0 s in all (the computer slept, or the program was")
    assert "about 1,200 frames of that time are lost" in text


def test_why_poses_are_missing_and_what_to_do_is_said():
    (text,) = verdict_of(account(431, 419, unsolved={"skipped to stay live": 12})).texts
    assert text == "12 of 431 frames have no pose (skipped to stay live: 12). Solve it again in review."


def test_poses_that_went_with_their_frames_are_told_with_them():
    told = account(500, 444, dropped={"damaged file": 105}, unsolved={"skipped to stay live": 55, "damaged file": 106})
    (text,) = (text for text in verdict_of(told).texts if "pose" in text)
    assert text.startswith("56 of 500 frames have no pose (skipped to stay live: 55; damaged file: 1).")
