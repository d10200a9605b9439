"""Processes that end without a word: killed by the system, by somebody, or with their display."""

from __future__ import annotations

import random
import signal
import time
from pathlib import Path

from core.errors import PhalanxError
from core.takes.reader import open_take
from core.takes.recover import recover
from tests.faults.fault import Fault, Outcome
from tests.faults.stage import Running, batches, frames_in, plural, recordings, served, until, wrong_in, wrong_sealed
from tests.faults.windows import display, window

RECOVERED = "Opens in review as it is; Recover makes a whole take of it."


def wrong_cut(path: Path, held: int) -> str:
    """What is wrong with a take whose recorder was killed, and with what is recovered of it. held: frames that could be
    read of it before."""
    try:
        with open_take(path) as take:
            n, wrong = len(take.raw), wrong_in(take, held)
        if wrong:
            return wrong
        result = recover(path)
        if result.recovered != n:
            return f"{result.recovered} of {n} frames were recovered"
        return wrong_sealed(result.path or path, held)  # it may have been whole by then
    except PhalanxError as error:
        return error.what


class _Unwritten:
    """Frames that were sent before a kill and are in no take."""

    def __init__(self) -> None:
        self.total = self.most = 0

    def add(self, sent: int, path: Path) -> None:
        """sent: frames that the server had sent when the recorder was killed."""
        try:
            with open_take(path) as take:
                last = take.raw[-1].sequence if len(take.raw) else -1
        except PhalanxError:
            return
        behind = max(sent - 1 - last, 0)
        self.total += behind
        self.most = max(self.most, behind)

    @property
    def words(self) -> str:
        """For the table."""
        if not self.total:
            return "nothing"
        return f"{plural(self.total, 'frame')} in all, at most {self.most} in one: those on their way to the disk"


def record_killed(tries: int, folder: Path) -> Outcome:
    """kill -9 of `phalanx record` at moments that chance picks."""
    chance, outcome, unwritten = random.Random(1), Outcome(said=RECOVERED), _Unwritten()
    with served() as server:
        for n, place in batches(tries, folder):
            with recordings(place, server, n) as running:
                for one in running:
                    time.sleep(chance.uniform(0.0, 1.0))
                    held, sent = frames_in(one.take), server.sent
                    one.kill()
                    unwritten.add(sent, one.take)
                    outcome.count(wrong_cut(one.take, held))
    outcome.lost = unwritten.words
    return outcome


def sealing_killed(tries: int, folder: Path) -> Outcome:
    """kill -9 while the take that was ended is being made whole."""
    chance = random.Random(2)
    outcome = Outcome(said="Opens in review, sealed or as it was recorded; nothing of it is missing.")
    with served() as server:
        for n, place in batches(tries, folder):
            with recordings(place, server, n) as running:
                time.sleep(2.0)
                for one in running:
                    held = frames_in(one.take)
                    one.process.send_signal(signal.SIGINT)
                    time.sleep(chance.uniform(0.0, 0.5))
                    one.kill()
                    outcome.count(wrong_cut(one.take, held))
    return outcome


def window_killed(tries: int, folder: Path) -> Outcome:
    """kill -9 of the window while it records."""
    outcome, unwritten = Outcome(said=RECOVERED), _Unwritten()
    with served() as server, display() as shown:
        for i in range(tries):
            place = folder / f"window{i}"
            place.mkdir()
            running = window(place, server, shown)
            try:
                running.recording(frames=60)
                held, sent = frames_in(running.take), server.sent
            finally:
                running.kill()
            unwritten.add(sent, running.take)
            outcome.count(wrong_cut(running.take, held))
    outcome.lost = unwritten.words
    return outcome


def display_killed(tries: int, folder: Path) -> Outcome:
    """The X server is killed under a window that records."""
    outcome, unwritten = Outcome(said="The take is there as if Record had been pressed."), _Unwritten()
    with served() as server:
        for i in range(tries):
            place = folder / f"display{i}"
            place.mkdir()
            with display() as shown:
                running = window(place, server, shown)
                try:
                    running.recording(frames=60)
                    held, sent = frames_in(running.take), server.sent
                    shown.kill()
                    until(lambda one=running: one.process.poll() is not None, "the window's end")
                except TimeoutError as error:
                    outcome.broken.append(str(error))
                finally:
                    running.kill()
            unwritten.add(sent, running.take)
            outcome.count(wrong_sealed(running.take, held))
    outcome.lost = unwritten.words
    return outcome


def server_killed(tries: int, folder: Path) -> Outcome:
    """The cameras' program ends while a take is recorded, and is started again."""
    outcome, away_s, said = Outcome(), 0.0, ""
    for i in range(tries):
        place = folder / f"server{i}"
        place.mkdir()
        with served() as first:
            ports = {"command_port": first.command_port, "data_port": first.data_port}
            with recordings(place, first, 1) as (running,):
                time.sleep(1.0)
                first.close()
                before = frames_in(running.take)
                time.sleep(2.0)
                with served(**ports):
                    until(lambda one=running, n=before: frames_in(one.take) > n + 120, "frames again")
                    running.end()
                outcome.count(_wrong_after_silence(running))
                said = running.said("without frames")
                away_s += float(sum(running.figures.get("holes", {}).get("frames", [])) or 0)
    outcome.lost = f"what was not sent: about {away_s:,.0f} frames, counted as time without frames"
    outcome.said = said
    return outcome


def _wrong_after_silence(running: Running) -> str:
    wrong = wrong_sealed(running.take, gaps=True)
    if wrong:
        return wrong
    with open_take(running.take) as take:
        if not 1.5 <= take.holes.seconds <= 20.0:
            return f"{take.holes.seconds:.1f} s are said to be missing"
    return "" if running.process.returncode == 3 else f"exit status {running.process.returncode}, not 3"


FAULTS = (
    Fault("kill-record", "kill -9 of a recording without a window", 12, record_killed),
    Fault("kill-sealing", "kill -9 while a take that was ended is made whole", 6, sealing_killed),
    Fault("kill-window", "kill -9 of the window while it records", 2, window_killed),
    Fault("kill-display", "the display is killed under a window that records", 1, display_killed),
    Fault("kill-server", "the cameras' program ends in mid-take and is started again", 1, server_killed),
)
