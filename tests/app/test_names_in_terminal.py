"""Names that act where they are shown: from every file and server, through real processes, to every output."""

from __future__ import annotations

import csv
import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from core.frames import RigidBody
from core.takes.formats import read_recording
from core.takes.reader import open_take
from devices.natnet.simulator import NatNetSimulator
from tests.app.command import TIMEOUT_S, Ran
from tests.app.evil import EVIL, EVIL_FILE, SHOWN, assert_calm, evil_profile, evil_take
from tests.app.stage import performance
from tests.data import ROOT


def phalanx(*words: object, **environment: str) -> Ran:
    """The real command; neither what it prints nor its figures hold anything that acts."""
    done = subprocess.run(
        [sys.executable, "-m", "app", *map(str, words)],
        cwd=ROOT, capture_output=True, stdin=subprocess.DEVNULL, timeout=TIMEOUT_S, check=False,
        env={**os.environ, **environment},
    )  # fmt: skip
    out, err = (text.decode("utf-8") for text in (done.stdout, done.stderr))
    assert "Traceback" not in out + err, err
    assert_calm(out)
    assert_calm(err)
    return Ran(done.returncode, out, err)


@pytest.fixture(scope="module")
def profile_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("profile") / "profile.json"
    path.write_text(evil_profile().to_json(), encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def take_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A take whose every text is such a name, in a file of such a name in a folder of such a name."""
    return evil_take(tmp_path_factory.mktemp("takes") / EVIL_FILE)


def points(folder: Path) -> Path:
    """A recording in the formats' own words, labelled with such names."""
    path = folder / f"{EVIL_FILE}.trc"
    labels = ("\x1b[2JThumb", "\u202eIndex", "<b>x</b>")
    head = (
        "PathFileType\t4\t(X/Y/Z)\tx.trc\nDataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\n100\t100\t3\t3\tmm\n"
        "Frame#\tTime\t" + "\t\t\t".join(labels) + "\t\t\t\n\t\tX1\tY1\tZ1\tX2\tY2\tZ2\tX3\tY3\tZ3\n\n"
    )
    rows = "".join(f"{i}\t{i / 100}\t1\t2\t3\t4\t5\t6\t7\t8\t{9 + i}\n" for i in range(1, 4))
    path.write_text(head + rows, encoding="utf-8")
    return path


@pytest.mark.parametrize("command", ("info", "verify"))
def test_what_is_said_of_a_take(take_file: Path, command: str) -> None:
    said = phalanx(command, take_file, "--json")
    assert "FORGED" in said.out
    figures = said.figures
    assert figures["take"] == str(take_file), "the path in the figures is the path"
    if command == "info":
        assert figures["name"] == SHOWN
        assert SHOWN in said.out


@pytest.mark.parametrize("command", ("info", "verify"))
def test_what_is_said_of_a_recording(tmp_path: Path, command: str) -> None:
    path = points(tmp_path)
    said = phalanx(command, path, "--json")
    assert said.figures["markers"] == [r"\x1b[2JThumb", r"\u202eIndex", "<b>x</b>"]
    assert r"\x1b[2J\nFORGED\udce9" in said.out


def test_what_is_exported(take_file: Path, tmp_path: Path) -> None:
    """Every file can be read again, no cell, line or formula comes of a name, and no file has a name that acts."""
    said = phalanx("export", take_file, "--to", "c3d,trc,csv,points,bvh,gltf", "--out", tmp_path / "out", "--json")
    assert said.code == 0, said.err
    files = [path for path in (tmp_path / "out").rglob("*") if path.is_file()]
    assert len(files) > 8
    for path in files:
        assert_calm(path.name)
        if path.suffix in (".csv", ".json", ".trc", ".bvh"):
            assert_calm(path.read_text(encoding="utf-8"))
    for path in files:
        if path.suffix == ".csv":
            with path.open(encoding="utf-8", newline="") as stream:
                rows = list(csv.reader(stream))
            assert {len(row) for row in rows} == {len(rows[0])}, path
            assert not [cell for row in rows for cell in row if cell.startswith(("=", "@"))], path
        elif path.suffix in (".c3d", ".trc"):
            assert_calm(" ".join(read_recording(path).labels))
    record = json.loads(next(path for path in files if path.name.endswith("_export.json")).read_text("utf-8"))
    assert record["recording"]["performers"][0]["name"] == SHOWN


def test_what_is_solved(profile_file: Path, tmp_path: Path) -> None:
    """Names of profile, layout, markers and props; a recording of such a name; run.json and its methods."""
    lines = ["frame,time_s,id,x_m,y_m,z_m"]
    for i, frame in enumerate(performance()[:40]):
        lines += [f"{i},{i / 120},{n},{x},{y},{z}" for n, (x, y, z) in zip(frame.ids, frame.points_m, strict=True)]
    folder = tmp_path / EVIL_FILE
    folder.mkdir()
    path = folder / f"{EVIL_FILE}.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    out = tmp_path / "out\x1b[2J"
    said = phalanx("track", path, "--profile", profile_file, "--out", out, "--take", "--json")
    assert said.code in (0, 3), said.err
    made = [path for path in out.rglob("*") if path.is_file()]
    (run,) = (path for path in made if path.name == "run.json")
    text = run.read_text(encoding="utf-8")
    assert_calm(text)
    assert_calm(json.loads(text)["methods"])
    (take,) = (path for path in made if path.suffix == ".mcap")
    with open_take(take) as solved:
        assert solved.profile.performer == SHOWN
        assert_calm(solved.info.name)


def test_what_is_typed_is_quoted(tmp_path: Path) -> None:
    for words in (
        ("info", EVIL), ("export", EVIL, "--to", EVIL), ("track", EVIL, "--profile", EVIL, "--out", tmp_path),
        (EVIL,), ("info", "x", EVIL), ("verify", "x" * 300_00),
        ("record", "natnet", "--out", tmp_path / "x", "--server", EVIL),
        ("layout", "show", EVIL), ("prop", "show", EVIL), ("simulate", "natnet", EVIL),
    ):  # fmt: skip
        said = phalanx(*words)
        assert said.code in (1, 2), words
        assert len(said.err) < 8000, "shortened"


def test_a_terminal_without_our_letters_is_no_reason_to_fail(take_file: Path) -> None:
    said = phalanx("info", take_file, PYTHONIOENCODING="ascii")
    assert said.code == 0, said.err


@pytest.mark.parametrize("name", (EVIL, "x" * 200))
def test_what_a_server_says_of_itself(tmp_path: Path, name: str) -> None:
    frames = [
        replace(frame, rigid_bodies=(RigidBody(7, name, np.zeros(3), np.array([1.0, 0, 0, 0]), True),))
        for frame in performance()[:120]
    ]
    with NatNetSimulator(frames, 120.0, command_port=0, data_port=0, loop=True, name=name) as server:
        server.start()
        said = phalanx(
            "record", "natnet", "--server", "127.0.0.1", "--local", "127.0.0.1",
            "--command-port", server.command_port, "--data-port", server.data_port,
            "--seconds", "1", "--out", tmp_path / EVIL_FILE, "--notes", EVIL, "--json",
        )  # fmt: skip
    assert said.code in (0, 3), said.err
    (path,) = tmp_path.glob("*.mcap")
    with open_take(path) as take:
        assert_calm(" ".join([*take.info.device, *take.info.device.values(), take.info.name]))
        assert_calm(take.raw[0].rigid_bodies[0].name)
        assert "FORGED" in take.info.notes, "a note may have lines"


def test_the_log_holds_no_line_of_a_name(tmp_path: Path) -> None:
    script = (
        "from app.notifications import LOG, NotificationCentre, start_log\nfrom pathlib import Path\nimport sys\n"
        "start_log(Path(sys.argv[1])); centre = NotificationCentre()\n"
        "centre.problem(sys.argv[2], sys.argv[2], sys.argv[2]); LOG.warning('%s', sys.argv[2])\n"
        "try:\n    raise RuntimeError(sys.argv[2])\nexcept RuntimeError as error:\n    centre.error(error, 'x')\n"
    )
    subprocess.run([sys.executable, "-c", script, tmp_path, EVIL], cwd=ROOT, check=True, timeout=TIMEOUT_S)
    text = (tmp_path / "phalanx.log").read_text(encoding="utf-8")
    assert text.count("FORGED") >= 4
    assert not [line for line in text.splitlines() if line.startswith("FORGED")]
    assert "\x1b" not in text and "\x9b" not in text


def test_the_last_net_lets_nothing_through() -> None:
    """Whatever a command prints, also what no record has mended."""
    script = (
        "import sys\nfrom app.commands.printable_output import printable_output\n"
        "with printable_output():\n    print(sys.argv[1]); print(sys.argv[1], file=sys.stderr)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", script, "\x1b[2J\x9b\u202eé–"],
        cwd=ROOT, capture_output=True, check=True, timeout=TIMEOUT_S, env={**os.environ, "PYTHONIOENCODING": "ascii"},
    )  # fmt: skip
    shown = b"\\x1b[2J\\x9b\\u202e\\xe9\\u2013\n"
    assert (done.stdout, done.stderr) == (shown, shown)
