"""Runs the real command, as an operator would."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from tests.data import ROOT

TIMEOUT_S = 240.0


@dataclass(frozen=True)
class Ran:
    code: int
    out: str
    err: str

    @property
    def figures(self) -> dict[str, Any]:
        """The JSON object on the last line of standard output."""
        figures: dict[str, Any] = json.loads(self.out.splitlines()[-1])
        return figures


def phalanx(*words: object) -> Ran:
    """`phalanx WORDS`; never a traceback."""
    done = subprocess.run(
        [sys.executable, "-m", "app", *map(str, words)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        stdin=subprocess.DEVNULL,
        timeout=TIMEOUT_S,
        check=False,
    )
    assert "Traceback" not in done.stderr + done.stdout, done.stderr
    return Ran(done.returncode, done.stdout, done.stderr)


@contextmanager
def serving(*words: object) -> Iterator[tuple[int, int]]:
    """A simulated NatNet server on free ports while the block lasts: its command and data port."""
    command = [sys.executable, "-m", "app", "simulate", "natnet", "--command-port", "0", "--data-port", "0"]
    with subprocess.Popen(
        [*command, *map(str, words)], cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as server:
        try:
            assert server.stdout is not None
            words_out = server.stdout.readline().replace(",", " ").replace(".", " ").split()
            ports = [int(words_out[i + 1]) for i, word in enumerate(words_out) if word == "port"]
            yield ports[0], ports[1]
        finally:
            server.terminate()
            rest, errors = server.communicate(timeout=TIMEOUT_S)
    assert server.returncode == 0, errors
    assert rest.startswith("Sent "), rest
