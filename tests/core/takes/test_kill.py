"""`kill -9` at random moments of recording and sealing: no acknowledged frame is lost, every take opens."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from core.takes.reader import open_take
from core.takes.recover import recover
from core.takes.seal import seal_take
from core.takes.verify import verify
from tests.core.takes import several
from tests.core.takes.frames import bits, plain_frame, plain_solved
from tests.data import ROOT
from tests.some import some


def record_and_kill(path: Path, frames: int, lines: int, wait_s: float, kind: str = "one") -> list[str]:
    """Records, kills after so many reports and a moment more; all it reported."""
    command = [sys.executable, "-m", "tests.core.takes.recorder", kind, str(path), str(frames)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=ROOT) as process:
        assert process.stdout is not None
        said = [process.stdout.readline() for _ in range(lines)]
        try:
            process.wait(wait_s)
        except subprocess.TimeoutExpired:
            process.kill()
        said += process.stdout.readlines()  # what was in the pipe when it died was acknowledged too
    assert all(line.endswith("\n") for line in said[:-1])
    return [line.strip() for line in said if line.endswith("\n")]


@pytest.mark.parametrize("seed", range(20))
def test_killed_while_recording(tmp_path: Path, seed: int) -> None:
    rng = np.random.default_rng(seed)
    path = tmp_path / "take.mcap"
    said = record_and_kill(path, 10**9, int(rng.integers(1, 400)), float(rng.uniform(0, 0.05)))
    raw, solved = map(int, said[-1].split())
    with open_take(path) as take:
        n, m = len(take.raw), len(take.solved)
        # Between the last report and the end there was time for one more frame, or part of it.
        assert raw <= n <= raw + 1 and solved <= m <= n
        assert bits(tuple(take.raw)) == bits(tuple(plain_frame(i, n=40) for i in range(n)))
        assert bits(tuple(take.solved)) == bits(tuple(plain_solved(i) for i in range(m)))
        assert not take.sealed and take.counts is None
        whole = take.complete
    result = recover(path)
    assert result.path is not None
    assert (result.recovered, result.recovered_solved) == (n, m)
    assert result.lost + result.lost_solved == (0 if whole else 1) and result.complete == whole
    with open_take(result.path) as take:
        assert take.sealed and take.complete and len(take.raw) == n and len(take.solved) == m
        assert take.counts is not None and take.counts.balanced
        assert bits(tuple(take.raw)) == bits(tuple(plain_frame(i, n=40) for i in range(n)))
    assert verify(result.path).ok


@pytest.mark.parametrize("seed", range(6))
def test_killed_while_sealing(tmp_path: Path, seed: int) -> None:
    n = 1500
    wait_s = float(np.random.default_rng(seed).uniform(0, 0.35))
    path = tmp_path / "take.mcap"
    said = record_and_kill(path, n, n + 1, wait_s)
    assert said[n] == "sealing"
    for _ in range(2):
        with open_take(path) as take:
            assert take.complete and len(take.raw) == len(take.solved) == n
            assert bits(tuple(take.raw)) == bits(tuple(plain_frame(i, n=40) for i in range(n)))
            sealed = take.sealed
        seal_take(path)
    assert sealed
    assert verify(path).ok
    assert [file.name for file in tmp_path.iterdir()] == ["take.mcap"]


@pytest.mark.parametrize("seed", range(20))
def test_killed_while_recording_several_streams(tmp_path: Path, seed: int) -> None:
    rng = np.random.default_rng(100 + seed)
    path = tmp_path / "take.mcap"
    said = record_and_kill(path, 10**9, int(rng.integers(1, 800)), float(rng.uniform(0, 0.05)), "several")
    acknowledged = int(said[-1])
    with open_take(path) as take:
        n = several.n_records(take)
        assert acknowledged <= n <= acknowledged + 1
        written = several.first_of(n)
        assert several.held(take) == written.bits and not take.sealed and take.counts is None
        whole = take.complete
    result = recover(path)
    assert result.path is not None and result.recovered + result.recovered_solved + result.beside == n
    assert result.lost + result.lost_solved + result.lost_beside == (0 if whole else 1)
    with open_take(result.path) as take:
        assert take.sealed and take.complete and several.held(take) == written.bits
        assert take.counts is not None and take.counts.balanced
        assert all(one.balanced and one.dropped_total <= 1 for one in some(take.counts.others.values()))
    assert verify(result.path).ok


@pytest.mark.parametrize("seed", range(6))
def test_killed_while_sealing_several_streams(tmp_path: Path, seed: int) -> None:
    n = 700
    n_events = several.n_events(n)
    wait_s = float(np.random.default_rng(seed).uniform(0, 0.35))
    path = tmp_path / "take.mcap"
    said = record_and_kill(path, n, n_events + 1, wait_s, "several")
    assert said[n_events] == "sealing"
    written = several.first_of(n_events)
    for _ in range(2):
        with open_take(path) as take:
            assert take.complete and several.held(take) == written.bits
            sealed = take.sealed
        seal_take(path)
    assert sealed
    assert verify(path).ok
    assert [file.name for file in tmp_path.iterdir()] == ["take.mcap"]
