"""What is counted of a stream of any kind, and the words made of it."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from core.frames import Standstill, Times
from core.level import Level
from devices.common.clock_sync import ClockSync
from devices.common.counting import Arrival
from devices.common.health import Tally
from devices.common.hearing import Hearing
from devices.common.stamps import Came, Unstamped
from devices.common.timing import Timing, mapped

RATE_HZ = 100.0
ADVICE = "Look at the cable."


def fed(tally: Tally[int], numbers: list[int], begin_s: float = 10.0) -> list[int]:
    """Frames that arrive at their rate, their clock by their numbers; those that are handed on."""
    out = []
    for number in numbers:
        at_s = begin_s + number / RATE_HZ
        for frame, came, _ in tally.arrived(number, number, number / RATE_HZ, Came(at_s), RATE_HZ):
            tally.handed_on(Times(frame / RATE_HZ, came.latest_s - 0.002, came.latest_s))
            out.append(frame)
    return out


def test_received_and_lost_are_told_in_figures_and_in_words() -> None:
    tally: Tally[int] = Tally()
    kept = [n for n in range(200) if n not in (150, 151, 152)]
    assert fed(tally, kept) == kept
    now_s = 10.0 + 199 / RATE_HZ
    health = tally.health(Level.GOOD, "Fine.", now_s, Hearing())
    assert (health.received, health.lost, health.untimed, health.rejected) == (197, 3, 0, 0)
    assert health.rate_hz == pytest.approx(97, abs=2) and health.latency_s == pytest.approx(0.002)
    assert tally.losses(now_s, ADVICE) == f"3 frames lost on the way just now, 3 in all. {ADVICE}"
    assert tally.losses(now_s + 10, ADVICE) == "" and not tally.fresh(now_s + 10)
    assert tally.health(Level.GOOD, "", now_s + 10, Hearing()).rate_hz == 0.0


def test_what_was_lost_while_nobody_read_is_no_fault_of_the_way() -> None:
    tally: Tally[int] = Tally()
    fed(tally, list(range(100)))
    tally.standstills.append(Standstill(11.0, 13.0, 2.0))
    fed(tally, list(range(300, 310)))
    now_s = 13.1
    assert tally.losses(now_s, ADVICE).startswith("Phalanx stood still for 2.0 s")
    health = tally.health(Level.GOOD, "", now_s, Hearing())
    assert health.lost == health.unread == 200


def test_frames_of_unknown_time_are_counted_and_said() -> None:
    tally: Tally[int] = Tally()
    for frame, came, _ in tally.arrived(1, 1, math.nan, Came(5.0, 3.0), RATE_HZ):
        tally.handed_on(mapped(ClockSync(), math.nan, math.nan, came) if frame == 1 else Times(0.0, 0.0, 0.0))
    assert tally.without_time(5.1).startswith("1 frames came while this machine slept")
    assert tally.health(Level.GOOD, "", 5.1, Hearing()).untimed == 1
    assert "of unknown time" in tally.heard("", "port 7", "the glove")


def test_the_words_for_what_is_heard() -> None:
    tally, hearing = Tally[int](), Hearing()
    assert tally.heard(hearing.text(), "COM5", "the glove") == "COM5 hears nothing."
    hearing.frame("COM5")
    hearing.reject("COM5", "No header.", 1.0)
    assert hearing.text("BVH 1.1") == "COM5: 1 frames of BVH 1.1, 1 packets not understood"
    assert hearing.not_understood(2.0).endswith("A packet from COM5 was not understood. No header.")
    assert hearing.not_understood(7.0) == "" and hearing.not_used(1.0) == ""


def test_a_sample_without_a_clock_is_of_its_arrival() -> None:
    assert mapped(ClockSync(), math.nan, math.nan, Came(7.0)) == Times(math.nan, 7.0, 7.0) or math.isnan(
        mapped(ClockSync(), math.nan, math.nan, Came(7.0)).device_s
    )
    assert mapped(ClockSync(), 3.0, math.nan, Came(7.0)).host_s == 7.0
    assert not mapped(ClockSync(), 3.0, math.nan, Came(7.0, slack_s=1.0)).known


def test_times_never_run_backwards_and_a_loop_goes_on_from_its_arrival() -> None:
    timing = Timing()
    times = [timing.in_order(Times(s, s, s + 0.01)).host_s for s in (1.0, 2.0, 1.99, 3.0)]
    assert times == [1.0, 2.0, 2.0, 3.0]
    again = Times(1.0, 1.0, 4.0)  # stamped as the first pass was
    timing.restarted(again)
    assert timing.in_order(again).host_s == 4.0
    assert timing.in_order(Times(1.5, 1.5, 4.6)).host_s == 4.5
    unknown = replace(again, host_s=math.nan)
    assert timing.in_order(unknown) is unknown


def test_what_bears_no_stamp_came_just_now_or_since_nothing_waited() -> None:
    now = [100.0]
    unstamped = Unstamped(lambda: now[0])
    now[0] = 100.1
    assert unstamped.arrival() == Came(100.1, 0.0)
    now[0] = 109.0
    assert unstamped.arrival() == Came(109.0, 9.0)
    unstamped.emptied(108.9)
    assert unstamped.arrival() == Came(109.0, 0.0)


def test_a_restart_of_the_source_is_told_with_its_first_frame() -> None:
    tally: Tally[int] = Tally()
    fed(tally, list(range(100)))
    said = []
    for number in range(10):
        came = Came(11.0 + number / RATE_HZ)
        said += [what for *_, what in tally.arrived(number, number, number / RATE_HZ, came, RATE_HZ)]
    assert said == [Arrival.RESTART] + [Arrival.NEXT] * 9
