"""Files opened by the command line in a process of its own each, whose time and memory are counted.

The processes are forks of one that has imported everything: a thousand files take a minute, not an hour.
Run as a program: reads lines of JSON, [command, words...] each, and writes one line of JSON for each.
"""

from __future__ import annotations

import importlib
import json
import os
import resource
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from core.errors import PhalanxError
from tests.data import ROOT
from tests.faults.stage import environment

PATIENCE_S = 30.0
"""However busy the machine is, what takes longer hangs."""
MOST_CPU_S, MOST_MB = 5.0, 500.0
MACHINE_BYTES = 6 << 30
"""Address space that one file may take before it is refused: the machine must live on."""


@dataclass(frozen=True)
class Opened:
    """What came of a file. status: exit status, negative: the signal that ended it. cpu_s, mb: what it took."""

    status: int
    text: str
    cpu_s: float
    mb: float
    timed_out: bool

    @property
    def refused(self) -> bool:
        """With a message, as it should be."""
        return self.status in (1, 2, 3)

    @property
    def wrong(self) -> str:
        """What is wrong with how it was opened; "" if nothing."""
        if self.timed_out:
            return f"was still being read after {PATIENCE_S:g} s"
        if self.status < 0:
            return f"ended the program (signal {-self.status})"
        if "Traceback" in self.text:
            return f"was not understood: {self.text.strip().splitlines()[-1]}"
        if "Unexpected " in self.text:
            return f"was not expected: {self.text[self.text.index('Unexpected ') :].splitlines()[0]}"
        if self.cpu_s > MOST_CPU_S:
            return f"took {self.cpu_s:.1f} s"
        if self.mb > MOST_MB:
            return f"took {self.mb:.0f} MB"
        return "" if self.status in (0, 1, 2, 3) else f"gave exit status {self.status}"


class Opener:
    """The process that opens files."""

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self._process = process

    def open(self, *words: object) -> Opened:
        """`phalanx WORDS`; of what no command alone opens, the function `=module:name` with the other words."""
        assert self._process.stdin is not None and self._process.stdout is not None
        self._process.stdin.write(json.dumps([str(word) for word in words]) + "\n")
        self._process.stdin.flush()
        return Opened(**json.loads(self._process.stdout.readline()))


@contextmanager
def opener(folder: Path) -> Iterator[Opener]:
    """Ready while the block lasts."""
    with subprocess.Popen(
        [sys.executable, "-m", "tests.faults.opened"],
        cwd=ROOT,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env=environment(folder, OPENBLAS_NUM_THREADS="1"),
    ) as process:
        try:
            yield Opener(process)
        finally:
            assert process.stdin is not None
            process.stdin.close()


def _open(words: Sequence[str], said: Path) -> Opened:
    """In a fork of this process."""
    from app.cli import main

    pid = os.fork()
    if pid == 0:
        status = 99
        try:
            with said.open("wb") as file:
                os.dup2(file.fileno(), 1)
                os.dup2(file.fileno(), 2)
            resource.setrlimit(resource.RLIMIT_AS, (MACHINE_BYTES, MACHINE_BYTES))
            status = _call(words) if words[0].startswith("=") else int(main(list(words)))
            sys.stdout.flush()
        except SystemExit as end:
            status = end.code if isinstance(end.code, int) else 1
        except BaseException:
            import traceback

            os.write(2, traceback.format_exc().encode())
        finally:
            os._exit(status)
    deadline, timed_out = time.monotonic() + PATIENCE_S, False
    while True:
        ended, how, used = os.wait4(pid, os.WNOHANG)
        if ended:
            break
        if time.monotonic() > deadline and not timed_out:
            os.kill(pid, signal.SIGKILL)
            timed_out = True
        time.sleep(0.005)
    text = said.read_text(errors="replace") if said.exists() else ""
    cpu_s = used.ru_utime + used.ru_stime
    return Opened(os.waitstatus_to_exitcode(how), text[-4000:], cpu_s, used.ru_maxrss / 1024.0, timed_out)


def _call(words: Sequence[str]) -> int:
    """As the command line does with what a command raises."""
    module, _, name = words[0][1:].partition(":")
    try:
        getattr(importlib.import_module(module), name)(*words[1:])
    except PhalanxError as error:
        print(f"phalanx: {error}", file=sys.stderr, flush=True)
        return 1
    return 0


def _serve() -> None:
    from app.cli import build_parser
    from core.labelling import network  # noqa: F401, what every fork would have to import
    from core.takes import formats, reader, verify  # noqa: F401

    build_parser()
    answers = os.fdopen(os.dup(1), "w")
    with tempfile.TemporaryDirectory() as folder:
        for line in sys.stdin:
            answers.write(json.dumps(_open(json.loads(line), Path(folder) / "said").__dict__) + "\n")
            answers.flush()


if __name__ == "__main__":
    _serve()
