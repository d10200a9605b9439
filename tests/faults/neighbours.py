"""Two programs that want the same thing."""

from __future__ import annotations

import time
from pathlib import Path

from tests.faults.fault import Fault, Outcome
from tests.faults.stage import frames_in, record, recordings, served, wrong_sealed
from tests.faults.windows import display, window


def one_name(tries: int, folder: Path) -> Outcome:
    """A second recording is to go into the file that a first one writes."""
    outcome = Outcome()
    for i in range(tries):
        place = folder / f"try{i}"
        place.mkdir()
        with served() as server, recordings(place, server, 1) as (first,):
            (place / "second").mkdir()
            second = record(place / "second" / "words.mcap", server, "--out", first.take)
            status = second.process.wait(120)
            held = frames_in(first.take)
            first.end()
            wrong = wrong_sealed(first.take, held)
            outcome.count(wrong or ("" if status == 1 else f"the second ended with status {status}"))
            outcome.said = second.said("exists") or second.said()
    return outcome


def one_folder(tries: int, folder: Path) -> Outcome:
    """A window and a recording without one, on one server, into one folder, at the same time."""
    outcome = Outcome(said="Each writes a take of its own.")
    for i in range(tries):
        place = folder / f"try{i}"
        place.mkdir()
        with served() as server, display() as shown:
            open_window = window(place, server, shown)
            other = record(place / "beside.mcap", server)
            try:
                open_window.recording()
                other.recording()
                time.sleep(1.0)
                held = frames_in(open_window.take)
                wrong = "" if other.end() in (0, 3) else "the recording beside the window failed"
                open_window.kill()
                if frames_in(open_window.take) < held:
                    wrong = "the window's take lost frames"
                outcome.count(wrong or wrong_sealed(other.take))
            finally:
                open_window.kill()
                other.kill()
    return outcome


FAULTS = (
    Fault("one-name", "a second recording into the file of a first one", 1, one_name),
    Fault("one-folder", "two programs record from one server into one folder", 1, one_folder),
)
