"""`phalanx record` before it records: what it waits for, how long, and that it can be stopped meanwhile."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.app.command import phalanx
from tests.app.stage import server
from tests.app.test_record_faults import Recording
from tests.data import ROOT
from tests.restricted import read_only, restricted

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="sends signals")

SLOW = """
import sys, time
import app.session as session
def compiling():
    time.sleep(600)
session.warm_up_kernels = compiling
session.Session.__init__.__kwdefaults__["warm_up"] = compiling
import app.commands.record as record
record.COMPILING_S = 0.5
from app.cli import main
sys.exit(main())
"""
BROKEN = SLOW.replace("time.sleep(600)", "raise OSError('no compiler')")


@contextmanager
def recording(program: tuple[str, ...], *words: object, before: tuple[str, ...] = ()) -> Iterator[Recording]:
    process = subprocess.Popen(
        [*before, sys.executable, *program, "record", *map(str, words)], cwd=ROOT, text=True,
        stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    )  # fmt: skip
    try:
        yield Recording(process)
    finally:
        process.kill()
        process.wait()


@pytest.fixture
def nobody() -> Iterator[int]:
    """A port at which nobody answers, and nobody says so."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as silent:
        silent.bind(("127.0.0.1", 0))
        yield silent.getsockname()[1]


@pytest.mark.parametrize(
    ("number", "words"),
    [
        ("SIGTERM", "SIGTERM"),
        *(pytest.param(*one, marks=pytest.mark.long) for one in (("SIGINT", "Ctrl+C"), ("SIGHUP", "SIGHUP"))),
    ],
)
def test_stopped_while_the_solver_is_prepared(tmp_path: Path, number: str, words: str) -> None:
    with recording(("-c", SLOW), "demo", "--out", tmp_path / "take") as command:
        command.says("Ctrl+C ends it; the next start goes on where it was")
        command.process.send_signal(getattr(signal, number))
        ran = command.ended()
    assert ran.code == 1 and ran.err.splitlines()[-1] == f"phalanx: Stopped by {words}."
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("number", "words"), [("SIGINT", "Ctrl+C"), pytest.param("SIGTERM", "SIGTERM", marks=pytest.mark.long)]
)
def test_stopped_while_no_server_answers(tmp_path: Path, nobody: int, number: str, words: str) -> None:
    with recording(
        ("-m", "app"), "natnet", "--command-port", nobody, "--wait", 300, "--out", tmp_path / "take"
    ) as command:
        command.says("Preparing the solver")
        time.sleep(8.0)  # until it asks, on most machines; wherever it is, the same is said
        command.process.send_signal(getattr(signal, number))
        ran = command.ended()
    assert ran.code == 1 and ran.err.splitlines()[-1] == f"phalanx: Stopped by {words}."
    assert not list(tmp_path.iterdir())


def test_it_waits_for_a_server_that_comes_later(tmp_path: Path) -> None:
    """For longer than asking once takes."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    words = ["natnet", "--local", "127.0.0.1", "--wait", 120, "--seconds", 1, "--out", tmp_path / "take"]
    with recording(("-m", "app"), *words, "--command-port", port) as command:
        command.says("Preparing the solver")
        time.sleep(12.0)
        assert command.process.poll() is None
        with server(command_port=port):
            ran = command.ended()
    assert ran.code in (0, 3), ran.err
    assert (tmp_path / "take.mcap").exists()


def test_it_waits_no_longer_than_it_is_to(tmp_path: Path, nobody: int) -> None:
    ran = phalanx("record", "natnet", "--command-port", nobody, "--wait", "1", "--out", tmp_path / "take", "--json")
    assert ran.code == 1 and "did not answer within 1 s" in ran.figures["error"]


def test_which_of_several_did_not_answer_is_said(tmp_path: Path, nobody: int) -> None:
    with server() as simulator:
        ran = phalanx(
            "record", "natnet", "--command-port", simulator.command_port, "--data-port", simulator.data_port,
            "--wait", "1", "--out", tmp_path / "take", "--beside", "natnet", f"command_port={nobody}",
        )  # fmt: skip
    assert ran.code == 1 and "(natnet-2) did not answer within 1 s" in ran.err


def test_a_solver_that_cannot_start_is_said_at_once_and_where_the_reason_is(tmp_path: Path) -> None:
    with recording(("-c", BROKEN), "demo", "--out", tmp_path / "take") as command:
        ran = command.ended()
    assert ran.code == 1 and "The solver could not start." in ran.err and "phalanx.log" in ran.err
    assert not list(tmp_path.iterdir())


def test_a_folder_that_cannot_be_written_is_said_before_the_solver_is_prepared(tmp_path: Path) -> None:
    before = tuple(restricted())
    with (
        read_only(tmp_path / "takes") as folder,
        recording(("-m", "app"), "demo", "--out", folder / "take", before=before) as command,
    ):
        ran = command.ended()
    assert ran.code == 1 and "Preparing" not in ran.err
    assert f"No take can be written to the folder {folder}" in ran.err and "Permission denied" in ran.err
    assert not os.listdir(folder)  # noqa: PTH208
