"""The server's clock by ours."""

from __future__ import annotations

import math
import random

import pytest

from devices.common.clock_sync import DRIFT, ClockSync


def test_nothing_known_is_now() -> None:
    clock = ClockSync()
    assert clock.host_s(5.0, 123.0) == 123.0
    assert not clock.synchronised
    assert math.isnan(clock.round_trip_s)


def test_the_shortest_round_trip_counts() -> None:
    """The error is at most half the shortest round trip, whatever the others were."""
    chance = random.Random(1)
    for _ in range(200):
        clock, offset, shortest = ClockSync(), chance.uniform(-1e5, 1e5), math.inf
        for i in range(10):
            there, back = chance.uniform(1e-5, 5e-3), chance.uniform(1e-5, 5e-3)
            sent = 100 + 0.01 * i
            clock.echo(sent, sent + there + offset, sent + there + back)
            shortest = min(shortest, there + back)
        assert abs(clock.host_s(100.0 + offset, 100.1) - 100.0) <= shortest / 2 + DRIFT * 0.2
        assert math.isclose(clock.round_trip_s, shortest, rel_tol=1e-6)


def test_drift_is_followed() -> None:
    """Clocks that part by 50 ppm for an hour: never worse than half a trip and the age of the echo used."""
    clock, rate = ClockSync(), 1 + 50e-6
    for i in range(7200):
        sent = 0.5 * i
        clock.echo(sent, (sent + 0.0004) * rate, sent + 0.0008)
        assert abs(clock.host_s((sent + 0.1) * rate, sent + 0.1) - (sent + 0.1)) < 0.001


def test_a_server_started_anew_is_noticed() -> None:
    clock = ClockSync()
    clock.echo(0.0, 5000.0005, 0.001)
    clock.echo(0.5, 3.001, 0.502)
    assert clock.doubted  # it alone may be spoilt
    assert clock.host_s(5001.0, 0.6) == 1.0
    clock.echo(0.515, 3.016, 0.517)
    assert not clock.doubted
    assert abs(clock.host_s(3.0, 0.6) - 0.5) < 0.002


@pytest.mark.parametrize("server_s", [0.0, 1e9, 100.58])
def test_an_echo_spoilt_once_changes_nothing(server_s: float) -> None:
    clock = ClockSync()
    for k in range(20):
        clock.echo(0.5 * k, server_s if k == 7 else 100.0005 + 0.5 * k, 0.5 * k + 0.001)
        assert abs(clock.host_s(100.0 + 0.5 * k, 0.5 * k + 0.01) - 0.5 * k) < 0.001


def test_the_first_echo_may_be_spoilt() -> None:
    clock = ClockSync()
    for k in range(3):
        clock.echo(0.015 * k, 7.0 if k == 0 else 100.0005 + 0.015 * k, 0.015 * k + 0.001)
    assert abs(clock.host_s(100.0, 0.1)) < 0.001


@pytest.mark.parametrize("off_s", [0.58, -0.58, 0.02, 1e6, -1e6])
@pytest.mark.parametrize("at", [0, 1, 50])
@pytest.mark.parametrize("echoes", [False, True])
def test_a_stamp_spoilt_once_shifts_no_times(off_s: float, at: int, echoes: bool) -> None:
    clock = ClockSync()
    if echoes:
        clock.echo(-0.1, 1000.0 - 0.0995, -0.099)
    for k in range(500):
        sent = k / 100
        clock.packet(1000.0 + sent + (off_s if k == at else 0.0), sent + 0.001)
        if k > max(at, 2):
            assert abs(clock.host_s(1000.0 + sent, sent + 0.001) - sent) < 0.0015


def test_answers_from_the_past_are_ignored() -> None:
    clock = ClockSync()
    clock.echo(10.0, 0.0, 9.0)
    assert not clock.synchronised


def test_packets_bound_the_offset() -> None:
    """A packet cannot arrive before it was sent, whatever a lopsided echo says."""
    clock = ClockSync()
    clock.echo(0.0, 1000.0, 0.004)  # all of the round trip was on the way back
    assert abs(clock.host_s(1000.0, 0.0) - 0.002) < 1e-9
    clock.packet(1000.1, 0.1001)
    assert abs(clock.host_s(1000.1, 0.1001) - 0.1001) < 1e-5


def test_stamps_of_another_day_bound_nothing() -> None:
    clock = ClockSync()
    clock.echo(0.0, 1000.0005, 0.001)
    clock.packet(99999.0, 0.1)
    assert abs(clock.host_s(1000.1, 0.1) - 0.1) < 0.001


def test_without_echoes_the_quickest_packet_counts() -> None:
    chance = random.Random(2)
    clock, delays = ClockSync(), [chance.uniform(0.001, 0.02) for _ in range(100)]
    for i, delay in enumerate(delays):
        clock.packet(0.01 * i, 50 + 0.01 * i + delay)
    error = clock.host_s(1.0, 51.0 + delays[-1]) - 51.0
    assert min(delays) - 1e-9 <= error <= min(delays) + DRIFT * 1.1


def test_a_clock_set_back_is_followed() -> None:
    """A take that is looped begins its timestamps again."""
    clock = ClockSync()
    clock.packet(60.0, 100.0)
    clock.packet(0.0, 100.1)
    clock.packet(0.01, 100.11)
    assert abs(clock.host_s(0.01, 100.11) - 100.11) < 1e-9


def test_what_cannot_have_arrived_yet_is_not_explained() -> None:
    """This machine slept for a minute, and its clock with it: the server's has gone on."""
    clock = ClockSync()
    clock.echo(0.0, 1000.0005, 0.001)
    assert clock.explains(1010.0, 10.001)
    assert not clock.explains(1070.0, 10.001)
    clock.echo(10.1, 1070.1005, 10.101)
    clock.echo(10.115, 1070.1155, 10.116)
    assert clock.explains(1070.2, 10.201)
    assert abs(clock.host_s(1070.2, 10.201) - 10.2) < 0.001
