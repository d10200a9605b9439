"""Every way to be ended, of real processes: what was recorded is on disk, sealed and whole, or said not to be."""

from __future__ import annotations

import json
import os
import pty
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import ClassVar

import pytest

from app.left_behind.found import look
from app.left_behind.run_file import ended_runs
from app.signals import SAME_S
from app.virtual_display import virtual_display
from app.window_ending import ANSWER_S
from core.takes.reader import open_take
from tests.app.command import phalanx
from tests.app.stage import server
from tests.data import ROOT

pytestmark = pytest.mark.skipif(not hasattr(signal, "SIGHUP"), reason="signals of POSIX")
PATIENCE_S = 120.0
STUCK_S = 30.0
"""What waits for a thread that cannot be interrupted takes longer than this [s]."""


@pytest.fixture(scope="module")
def stage():
    with server() as simulator:
        yield simulator


@pytest.fixture(autouse=True)
def nobody_stays() -> Iterator[None]:
    """Not even of a test that failed."""
    yield
    for process in Ran.begun:
        process.kill()
        process.wait()
    Ran.begun.clear()


class Ran:
    """A process that records into one folder."""

    begun: ClassVar[list[subprocess.Popen[str]]] = []

    def __init__(self, words: list[object], folder: Path, **how: object) -> None:
        config = folder / "config"
        (config / "phalanx").mkdir(parents=True, exist_ok=True)
        self.takes = folder / "takes"
        (config / "phalanx" / "settings.json").write_text(json.dumps({"takes/folder": str(self.takes)}))
        env = {**os.environ, "XDG_CONFIG_HOME": str(config), "XDG_STATE_HOME": str(folder / "state")}
        pipes = dict.fromkeys(("stdin", "stdout", "stderr"), subprocess.PIPE)
        self.process = subprocess.Popen(
            [sys.executable, "-m", *map(str, words)], cwd=ROOT, text=True, env=env, **{**pipes, **how}
        )
        self.begun.append(self.process)

    def read_until(self, stream: str, word: str) -> str:
        lines = getattr(self.process, stream)
        while word not in (line := lines.readline()):
            assert line, f"ended before it said {word}: {self.process.stderr.read()}"
        return line

    def order(self, text: str) -> None:
        self.process.stdin.write(f"{text}\n")
        self.process.stdin.flush()
        self.read_until("stdout", "obeyed")

    def end(self) -> tuple[int, str]:
        """Exit status, and what was said on standard error."""
        _, err = self.process.communicate(timeout=PATIENCE_S)
        assert "Traceback" not in err, err
        return self.process.returncode, err


def window(stage, folder: Path, *words: str, **how: object) -> Ran:
    """The window, recording."""
    ran = Ran(["tests.app.recording_window", stage.command_port, stage.data_port, *words], folder, **how)
    ran.read_until("stdout", "recording")
    return ran


def headless(stage, folder: Path, **how: object) -> Ran:
    """`phalanx record`, recording."""
    words = ["app", "record", "natnet", "--command-port", stage.command_port, "--data-port", stage.data_port]
    ran = Ran([*words, "--local", "127.0.0.1", "--out", folder / "takes" / "take"], folder, **how)
    if not how:
        ran.read_until("stderr", "Recording")
        time.sleep(0.5)
    return ran


def the_take(ran: Ran) -> Path:
    """The only file in the folder: nothing else is left there."""
    (path,) = ran.takes.iterdir()
    return path


def assert_sealed(ran: Ran) -> None:
    path = the_take(ran)
    with open_take(path) as take:
        assert take.sealed and len(take.raw) >= 30 and take.counts.received == len(take.raw)
    told = phalanx("verify", path, "--json")  # a busy machine may hold up what sends the frames
    assert told.code == (3 if "without frames" in told.figures["verdict"]["headline"] else 0), told.out


def wait_until(condition, ran: Ran) -> None:
    deadline = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < deadline and ran.process.poll() is None
        time.sleep(0.05)


@pytest.mark.parametrize(("begin", "number"), [(window, "SIGHUP"), (headless, "SIGHUP"), (headless, "SIGTERM")])
def test_a_request_to_end_seals_the_take(tmp_path: Path, stage, begin, number: str) -> None:
    ran = begin(stage, tmp_path)
    ran.process.send_signal(getattr(signal, number))
    ran.process.send_signal(getattr(signal, number))  # as a shell and its terminal do
    assert ran.end()[0] == 0
    assert_sealed(ran)


