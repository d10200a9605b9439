"""Long work beside the window: real processes, real takes, and what is left when they are ended."""

from __future__ import annotations

import multiprocessing
import os
import platform
import signal
import subprocess
import sys
import tempfile
import threading
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import pytest

from app.review import document as work
from app.review.job import Report
from app.review.own_process import run
from core.errors import CancelledError, ExportError, FormatError, PhalanxError, TakeError
from core.profile import load_profile
from core.takes.codec import encode_raw, encode_solved
from core.takes.reader import open_take
from core.takes.reprocess import relabelled_each, solve_each
from core.takes.take import Mark, TakeCounts, TakeInfo
from core.takes.verify import verify
from core.takes.writer import TakeWriter
from tests.app.stage import RATE_HZ, performance, until
from tests.app.takes import write_take
from tests.data import ROOT


class Watch(Report):
    """A report that keeps what it was told, and stops when asked to."""

    def __init__(self) -> None:
        self.told: list[tuple[float, str]] = []
        self.stop = threading.Event()
        super().__init__(lambda _, value: self.told.append(value), self.stop)


@pytest.fixture
def watch():
    return Watch()


@pytest.fixture
def temporary(tmp_path, monkeypatch):
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    yield folder
    assert not multiprocessing.active_children()


@pytest.fixture
def performed(tmp_path):
    """A take of the performer's frames, none of them solved yet."""
    path = tmp_path / "performed.mcap"
    writer = TakeWriter(path, TakeInfo("performed", "Ann", rate_hz=RATE_HZ, rating="A"), load_profile("han19"))
    for frame in performance():
        writer.raw("", frame)
    writer.mark(Mark(0.5, "clap"))
    writer.seal(TakeCounts(len(performance()) + 3, len(performance()), {"disk error": 3}, lost=2))
    return path


def child() -> multiprocessing.process.BaseProcess:
    until(multiprocessing.active_children, "the process")
    return multiprocessing.active_children()[0]


@pytest.mark.parametrize("live_labels", [False, True])
def test_a_solution_is_bit_for_bit_that_of_this_process(performed, temporary, watch, live_labels):
    profile = load_profile("han19")
    before = performed.read_bytes()
    solved = work.solve_again(performed, profile, watch, live_labels)
    shares = [share for share, _ in watch.told]
    assert shares == sorted(shares) and 0 < shares[-1] <= 1 and len(set(shares)) > 3
    assert any("of 480" in text for _, text in watch.told)
    with open_take(performed) as take:
        here = [whole for _, whole in (solve_each if live_labels else relabelled_each)(take.raw, profile, fill=True)]
        raw = [encode_raw(frame) for frame in take.raw]
    assert [timeless(frame) for frame in solved.again.solved] == [timeless(frame) for frame in here]
    assert [encode_raw(frame) for frame in solved.again.raw] == raw
    assert solved.matched.tolist() == list(range(480))
    assert performed.read_bytes() == before
    report = verify(solved.again.path)
    assert report.ok and report.sealed
    target = work.free_name(performed)
    work.save_solved(solved.again.path, target, TakeInfo("other", notes="seen"), [Mark(1.0, "turn")], watch)
    with open_take(target) as saved:
        assert (saved.info.name, saved.info.performer, saved.info.notes) == ("other", "Ann", "seen")
        assert [(mark.time_s, mark.text) for mark in saved.marks] == [(1.0, "turn")]
        counts = saved.counts
        assert (counts.received, counts.written, counts.dropped_total, counts.lost, counts.solved) == (
            483,
            480,
            3,
            2,
            480,
        )
        assert [timeless(frame) for frame in saved.solved] == [timeless(frame) for frame in here]
    with pytest.raises(TakeError, match="exists already"):
        work.save_solved(solved.again.path, target, TakeInfo("other"), [], watch)
    assert [path.name for path in target.parent.iterdir() if "sealing" in path.name] == []
    solved.discard()
    assert list(temporary.iterdir()) == []


def timeless(frame) -> bytes:
    """A solved frame without how long its solution took."""
    return encode_solved(replace(frame, stage_s={}))


