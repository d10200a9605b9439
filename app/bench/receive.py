"""Frames over loopback: sent, received, lost, and how late, by the real client and a server in its own process."""

from __future__ import annotations

import argparse
import time
from typing import Any

import numpy as np

from app.loopback import next_frame, served
from core.errors import DeviceError

SETTLE_S = 0.5


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of this benchmark."""
    parser.add_argument("--rate", metavar="HZ", type=float, default=240.0, help="frames per second; default 240")
    parser.add_argument("--seconds", metavar="S", type=float, default=10.0, help="how long [s]; default 10")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Two hands of 19 markers; latency is from exposure to arrival."""
    with served(["--rate", str(arguments.rate)]) as device:
        latencies = _receive(device, arguments.seconds)
        health = device.health()
    latency_s = np.asarray(latencies)
    figures = {
        "rate_hz": arguments.rate,
        "received": len(latencies),
        "lost": health.lost,
        "latency_median_s": float(np.median(latency_s)),
        "latency_p99_s": float(np.percentile(latency_s, 99)),
        "latency_max_s": float(latency_s.max()),
    }
    print(
        f"{figures['received']:,} frames at {arguments.rate:g} Hz, {health.lost:,} lost; exposure to arrival: median "
        f"{1e3 * figures['latency_median_s']:.2f} ms, 99 % below {1e3 * figures['latency_p99_s']:.2f} ms"
    )
    return figures


def _receive(device: Any, seconds: float) -> list[float]:
    """Latency of every frame [s]. Raises DeviceError if none comes."""
    device.start()
    latencies: list[float] = []
    settled = time.monotonic() + SETTLE_S
    while time.monotonic() < settled:  # what waited in the socket while the connection was made
        next_frame(device, 0.01)
    until = settled + seconds
    while time.monotonic() < until:
        frame = next_frame(device, 0.1)
        if frame is not None:
            latencies.append(frame.times.latency_s)
    if not latencies:
        raise DeviceError("No frame arrived.", device.health().reason)
    return latencies
