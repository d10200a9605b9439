"""A stage for tests of the session and the window: the built-in performer on a real NatNet server in this process."""

from __future__ import annotations

import itertools
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache

from core.frames import MarkerFrame
from core.motion.performer import Performer
from core.motion.stream import MarkerStream
from core.profile import load_profile
from devices.natnet.simulator import NatNetSimulator

RATE_HZ = 120.0
PATIENCE_S = 60.0


@cache
def performance() -> tuple[MarkerFrame, ...]:
    """Four seconds of two hands with 19 markers each."""
    stream = MarkerStream(Performer(load_profile("han19"), 1), RATE_HZ, 1, hidden=0.03, ghosts=0.3)
    return tuple(itertools.islice(stream.frames(), round(4 * RATE_HZ)))


@contextmanager
def server(command_port: int = 0, data_port: int = 0, rate_hz: float = RATE_HZ) -> Iterator[NatNetSimulator]:
    """The performance over and over, on any free ports or those given."""
    simulator = NatNetSimulator(
        performance(), rate_hz, command_port=command_port, data_port=data_port, loop=True, name="Stage"
    )
    simulator.start()
    try:
        yield simulator
    finally:
        simulator.close()


def settings_for(simulator: NatNetSimulator) -> dict[str, object]:
    """What a NatNet device needs to reach it."""
    return {
        "server": "127.0.0.1",
        "local": "127.0.0.1",
        "command_port": simulator.command_port,
        "data_port": simulator.data_port,
    }


def until(condition: Callable[[], object], what: str = "", poll: Callable[[float], None] = time.sleep) -> None:
    """Wait for a condition, a minute at most: nothing here is about speed."""
    deadline = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < deadline, f"waited {PATIENCE_S:g} s for {what or condition}"
        poll(0.02)


def own_threads() -> list[str]:
    """Threads of the session that stay. One that prepares the solver ends by itself, and is given the time."""
    deadline = time.monotonic() + PATIENCE_S
    while True:
        names = sorted(thread.name for thread in threading.enumerate() if thread.name.startswith("phalanx"))
        if not any("engine" in name or "errands" in name for name in names) or time.monotonic() > deadline:
            return names
        time.sleep(0.02)
