"""The capture of a real server, sent over a real socket to the client."""

from __future__ import annotations

import threading
from collections.abc import Iterator

import numpy as np
import pytest

from devices.device import Level
from devices.natnet.client import NatNetDevice
from devices.natnet.frames import decode_frame
from devices.natnet.protocol import unpack
from tests.devices.natnet.capture import printout
from tests.devices.natnet.replay import CLOCK_HZ, ReplayServer
from tests.devices.natnet.streams import free_port, need_loopback_multicast, read_while

GROUP = "239.255.42.99"


@pytest.fixture
def server() -> Iterator[ReplayServer]:
    need_loopback_multicast()
    server = ReplayServer(GROUP, free_port())
    yield server
    server.close()


def test_vendor_capture_over_a_socket(server: ReplayServer, capsys: pytest.CaptureFixture[str]) -> None:
    device = NatNetDevice(
        transmission="multicast", command_port=server.command_port, data_port=server.target[1], group=GROUP
    )
    try:
        server.rewind()
        device.open()
        device.start()
        playing = threading.Thread(target=server.play)
        playing.start()
        received, latencies, errors_s = [], {}, []
        for frame in read_while(device, playing.is_alive):
            wire = device.latest
            assert wire is not None and wire.number == frame.sequence
            received.append(frame)
            described = device.describe().details
            latencies[frame.sequence] = (described["System latency"], described["Software latency"])
            assert frame.times.device_s == wire.mid_exposure_ticks / CLOCK_HZ
            errors_s.append(frame.times.host_s - server.host_s(wire.mid_exposure_ticks))
        playing.join()
        health = device.health()
    finally:
        device.close()

    # Every frame arrives, once, in order.
    assert [frame.sequence for frame in received] == list(range(162734, 162734 + 518))
    assert (health.received, health.lost, health.rejected, health.reconnects) == (518, 0, 0, 0)
    assert health.level in (Level.GOOD, Level.WARNING)

    # Latencies equal the vendor's own figures.
    assert latencies[162734] == ("5.50 ms", "0.88 ms")
    for printed in printout():
        system, software = latencies[printed.number]
        assert abs(float(system.split()[0]) - float(printed.system_ms)) < 0.011  # ties are printed otherwise
        assert abs(float(software.split()[0]) - float(printed.software_ms)) < 0.011

    # The server's clock is mapped onto ours to within the echo's round trip.
    assert np.abs(errors_s).max() < 0.05

    # Each point once, with its id: five of a rigid body, listed twice by this server, and one loose.
    for frame, (_, packet) in zip(received, server.frames, strict=True):
        wire = decode_frame(unpack(packet)[1], (3, 0))
        assert np.array_equal(frame.points_m, wire.labelled["position"].astype(float))
        assert np.array_equal(frame.ids, wire.labelled["id"])
        assert [(body.id, body.name, body.tracked) for body in frame.rigid_bodies] == [(2, "RaceQuad", True)]
    assert received[0].ids.tolist() == [131073, 131074, 131075, 131076, 131077, 50007]
    with capsys.disabled():
        print(
            f"\n{len(received)} of 518 frames arrived over a socket; "
            f"clock mapped to within {1000 * np.abs(errors_s).max():.3f} ms"
        )


def test_listening_recognises_the_version_by_itself(server: ReplayServer) -> None:
    """No word to the server: the layout of its frames tells the version, points come without rigid body names."""
    device = NatNetDevice(transmission="listen only", data_port=server.target[1], group=GROUP, local="127.0.0.1")
    try:
        device.open()
        device.start()
        playing = threading.Thread(target=server.play_fast)
        playing.start()
        received = list(read_while(device, playing.is_alive))
        playing.join()
        assert [frame.sequence for frame in received] == list(range(162734, 162734 + 518))
        assert device.describe().details["Bitstream"] == "3.0"
        assert {body.name for frame in received for body in frame.rigid_bodies} == {"Rigid body 2"}
        assert device.health().lost == device.health().rejected == 0
    finally:
        device.close()