def test_a_request_to_end_does_not_wait_for_the_answer_to_a_question(tmp_path: Path, stage) -> None:
    ran = window(stage, tmp_path)
    ran.order("close")  # "Still recording"
    time.sleep(0.5)
    assert ran.process.poll() is None
    begun = time.monotonic()
    ran.process.terminate()
    assert ran.end()[0] == 0
    assert time.monotonic() - begun < PATIENCE_S
    assert_sealed(ran)


def test_ctrl_c_asks_in_the_window_and_seals_if_nobody_answers(tmp_path: Path, stage) -> None:
    ran = window(stage, tmp_path)
    begun = time.monotonic()
    ran.process.send_signal(signal.SIGINT)
    assert ran.end()[0] == 0
    assert time.monotonic() - begun > ANSWER_S - 1.0  # it did wait
    assert_sealed(ran)


def seconds_left(ran: Ran) -> int:
    """What the question says there is to answer it [s]."""
    ran.order("question")
    asked = ran.read_until("stdout", "asked")
    left = re.search(
        r"still being recorded.*Without an answer the take is finished and Phalanx closes in (\d+) s", asked
    )
    assert left, asked
    return int(left[1])


def test_the_question_after_ctrl_c_counts_down_and_time_asleep_does_not_count(tmp_path: Path, stage) -> None:
    ran = window(stage, tmp_path)
    ran.process.send_signal(signal.SIGINT)
    time.sleep(1.5)
    first = seconds_left(ran)
    time.sleep(2.0)
    second = seconds_left(ran)
    assert ANSWER_S >= first > second > 0
    ran.process.send_signal(signal.SIGSTOP)  # all that is seen of a machine that sleeps
    time.sleep(ANSWER_S + 1.0)
    ran.process.send_signal(signal.SIGCONT)
    assert seconds_left(ran) > 0
    assert ran.end()[0] == 0
    with open_take(the_take(ran)) as take:
        assert take.sealed


def test_ctrl_c_beside_a_question_that_is_asked_already_does_not_ask_twice(tmp_path: Path, stage) -> None:
    ran = window(stage, tmp_path)
    ran.order("close")
    time.sleep(0.5)
    ran.process.send_signal(signal.SIGINT)
    time.sleep(1.5)
    assert ANSWER_S >= seconds_left(ran) > 0
    assert ran.end()[0] == 0
    assert_sealed(ran)


def test_a_display_that_goes_away_seals_the_take_and_the_next_start_says_so(tmp_path: Path, stage) -> None:
    with virtual_display():
        ran = window(stage, tmp_path)
    code, err = ran.end()
    assert code == 1, err
    assert_sealed(ran)
    path = the_take(ran)
    time.sleep(1.5)
    again = window(stage, tmp_path)
    again.order("left")
    assert again.read_until("stdout", "shown") == f"shown [] [] ['{path.name}']\n"
    again.process.terminate()
    assert again.end()[0] == 0


def test_a_second_ctrl_c_ends_the_window_at_once_and_says_what_is_left(tmp_path: Path, stage) -> None:
    ran = window(stage, tmp_path)
    ran.process.send_signal(signal.SIGINT)
    time.sleep(1.0)
    assert ran.process.poll() is None
    ran.process.send_signal(signal.SIGINT)
    code, err = ran.end()
    path = the_take(ran)
    assert code == 130 and f"Take {path} is not sealed" in err
    with open_take(path) as take:
        assert not take.sealed and len(take.raw) >= 30
    assert phalanx("recover", path).code == 0


def test_a_second_ctrl_c_says_of_a_disk_that_hangs_what_the_window_says(tmp_path: Path, stage) -> None:
    ran = window(stage, tmp_path, "hanging")
    ran.order("hang")
    time.sleep(1.0)  # of frames that wait in memory
    ran.order("end")
    ran.order("waits")
    said = ran.read_until("stdout", "waits")
    ran.process.send_signal(signal.SIGINT)
    assert "Ctrl+C again ends at once" in ran.read_until("stderr", "again")
    ran.order("waits")  # the window waits on, and is there
    ran.read_until("stdout", "waits")
    time.sleep(3 * SAME_S)  # closer to the first it would be the same one
    ran.process.send_signal(signal.SIGINT)
    code, err = ran.end()
    path = the_take(ran)
    counted = re.search(r"([\d,]+) of its ([\d,]+) frames are on the disk and can be recovered", said)
    assert counted, said
    assert code == 130 and f"Take {path} is not sealed: {counted[0]}" in err
    written, received = (int(n.replace(",", "")) for n in counted.groups())
    with open_take(path) as take:
        assert len(take.raw) == written < received


STUCK = """
import threading
from app.commands.terminal import until_stopped
with until_stopped(lambda: "Take t is not sealed.") as stopped:
    print("begun", flush=True)
    stopped.wait()
    print("stopping", flush=True)
    while True:  # as a system call does that no signal ends
        try:
            threading.Semaphore(0).acquire()
        except KeyboardInterrupt:
            pass
"""


