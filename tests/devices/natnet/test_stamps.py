"""The kernel's stamps by our clock, whatever becomes of the wall clock while nobody reads them."""

from __future__ import annotations

import random
from dataclasses import dataclass, replace

import pytest

from core.frames import Standstill
from devices.common.clock_sync import ClockSync
from devices.common.stamps import Stamps
from devices.common.udp import Datagram
from devices.natnet import protocol
from devices.natnet.client import NatNetDevice
from devices.natnet.conversation import Conversation
from devices.natnet.frames import encode_frame
from devices.natnet.protocol import Message
from devices.natnet.simulator import CLOCK_HZ, NatNetSimulator
from tests.devices.natnet.served import client, simulator
from tests.devices.natnet.streams import make_frames, read_until
from tests.some import some


@dataclass
class Clocks:
    """A machine's two clocks [s]: the wall clock may be set, and ours stands still while the machine sleeps."""

    ours_s: float = 5000.0
    ahead_s: float = 1.7e9

    def run(self, seconds: float) -> None:
        self.ours_s += seconds

    def sleep(self, seconds: float) -> None:
        self.ahead_s += seconds

    set = sleep

    def wall_ns(self) -> int:
        return round((self.ours_s + self.ahead_s) * 1e9)

    def stamps(self) -> Stamps:
        return Stamps(self.wall_ns, lambda: self.ours_s)

    def receive(self, n: int, step_s: float) -> list[tuple[float, int]]:
        """n datagrams: when each came, and its stamp."""
        came = []
        for _ in range(n):
            self.run(step_s)
            came.append((self.ours_s, self.wall_ns()))
        return came


def test_a_stamp_of_any_age_is_believed() -> None:
    clocks = Clocks()
    stamps = clocks.stamps()
    came = clocks.receive(100, 1.0)
    clocks.run(3600.0)
    for at_s, stamp in some(came):
        arrival = stamps.arrival(stamp)
        assert arrival.slack_s == 0.0
        assert abs(arrival.latest_s - at_s) < 1e-5


@pytest.mark.parametrize("by_s", [3600.0, -3600.0, 86_400 * 365.0])
def test_a_wall_clock_that_was_set_is_no_age(by_s: float) -> None:
    clocks = Clocks()
    stamps = clocks.stamps()
    came = clocks.receive(200, 0.1)
    clocks.set(by_s)
    came += clocks.receive(200, 0.1)
    for at_s, stamp in came:
        arrival = stamps.arrival(stamp)
        assert arrival.slack_s == 0.0
        assert abs(arrival.latest_s - at_s) < 1e-4
    stamps.emptied(clocks.ours_s)
    ((at_s, stamp),) = clocks.receive(1, 1.0)
    assert abs(stamps.arrival(stamp).latest_s - at_s) < 1e-4


def test_what_waited_while_this_machine_slept() -> None:
    """Our clock stood still; some came before, some after."""
    clocks = Clocks()
    stamps = clocks.stamps()
    came = clocks.receive(50, 0.01)
    clocks.sleep(7 * 3600.0)
    came += clocks.receive(50, 0.01)
    assert all(abs(stamps.arrival(stamp).latest_s - at_s) < 1e-4 for at_s, stamp in some(came))


@pytest.mark.parametrize("by_s", [5.0, -5.0, 0.05, -0.05])
def test_where_a_stamp_cannot_tell_it_says_so(by_s: float) -> None:
    """The clock was set by less than the time that nobody read: on which side of it some came is not known."""
    clocks = Clocks()
    stamps = clocks.stamps()
    came = clocks.receive(100, 0.1)
    clocks.set(by_s)
    came += clocks.receive(100, 0.1)
    told = [(at_s, stamps.arrival(stamp)) for at_s, stamp in came]
    for at_s, arrival in told:
        assert arrival.latest_s - arrival.slack_s - 1e-4 <= at_s <= arrival.latest_s + 1e-4
        assert arrival.slack_s < abs(by_s) + 1e-4
    assert any(arrival.slack_s > 0.9 * abs(by_s) for _, arrival in told)
    stamps.emptied(clocks.ours_s)
    assert all(stamps.arrival(stamp).slack_s == 0.0 for _, stamp in clocks.receive(10, 0.1))


