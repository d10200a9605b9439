"""Damaged, crafted and hostile files, and what is no file at all, given to every command that opens one."""

from __future__ import annotations

import os
import shutil
import socket
from collections.abc import Sequence
from pathlib import Path

import pytest

from core.markers.layout import load_layout
from tests.app.many_commands import ORDER, Done, many
from tests.data import CASES, ROOT

FAULTS = CASES / "faults"
MOST_S = 5.0
MOST_MB = 500.0
BUSY = 6.0
"""How many times longer anything may take while the machine does much else."""


def points_csv(path: Path) -> Path:
    """Some frames of a hand at rest."""
    lines = ["frame,time_s,id,x_m,y_m,z_m"]
    for i in range(5):
        lines += [
            f"{i},{i / 100:.2f},{k + 1},{x:.6f},{y + 1.0:.6f},{z:.6f}"
            for k, (x, y, z) in enumerate(load_layout("han19").positions_m)
        ]
    path.write_text("\n".join(lines) + "\n")
    return path


def said_clearly(done: Done, name: str) -> None:
    """One sentence that names the file and what is wrong with it, nothing unexpected."""
    assert done.code == 1, done
    assert "Unexpected" not in done.said and "Traceback" not in done.said, done
    assert name in done.said, done
    assert len(done.said) < 2000, done


def in_bounds(done: Sequence[Done], least_mb: float) -> None:
    """Each within the time, all within the memory above what the process has anyway."""
    for one in done:
        assert one.seconds < BUSY * MOST_S, one
    assert max(one.memory_mb for one in done) < least_mb + MOST_MB


def fault(pattern: str) -> list[Path]:
    found = sorted(FAULTS.glob(pattern))
    if not found:
        pytest.skip("needs the case faults (set PHALANX_CASES to the folder that holds it)")
    return found


GOOD = ("layout", "show", "han19")
"""So that what every command loads counts for none."""


@pytest.mark.long
def test_every_json_of_the_collection(tmp_path: Path) -> None:
    recording, out = points_csv(tmp_path / "points.csv"), tmp_path / "out"
    commands: list[Sequence[object]] = [GOOD]
    for path in fault("*.json"):
        commands += [
            ("layout", "show", path),
            ("prop", "show", path),
            ("prop", "add", path, "--profile", "han19", "--out", tmp_path / "p.json"),
            ("track", recording, "--profile", path, "--out", out),
            ("calibrate", "size", "M", "--profile", path, "--out", tmp_path / "p.json"),
            ("calibrate", "hand", recording, "--profile", path, "--out", tmp_path / "p.json"),
            ("calibrate", "neutral", recording, "--profile", path, "--from", "0", "--to", "1"),
            ("subspace", recording, "--profile", path, "--out", tmp_path / "s.json"),
            ("simulate", "natnet", "--profile", path),
            ("record", "playback", "--file", recording, "--profile", path, "--out", tmp_path / "t.mcap"),
            ("info", path),
            ("verify", path),
        ]
    good, *done = many(commands)
    for one in done:
        said_clearly(one, "fuzz_")
    in_bounds(done, good.memory_mb)
    assert sorted(tmp_path.iterdir()) == [recording]


def test_every_npz_of_the_collection(tmp_path: Path) -> None:
    commands: list[Sequence[object]] = [GOOD]
    for path in fault("*.npz"):
        folder = tmp_path / path.stem
        folder.mkdir()
        shutil.copy(path, folder)
        commands += [
            ("calibrate", "import", path, "--profile", "han19", "--out", tmp_path / "p.json"),
            (ORDER, "--layout", "han19", "--data", folder, "--out", tmp_path / "n.onnx"),
            ("bench", "sequences", path),
            ("info", path),
        ]
    good, *done = many(commands)
    for one in done:
        said_clearly(one, ".npz")
    assert good.code == 0 and len(done) == 4 * len(fault("*.npz"))
    in_bounds(done, good.memory_mb)


