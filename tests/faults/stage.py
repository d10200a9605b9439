"""Real processes to do harm to: the command line on a real server of this process, and what is left of their takes."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np

from core.errors import PhalanxError
from core.takes.reader import Take, open_take
from devices.natnet.simulator import NatNetSimulator
from tests.app.stage import performance
from tests.data import ROOT

START_S, END_S = 300.0, 60.0
"""However busy the machine is [s]."""
POLL_S = 0.1
"""A take is read anew at every look."""
AT_ONCE = 3
"""Recordings that run side by side: most of the time they start."""


_STARTED: set[subprocess.Popen[Any]] = set()
_OVER = threading.Event()


def started(process: subprocess.Popen[Any]) -> None:
    """Whatever becomes of the run, this process does not outlive it."""
    _STARTED.add(process)
    if _OVER.is_set():
        end_all()


def end_all() -> None:
    """The run is over: every process it started ends, and none is started any more."""
    _OVER.set()
    for process in list(_STARTED):
        process.kill()


def environment(folder: Path, **more: str) -> dict[str, str]:
    """Of a process that finds no settings of anybody and leaves its own in `folder`. more: others, "" for none."""
    homes = ("HOME", "XDG_CONFIG_HOME", "XDG_DATA_HOME", "XDG_STATE_HOME", "XDG_CACHE_HOME")
    made = {**os.environ, **dict.fromkeys(homes, str(folder / "home")), **more}
    return {name: value for name, value in made.items() if value}


def until(condition: Callable[[], object], what: str, timeout_s: float = START_S) -> None:
    """Wait for a condition. Raises TimeoutError."""
    deadline = time.monotonic() + timeout_s
    while not condition():
        if time.monotonic() > deadline:
            raise TimeoutError(f"{what}: not within {timeout_s:g} s")
        time.sleep(POLL_S)


class Running:
    """A process whose words go to two files beside its take, so that nothing it says can hold it up."""

    def __init__(self, words: list[str], take: Path, **variables: str) -> None:
        self.take = take
        self._out, self._err = take.with_suffix(".out"), take.with_suffix(".err")
        with self._out.open("wb") as out, self._err.open("wb") as err:
            self.process = subprocess.Popen(
                [sys.executable, *words],
                cwd=ROOT,
                stdin=subprocess.DEVNULL,
                stdout=out,
                stderr=err,
                env=environment(take.parent, **variables),
            )
        started(self.process)

    @property
    def out(self) -> str:
        """Its standard output so far."""
        return self._out.read_text(errors="replace")

    @property
    def err(self) -> str:
        """Its messages so far, less its progress."""
        return self._err.read_text(errors="replace")

    def said(self, word: str = "") -> str:
        """The last thing it told the operator with this word in it, "" if nothing."""
        lines = [line.removeprefix("phalanx: ") for line in self.err.splitlines() if line.startswith("phalanx: ")]
        return next((line for line in reversed(lines) if word in line), "")

    @property
    def figures(self) -> dict[str, Any]:
        """The JSON object on its last line, empty if there is none."""
        with suppress(ValueError, IndexError):
            found = json.loads(self.out.splitlines()[-1])
            return found if isinstance(found, dict) else {}
        return {}

    def recording(self, frames: int = 1) -> None:
        """Waits until the take holds this many frames. Raises TimeoutError, or RuntimeError if it ended instead."""

        def begun() -> bool:
            if self.process.poll() is not None:
                raise RuntimeError(f"ended with status {self.process.returncode}: {self.err[-300:]}")
            if not self.take.exists() or "Recording" not in self.err:
                return False
            return frames_in(self.take) >= frames

        until(begun, "recording")

    def end(self, how: int = signal.SIGINT, timeout_s: float = END_S) -> int | None:
        """Its exit status after this signal; None if it is still there when the time is over, and it is killed then."""
        with suppress(ProcessLookupError):
            self.process.send_signal(how)
        try:
            return self.process.wait(timeout_s)
        except subprocess.TimeoutExpired:
            self.kill()
            return None

    def kill(self) -> None:
        """At once, as the system does when memory is short."""
        self.process.kill()
        self.process.wait()
        _STARTED.discard(self.process)


@contextmanager
def served(**options: Any) -> Iterator[NatNetSimulator]:
    """Two hands at 120 Hz over and over, on free ports."""
    simulator = NatNetSimulator(
        performance(), 120.0, **{"command_port": 0, "data_port": 0, "loop": True, "name": "Motive", **options}
    )
    simulator.start()
    try:
        yield simulator
    finally:
        simulator.close()


def record(take: Path, server: NatNetSimulator, *options: object, **variables: str) -> Running:
    """`phalanx record` from this server, just started."""
    words = ["-m", "app", "record", "natnet", "--command-port", str(server.command_port), "--out", str(take), "--json"]
    return Running([*words, *map(str, options)], take, **variables)


@contextmanager
def recordings(folder: Path, server: NatNetSimulator, n: int, *options: object) -> Iterator[list[Running]]:
    """So many at once, all with frames in their takes; whatever still runs at the end is killed."""
    with ExitStack() as stack:
        made = []
        for i in range(n):
            running = record(folder / f"take{i + 1}.mcap", server, *options)
            stack.callback(running.kill)
            made.append(running)
        for running in made:
            running.recording()
        yield made


def batches(tries: int, folder: Path) -> Iterator[tuple[int, Path]]:
    """So many tries, some at once: how many, and a folder for each lot."""
    done = 0
    while done < tries:
        n = min(AT_ONCE, tries - done)
        place = folder / f"lot{done}"
        place.mkdir()
        yield n, place
        done += n


def frames_in(path: Path) -> int:
    """Raw frames that can be read of a take in any state; 0 if it is none yet."""
    try:
        with open_take(path) as take:
            return len(take.raw)
    except (PhalanxError, OSError):
        return 0


def wrong_in(take: Take, least: int = 1, *, gaps: bool = False, untimed: bool = False, off_m: float = 0.0) -> str:
    """What is wrong with the frames of a take of the performance: fewer than `least`, a number that is missing (unless
    `gaps` are expected), a point that is not as it was sent, a time that is off by 5 ms or more, or is not known
    (unless `untimed` is expected). "" if nothing. off_m: what a point may be off, where another process sent it: the
    same performance made twice may differ in a last bit."""
    if len(take.raw) < least:
        return f"{plural(len(take.raw), 'frame')} of at least {least:,} are left"
    sent = performance()
    sequences = np.array([frame.sequence for frame in take.raw])
    if not gaps and len(sequences) and not (np.diff(sequences) == 1).all():
        return f"{int((np.diff(sequences) - 1).sum())} frames are missing in the middle"
    for frame in take.raw:
        true_m = np.float32(sent[frame.sequence % len(sent)].points_m)
        if frame.points_m.shape != true_m.shape:
            return f"frame {frame.sequence} has {len(frame.points_m)} points, {len(true_m)} were sent"
        worst_m = float(np.abs(frame.points_m - true_m).max(initial=0.0))
        if not worst_m <= off_m:
            return f"frame {frame.sequence} is not as it was sent: a point is {1e3 * worst_m:.3g} mm off"
    return _wrong_times(take, untimed)


def _wrong_times(take: Take, untimed: bool) -> str:
    """Frames whose exposure is put 5 ms or more from when it was. The server's clock is this machine's own."""
    off_s = np.array([frame.times.host_s - frame.times.device_s for frame in take.raw])
    unknown = ~np.isfinite(off_s)
    if unknown.any() and not untimed:
        return f"of {plural(int(unknown.sum()), 'frame')} the time is not known"
    off_s = np.abs(off_s[~unknown])
    late = off_s >= 0.005
    return f"{int(late.sum())} times are off, by {off_s.max():.3f} s at most" if late.any() else ""


def wrong_sealed(path: Path, least: int = 1, **expected: Any) -> str:
    """What is wrong with a take that should be whole and sealed, as `wrong_in` says it; "" if nothing."""
    try:
        with open_take(path) as take:
            if not take.sealed or not take.complete:
                return "the take is not sealed" if not take.sealed else take.damage[0]
            if take.counts is None or take.counts.written != len(take.raw):
                return "the take does not hold as many frames as it says"
            return wrong_in(take, least, **expected)
    except PhalanxError as error:
        return error.what


def plural(n: int, thing: str) -> str:
    """'1 frame', '2 frames'."""
    return f"{n:,} {thing}{'' if n == 1 else 's'}"
