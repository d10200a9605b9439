"""Programs that are told to end while they record: by Ctrl+C, the system, a log-out, a terminal that is closed."""

from __future__ import annotations

import signal
import time
from pathlib import Path

from tests.faults.fault import Fault, Outcome
from tests.faults.stage import Running, batches, frames_in, recordings, served, wrong_sealed
from tests.faults.windows import display, window

SIGNALS = (signal.SIGTERM, signal.SIGHUP, signal.SIGINT)


def _wrong_end(running: Running, how: signal.Signals) -> str:
    """What is wrong with the take of a recording that gets this signal; "" if nothing."""
    held = frames_in(running.take)
    status = running.end(how)
    if status is None:
        return f"{how.name}: it went on"
    wrong = wrong_sealed(running.take, held)
    return f"{how.name}: {wrong}" if wrong else ""


def record_ended(tries: int, folder: Path) -> Outcome:
    """Each signal in turn."""
    outcome = Outcome()
    with served() as server:
        for n, place in batches(tries, folder):
            with recordings(place, server, n) as running:
                time.sleep(1.0)
                for one in running:
                    outcome.count(_wrong_end(one, SIGNALS[outcome.tried % len(SIGNALS)]))
                    outcome.said = outcome.said or one.out.partition(": ")[2].partition("\n")[0]
    return outcome


def window_ended(tries: int, folder: Path) -> Outcome:
    """Each signal in turn, to a window with nobody at it."""
    outcome = Outcome(said="The take is there as if Record had been pressed.")
    with served() as server, display() as shown:
        for i in range(tries):
            place = folder / f"window{i}"
            place.mkdir()
            running = window(place, server, shown)
            try:
                running.recording(frames=60)
                outcome.count(_wrong_end(running, SIGNALS[i % len(SIGNALS)]))
            finally:
                running.kill()
    return outcome


FAULTS = (
    Fault("end-record", "a recording is ended by the system, a log-out or Ctrl+C", 3, record_ended),
    Fault("end-window", "the window is ended by the system, a log-out or Ctrl+C while it records", 3, window_ended),
)
