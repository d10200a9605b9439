"""Ctrl+C at any moment, once or more: while a command starts, while it works with others, while it clears up."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from app.signals import interrupting
from tests.app.test_cli_track import is_gone, points_file
from tests.data import ROOT

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Ctrl+C is another thing there")
PATIENCE_S = 60.0


def begun(*words: object, program: tuple[str, ...] = ("-m", "app")) -> subprocess.Popen[str]:
    """In a group of its own, as a terminal begins it."""
    return subprocess.Popen(
        [sys.executable, *program, *map(str, words)], cwd=ROOT, text=True, start_new_session=True,
        stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    )  # fmt: skip


def until(condition: Callable[[], bool], process: subprocess.Popen[str]) -> None:
    deadline = time.monotonic() + PATIENCE_S
    while not condition():
        assert process.poll() is None and time.monotonic() < deadline
        time.sleep(0.02)


DEAF = """
import sys, time
from pathlib import Path
from app.commands.parallel import in_parallel

def work(thing, progress):
    Path(thing).touch()
    while True:  # as what does not look at its progress for long
        time.sleep(0.1)

if __name__ == "__main__":
    import app.commands.track as track
    track.solve_and_place = lambda job, progress: None
    track.usable_cores = lambda: 2
    def two(jobs):
        yield from in_parallel(work, [str(job.folder) + ".begun" for job in jobs], 2, "Solving")
    track._outcomes = two
    from app.cli import main
    sys.exit(main())
"""


@pytest.mark.parametrize("times", [2, pytest.param(3, marks=pytest.mark.long)])
def test_several_files_end_at_a_second_ctrl_c(tmp_path: Path, times: int) -> None:
    """Processes that do not come to look whether they are to end, as in the middle of a large file."""
    script, out = tmp_path / "deaf.py", tmp_path / "out"
    script.write_text(f"import sys\nsys.path.insert(0, {str(ROOT)!r})\n{DEAF}")
    out.mkdir()
    files = [points_file(tmp_path / f"take{k}.csv", 3, k) for k in range(3)]
    process = begun("track", *files, "--profile", "han19", "--out", out, program=(str(script),))
    try:
        until(lambda: len(list(out.glob("*.begun"))) == 2, process)
        for _ in range(times):
            os.killpg(process.pid, signal.SIGINT)
            time.sleep(0.3 if times == 2 else 0.15)
        out_text, err = process.communicate(timeout=PATIENCE_S)
        assert "Traceback" not in out_text + err
        assert process.returncode in ((1,) if times == 2 else (1, 130)), err
        assert is_gone(process.pid)
    finally:
        process.kill()
        process.communicate()


LOST = """
import os, signal, time
from app.signals import interrupting

class Clearing:
    def __del__(self):
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(0.05)

try:
    with interrupting():
        Clearing()
        print("asked", flush=True)
        time.sleep(20.0)
    print("went on")
except KeyboardInterrupt as stop:
    print(stop)
"""


def test_ctrl_c_within_what_cannot_be_left_is_not_lost() -> None:
    process = begun(program=("-c", LOST))
    out, err = process.communicate(timeout=PATIENCE_S)
    assert out == "asked\nStopped by Ctrl+C.\n" and not err


WHILE_IT_IMPORTS = """
import os, runpy, signal, sys
class Hook:
    def find_spec(self, name, path=None, target=None):
        if name == sys.argv[1]:
            del sys.argv[1]
            sys.meta_path.remove(self)
            os.kill(os.getpid(), signal.SIGINT)
sys.meta_path.insert(0, Hook())
runpy.run_module("app", run_name="__main__", alter_sys=True)
"""


@pytest.mark.parametrize(
    "module",
    [
        "app.cli",
        "numba",
        *(pytest.param(name, marks=pytest.mark.long) for name in ("argparse", "app.commands.record", "app.session")),
    ],
)
def test_ctrl_c_while_a_command_imports_ends_it_at_once_and_quietly(tmp_path: Path, module: str) -> None:
    process = begun(module, "record", "demo", "--out", tmp_path / "take", program=("-c", WHILE_IT_IMPORTS))
    out, err = process.communicate(timeout=PATIENCE_S)
    assert (process.returncode, out, err) == (-signal.SIGINT, "", "")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("after_s", [0.8, *(pytest.param(s, marks=pytest.mark.long) for s in (0.3, 1.5))])
def test_ctrl_c_while_a_recording_starts_ends_it_at_once_and_quietly(tmp_path: Path, after_s: float) -> None:
    process = begun("record", "demo", "--out", tmp_path / "take")
    try:
        handled = f"/proc/{process.pid}/status"
        until(lambda: not defaults(handled), process)  # the interpreter's own beginning is not ours
        time.sleep(after_s)
        process.send_signal(signal.SIGINT)
        begun_s = time.monotonic()
        out, err = process.communicate(timeout=PATIENCE_S)
        assert time.monotonic() - begun_s < PATIENCE_S
        assert "Traceback" not in err and "KeyboardInterrupt" not in err and "Recording" not in err
        assert process.returncode in (-signal.SIGINT, 1)
        assert not out and not list(tmp_path.iterdir())
    finally:
        process.kill()
        process.communicate()


def defaults(status: str) -> bool:
    """Whether the process has Ctrl+C end it as the interpreter begins, before it has come to its own beginning."""
    caught = next(line for line in Path(status).read_text().splitlines() if line.startswith("SigCgt:"))
    return bool(int(caught.split()[1], 16) & (1 << (signal.SIGINT - 1)))


def test_what_was_begun_with_ctrl_c_ignored_does_not_hear_it() -> None:
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        with interrupting():
            os.kill(os.getpid(), signal.SIGINT)
            time.sleep(0.05)
            went_on = True
    finally:
        signal.signal(signal.SIGINT, before)
    assert went_on
