"""A recording that is halted and goes on: what is missing is said once, with its reason, wherever it is said."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from core.level import Level
from core.takes.reader import open_take
from core.takes.verify import verify
from tests.data import ROOT
from tests.faults.stage import recordings, served, until

pytestmark = pytest.mark.skipif(not hasattr(signal, "SIGSTOP"), reason="this system cannot stop a process")

HALTED_S = 14.0
"""Longer than a server goes on sending to one who does not answer."""


def last_number(path: Path) -> int:
    with open_take(path) as take:
        return take.raw[-1].sequence


def test_a_recording_that_was_halted_says_so_once(tmp_path: Path) -> None:
    with served() as server, recordings(tmp_path, server, 1) as (running,):
        running.process.send_signal(signal.SIGSTOP)
        time.sleep(HALTED_S)
        sent = server.sent
        running.process.send_signal(signal.SIGCONT)
        until(lambda: last_number(running.take) > sent + 120, "frames again")
        assert running.end() == 3
        said, figures = running.err + running.out, running.figures
    print(said)
    with open_take(running.take) as take:
        counts, verdict = take.counts, take.verdict
        numbers = np.array([frame.sequence for frame in take.raw])
        assert counts is not None
        (one,) = counts.standstills
        assert counts.received + counts.lost == numbers[-1] - numbers[0] + 1
        assert one.lost == counts.unread == counts.lost > 0
        assert abs(one.seconds - HALTED_S) < 1.0
        assert take.holes.own.all()
    (text,) = (finding.text for finding in verdict.findings if finding.level is Level.PROBLEM)
    still = f"Phalanx stood still for {one.seconds:.1f} s (the computer slept, or the program was halted)"
    assert text.startswith(still)
    assert f"{one.lost:,} frames of that time are lost" in text
    assert text in running.err
    assert figures["lost"] == one.lost and figures["standstills"][0]["lost"] == one.lost
    for wrong in ("nothing came", "without frames", "on the network", "lost before this machine"):
        assert wrong not in said
    assert not [finding.text for finding in verify(running.take).findings if "nothing came" in finding.text]
    told = subprocess.run(
        [sys.executable, "-m", "app", "info", str(running.take), "--json"],
        cwd=ROOT, capture_output=True, text=True, timeout=120, check=False,
    )  # fmt: skip
    assert told.returncode == 3 and text in told.stdout and "nothing came" not in told.stdout
    assert json.loads(told.stdout.splitlines()[-1])["counts"]["standstills"][0]["lost"] == one.lost


def test_a_short_halt_that_lost_nothing_is_told_once_and_changes_no_status(tmp_path: Path) -> None:
    with served() as server, recordings(tmp_path, server, 1) as (running,):
        running.process.send_signal(signal.SIGSTOP)
        time.sleep(2.0)
        sent = server.sent
        running.process.send_signal(signal.SIGCONT)
        until(lambda: "Phalanx stood still" in running.err, "a word of it", 60.0)
        until(lambda: last_number(running.take) > sent + 120, "frames again")
        code = running.end()
        told = [line for line in running.err.splitlines() if line.startswith("phalanx: Phalanx stood still for ")]
    assert len(told) == 1 and "What waited meanwhile is read now" in told[0], running.err
    with open_take(running.take) as take:
        assert take.counts is not None
        (one,) = take.counts.standstills
        lost = take.counts.lost
    if lost:
        pytest.skip("this machine was so busy that frames were lost besides")
    assert code == 0 and one.seconds > 1.0
    assert (
        f"for {one.seconds:.1f} s (the computer slept, or the program was halted): nothing lost by that" in running.out
    )
