"""`phalanx track`: several files at once as one by one, gaps filled or left, and a calm end."""

from __future__ import annotations

import csv
import itertools
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from core.motion.performer import Performer
from core.motion.stream import MarkerStream
from core.profile import load_profile
from tests.app.command import phalanx
from tests.data import ROOT

RATE_HZ = 100.0
GAP = range(60, 85)


def points_file(path: Path, n: int, seed: int) -> Path:
    """A right hand and its left one, the right index finger without its markers for a quarter of a second."""
    stream = MarkerStream(Performer(load_profile("han19"), seed=seed), RATE_HZ, seed)
    hidden = [i for i, label in enumerate(stream.labels) if label.startswith("right_Index")]
    lines = ["frame,time_s,id,x_m,y_m,z_m"]
    for i, sent in enumerate(itertools.islice(stream.labelled(), 200, 200 + n)):
        for (x, y, z), point_id, truth in zip(sent.frame.points_m, sent.frame.ids, sent.truth, strict=True):
            if i not in GAP or truth not in hidden:
                lines.append(f"{i},{i / RATE_HZ},{point_id},{x:.9f},{y:.9f},{z:.9f}")
    path.write_text("\n".join(lines) + "\n")
    return path


def angles(folder: Path, side: str = "right") -> np.ndarray:
    """(n, 20) of one hand."""
    with (folder / "angles.csv").open() as stream:
        rows = [row for row in csv.DictReader(stream) if row["hand"] == side]
    names = list(rows[0])[5 + 6 : 5 + 26]
    return np.array([[float(row[name]) for name in names] for row in rows])


def same_files(a: Path, b: Path) -> bool:
    names = sorted(path.relative_to(a) for path in a.rglob("*.csv"))
    return names == sorted(path.relative_to(b) for path in b.rglob("*.csv")) and all(
        (a / name).read_bytes() == (b / name).read_bytes() for name in names
    )


def is_gone(group: int) -> bool:
    """Nobody of a group of processes is left, or after a moment: what counts resources ends last."""
    for _ in range(100):
        try:
            os.killpg(group, 0)
        except ProcessLookupError:
            return True
        time.sleep(0.1)
    return False


def test_several_files_at_once_are_the_same_as_one_by_one(tmp_path: Path) -> None:
    files = [points_file(tmp_path / f"take{k}.csv", 120, k) for k in range(3)]
    bad = tmp_path / "bad.csv"
    bad.write_text("not a recording\n")
    ran = phalanx("track", files[0], bad, *files[1:], "--profile", "han19", "--out", tmp_path / "all", "--json")
    assert ran.code == 1
    assert list(ran.figures["failed"]) == [str(bad)]
    assert [Path(one["file"]).name for one in ran.figures["files"]] == [path.name for path in files]
    assert [line.split(":")[0] for line in ran.out.splitlines()[:3]] == [path.name for path in files]
    for path in files:
        assert phalanx("track", path, "--profile", "han19", "--out", tmp_path / "single").code == 0
    assert same_files(tmp_path / "all", tmp_path / "single")
    everything = ran.figures["all"]
    assert everything["frames"] == 360
    assert everything["speed"] > 0.0
    for one in ran.figures["files"]:
        assert one["speed"] > 0.0
        assert one["filled"] >= len(GAP) / 120
    assert "x real time" in ran.out.splitlines()[0]


def test_gaps_live_leaves_the_frames_as_they_were_solved(tmp_path: Path) -> None:
    path = points_file(tmp_path / "take.csv", 140, 5)
    for gaps in ("fill", "live"):
        ran = phalanx("track", path, "--profile", "han19", "--gaps", gaps, "--out", tmp_path / gaps, "--json")
        assert ran.code == 0, ran.err
        assert ran.figures["gaps"] == gaps
        assert (ran.figures["files"][0]["filled"] > 0.0) == (gaps == "fill")
    fill, live = (angles(tmp_path / gaps / "take") for gaps in ("fill", "live"))
    outside = [i for i in range(140) if i not in GAP]
    np.testing.assert_array_equal(fill[outside], live[outside])
    assert not np.array_equal(fill[GAP.start : GAP.stop, 4:8], live[GAP.start : GAP.stop, 4:8])
    np.testing.assert_array_equal(fill[:, 8:], live[:, 8:])
    assert phalanx("track", path, "--profile", "han19", "--gaps", "none", "--out", tmp_path).code == 2


@pytest.mark.skipif(sys.platform == "win32", reason="Ctrl+C is another thing there")
def test_ctrl_c_ends_every_process_and_leaves_nothing_half_done(tmp_path: Path) -> None:
    files = [points_file(tmp_path / f"take{k}.csv", 6000, k) for k in range(2)]
    process = subprocess.Popen(
        [sys.executable, "-m", "app", "track", *map(str, files), "--profile", "han19", "--out", str(tmp_path / "out")],
        cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, stdin=subprocess.DEVNULL, text=True,
        start_new_session=True,
    )  # fmt: skip
    children = Path(f"/proc/{process.pid}/task/{process.pid}/children")
    deadline = time.monotonic() + 60.0
    while process.poll() is None and time.monotonic() < deadline:
        if children.exists() and len(children.read_text().split()) >= 3:  # two that solve, one that counts resources
            break
        time.sleep(0.05)
    time.sleep(1.0)
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does: to all of them
    out, err = process.communicate(timeout=60.0)
    assert process.returncode == 1
    assert err.splitlines()[-1] == "phalanx: Stopped by Ctrl+C."
    assert "Traceback" not in out + err
    assert is_gone(process.pid)
    left = [path.name for path in (tmp_path / "out").rglob("*")] if (tmp_path / "out").exists() else []
    assert not [name for name in left if name.endswith(".part") or name.startswith(".")]


def markers(folder: Path) -> dict[tuple[int, str, str], int]:
    """The point that each observed marker is, by frame, hand and marker."""
    with (folder / "markers.csv").open() as stream:
        return {
            (int(row["frame"]), row["hand"], row["marker"]): int(row["point"])
            for row in csv.DictReader(stream)
            if row["source"] == "observed"
        }


def test_labels_come_from_the_whole_recording_unless_told_otherwise(tmp_path: Path) -> None:
    """Too few markers are seen at first to know the hand by, live; what comes after tells."""
    stream = MarkerStream(Performer(load_profile("han19").with_sides(("right",)), seed=2), RATE_HZ, 2)
    lines, begin = ["frame,time_s,id,x_m,y_m,z_m"], 40
    truth: dict[tuple[int, str, str], int] = {}
    for i, sent in enumerate(itertools.islice(stream.labelled(), 200, 320)):
        keep = [k for k, true in enumerate(sent.truth) if i >= begin or true % 4 == 0]
        for row, k in enumerate(keep):
            x, y, z = sent.frame.points_m[k]
            lines.append(f"{i},{i / RATE_HZ},{sent.frame.ids[k]},{x:.9f},{y:.9f},{z:.9f}")
            truth[i, "right", stream.labels[sent.truth[k]].removeprefix("right_")] = row
    path = tmp_path / "take.csv"
    path.write_text("\n".join(lines) + "\n")
    for option in ((), ("--live-labels",)):
        ran = phalanx("track", path, "--profile", "han19", *option, "--out", tmp_path / f"out{len(option)}", "--json")
        assert ran.code == 0, ran.err
        assert ran.figures["live_labels"] == bool(option)
    assert markers(tmp_path / "out0" / "take") == truth
    assert markers(tmp_path / "out1" / "take") == {key: point for key, point in truth.items() if key[0] >= begin}