def test_bounds_hold_whatever_happens() -> None:
    chance = random.Random(3)
    for _ in range(300):
        clocks = Clocks()
        stamps = clocks.stamps()
        came = clocks.receive(20, chance.choice([0.001, 0.1, 1.0]))
        clocks.set(chance.choice([-1, 1]) * 10 ** chance.uniform(-2, 6))
        came += clocks.receive(20, chance.choice([0.001, 0.1, 1.0]))
        for at_s, stamp in some(came):
            clocks.run(1e-5)
            arrival = stamps.arrival(stamp)
            assert arrival.latest_s <= clocks.ours_s
            assert arrival.latest_s - arrival.slack_s - 1e-3 <= at_s <= arrival.latest_s + 1e-3


def settled(server: NatNetSimulator) -> tuple[NatNetDevice, Conversation]:
    """A client that has all answers, and its conversation, with a clock that knows nothing yet."""
    device = client(server)
    device.open()
    device.start()
    talk = device._conversation
    assert talk is not None
    read_until(device, lambda: talk.settled)
    talk.clock = ClockSync()
    return device, talk


def test_frames_after_a_sleep_of_this_machine_are_timed_at_once() -> None:
    """The server's clock has gone on for a minute, ours has not: the echoes of before do not hold, and until others
    are answered the arrival tells."""
    with simulator(make_frames(200), 120.0) as server:
        device, talk = settled(server)
        talk.clock.echo(999.9, 999.9003, 999.9005)
        got = []
        for frame in make_frames(200):
            slept_s = 60.0 if frame.sequence >= 100 else 0.0
            number = frame.sequence + round(slept_s * 120)
            exposed_s = 1000 + frame.sequence / 120
            record = replace(
                server._record(number, frame, exposed_s + slept_s),
                transmit_ticks=int((exposed_s + slept_s + 0.005) * CLOCK_HZ),
            )
            packet = protocol.pack(Message.FRAMEOFDATA, encode_frame(record, (4, 1)))
            if frame.sequence == 150:
                talk.clock.echo(exposed_s, exposed_s + 60.0003, exposed_s + 0.0005)
                talk.clock.echo(exposed_s + 0.01, exposed_s + 60.0103, exposed_s + 0.0105)
            datagram = Datagram(packet, "127.0.0.1", exposed_s + 0.0052, True, server.data_port)
            got += [(exposed_s, one) for one in device._take(datagram, talk)]
        health = device.health()
        device.close()
    assert len(got) == 200
    assert max(abs(frame.times.host_s - exposed_s) for exposed_s, frame in got) < 0.001
    assert (health.lost, health.untimed) == (7200, 0)


@pytest.mark.parametrize(
    ("gap_s", "from_s", "to_s", "asleep_s", "own"),
    [
        (60.0, 0.0, 0.05, 59.9, True),  # the machine slept, and our clock with it
        (60.0, 0.0, 0.05, 55.0, True),  # its network took some seconds to come back
        (20.0, 0.0, 20.0, 0.0, True),  # the program was halted
        (20.0, -3.0, 20.0, 0.0, True),  # the first three seconds waited, and were read
        (60.0, 30.0, 31.0, 0.0, False),  # a cable was out for a minute, and for a second of it nobody read
        (20.0, -9.0, -2.0, 0.0, False),  # it came back, and then the cable was pulled
        (20.0, 0.0, 0.0, 0.0, False),
    ],
)
def test_whose_fault_a_loss_is(gap_s: float, from_s: float, to_s: float, asleep_s: float, own: bool) -> None:
    """from_s, to_s: when nobody read, from the last frame before the gap, by our clock, which stood still meanwhile."""
    clock_gap_s = gap_s - asleep_s
    with simulator(make_frames(200), 120.0) as server:
        device, talk = settled(server)
        for frame in make_frames(200):
            after = frame.sequence >= 100
            if frame.sequence == 100:
                device._intake.tally.standstills.append(
                    Standstill(1000 + 99 / 120 + from_s, 1000 + 99 / 120 + to_s, to_s - from_s + asleep_s)
                )
            exposed_s = 1000 + frame.sequence / 120
            record = replace(
                server._record(frame.sequence + after * round(gap_s * 120), frame, exposed_s + after * gap_s),
                transmit_ticks=int((exposed_s + after * gap_s + 0.005) * CLOCK_HZ),
            )
            packet = protocol.pack(Message.FRAMEOFDATA, encode_frame(record, (4, 1)))
            arrival_s = exposed_s + 0.0052 + after * clock_gap_s
            device._take(Datagram(packet, "127.0.0.1", arrival_s, True, server.data_port), talk)
        health = device.health()
        device.close()
    assert (health.received, health.lost) == (200, round(gap_s * 120))
    assert health.unread == (health.lost if own else 0)
