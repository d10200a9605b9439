"""Batches of `phalanx track` that are killed, told to end, and resumed."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from app.commands.batch import batch_of
from app.commands.job import Job
from app.signals import interrupting
from tests.app.command import phalanx
from tests.app.test_cli_track import points_file
from tests.data import ROOT

PATIENCE_S = 120.0
posix = pytest.mark.skipif(sys.platform == "win32", reason="signals are another thing there")


def wait_for(what: Callable[[], object], process: subprocess.Popen[str] | None = None) -> None:
    deadline = time.monotonic() + PATIENCE_S
    while not what():
        assert process is None or process.poll() is None, process.communicate()
        assert time.monotonic() < deadline
        time.sleep(0.01)


def children(pid: int) -> list[int]:
    """Of a process, as far as this system tells them."""
    place = Path(f"/proc/{pid}/task/{pid}/children")
    return [int(one) for one in place.read_text().split()] if place.exists() else []


def is_alive(pid: int) -> bool:
    """A process that ended, and that nobody has asked what became of it, is not."""
    stat = Path(f"/proc/{pid}/stat")
    try:
        return stat.read_text().rpartition(")")[2].split()[0] != "Z"
    except (FileNotFoundError, ProcessLookupError):
        return False


def is_worker(pid: int) -> bool:
    """Of the children one counts resources, the others solve."""
    return b"spawn_main" in Path(f"/proc/{pid}/cmdline").read_bytes()


def content(folder: Path) -> dict[str, object]:
    """Every file of the results by its name; of run.json all but what is of one run alone."""
    found: dict[str, object] = {}
    for path in folder.rglob("*"):
        if path.is_file():
            found[str(path.relative_to(folder))] = path.read_bytes()
        if path.name == "run.json":
            record = json.loads(path.read_text(encoding="utf-8"))
            assert set(record.pop("run")) == {"command", "date_utc", "seconds"}
            found[str(path.relative_to(folder))] = record
    return found


def begun(words: list[object], out: Path) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-m", "app", "track", *map(str, words), "--out", str(out)],
        cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, stdin=subprocess.DEVNULL, text=True,
        start_new_session=True,
    )  # fmt: skip


def finished(out: Path) -> set[Path]:
    return set(out.glob("take*/run.json"))


@posix
@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="processes are looked up in /proc")
@pytest.mark.long
def test_a_batch_killed_told_to_end_and_resumed_is_the_same_as_in_one_go(tmp_path: Path) -> None:
    n = 8
    for k in range(n):
        points_file(tmp_path / f"take{k}.csv", 120, k)
    words = [tmp_path / "take*.csv", "--profile", "han19", "--live-labels", "--to", "csv,c3d"]
    whole, cut = tmp_path / "whole", tmp_path / "cut"
    assert phalanx("track", *words, "--out", whole).code == 0

    for how, resume in (("kill", ()), ("term", ("--resume",)), ("group", ("--resume",)), ("worker", ("--resume",))):
        before = finished(cut)
        process = begun([*words, *resume], cut)
        wait_for(lambda: finished(cut) - before, process)  # noqa: B023 - called before the next turn
        workers = children(process.pid)
        if how == "kill":
            process.kill()
        elif how == "term":
            process.terminate()
        elif how == "group":
            os.killpg(process.pid, signal.SIGTERM)
        else:  # as a system that is out of memory does
            os.kill(next(pid for pid in workers if is_worker(pid)), signal.SIGKILL)
        out, err = process.communicate(timeout=PATIENCE_S)
        wait_for(lambda: not any(map(is_alive, workers)))  # noqa: B023
        done = len(finished(cut))
        assert len(before) < done < n
        # Whatever has its name is whole, run.json and all.
        assert content(cut).keys() >= {f"take{k}/run.json" for k in range(n) if (cut / f"take{k}").exists()}
        for path in finished(cut):
            name = path.parent.name
            theirs = {key: value for key, value in content(cut).items() if Path(key).parts[0] == name}
            assert theirs == {key: value for key, value in content(whole).items() if Path(key).parts[0] == name}
        if how == "kill":
            continue
        assert process.returncode == 1 and "Traceback" not in out + err
        left = (
            f"phalanx: {done} of {n} files have their results, the others not yet; the same command with --resume does "
            "those."
        )
        if how == "worker":
            assert err.splitlines()[-1] == left and "A process broke down before this was done." in err
        else:
            assert err.splitlines()[-2:] == [left, "phalanx: Stopped by SIGTERM."]
            assert {path.name for path in cut.iterdir()} == {path.parent.name for path in finished(cut)}

    done = len(finished(cut))
    last = phalanx("track", *words, "--resume", "--out", cut, "--json")
    assert last.code == 0, last.err
    assert f"phalanx: {done} of {n} files are done already, {n - done} to do." in last.err
    assert len(last.figures["skipped"]) == done and last.out.count("(done before)") == done
    assert content(cut) == content(whole)
    figures = {one["file"]: one for one in last.figures["files"]}
    assert list(figures) == [str(tmp_path / f"take{k}.csv") for k in range(n)]


@posix
def test_what_a_killed_run_left_is_cleared_by_the_next(tmp_path: Path) -> None:
    points_file(tmp_path / "take.csv", 3000, 1)
    out = tmp_path / "out"
    words: list[object] = [tmp_path / "take.csv", "--profile", "han19", "--live-labels"]
    process = begun(words, out)
    wait_for(lambda: list(out.glob(".*/lock")), process)
    process.kill()
    process.communicate()
    (left,) = out.iterdir()
    points_file(tmp_path / "take.csv", 60, 1)
    assert phalanx("track", *words, "--out", out).code == 0
    assert left not in list(out.iterdir()) and [path.name for path in out.iterdir()] == ["take"]


def test_results_that_are_to_be_replaced_are_not_counted(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """What `--overwrite` has not come to is still the results of other settings."""
    jobs = []
    for k in range(3):
        points_file(tmp_path / f"take{k}.csv", 3, k)
        folder = tmp_path / "out" / f"take{k}"
        if k < 2:
            folder.mkdir(parents=True)
            (folder / "run.json").write_text('{"format": "phalanx-run", "input": {}}')
        jobs.append(Job(tmp_path / f"take{k}.csv", ("han19",), folder, False, True, True, overwrite=True))
    batch = batch_of(jobs, resume=False)
    assert [job.folder for job in batch.jobs] == [job.folder for job in jobs]
    for done in (0, 1):
        capsys.readouterr()
        batch.say_what_is_left()
        assert f"phalanx: {done} of 3 files have their results, the others not yet;" in capsys.readouterr().err
        new = tmp_path / "out" / "take1" / "run.json"
        os.utime(new, ns=(0, new.stat().st_mtime_ns + 1_000_000_000))


@posix
def test_what_nohup_ignores_stays_ignored() -> None:
    before = {number: signal.getsignal(number) for number in (signal.SIGTERM, signal.SIGHUP)}
    try:
        signal.signal(signal.SIGHUP, signal.SIG_IGN)
        with interrupting():
            os.kill(os.getpid(), signal.SIGHUP)
            with pytest.raises(KeyboardInterrupt, match=r"Stopped by SIGTERM\."):
                os.kill(os.getpid(), signal.SIGTERM)
        assert signal.getsignal(signal.SIGTERM) is before[signal.SIGTERM]
        signal.signal(signal.SIGHUP, signal.SIG_DFL)
        with interrupting(), pytest.raises(KeyboardInterrupt, match=r"Stopped by SIGHUP\."):
            os.kill(os.getpid(), signal.SIGHUP)
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
