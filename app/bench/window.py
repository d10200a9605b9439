"""Two hands at 120 Hz with the real window drawing and a take being written: frames dropped, latency, frames drawn."""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from app.virtual_display import has_display, virtual_display
from core.errors import PhalanxError


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of this benchmark."""
    parser.add_argument("--seconds", metavar="S", type=float, default=60.0, help="of the take [s]; default 60")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """The built-in performer over loopback, as `phalanx --demo` has it; on a virtual display where there is none."""
    if not has_display():
        with virtual_display():
            # Qt does not outlive its display: a process of its own.
            command = [sys.executable, "-m", "app", "bench", "window", "--seconds", str(arguments.seconds)]
            code = subprocess.run(command, check=False).returncode
        if code:
            raise PhalanxError("The benchmark's window failed.", "Its message is above.")
        return {}
    from app import settings as names
    from app.application import start
    from app.settings import Settings

    with tempfile.TemporaryDirectory() as folder:
        settings = Settings(None)
        settings.set(names.TAKE_FOLDER, str(Path(folder)))
        running = start(settings, demo=True)
        try:
            running.window.resize(1600, 1000)
            return _measure(running, arguments.seconds)
        finally:
            running.window.stop_and_close()


def _measure(running: Any, seconds: float) -> dict[str, Any]:
    from app.tour import READY_S, SEALED_S, TRACKED_S, both_tracked, pause, until

    window, session = running.window, running.session
    until(lambda: session.ready, READY_S, "The solver did not get ready")
    until(lambda: both_tracked(running), TRACKED_S, "The hands were not found")
    until(lambda: window.record_action.isEnabled(), TRACKED_S, "Recording did not become possible")
    pause(3.0)
    drawn, finished, latencies = [], [], []
    window.viewport.drawn.connect(lambda: drawn.append(1))
    window.worker.take_finished.connect(finished.append)
    window.record_action.trigger()
    until(lambda: session.recording, TRACKED_S, "Recording did not start")
    drawn.clear()
    for _ in range(max(round(seconds), 1)):
        pause(1.0)
        latencies.append(session.numbers().solver.latency_s)
    frames_drawn = len(drawn)
    window.record_action.trigger()
    until(lambda: bool(finished), SEALED_S, "The take was not finished")
    take = finished[0]
    figures = {
        "seconds": seconds,
        "received": take.received,
        "written": take.written,
        "dropped": take.dropped,
        "lost": take.lost,
        "solved": take.solved,
        "unsolved": take.unsolved,
        "drawn_hz": frames_drawn / seconds,
        "latency_median_s": sorted(latencies)[len(latencies) // 2],
        "latency_worst_second_s": max(latencies),
    }
    print(f"{seconds:g} s: {take.line}")
    print(
        f"drawn {figures['drawn_hz']:.1f} times a second; exposure to pose {1e3 * figures['latency_median_s']:.1f} ms "
        f"(median of the seconds), {1e3 * figures['latency_worst_second_s']:.1f} ms in the worst second"
    )
    return figures