@pytest.mark.parametrize("end", ["cancel", "kill"])
@pytest.mark.parametrize("what", ["solve", "save", "export"])
def test_work_that_is_ended_leaves_nothing(performed, temporary, watch, end, what, tmp_path):
    folder, out = tmp_path / "takes", tmp_path / "out"
    long = write_take(folder, "long", 3000)
    jobs = {
        "solve": lambda: work.solve_again(performed, load_profile("han19"), watch),
        "save": lambda: work.save_solved(long, folder / "copy.mcap", TakeInfo("copy"), [], watch),
        "export": lambda: work.export_part(long, 0, 2999, ["gltf"], out, work.ExportOptions(), watch),
    }
    with ThreadPoolExecutor(1) as pool:
        ended = pool.submit(jobs[what])
        process = child()
        assert process.pid != os.getpid()
        until(lambda: watch.told if what != "export" else list(out.glob(".export-*")), "the work to begin")
        if end == "cancel":
            watch.stop.set()
        else:
            os.kill(process.pid, signal.SIGKILL)
        error = ended.exception(60)
    if end == "cancel":
        assert isinstance(error, CancelledError)
    else:
        assert type(error) is PhalanxError and f"to {what} the take broke down (exit code -9)" in error.what
        assert error.action
    assert list(temporary.iterdir()) == list(out.glob("*")) == []
    assert [path.name for path in folder.iterdir()] == ["long.mcap"]


def test_a_fault_of_its_process_is_told_with_a_report(performed, temporary, watch):
    with ThreadPoolExecutor(1) as pool:
        ended = pool.submit(work.solve_again, performed, load_profile("han19"), watch)
        process = child()
        until(lambda: watch.told, "the work to begin")
        os.kill(process.pid, signal.SIGSEGV)
        error = ended.exception(60)
    assert "broke down (exit code -11)" in error.what
    report = Path(error.action.partition("The report of the fault is ")[2].removesuffix("."))
    told = report.read_text().splitlines()
    assert "Fatal Python error: Segmentation fault" in told and f"process: {process.pid} on {platform.node()}" in told


def test_cancelled_before_its_process_is_up(performed, temporary, watch):
    watch.stop.set()
    with pytest.raises(CancelledError):
        work.solve_again(performed, load_profile("han19"), watch)
    assert list(temporary.iterdir()) == []


def test_errors_keep_their_kind_and_words(tmp_path, temporary, watch):
    foreign = tmp_path / "foreign.mcap"
    foreign.write_bytes(b"nothing of a take")
    with pytest.raises(FormatError, match=r"foreign\.mcap is not a take"):
        work.solve_again(foreign, load_profile("han19"), watch)
    empty = write_take(tmp_path, "empty", 0)
    with pytest.raises(TakeError, match="holds no frames") as raised:
        work.solve_again(empty, load_profile("han19"), watch)
    assert raised.value.action == "There is nothing to solve."
    take = write_take(tmp_path, "take", 20)
    for _ in range(2):
        options = work.ExportOptions()
        if (tmp_path / "out").exists():
            with pytest.raises(ExportError, match="exists already"):
                work.export_part(take, 5, 15, ["csv"], tmp_path / "out", options, watch)
        else:
            assert work.export_part(take, 5, 15, ["csv"], tmp_path / "out", options, watch)
    assert list(temporary.iterdir()) == []


def test_what_nobody_expected_is_told_and_logged(watch, caplog):
    with pytest.raises(PhalanxError, match="Unexpected TypeError"):
        run("solve", {"colour": "red"}, watch)
    assert "Traceback" in caplog.text


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="needs /proc to see processes of others")
def test_the_process_ends_with_a_window_that_was_killed(tmp_path):
    long = write_take(tmp_path, "long", 3000)
    words = (
        "import sys, threading, pathlib; from app.review import document; from app.review.job import Report;"
        "from core.profile import load_profile\n"
        "if __name__ == '__main__':\n"
        "    import multiprocessing\n"
        "    told = lambda *told: print(multiprocessing.active_children()[0].pid, flush=True)\n"
        "    report = Report(told, threading.Event())\n"
        "    document.solve_again(pathlib.Path(sys.argv[1]), load_profile('han19'), report)\n"
    )
    script = tmp_path / "window.py"
    script.write_text(words)
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "TMPDIR": str(tmp_path)}
    with subprocess.Popen([sys.executable, script, long], stdout=subprocess.PIPE, text=True, env=environment) as window:
        pid = int(window.stdout.readline())
        window.kill()
    until(lambda: not running(pid), "the process to end")
    left = list(tmp_path.glob("phalanx-solved-*/*"))
    assert [path.name for path in left] in ([], ["lock"]), left  # cleared with its folder at the next start


def running(pid: int) -> bool:
    """Whether a process that is not a child of this one runs; one that nobody waits for does not."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(") ")[2][0] != "Z"
    except FileNotFoundError:
        return False
