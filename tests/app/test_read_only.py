"""Folders that may not be written, for somebody who is not root: each command says which, and what to do."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.app.command import TIMEOUT_S, Ran, serving
from tests.app.stage import performance
from tests.app.takes import write_take
from tests.data import ROOT
from tests.restricted import read_only, restricted


def phalanx(*words: object, root: Path = ROOT, **environment: object) -> Ran:
    done = subprocess.run(
        [*restricted(), sys.executable, "-m", "app", *map(str, words)],
        cwd=root, capture_output=True, text=True, stdin=subprocess.DEVNULL, timeout=TIMEOUT_S, check=False,
        env={**os.environ, **{name: str(value) for name, value in environment.items()}},
    )  # fmt: skip
    assert "Traceback" not in done.stderr + done.stdout, done.stderr
    return Ran(done.returncode, done.stdout, done.stderr)


def recording(path: Path) -> Path:
    lines = ["frame,time_s,id,x_m,y_m,z_m"]
    for i, frame in enumerate(performance()[:20]):
        lines += [f"{i},{i / 120},{n},{x},{y},{z}" for n, (x, y, z) in zip(frame.ids, frame.points_m, strict=True)]
    path.write_text("\n".join(lines) + "\n")
    return path


def said(ran: Ran, *words: str) -> None:
    assert ran.code == 1, ran.err
    (line,) = (line for line in ran.err.splitlines() if line.startswith("phalanx: "))
    for word in words:
        assert word in line, line
    assert "Unexpected" not in line


def test_each_command_says_which_folder(tmp_path: Path) -> None:
    (tmp_path / "takes").mkdir()
    write_take(tmp_path / "takes", "whole")
    write_take(tmp_path / "takes", "cut", seal=False)
    points = recording(tmp_path / "points.csv")
    with read_only(tmp_path / "locked") as locked, read_only(tmp_path / "takes") as takes:
        why = "Permission denied"
        said(phalanx("export", takes / "whole.mcap", "--to", "csv", "--out", locked / "x"), why, str(locked))
        said(phalanx("export", takes / "whole.mcap", "--to", "csv", "--out", takes), why, str(takes))
        said(phalanx("track", points, "--profile", "han19", "--out", locked / "out"), why, str(locked), "--out")
        said(phalanx("recover", takes / "cut.mcap"), why, "cut.mcap")
        said(phalanx("calibrate", "size", "M", "--profile", "han19", "--out", locked / "p.json"), why, str(locked))
        assert sorted(path.name for path in takes.iterdir()) == ["cut.mcap", "whole.mcap"]
        assert not list(locked.iterdir())


def test_a_take_folder_that_may_not_be_written(tmp_path: Path) -> None:
    with serving("--seconds", "60") as (command_port, data_port), read_only(tmp_path / "locked") as locked:
        ports = ("--server", "127.0.0.1", "--command-port", command_port, "--data-port", data_port)
        said(
            phalanx("record", "natnet", *ports, "--seconds", "1", "--out", locked / "take"),
            "Permission denied", str(locked), "Choose",
        )  # fmt: skip
        assert not list(locked.iterdir())


def test_a_take_that_may_not_be_read(tmp_path: Path) -> None:
    path = write_take(tmp_path, "take")
    path.chmod(0)
    for command in ("info", "verify", "export"):
        words = ("--to", "csv", "--out", tmp_path / "x") if command == "export" else ()
        said(phalanx(command, path, *words), "Permission denied", "take.mcap")
    assert not (tmp_path / "x").exists()


def test_no_place_for_compiled_kernels_log_and_settings(tmp_path: Path) -> None:
    """An installation and a home that may not be written: it is slower to start, and all works."""
    installed = tmp_path / "installed"
    for room in ("app", "core", "devices", "resources"):
        shutil.copytree(ROOT / room, installed / room, ignore=shutil.ignore_patterns("__pycache__", "*.nbc", "*.nbi"))
    with read_only(tmp_path / "home") as home:
        nowhere = {"HOME": home, "PYTHONDONTWRITEBYTECODE": "1"}
        nowhere |= {f"XDG_{kind}_HOME": home / "x" for kind in ("CACHE", "STATE", "CONFIG", "DATA")}
        for folder in sorted(installed.rglob("*"), reverse=True):
            if folder.is_dir():
                folder.chmod(0o555)
        try:
            ran = phalanx("layout", "show", "han19", root=installed, **nowhere)
            assert ran.code == 0, ran.err
            said(phalanx("track", tmp_path / "none.csv", "--profile", "han19", "--out", tmp_path / "o",
                         root=installed, **nowhere), "none.csv")  # fmt: skip
        finally:
            for folder in installed.rglob("*"):
                if folder.is_dir():
                    folder.chmod(0o755)
        assert not list(home.iterdir())


def test_the_window_opens_where_it_can_remember_nothing(tmp_path: Path) -> None:
    script = (
        "import sys\nfrom app import settings as names\nfrom app.application import start\n"
        "from app.settings import Settings, default_path\n"
        "running = start(Settings(default_path()))\n"
        "running.window.settings.set(names.TAKE_FOLDER, sys.argv[1])\n"
        "assert running.window.settings.get(names.TAKE_FOLDER, '') == sys.argv[1]\n"
        "running.window.stop_and_close(); print('opened')\n"
    )
    with read_only(tmp_path / "home") as home:
        places = {f"XDG_{kind}_HOME": str(home / "x") for kind in ("STATE", "CONFIG", "DATA")}
        done = subprocess.run(
            [*restricted(), sys.executable, "-c", script, str(tmp_path)],
            cwd=ROOT, capture_output=True, text=True, timeout=TIMEOUT_S, check=False,
            env={**os.environ, **places},
        )  # fmt: skip
    assert done.returncode == 0 and "opened" in done.stdout, done.stderr


@pytest.mark.skipif(sys.platform != "linux", reason="as above")
def test_the_tour_ends_with_the_reason(tmp_path: Path) -> None:
    with read_only(tmp_path / "locked") as locked:
        said(phalanx("demo", "--tour", "--seconds", "1", "--out", locked), "Permission denied", str(locked))
        assert not list(locked.iterdir())
