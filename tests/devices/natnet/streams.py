"""Frames to send and helpers to receive them, for tests over real sockets."""

from __future__ import annotations

import socket
import time
from collections.abc import Callable, Iterator

import numpy as np
import pytest

from core.frames import MarkerFrame, RigidBody, Times
from devices.device import Device

PATIENCE_S = 30.0
"""Far beyond what anything here takes: a test that hangs fails instead."""


def make_frames(n: int, points: int = 20, seed: int = 1, first: int = 0) -> list[MarkerFrame]:
    """Points exact in float32, ids that change, two rigid bodies."""
    rng = np.random.default_rng(seed)
    made = []
    for i in range(first, first + n):
        quaternion = rng.normal(size=4)
        quaternion /= np.linalg.norm(quaternion)
        wand = RigidBody(7, "Wand", rng.normal(size=3).astype(np.float32).astype(float), quaternion, True, 0.0005)
        table = RigidBody(8, "Table", np.zeros(3), np.array([1.0, 0, 0, 0]), False, 0.0)
        made.append(
            MarkerFrame(
                sequence=i,
                times=Times(i / 120, i / 120, i / 120),
                points_m=rng.normal(size=(points, 3)).astype(np.float32).astype(float),
                ids=rng.choice(1_000_000, points, replace=False).astype(np.int64),
                residuals_m=rng.uniform(0, 0.001, points).astype(np.float32).astype(float),
                rigid_bodies=(wand, table),
            )
        )
    return made


def assert_same(received: MarkerFrame, sent: MarkerFrame) -> None:
    """Points, ids, residuals bit for bit; bodies as float32 carries them."""
    assert received.points_m.dtype == np.float64
    assert received.ids.dtype == np.int64
    assert np.array_equal(received.points_m, sent.points_m)
    assert np.array_equal(received.ids, sent.ids)
    assert np.array_equal(received.residuals_m, sent.residuals_m)
    for got, body in zip(received.rigid_bodies, sent.rigid_bodies, strict=True):
        assert (got.id, got.name, got.tracked) == (body.id, body.name, body.tracked)
        assert np.array_equal(got.position_m, body.position_m)
        assert np.allclose(got.quaternion_wxyz, body.quaternion_wxyz, atol=1e-7)
        assert got.mean_error_m == np.float32(body.mean_error_m)


def next_frame(device: Device, timeout_s: float) -> MarkerFrame | None:
    """The next frame of points, waiting at most `timeout_s`; comparisons of the clocks are passed over."""
    end = time.monotonic() + timeout_s
    while (sample := device.read(max(end - time.monotonic(), 0.0))) is not None:
        if isinstance(sample.frame, MarkerFrame):
            return sample.frame
    return None


def read_while(device: Device, busy: Callable[[], bool]) -> Iterator[MarkerFrame]:
    """Frames until `busy` is False and the stream has run dry."""
    end = time.monotonic() + PATIENCE_S
    while time.monotonic() < end:
        going = busy()
        frame = next_frame(device, 0.2)
        if frame is not None:
            yield frame
        elif not going:
            return
    raise AssertionError(f"the stream did not end: {device.health()}")


def read_until(device: Device, done: Callable[[], bool]) -> list[MarkerFrame]:
    """Frames until `done`."""
    end = time.monotonic() + PATIENCE_S
    got = []
    while not done():
        assert time.monotonic() < end, f"never happened: {device.health()}"
        frame = next_frame(device, 0.05)
        if frame is not None:
            got.append(frame)
    return got


def free_port() -> int:
    """A UDP port that nobody holds just now."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def need_loopback_multicast() -> None:
    """Skips where the machine refuses multicast on its loopback interface."""
    group = "239.255.42.98"
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender,
    ):
        try:
            receiver.bind(("", 0))
            request = socket.inet_aton(group) + socket.inet_aton("127.0.0.1")
            receiver.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, request)
            receiver.settimeout(2)
            sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton("127.0.0.1"))
            sender.sendto(b"?", (group, receiver.getsockname()[1]))
            receiver.recv(1)
        except OSError as error:
            pytest.skip(f"this machine refuses multicast over loopback ({error})")
