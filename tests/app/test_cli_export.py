"""`phalanx export` and `phalanx track --to --take`: how files are written, by the command line."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from app.cli import main
from app.commands.export_options import formats
from core.frames import HandState
from core.takes.export import export
from core.takes.formats import read_recording
from core.takes.reader import open_take
from core.takes.take import Mark, TakeInfo
from core.takes.verify import verify
from core.takes.whole import write_take
from tests.app.command import phalanx
from tests.core.export.recordings import RATE, every_point, solution


def write(path: Path, tracked: bool = True) -> Path:
    """A take of two hands, whose name inside is another than its file's."""
    some = solution(120, lost=(), untracked=(0, 0))
    solved = some.solved if tracked else [
        replace(frame, hands=tuple(replace(hand, state=HandState.SEARCHING) for hand in frame.hands))
        for frame in some.solved
    ]  # fmt: skip
    info = TakeInfo("inner", "Anna", rate_hz=RATE, notes="cold hands", rating="A", shot="coffee")
    write_take(path, info, some.cast, zip(some.raw, solved, strict=True), (Mark(0.5, "Grasp"),))
    return path


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("takes")
    write(folder / "one.mcap")
    write(folder / "two.mcap", tracked=False)
    return folder


def test_files_are_named_after_the_file_and_follow_every_option(folder: Path, tmp_path: Path) -> None:
    ran = phalanx(
        "export", folder / "one.mcap", "--to", "c3d,trc,csv,gltf", "--out", tmp_path, "--measured", "--up", "z",
        "--unit", "m", "--rate", 60, "--from", 0.25, "--to-time", 0.75, "--joints", "--json",
    )  # fmt: skip
    assert ran.code == 0, ran.err
    assert [Path(file).name for file in ran.figures["files"]][:2] == ["one.c3d", "one.trc"]
    assert Path(ran.figures["files"][-1]).name == "marks.csv"
    assert "glTF is Y up, and so is this file" in ran.err and "CSV keeps the recording's own frames" in ran.err
    recording = every_point(tmp_path / "one.c3d")
    assert (recording.rate_hz, recording.n_frames) == (60.0, 31) and "R_thumb_tip_joint" in recording.labels
    record = json.loads(Path(ran.figures["record"]).read_text(encoding="utf-8"))
    assert record["recording"]["notes"] == "cold hands" and record["recording"]["shot"] == "coffee"
    assert (
        record["files"][0]["up"] == "z" and record["files"][0]["unit"] == "m" and record["files"][0]["from_s"] == 0.25
    )
    header, mark = (tmp_path / "marks.csv").read_text().splitlines()
    assert header == "time_s,frame,text,time_source_s" and mark.startswith("0.250000,7060,Grasp,")


def test_several_takes_go_into_folders_and_what_fails_stops_nothing(folder: Path, tmp_path: Path) -> None:
    gone = folder / "gone.mcap"
    ran = phalanx(
        "export", folder / "one.mcap", gone, folder / "two.mcap", "--to", "bvh,trc", "--out", tmp_path, "--json"
    )
    assert ran.code == 1
    assert f"There is no take {gone}" in ran.err and "there is no motion for bvh" in ran.err
    made = sorted(str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*.*") if path.is_file())
    assert {"one/one.trc", "one/one_left.bvh", "one/one_right.bvh", "two/two.trc"} <= set(made)
    one, missing, two = ran.figures["takes"]
    assert one["failed"] == {} and list(two["failed"]) == ["bvh"] and missing["files"] == []


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (("--from", 5), "no frames from 5 s to its end: its frames are from 0 to 0.992 s"),
    ],
)
def test_what_cannot_be_asked_for_says_why(folder: Path, tmp_path: Path, words: tuple[object, ...], why: str) -> None:
    ran = phalanx("export", folder / "one.mcap", "--to", "c3d", "--out", tmp_path / "x", *words)
    assert ran.code == 1 and why in ran.err and not (tmp_path / "x").exists()


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (("--to", "fbx"), "argument --to: 'fbx' is no export format in 'fbx': choose of c3d, trc"),
        (("--to", ""), "argument --to: a format is missing in ''"),
        (("--to", "c3d,,trc"), "argument --to: a format is missing in 'c3d,,trc'"),
        (("--bones", "foo"), "argument --bones: 'foo' is no way to name bones. Choose of phalanx"),
        (("--rate", "0"), "argument --rate: 0 Hz is no rate to export at. Choose 0.1 to"),
        (("--rate=-5",), "argument --rate: -5 Hz is no rate"),
        (("--rate", "fast"), "argument --rate: invalid float value: 'fast'"),
        (("--from", "nan"), "argument --from: nan s is no time. Give seconds from the first frame."),
        (("--from", "-1"), "argument --from: -1 s is before the first frame"),
        (("--to-time", "-0.5"), "argument --to-time: -0.5 s is before the first frame"),
        (("--to-time", "later"), "argument --to-time: 'later' is no number of seconds"),
        (("--from", "0.5", "--to-time", "0.2"), "would end, at 0.2 s, before it begins, at 0.5 s"),
    ],
)
@pytest.mark.parametrize("command", ["export", "track"])
def test_usage_mistakes_are_told_as_such(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, command: str, words: tuple[str, ...], why: str
) -> None:
    to = () if words[0] == "--to" else ("--to", "c3d")
    with pytest.raises(SystemExit) as ended:
        main([command, "a.mcap", "--out", str(tmp_path / "x"), *to, *words])
    told = " ".join(capsys.readouterr().err.split())
    assert ended.value.code == 2 and f"phalanx {command}: error: " in told and why in told
    assert told.startswith(f"usage: phalanx {command}") and not (tmp_path / "x").exists()


