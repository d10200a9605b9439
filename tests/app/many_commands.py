"""Runs many commands of `phalanx` in one process, so that what each takes can be measured in reasonable time.

Reads a JSON list of command lines; prints one JSON object for each as soon as it has ended: its exit status, seconds,
what it printed, and the most memory that the process had until then [MB].
"""

from __future__ import annotations

import contextlib
import io
import json
import resource
import subprocess
import sys
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from queue import Empty, Queue
from threading import Thread

from tests.data import ROOT

BEGIN = "done: "
ORDER = "order of training"
"""In place of a command: what `phalanx train` reads before it loads what trains, which tests have not."""


@dataclass(frozen=True)
class Done:
    words: tuple[str, ...]
    code: int
    seconds: float
    said: str
    memory_mb: float


def many(commands: Sequence[Sequence[object]], each_s: float = 90.0) -> list[Done]:
    """What came of each, in a process of its own. Fails, naming the command, if one does not end."""
    words = [[str(word) for word in command] for command in commands]
    lines: Queue[str | None] = Queue()
    with subprocess.Popen(
        [sys.executable, "-m", "tests.app.many_commands"],
        cwd=ROOT,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    ) as process:
        assert process.stdin is not None
        process.stdin.write(json.dumps(words))
        process.stdin.close()
        Thread(target=_listen, args=(process.stdout, lines), daemon=True).start()
        done, other = [], []
        while len(done) < len(words):
            try:
                line = lines.get(timeout=each_s)
            except Empty:
                process.kill()
                raise AssertionError(f"does not end: phalanx {' '.join(words[len(done)])}") from None
            assert line is not None, f"ended at phalanx {' '.join(words[len(done)])}: {''.join(other[-40:])}"
            if line.startswith(BEGIN):
                done.append(Done(tuple(words[len(done)]), **json.loads(line.removeprefix(BEGIN))))
            else:
                other.append(line)
    return done


def _listen(stream: Iterable[str], lines: Queue[str | None]) -> None:
    for line in stream:
        lines.put(line)
    lines.put(None)


def _run(words: list[str]) -> int:
    from app.cli import build_parser, main
    from core.errors import PhalanxError

    if words[0] != ORDER:
        return main(words)
    from app.commands.train import order_of

    try:
        order_of(build_parser(["train"]).parse_args(["train", "labeller", *words[1:]]))
    except PhalanxError as error:
        print(error)
        return 1
    return 0


def _all() -> None:
    for words in json.load(sys.stdin):
        said = io.StringIO()
        began = time.monotonic()
        try:
            with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
                code = _run(words)
        except SystemExit as end:
            code = int(end.code or 0)
        done = {
            "code": code,
            "seconds": time.monotonic() - began,
            "said": said.getvalue(),
            "memory_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
        }
        print(f"{BEGIN}{json.dumps(done)}", flush=True)


if __name__ == "__main__":
    assert Path.cwd() == ROOT
    _all()
