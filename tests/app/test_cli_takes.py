"""The command line on takes: captured over loopback, looked at, cut short, recovered, exported."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from app.live_numbers import SKIPPED
from core.frames import HandState
from core.takes.formats import read_recording
from core.takes.reader import open_take
from tests.app.command import phalanx, serving
from tests.data import ROOT, data_path

FRAMES_S = 120
SECONDS = 2.0


@pytest.fixture(scope="module")
def take(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A take of the simulated performer, captured by the real client."""
    path = tmp_path_factory.mktemp("takes") / "performer.mcap"
    with serving("--hide", 0.05, "--ghosts", 0.5, "--seed", 3) as (command_port, data_port):
        ran = phalanx(
            "record", "natnet", "--command-port", command_port, "--data-port", data_port, "--seconds", SECONDS,
            "--out", path, "--profile", "han19", "--notes", "loopback", "--shot", "tea", "--json",
        )  # fmt: skip
    assert ran.code == 0, ran.err
    figures = ran.figures
    assert figures["take"] == str(path)
    assert figures["received"] == figures["written"] + sum(figures["dropped"].values())
    assert figures["dropped"] == {}
    assert figures["lost"] == 0
    assert 0 < figures["received"] <= 1.1 * FRAMES_S * SECONDS  # fewer where the machine has other work
    assert figures["sealed"] is True
    return path


def test_a_recorded_take_holds_every_frame_and_two_tracked_hands(take: Path) -> None:
    with open_take(take) as opened:
        sequences = [frame.sequence for frame in opened.raw]
        assert sequences == list(range(sequences[0], sequences[0] + len(sequences)))
        solved = [frame.sequence for frame in opened.solved]  # the solver skips frames where the machine has other work
        assert solved == [number for number in sequences if number in set(solved)]
        assert set(opened.counts.unsolved) <= {SKIPPED}
        assert len(solved) + sum(opened.counts.unsolved.values()) == len(sequences)
        assert {hand.side for hand in opened.solved[-1].hands if hand.state is HandState.TRACKED} == {"left", "right"}
        assert (opened.info.notes, opened.info.shot) == ("loopback", "tea")
        assert opened.info.rate_hz == FRAMES_S


def test_info_and_verify_say_what_the_take_holds(take: Path) -> None:
    info = phalanx("info", take, "--json")
    assert info.code == 0
    figures = info.figures
    assert (figures["layout"], figures["shot"]) == ("han19", "tea")
    assert figures["sealed"] is True
    assert figures["counts"]["written"] == figures["raw"]
    assert f"{figures['raw']:,} raw" in info.out
    verified = phalanx("verify", take, "--json")
    assert verified.code == 0
    assert verified.figures["ok"] is True
    assert verified.figures["raw"] == figures["raw"]
    recovered = phalanx("recover", take, "--json")
    assert (recovered.code, recovered.figures["recovered_take"]) == (0, None)


def test_a_cut_take_is_recovered_with_its_loss(take: Path, tmp_path: Path) -> None:
    cut = tmp_path / "cut.mcap"
    content = take.read_bytes()
    cut.write_bytes(content[: len(content) // 2])
    info = phalanx("info", cut, "--json")
    assert info.code == 3
    assert phalanx("verify", cut).code == 3
    ran = phalanx("recover", cut, "--json")
    figures = ran.figures
    assert ran.code == 3
    assert figures["lost"] > 0
    assert figures["recovered"] == info.figures["raw"]
    assert cut.read_bytes() == content[: len(content) // 2]
    again = phalanx("verify", figures["recovered_take"], "--json")
    assert (again.code, again.figures["raw"]) == (3, figures["recovered"])  # whole it is not


def test_export_to_every_format_and_never_over_another(take: Path, tmp_path: Path) -> None:
    out = tmp_path / "exports"
    words = ["export", take, "--to", "c3d,trc,csv,bvh,gltf", "--out", out, "--json"]
    ran = phalanx(*words)
    assert ran.code == 0, ran.err
    files = [Path(name) for name in ran.figures["files"]]
    assert {path.suffix for path in files} == {".c3d", ".trc", ".csv", ".bvh", ".glb"}
    assert {"markers.csv", "angles.csv", "joints.csv"} <= {path.name for path in files}
    record = Path(ran.figures["record"])
    assert sorted(out.iterdir()) == sorted([*files, record]) and record.name == "performer_export.json"
    header = (out / "markers.csv").read_text().splitlines()[0]
    assert header == "frame,time_s,hand,marker,x_m,y_m,z_m,source,point,confidence,std_m,time_source_s"
    before = {path: path.read_bytes() for path in files}
    again = phalanx(*words)
    assert again.code == 1
    assert "exists already" in again.err
    assert {path: path.read_bytes() for path in files} == before
    assert phalanx(*words, "--overwrite").code == 0


def test_an_unknown_format_names_the_known_ones(take: Path, tmp_path: Path) -> None:
    ran = phalanx("export", take, "--to", "fbx", "--out", tmp_path / "x")
    assert ran.code == 2
    assert "fbx" in ran.err
    assert "c3d" in ran.err
    assert not (tmp_path / "x").exists()


def test_a_take_is_solved_again_to_the_same_hands(take: Path, tmp_path: Path) -> None:
    ran = phalanx("track", take, "--profile", "han19", "--out", tmp_path, "--json")
    assert ran.code == 0, ran.err
    (figures,) = ran.figures["files"]
    assert set(figures["hands"]) == {"left", "right"}
    with open_take(take) as opened:
        assert figures["frames"] == len(opened.raw)
    own = phalanx("track", take, "--out", tmp_path / "own")  # by the profile saved in the take
    assert own.code == 0, own.err
    tables = [folder / take.stem / "angles.csv" for folder in (tmp_path, tmp_path / "own")]
    assert tables[0].read_bytes() == tables[1].read_bytes()


def test_track_needs_a_profile_for_what_is_no_take(tmp_path: Path) -> None:
    path = tmp_path / "points.csv"
    path.write_text("frame,time_s,id,x_m,y_m,z_m\n" + "".join(f"{f},{f / 50},1,0,1,0\n" for f in range(10)))
    ran = phalanx("track", path, "--out", tmp_path / "out")
    assert ran.code == 1
    assert "--profile" in ran.err
    assert not (tmp_path / "out").exists()


def test_record_never_overwrites(take: Path) -> None:
    before = take.read_bytes()
    ran = phalanx("record", "natnet", "--out", take)
    assert ran.code == 1
    assert "exists already" in ran.err
    assert take.read_bytes() == before


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["natnet", "--command-port", "9"], "No NatNet server answers"),
        (["natnet", "--server", "no.such.host.invalid"], "no.such.host.invalid"),
        (["natnet", "--command-port", "99999"], "99999"),
        (["natnet", "--local", "203.0.113.7"], "203.0.113.7"),
        (["playback"], "No file"),
        (["playback", "--file", "absent.trc"], "absent.trc"),
        (["playback", "--speed", "1000"], "1000"),
        (["natnet", "--seconds", "-1"], "-1"),
        (["natnet", "--profile", "no-such-profile"], "no-such-profile"),
    ],
)
def test_record_says_why_it_cannot(tmp_path: Path, words: list[str], said: str) -> None:
    ran = phalanx("record", *words, "--out", tmp_path / "take", "--json")
    assert ran.code == 1
    assert said in ran.figures["error"]
    assert [line for line in ran.err.splitlines() if line.startswith("phalanx:")] == [
        f"phalanx: {ran.figures['error']}"
    ]
    assert list(tmp_path.iterdir()) == []