def test_formats_in_any_case_and_each_once() -> None:
    assert formats("C3D, trc,c3d") == ("c3d", "trc")


def test_what_is_there_already_says_how_to_replace_it(folder: Path, tmp_path: Path) -> None:
    words = ("export", folder / "two.mcap", "--to", "trc", "--out", tmp_path)
    assert phalanx(*words).code == 0
    again = phalanx(*words)
    assert again.code == 1 and "two.trc exists already" in again.err and "--overwrite" in again.err
    assert phalanx(*words, "--overwrite").code == 0


def test_of_several_takes_each_line_says_whose_it_is_and_alike_notes_come_once(tmp_path: Path) -> None:
    for name, kept in (("even", 120), ("hole", 60)):
        some = solution(120, lost=(), untracked=(0, 0))
        pairs = [
            tuple(replace(one, times=replace(one.times, host_s=one.times.host_s + (i >= kept))) for one in pair)
            for i, pair in enumerate(zip(some.raw, some.solved, strict=True))
        ]
        write_take(tmp_path / f"{name}.mcap", TakeInfo(name, rate_hz=RATE), some.cast, pairs, ())
    words = ("--to", "trc,csv", "--rate", 60, "--joints", "--json")
    ran = phalanx("export", tmp_path / "even.mcap", tmp_path / "hole.mcap", "--out", tmp_path / "out", *words)
    assert ran.code == 3, ran.err
    assert ran.err.count("CSV keeps the recording's own frames") == 1
    assert "phalanx: all 2: CSV keeps the recording's own frames" in ran.err
    (gap,) = [line for line in ran.out.splitlines()[:-1] if "without frames" in line]
    assert gap.startswith("hole.mcap: 1.0") and gap.endswith("hole_holes.csv says where.")
    alone = phalanx("export", tmp_path / "hole.mcap", "--out", tmp_path / "alone", *words)
    assert "phalanx: CSV keeps the recording's own frames" in alone.err
    assert any(line.startswith("1.0") for line in alone.out.splitlines())


def test_a_recording_becomes_files_and_a_take(tmp_path: Path) -> None:
    """A C3D of another program: solved, exported, and a take that review opens and verify calls whole."""
    (source,) = export(replace(solution(120, lost=(), untracked=(0, 0)), name="subject 1"), ["c3d"], tmp_path / "in")
    words = (
        "track", source, "--profile", "han19", "--out", tmp_path / "out", "--to", "trc,bvh,points", "--up", "z",
        "--take", "--json",
    )  # fmt: skip
    ran = phalanx(*words)
    assert ran.code == 0, ran.err
    (figures,) = ran.figures["files"]
    out = tmp_path / "out" / "subject 1"
    names = {"subject 1.trc", "points.csv", "subject 1_left.bvh", "subject 1_right.bvh", "subject 1.mcap"}
    assert names <= {Path(file).name for file in figures["files"]}
    assert verify(out / "subject 1.mcap").findings == ()
    with open_take(out / "subject 1.mcap") as take:
        assert take.complete and take.sealed and len(take.raw) == len(take.solved) == 120
        assert take.counts is not None and take.counts.balanced and take.counts.tracked["right"] == 120
        assert take.info.rate_hz == RATE and take.info.name == "subject 1"
        recording = read_recording(source)
        seen = ~np.isnan(recording.points_m[50]).any(axis=1)
        np.testing.assert_array_equal(take.raw[50].points_m, recording.points_m[50][seen])
        assert take.profiles[0].layout.name == "han19"
    before = (out / "subject 1.mcap").read_bytes()
    again = phalanx(*words)
    assert again.code == 1 and "Takes are never overwritten" in again.err
    assert (out / "subject 1.mcap").read_bytes() == before
    assert phalanx("verify", out / "subject 1.mcap").code == 0


def test_a_take_that_is_solved_again_keeps_what_was_said_and_counted(folder: Path, tmp_path: Path) -> None:
    ran = phalanx("track", folder / "one.mcap", "--out", tmp_path, "--to", "c3d", "--live-labels", "--take", "--json")
    assert ran.code == 0, ran.err
    with open_take(folder / "one.mcap") as before, open_take(tmp_path / "one" / "one.mcap") as after:
        assert after.marks == before.marks and after.info == replace(before.info, name="one")
        assert after.counts is not None and before.counts is not None
        assert (after.counts.received, after.counts.lost) == (before.counts.received, before.counts.lost)
        assert [frame.sequence for frame in after.raw] == [frame.sequence for frame in before.raw]
    assert "marks.csv" in [Path(file).name for file in ran.figures["files"][0]["files"]]
