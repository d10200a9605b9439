"""Children that read, one for each reader, some at a time; what became of every file, and those that broke it."""

from __future__ import annotations

import json
import os
import select
import shlex
import signal
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

from tests.fuzz.child import MOST_S, WAITING_S, case_of, serve
from tests.fuzz.readers import Reader

_FATES = {
    signal.SIGPROF: f"It took more than {MOST_S:g} s of the processor.",
    signal.SIGALRM: f"It took more than {WAITING_S:g} s.",
    signal.SIGKILL: "The system ended it, out of memory.",
}
_ENDLESS = 1 << 40


@dataclass
class Round:
    """What became of the files of one reader. broken: number and what was said, of each that broke it."""

    reader: Reader
    outcomes: Counter[str] = field(default_factory=Counter)
    broken: list[tuple[int, str]] = field(default_factory=list)
    slowest_s: float = 0.0
    largest_mb: float = 0.0

    @property
    def tried(self) -> int:
        """How many files."""
        return sum(self.outcomes.values())


@dataclass
class _Child:
    pid: int
    said: BinaryIO
    round: Round
    seconds: float  # that it has for reading
    begun_s: float = 0.0  # with the first file
    reading: int = -1  # the number of the file that it is at


@dataclass(frozen=True)
class Order:
    """What is asked for. cases: how many files of each reader; 0: as many as `seconds` allow, shared out among them.
    only: the one case of this number, -1 for all. failures: the folder for what breaks a reader."""

    seed: int
    seconds: float
    cases: int
    jobs: int
    failures: Path
    only: int = -1


def run(order: Order, readers: Sequence[Reader]) -> list[Round]:
    """Tries all readers. A reader whose process ended is gone on with at the next file."""
    sound = {reader.name: list(reader.samples()) for reader in readers}
    rounds = [Round(reader) for reader in readers]
    each_s = order.seconds * order.jobs / max(len(readers), 1)
    waiting = list(rounds)
    running: dict[int, _Child] = {}
    with tempfile.TemporaryDirectory(prefix="phalanx-fuzz-") as folder:
        try:
            while waiting or running:
                while waiting and len(running) < order.jobs:
                    seconds = _ENDLESS if order.cases else each_s
                    child = _begin(waiting.pop(0), order, sound, seconds, 0, Path(folder))
                    running[child.said.fileno()] = child
                for fd in select.select(list(running), [], [])[0]:
                    line = running[fd].said.readline()
                    if line:
                        _heard(running[fd], json.loads(line), order, sound)
                    elif (again := _ended(running.pop(fd), order, sound, Path(folder))) is not None:
                        running[again.said.fileno()] = again
        finally:
            for child in running.values():
                os.kill(child.pid, signal.SIGKILL)
                os.waitpid(child.pid, 0)
    return rounds


def _ended(child: _Child, order: Order, sound: dict[str, list[bytes]], folder: Path) -> _Child | None:
    """Notes of what a child died, if it did; the one that goes on after it, if there is more to do."""
    child.said.close()
    _, status = os.waitpid(child.pid, 0)
    if not status:
        return None
    if child.reading < 0:
        raise RuntimeError(f"{child.round.reader.name}: its first sound file ended the process (status {status}).")
    _broke(child.round, child.reading, _fate(status), order, sound)
    left_s = child.seconds - (time.monotonic() - child.begun_s)
    return _begin(child.round, order, sound, left_s, child.reading + 1, folder) if order.only < 0 else None


def _begin(
    round_: Round, order: Order, sound: dict[str, list[bytes]], seconds: float, first: int, folder: Path
) -> _Child:
    out, into = os.pipe()
    pid = os.fork()
    if pid == 0:
        status = 1
        try:
            os.close(out)
            os.dup2(into, 1)
            numbers = range(first, order.cases or _ENDLESS) if order.only < 0 else (order.only,)
            serve(round_.reader, sound[round_.reader.name], order.seed, numbers, seconds, folder / f"{os.getpid()}")
            status = 0
        finally:
            os._exit(status)
    os.close(into)
    return _Child(pid, os.fdopen(out, "rb", 0), round_, seconds)


def _heard(child: _Child, said: dict[str, object], order: Order, sound: dict[str, list[bytes]]) -> None:
    if "failed" in said:
        raise RuntimeError(f"{child.round.reader.name} cannot be tried.\n{said['failed']}")
    if "began" in said:
        child.begun_s = child.begun_s or time.monotonic()
        child.reading = int(str(said["began"]))
        return
    told = child.round
    told.slowest_s = max(told.slowest_s, float(str(said["seconds"])))
    told.largest_mb = max(told.largest_mb, float(str(said["megabytes"])))
    if said["outcome"] == "broke":
        _broke(told, child.reading, str(said["said"]), order, sound)
    else:
        told.outcomes[str(said["outcome"])] += 1


def _fate(status: int) -> str:
    if os.WIFSIGNALED(status):
        number = os.WTERMSIG(status)
        return _FATES.get(signal.Signals(number), f"It ended the process ({signal.Signals(number).name}).")
    return f"It ended the process (status {os.WEXITSTATUS(status)})."


def _broke(told: Round, number: int, said: str, order: Order, sound: dict[str, list[bytes]]) -> None:
    """Counts it, and keeps the file with how to read it again."""
    told.outcomes["broke"] += 1
    told.broken.append((number, said))
    name = f"{told.reader.name.replace(' ', '-').replace(',', '')}-{order.seed}-{number}"
    order.failures.mkdir(parents=True, exist_ok=True)
    path = order.failures / f"{name}{told.reader.suffix}"
    path.write_bytes(case_of(told.reader, sound[told.reader.name], order.seed, number))
    again = f"make fuzz SEED={order.seed} READER={shlex.quote(told.reader.name)} CASE={number}"
    by_file = f"{sys.executable} -m tests.fuzz --reader {shlex.quote(told.reader.name)} --file {path}"
    (order.failures / f"{name}.txt").write_text(f"{said}\n\nAgain:\n  {again}\n  {by_file}\n", encoding="utf-8")


def table(rounds: Sequence[Round]) -> str:
    """Readers and what became of their files."""
    lines = [f"{'reader':16}{'tried':>8}{'read':>8}{'refused':>9}{'broke':>7}{'slowest s':>11}{'most MB':>9}"]
    lines += [
        f"{one.reader.name:16}{one.tried:8}{one.outcomes['read']:8}{one.outcomes['refused']:9}{one.outcomes['broke']:7}"
        f"{one.slowest_s:11.2f}{one.largest_mb:9.0f}"
        for one in rounds
    ]
    return "\n".join(lines)