def test_record_ends_a_played_file_by_itself_and_ctrl_c_ends_the_rest(tmp_path: Path) -> None:
    """A recording without end is stopped by Ctrl+C: the take is sealed and whole."""
    path = tmp_path / "stopped.mcap"
    process = subprocess.Popen(
        [sys.executable, "-m", "app", "record", "demo", "--out", str(path)],
        cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert process.stderr is not None
    while "Recording" not in (line := process.stderr.readline()):
        assert line, "ended before it recorded"
    time.sleep(1.0)
    os.kill(process.pid, signal.SIGINT)
    out, errors = process.communicate(timeout=120)
    assert process.returncode == 0, errors
    assert "dropped 0" in out
    assert phalanx("verify", path).code == 0


def test_a_recording_is_served_received_and_labelled(tmp_path: Path) -> None:
    """A real glove, as unlabelled points among all others of its room, over the wire and into a take."""
    recording = data_path("qualisys_hand", "recording.tsv")
    path = tmp_path / "glove.mcap"
    with serving("--motion", recording) as (command_port, data_port):
        ran = phalanx(
            "record", "natnet", "--command-port", command_port, "--data-port", data_port, "--seconds", 2,
            "--out", path, "--profile", "qualisys13", "--json",
        )  # fmt: skip
    assert ran.code == 0, ran.err
    assert ran.figures["lost"] == 0
    with open_take(path) as opened:
        states = [frame.hands[0].state for frame in opened.solved]
        assert states.count(HandState.TRACKED) >= 0.99 * len(states)


def test_track_writes_its_tables_and_its_figures(tmp_path: Path) -> None:
    recording = data_path("han2018", "trc", "user2_sequence.12_training_dense_left.trc")
    ran = phalanx("track", recording, "--profile", "han19", "--out", tmp_path, "--unlabelled", "--json")
    assert ran.code == 0, ran.err
    (figures,) = ran.figures["files"]
    source = read_recording(recording)
    assert figures["frames"] == source.n_frames
    assert set(figures["hands"]) == {"left"}
    assert figures["labelled_points"] == 19 * source.n_frames
    assert figures["labels_right"] > 0.99
    assert figures["tracked"] > 0.99
    assert 0.001 < figures["rms_m"] < 0.005
    folder = tmp_path / recording.stem
    assert sorted(path.name for path in folder.glob("*.csv")) == ["angles.csv", "joints.csv", "markers.csv"]
    angles = (folder / "angles.csv").read_text().splitlines()
    assert angles[0].startswith("frame,time_s,hand,state,rms_m,")
    assert len(angles[0].split(",")) == 5 + 4 * 26 + 1
    again = phalanx("track", recording, "--profile", "han19", "--out", tmp_path, "--unlabelled")
    assert again.code == 0
    assert (folder / "angles.csv").read_text().splitlines() == angles


def test_track_goes_on_after_a_bad_file_and_fails_at_its_end(tmp_path: Path) -> None:
    good = data_path("han2018", "trc", "gaps_user1_sequence.14_training_dense_right.trc")
    bad = tmp_path / "bad.trc"
    bad.write_text("not a recording\n")
    ran = phalanx("track", bad, good, "--profile", "han19", "--out", tmp_path / "out", "--json")
    assert ran.code == 1
    assert list(ran.figures["failed"]) == [str(bad)]
    (figures,) = ran.figures["files"]
    assert figures["frames"] == 49  # its header promises 50
    assert figures["labels_given"] is True
    assert (tmp_path / "out" / good.stem / "markers.csv").exists()