def test_every_network_of_the_collection(tmp_path: Path) -> None:
    recording = points_csv(tmp_path / "points.csv")
    commands: list[Sequence[object]] = [GOOD]
    for path in fault("*.onnx"):
        profile = tmp_path / f"{path.stem}.json"
        profile.write_text(_with_network(path))
        commands += [
            ("track", recording, "--profile", "han19", "--network", path, "--out", tmp_path / "out"),
            ("track", recording, "--profile", profile, "--out", tmp_path / "out"),
            ("record", "playback", "--file", recording, "--profile", profile, "--out", tmp_path / "t.mcap"),
            ("info", path),
        ]
    good, *done = many(commands)
    for one in done:
        said_clearly(one, ".onnx")
    assert good.code == 0 and len(done) == 4 * len(fault("*.onnx"))
    in_bounds(done, good.memory_mb)


def _with_network(path: Path) -> str:
    from dataclasses import replace

    from core.profile import load_profile

    return replace(load_profile("han19"), network=str(path)).to_json()


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs named pipes")
@pytest.mark.long
def test_what_is_no_file_is_refused_at_once(tmp_path: Path) -> None:
    recording, out = points_csv(tmp_path / "points.csv"), tmp_path / "out"
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    with socket.socket(socket.AF_UNIX) as listening:
        os.chdir(tmp_path)  # the name of a socket is short
        try:
            listening.bind("socket")
        finally:
            os.chdir(ROOT)
        odd = {"pipe": pipe, "device": Path("/dev/zero"), "socket": tmp_path / "socket", "folder": tmp_path}
        commands: list[Sequence[object]] = [GOOD]
        for kind, target in odd.items():
            for suffix in ("mcap", "csv", "json", "npz", "glb", "gltf", "onnx", "txt"):
                (tmp_path / f"{kind}.{suffix}").symlink_to(target)
            commands += _commands(tmp_path, kind, recording, out)
        good, *done = many(commands)
    for one in done:
        said_clearly(one, "")
        assert any(words in one.said for words in ("not a file", "is a folder")), one
    in_bounds(done, good.memory_mb)
    assert not out.exists() and not list(tmp_path.glob("made*"))


def _commands(folder: Path, kind: str, recording: Path, out: Path) -> list[Sequence[object]]:
    """Every command that takes a file, with what is none in the place of each."""
    take, text, profile, npz = (folder / f"{kind}.{suffix}" for suffix in ("mcap", "csv", "json", "npz"))
    network, made = folder / f"{kind}.onnx", folder / "made.json"
    profiled = folder / f"own-{kind}.json"
    profiled.write_text(_with_network(network))
    by, at = ("--profile", "han19"), ("--from", "0", "--to", "1")
    each: list[Sequence[object]] = []
    for file in (take, text):
        each += [
            ("info", file),
            ("verify", file),
            ("track", file, *by, "--out", out),
            ("export", file, "--to", "csv", "--out", out),
            ("calibrate", "hand", file, *by, "--out", made),
            ("calibrate", "neutral", file, *at, *by, "--out", made),
            ("subspace", file, *by, "--out", made),
            ("prop", "define", file, "--points", "1,2,3", "--name", "pen", "--out", made),
            ("simulate", "natnet", "--motion", file),
        ]
    each += [
        ("record", "playback", "--file", text, "--out", folder / "made.mcap"),
        ("recover", take),
        ("track", f"@{folder / kind}.txt", *by, "--out", out),
        ("track", recording, "--profile", profile, "--out", out),
        ("track", recording, *by, "--network", network, "--out", out),
        ("track", recording, "--profile", profiled, "--out", out),
        ("layout", "show", profile),
        ("prop", "show", profile),
        ("prop", "add", profile, *by, "--out", made),
        ("calibrate", "size", "M", "--profile", profile, "--out", made),
        ("calibrate", "neutral", recording, *at, *by, "--angles", text, "--out", made),
        ("calibrate", "import", npz, *by, "--out", made),
        ("calibrate", "import", folder / f"{kind}.glb", *by, "--out", made),
        ("calibrate", "import", folder / f"{kind}.gltf", *by, "--out", made),
        ("simulate", "natnet", "--profile", profile),
        ("bench", "sequences", npz),
        (ORDER, "--layout", profile, "--out", folder / "made.onnx"),
    ]
    return each