def stuck() -> subprocess.Popen[str]:
    """A command that Ctrl+C has come to once, and that waits."""
    process = subprocess.Popen(
        [sys.executable, "-c", STUCK],
        cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    Ran.begun.append(process)
    assert process.stdout.readline() == "begun\n"
    process.send_signal(signal.SIGINT)
    assert process.stdout.readline() == "stopping\n"
    return process


def test_a_second_ctrl_c_ends_a_command_at_once_whatever_it_waits_for(tmp_path: Path) -> None:
    process = stuck()
    process.terminate()  # asks no more than was asked
    time.sleep(0.5)
    assert process.poll() is None
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 130
    assert err == "phalanx: Ended at once by a second Ctrl+C. Take t is not sealed.\n"


def test_a_third_ctrl_c_waits_for_nothing(tmp_path: Path) -> None:
    process = stuck()
    for _ in range(2):
        time.sleep(0.3)
        process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 130
    assert err == "phalanx: Ended at once by a third Ctrl+C. Take t is not sealed.\n"


@pytest.mark.parametrize(
    "between_s", [0.0, 0.12, *(pytest.param(s, marks=pytest.mark.long) for s in (0.03, 0.2, 0.35, 0.6))]
)
def test_ctrl_c_three_times_leaves_a_word_of_the_take(tmp_path: Path, stage, between_s: float) -> None:
    """Wherever they come: while it is ended, sealed, told of, or when all is done."""
    ran = headless(stage, tmp_path)
    for _ in range(3):
        with suppress(ProcessLookupError):
            ran.process.send_signal(signal.SIGINT)
        time.sleep(between_s)
    out, err = ran.process.communicate(timeout=PATIENCE_S)
    path = the_take(ran)
    assert ran.process.returncode in (0, 3, 130), err
    assert "Traceback" not in err and "Stopped by Ctrl+C" not in err
    with open_take(path) as take:
        assert len(take.raw) >= 30
        if ran.process.returncode == 130:
            assert f"Take {path} is finished" in err if take.sealed else f"`phalanx recover {path}`" in err
        else:
            assert str(path) in out
            assert (ran.process.returncode == 0) <= take.sealed


def test_log_out_seals_the_take_and_nohup_outlives_a_terminal(tmp_path: Path, stage) -> None:
    ran = _under_nohup(window, stage, tmp_path)
    ran.order("log out")
    wait_until(lambda: sealed(ran), ran)
    assert ran.process.poll() is None  # the window stays: others may call it off
    ran.process.terminate()
    assert ran.end()[0] == 0
    assert_sealed(ran)


def test_a_command_under_nohup_outlives_its_terminal(tmp_path: Path, stage) -> None:
    ran = _under_nohup(headless, stage, tmp_path)
    ran.process.terminate()
    assert ran.end()[0] == 0
    assert_sealed(ran)


def _under_nohup(begin, stage, folder: Path) -> Ran:
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        ran = begin(stage, folder)
    finally:
        signal.signal(signal.SIGHUP, before)
    ran.process.send_signal(signal.SIGHUP)
    time.sleep(1.0)
    assert ran.process.poll() is None and not sealed(ran)
    return ran


def test_the_tour_on_a_virtual_display_ends_well_when_its_command_is_asked_to(tmp_path: Path) -> None:
    """The window is in a process of its own, and both end."""
    env = {name: value for name, value in os.environ.items() if name not in ("DISPLAY", "WAYLAND_DISPLAY")}
    process = subprocess.Popen(
        [sys.executable, "-m", "app", "demo", "--seconds", "60", "--out", str(tmp_path / "tour")],
        cwd=ROOT, env=env, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    Ran.begun.append(process)
    while "Recording" not in (line := process.stderr.readline()):
        assert line, "ended before it recorded"
    time.sleep(2.0)
    process.send_signal(signal.SIGHUP)
    _, err = process.communicate(timeout=PATIENCE_S)  # its pipes are the other's, too
    assert process.returncode == 1
    assert err.splitlines()[-1] == "phalanx: Stopped before the end of the tour; what was recorded is saved."
    (path,) = (tmp_path / "tour").iterdir()
    with open_take(path) as take:
        assert take.sealed and len(take.raw) > 60


@pytest.mark.parametrize("how", ["SIGTERM", pytest.param("SIGINT", marks=pytest.mark.long)])
def test_a_window_ends_at_once_while_the_solver_is_prepared(tmp_path: Path, how: str) -> None:
    """At the first start: with no compiled code, which takes a minute or more."""
    env = {**os.environ, "XDG_STATE_HOME": str(tmp_path / "state"), "XDG_CONFIG_HOME": str(tmp_path / "config")}
    process = subprocess.Popen(
        [sys.executable, "-m", "app", "window"],
        cwd=ROOT, env={**env, "NUMBA_CACHE_DIR": str(tmp_path / "compiled")}, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    Ran.begun.append(process)
    compiled, log = tmp_path / "compiled", tmp_path / "state" / "phalanx" / "log" / "phalanx.log"
    deadline = time.monotonic() + PATIENCE_S
    while not any(compiled.rglob("*.nbi")):  # the first of many
        assert time.monotonic() < deadline and process.poll() is None
        time.sleep(0.05)
    process.send_signal(getattr(signal, how))
    _, err = process.communicate(timeout=STUCK_S)
    assert process.returncode == 0 and "Traceback" not in err, err
    assert "Closed" in log.read_text() and "Solver ready" not in log.read_text()
    assert not list(log.parent.glob("running-*"))


def test_an_application_that_is_quit_past_its_window_seals_the_take(tmp_path: Path, stage) -> None:
    ran = window(stage, tmp_path)
    ran.order("quit")
    assert ran.end()[0] == 0
    assert_sealed(ran)


def sealed(ran: Ran) -> bool:
    (path,) = ran.takes.glob("*.mcap")  # beside it may be the copy that is being made
    with open_take(path) as take:
        return take.sealed


@pytest.fixture
def terminal() -> Iterator[tuple[int, int]]:
    """Both ends of a terminal; the test closes the first."""
    ours, theirs = pty.openpty()
    yield ours, theirs
    for end in (ours, theirs):
        with suppress(OSError):
            os.close(end)


@pytest.mark.parametrize("told", [True, False], ids=["told", "disowned"])
def test_a_terminal_that_closes_seals_the_take(tmp_path: Path, stage, terminal, told: bool) -> None:
    """With a real terminal: what is written to it fails from then on. Disowned, no signal tells, and it goes on."""
    ours, theirs = terminal
    how = {"stdin": theirs, "stdout": theirs, "stderr": theirs}
    ran = headless(stage, tmp_path, **how, preexec_fn=_own_terminal if told else os.setsid)
    os.close(theirs)
    seen = b""
    while b"frames" not in seen:  # of the line of progress
        seen += os.read(ours, 4096)
    time.sleep(1.0)  # of frames
    os.close(ours)
    if not told:
        time.sleep(1.0)
        assert ran.process.poll() is None
        ran.process.terminate()
    assert ran.process.wait(PATIENCE_S) == 0
    assert_sealed(ran)


def _own_terminal() -> None:
    import fcntl
    import termios

    os.setsid()
    fcntl.ioctl(0, termios.TIOCSCTTY, 0)


def test_a_fault_in_the_window_leaves_a_report_and_the_next_start_offers_the_take(
    tmp_path: Path, stage, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))  # for what looks in this process
    ran = window(stage, tmp_path)
    path = the_take(ran)
    assert ended_runs() == [] and not look(ran.takes).takes  # two at once: one that runs has not broken down
    ran.process.send_signal(signal.SIGSEGV)
    ran.process.communicate(timeout=PATIENCE_S)
    assert ran.process.returncode == -signal.SIGSEGV
    time.sleep(1.5)
    found = look(ran.takes)
    (fault,) = found.faults
    assert fault.what == "the window" and fault.fault == "Segmentation fault" and fault.takes == (path,)
    assert "Current thread" in fault.path.read_text()
    assert [take.path for take in found.takes] == [path]
    again = window(stage, tmp_path)
    again.order("left")
    assert again.read_until("stdout", "shown") == f"shown ['Segmentation fault'] ['{path.name}'] []\n"
    again.process.terminate()
    assert again.end()[0] == 0


def test_a_terminal_sees_no_control_characters_after_the_last_line(tmp_path: Path, terminal) -> None:
    ours, theirs = terminal
    words = ["app", "record", "demo", "--seconds", "1", "--out", tmp_path / "take"]
    ran = Ran(words, tmp_path, stdin=theirs, stdout=theirs, stderr=theirs)
    os.close(theirs)
    seen = b""
    with suppress(OSError):  # of a terminal that nobody holds any more
        while more := os.read(ours, 4096):
            seen += more
    assert ran.process.wait(PATIENCE_S) in (0, 3)
    assert seen.splitlines()[-1].decode().partition(": ")[0].endswith("take.mcap"), seen[-200:]
    assert b"\\x1b" not in seen and not seen.endswith(b"m")
