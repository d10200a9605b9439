"""A long take at the highest rate of the cameras: whether memory stays as it is, of the session and of the server."""

from __future__ import annotations

import argparse
import gc
import os
import subprocess
import sys
import tempfile
import time
import tracemalloc
from collections import Counter
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from app.loopback import Served, serving
from app.process_memory import memory_of, trim
from core.errors import PhalanxError
from core.profile import load_profile

if TYPE_CHECKING:
    from app.session import Session
    from app.take_summary import TakeSummary

LAYOUT = "han19"
HAND_POINTS, BODY_POINTS = 38, 4
SETTLE_MIN = 5.0
"""What is allocated once is allocated by then [min]; in a shorter run, by the middle of it."""
SAMPLE_S, LEAST_SAMPLES = 5.0, 12
LONG_S = 600.0
MB = 1e6


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of this benchmark."""
    parser.add_argument("--minutes", metavar="M", type=float, default=20.0, help="of the take [min]; default 20")
    parser.add_argument("--rate", metavar="HZ", type=float, default=836.0, help="frames per second; default 836")
    parser.add_argument("--points", metavar="N", type=int, default=72, help="in a frame, 38 of hands; default 72")
    parser.add_argument("--folder", metavar="DIR", type=Path, help="where to write; default a temporary folder")
    parser.add_argument("--window", action="store_true", help="with the window, on a virtual display if there is none")
    parser.add_argument("--trim", action="store_true", help="freed memory goes back to the system before each reading")
    parser.add_argument("--objects", action="store_true", help="also which kinds of Python objects have become more")
    parser.add_argument("--trace", action="store_true", help="also which lines hold more; slow, for a low rate")


@dataclass
class Readings:
    """Of one process, every few seconds: minutes since the take began, bytes resident, bytes of its own."""

    minutes: list[float] = field(default_factory=list)
    resident: list[int] = field(default_factory=list)
    own: list[int] = field(default_factory=list)

    def take(self, pid: int, minute: float) -> None:
        """One more reading."""
        memory = memory_of(pid)
        self.minutes.append(minute)
        self.resident.append(memory.resident)
        self.own.append(memory.own)

    def growth_mb(self, values: list[int]) -> float:
        """By how much a straight line through the readings after the first minutes rises from its begin to its end."""
        minutes = np.array(self.minutes)
        late = minutes >= min(SETTLE_MIN, 0.5 * float(minutes[-1]))
        if late.sum() < 3:
            return float("nan")
        slope = float(np.polyfit(minutes[late], np.array(values)[late] / MB, 1)[0])
        return slope * float(np.ptp(minutes[late]))

    def figures(self) -> dict[str, Any]:
        """For the last line of the output."""
        return {
            "growth_mb": self.growth_mb(self.resident),
            "own_growth_mb": self.growth_mb(self.own),
            "minutes": self.minutes,
            "resident_mb": [n / MB for n in self.resident],
            "own_mb": [n / MB for n in self.own],
        }


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Raises PhalanxError where the system does not tell how much memory a process holds."""
    memory_of(os.getpid())
    if arguments.window:
        from app.virtual_display import has_display, virtual_display

        if not has_display():
            with virtual_display():
                # Qt does not outlive its display: a process of its own, with the same options.
                command = [sys.executable, "-m", "app", *sys.argv[1:]]
                code = subprocess.run(command, check=False).returncode
            if code:
                raise PhalanxError("The benchmark's window failed.", "Its message is above.")
            return {}
    spare = max(arguments.points - HAND_POINTS, 0)
    options = ["--rate", str(arguments.rate), "--bodies", str(spare // BODY_POINTS)]
    options += ["--ghosts", str(spare % BODY_POINTS)]
    with ExitStack() as stack:
        folder = stack.enter_context(tempfile.TemporaryDirectory(dir=arguments.folder, prefix="phalanx-soak-"))
        served = stack.enter_context(serving(options))
        soak = _in_window if arguments.window else _without_window
        return soak(arguments, served, Path(folder))


def _without_window(arguments: argparse.Namespace, served: Served, folder: Path) -> dict[str, Any]:
    from app.session import Session
    from core.takes.take import TakeInfo
    from devices.natnet.client import NatNetDevice

    session = Session(load_profile(LAYOUT))
    try:
        session.start()
        session.wait_ready()
        stream = session.add_device(NatNetDevice, served.settings)
        session.connect(stream)
        stream.wait_connected(15.0)
        session.start_recording(folder / "soak.mcap", TakeInfo("soak", rate_hz=arguments.rate))
        return _watch(arguments, served, session, time.sleep, lambda: session.stop_recording().result(LONG_S))
    finally:
        session.close()


def _in_window(arguments: argparse.Namespace, served: Served, folder: Path) -> dict[str, Any]:
    from app import settings as names
    from app.application import start
    from app.settings import Settings
    from app.tour import READY_S, SEALED_S, TRACKED_S, pause, until
    from devices.natnet.client import NatNetDevice

    settings = Settings(None)
    settings.set(names.TAKE_FOLDER, str(folder))
    running = start(settings, profile=load_profile(LAYOUT))
    window, session = running.window, running.session
    finished: list[TakeSummary] = []

    def stop() -> TakeSummary:
        window.record_action.trigger()
        until(lambda: bool(finished), SEALED_S + LONG_S, "The take was not finished")
        return finished[0]

    try:
        window.resize(1600, 1000)
        window.worker.take_finished.connect(finished.append)
        until(lambda: session.ready, READY_S, "The solver did not get ready")
        window.worker.connect_device(window.worker.add_device(NatNetDevice, served.settings))
        until(window.record_action.isEnabled, TRACKED_S, "Recording did not become possible")
        window.record_action.trigger()
        until(lambda: session.recording, TRACKED_S, "Recording did not start")
        return _watch(arguments, served, session, pause, stop)
    finally:
        window.stop_and_close()


def _watch(
    arguments: argparse.Namespace,
    served: Served,
    session: Session,
    wait: Callable[[float], None],
    stop: Callable[[], TakeSummary],
) -> dict[str, Any]:
    """Reads the memory of both processes until the time is over, and ends the take."""
    readings = {"session": Readings(), "server": Readings()}
    pids = {"session": os.getpid(), "server": served.pid}
    kinds, lines = Counter[str](), None
    counted_min = 0.5 * min(arguments.minutes, SETTLE_MIN)
    if arguments.trace:
        tracemalloc.start(8)
    print("minute  frames/s  solved/s  waiting   session MB (own)     server MB (own)", flush=True)
    began, next_s, shown, received = time.monotonic(), 0.0, 0, 0
    while (elapsed := time.monotonic() - began) < 60.0 * arguments.minutes:
        wait(max(next_s - elapsed, 0.05))
        next_s += min(SAMPLE_S, 60.0 * arguments.minutes / LEAST_SAMPLES)
        minute = (time.monotonic() - began) / 60.0
        if arguments.trim:
            trim()
        for name, pid in pids.items():
            readings[name].take(pid, minute)
        if not kinds and minute >= counted_min and (arguments.objects or arguments.trace):
            kinds = _kinds()
            lines = tracemalloc.take_snapshot() if arguments.trace else None
        if minute >= shown:
            numbers = session.numbers()
            take = numbers.recording
            if take is None:
                raise PhalanxError("The take ended early.", "See the log file for the reason.")
            rate = (take.received - received) / 60.0 if shown else 0.0
            received, shown = take.received, shown + 1
            memory = [f"{r.resident[-1] / MB:9.1f} ({r.own[-1] / MB:7.1f})" for r in readings.values()]
            print(
                f"{minute:6.1f}  {rate:8.1f}  {numbers.solver.rate_hz:8.1f}  {take.queue_depth:7}  "
                + "  ".join(memory),
                flush=True,
            )
    growth = {name: of.figures() for name, of in readings.items()}
    if kinds:
        more = (_kinds() - kinds).most_common(12)
        print("Python objects more than before:", ", ".join(f"{name} {n:,}" for name, n in more) or "none")
    if lines is not None:
        for line in tracemalloc.take_snapshot().compare_to(lines, "lineno")[:20]:
            print(f"  {line}")
        tracemalloc.stop()
    summary = stop()
    frames_hz = summary.received / summary.duration_s
    print(
        f"{summary.duration_s:.0f} s at {frames_hz:.1f} frames a second, {summary.bytes / MB:,.0f} MB: {summary.line}"
    )
    for name, of in growth.items():
        print(
            f"{name}: after the first {min(SETTLE_MIN, 0.5 * arguments.minutes):g} minutes memory rose by "
            f"{of['growth_mb']:.2f} MB, its own by {of['own_growth_mb']:.2f} MB"
        )
    return {
        "minutes": arguments.minutes,
        "frames_hz": frames_hz,
        "received": summary.received,
        "written": summary.written,
        "dropped": summary.dropped,
        "lost": summary.lost,
        "solved": summary.solved,
        "growth": growth,
    }


def _kinds() -> Counter[str]:
    """How many Python objects of each kind there are."""
    gc.collect()
    return Counter(f"{type(thing).__module__}.{type(thing).__qualname__}" for thing in gc.get_objects())
