"""`run.json` beside the results of `phalanx track`: every fact against the thing itself; a folder for each settings."""

from __future__ import annotations

import hashlib
import json
import re
import shutil
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from importlib.metadata import version
from importlib.resources import files
from pathlib import Path
from typing import Any

import ezc3d
import pytest

from app.angle_methods import angle_sentences
from app.cli import main
from app.commands.job import Job
from app.commands.result_folders import placed, tell_places
from app.commands.whole_results import solve_and_place
from core.errors import ExportError
from core.profile import load_profile, save_profile
from core.takes.formats import read_recording
from core.takes.reader import open_take
from core.takes.take import program_version
from tests.app.test_cli_track import GAP, points_file
from tests.data import ROOT


def sha256(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def record(folder: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((folder / "run.json").read_text(encoding="utf-8"))
    return found


def bytes_of(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def without_run(folder: Path) -> tuple[dict[str, bytes], dict[str, Any]]:
    said = record(folder)
    del said["run"]
    return {name: content for name, content in bytes_of(folder).items() if name != "run.json"}, said


class Desk:
    """A recording, a profile and a place for results, worked on in this process: it is quicker."""

    def __init__(self, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
        self.path, self.profile, self.out = folder / "walk.csv", folder / "anna.json", folder / "out"
        points_file(self.path, 90, 3)
        save_profile(replace(load_profile("han19"), performer="Anna"), self.profile)
        self._capsys = capsys
        self.words: list[str] = []
        self.said = ""

    def track(self, *more: object, code: int = 0) -> tuple[dict[str, Any], str]:
        """The figures, and what was said."""
        self.words = ["track", str(self.path), "--profile", str(self.profile), "--live-labels", "--out", str(self.out)]
        self.words += [*map(str, more), "--json"]
        found = main(self.words)
        out, err = self._capsys.readouterr()
        self.said = out
        assert found == code, err
        return json.loads(out.splitlines()[-1]), err

    @property
    def folders(self) -> list[str]:
        return sorted(path.name for path in self.out.iterdir())


@pytest.fixture
def desk(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Desk:
    return Desk(tmp_path, capsys)


def test_every_fact_is_true(desk: Desk) -> None:
    before = datetime.now(UTC)
    figures, _ = desk.track("--to", "csv,c3d", "--take", "--up", "z")
    folder = desk.out / "walk"
    said = record(folder)
    assert (said["format"], said["version"], said["program"]) == ("phalanx-run", 1, "Phalanx")
    assert said["program_version"] == program_version()
    assert said["input"] == {"file": "walk.csv", "bytes": desk.path.stat().st_size, "sha256": sha256(desk.path)}
    network = hashlib.sha256((files("resources") / "networks" / "labeller.onnx").read_bytes()).hexdigest()
    assert said["profiles"] == [
        {
            "file": "anna.json", "sha256": sha256(desk.profile), "performer": "Anna", "layout": "han19", "markers": 19,
            "sides": ["left", "right"], "scale": None, "shape": "generic",
            "network": {"file": "shipped", "sha256": network},
        }
    ]  # fmt: skip
    assert said["settings"] == {
        "unlabelled": False, "no_ids": False, "live_labels": True, "gaps": "fill",
        "no_neutral": False, "joints": False, "measured": False,
        "up": "z", "unit": None, "bones": "phalanx", "rate": None, "from_s": None, "to_s": None,
    }  # fmt: skip
    assert said["formats"] == ["csv", "c3d"]
    names = {"angles.csv", "joints.csv", "markers.csv", "walk.c3d", "walk_export.json", "walk.mcap"}
    assert {one["file"]: one["sha256"] for one in said["files"]} == {name: sha256(folder / name) for name in names}
    assert {path.name for path in folder.iterdir()} == names | {"run.json"}
    (told,) = figures["files"]
    assert said["figures"] == {name: value for name, value in told.items() if name not in ("file", "files", "speed")}
    assert {Path(name) for name in told["files"]} == {folder / name for name in names - {"walk_export.json"}}
    assert said["made_on"]["numpy"] == version("numpy") and said["made_on"]["onnxruntime"] == version("onnxruntime")
    assert said["run"]["command"] == desk.words
    when = datetime.fromisoformat(said["run"]["date_utc"])
    assert when.utcoffset() == timedelta(0) and before - timedelta(seconds=1) <= when <= datetime.now(UTC)
    own = ezc3d.c3d(str(folder / "walk.c3d"))["parameters"]["PHALANX"]
    assert own["SOURCE"]["value"] == ["walk.csv"] and own["SOURCE_SHA256"]["value"] == [said["input"]["sha256"]]
    assert own["PROFILES_SHA256"]["value"] == [said["profiles"][0]["sha256"]]
    assert own["SETTINGS"]["value"] == [
        "labels: each frame from those before it, as live", "gaps: fill", f"network: shipped {network[:16]}",
    ]  # fmt: skip


def test_the_methods_paragraph_states_this_run(desk: Desk) -> None:
    figures, _ = desk.track()
    said = record(desk.out / "walk")
    (told,), text = figures["files"], said["methods"]
    recording = read_recording(desk.path)
    assert f"with Phalanx {program_version()} (" in text and "CITATION.cff" in text
    assert (
        f"The recording walk.csv (SHA-256 {sha256(desk.path)}) has {recording.n_frames} frames at 100 Hz, 0.90 s."
        in text
    )
    assert "19 markers each, of layout han19, on a hand model of generic proportions whose size was found" in text
    assert f"(profile: SHA-256 {sha256(desk.profile)})" in text
    network = said["profiles"][0]["network"]["sha256"]
    assert "named by Phalanx, each frame from those before it, as live, " in text
    assert f"with the labelling network shipped with it (SHA-256 {network})." in text
    (filled,) = re.findall(r"which concerns ([\d.]+) % of the frames", text)
    assert float(filled) == pytest.approx(100.0 * told["filled"], abs=0.005) and told["filled"] >= len(GAP) / 90
    for side, hand in told["hands"].items():
        (share, rms) = re.findall(
            rf"the {side} hand was tracked in ([\d.]+) % of them \(seen markers lie ([\d.]+) mm", text
        )[0]
        assert float(share) == pytest.approx(100.0 * hand["tracked"], abs=0.005)
        assert float(rms) == pytest.approx(1000.0 * hand["rms_m"], abs=0.005)
    assert "The exported files" not in text and "neutral" not in text
    assert (
        "_std_fixed are one standard deviation of what errors of bones and of marker places add, the same in all"
        in text
    )
    assert "They follow from what is open before a hand is seen, for it was not calibrated" in text
    desk.track("--gaps", "live", "--to", "trc")
    text = record(desk.out / "walk-2")["methods"]
    assert "gaps were not filled" in text and "angles.csv" not in text and "_std" not in text


def test_the_methods_say_of_each_performer_what_the_fixed_deviations_rest_on() -> None:
    ada, ben = {"performer": "Ada", "calibrated": True}, {"performer": "Ben"}
    (_, fixed) = angle_sentences([ada, ben], {"neutral": []})
    assert "Of performer Ada they follow from what the calibration left open." in fixed
    assert "Of performer Ben they follow from what is open before a hand is seen, for it was not calibrated" in fixed
    (_, fixed) = angle_sentences([ada], {"neutral": []})
    assert "They follow from what the calibration left open." in fixed and "not calibrated" not in fixed


def test_a_part_is_said_of_the_exports_and_not_of_the_take(desk: Desk) -> None:
    desk.track("--from", 0.2, "--to-time", 0.5)
    part = "The exported files hold the part from 0.2 s to 0.5 s"
    whole = "; the figures given here are of the whole recording."
    assert f"{part}{whole}" in record(desk.out / "walk")["methods"]
    desk.track("--from", 0.2, "--to-time", 0.5, "--take")
    assert f"{part}, the take all frames{whole}" in record(desk.out / "walk")["methods"]
    with open_take(desk.out / "walk" / "walk.mcap") as take:
        assert len(take.raw) == record(desk.out / "walk")["figures"]["frames"] == 90


def test_the_size_of_each_hand_found_is_told(desk: Desk) -> None:
    """The performer's hands are the generic one's size."""
    figures, _ = desk.track()
    hands = record(desk.out / "walk")["figures"]["hands"]
    assert hands == figures["files"][0]["hands"]
    for hand in hands.values():
        assert hand["length_m"] == pytest.approx(load_profile("han19").hand.skeleton.length_m, rel=0.03)
        assert f"({100 * hand['tracked']:.1f} %, {1000 * hand['length_m']:.0f} mm)" in desk.said


def test_the_same_again_replaces_its_own_results_and_adds_formats(desk: Desk) -> None:
    desk.track()
    first = without_run(desk.out / "walk")
    desk.track()
    assert without_run(desk.out / "walk") == first
    desk.track("--to", "trc")
    again, said = without_run(desk.out / "walk")
    assert said["formats"] == ["csv", "trc"] and desk.folders == ["walk"]
    assert {one["file"] for one in said["files"]} == again.keys() == first[0].keys() | {"walk.trc"}
    assert all(again[name] == first[0][name] for name in ("angles.csv", "joints.csv", "markers.csv"))
    assert {one["file"] for one in json.loads(again["walk_export.json"])["files"]} == again.keys() - {
        "walk_export.json"
    }


def test_results_of_other_settings_go_elsewhere(desk: Desk) -> None:
    desk.track()
    before = bytes_of(desk.out / "walk")
    for _ in range(2):
        _, err = desk.track("--gaps", "live")
        assert f"{desk.out / 'walk'} holds results of other settings (gaps fill, now live): walk.csv goes to " in err
        assert desk.folders == ["walk", "walk-2"] and record(desk.out / "walk-2")["settings"]["gaps"] == "live"
    save_profile(replace(load_profile(desk.profile), scale=1.02), desk.profile)
    _, err = desk.track()
    assert "holds results of another profile or network: walk.csv goes to" in err
    assert record(desk.out / "walk-3")["profiles"][0]["scale"] == 1.02
    points_file(desk.path, 60, 4)
    _, err = desk.track()
    assert "holds results of another recording of this name" in err
    assert desk.folders == ["walk", "walk-2", "walk-3", "walk-4"] and bytes_of(desk.out / "walk") == before


def test_overwrite_replaces_what_other_settings_wrote_and_nothing_else(desk: Desk) -> None:
    desk.track("--to", "csv,trc", "--take")
    folder = desk.out / "walk"
    (folder / "notes.txt").write_text("mine")
    take = (folder / "walk.mcap").read_bytes()
    _, err = desk.track("--gaps", "live", "--overwrite")
    assert "goes to" not in err and desk.folders == ["walk"]
    assert record(folder)["settings"]["gaps"] == "live"
    assert {path.name for path in folder.iterdir()} == {
        "angles.csv", "joints.csv", "markers.csv", "walk_export.json", "run.json", "notes.txt", "walk.mcap",
    }  # fmt: skip
    assert (folder / "walk.mcap").read_bytes() == take
    assert (folder / "notes.txt").read_text() == "mine"


def test_results_that_do_not_say_what_they_are_stay(desk: Desk) -> None:
    desk.track()
    folder = desk.out / "walk"
    (folder / "run.json").unlink()  # as written by an earlier version, or by phalanx export
    before = bytes_of(folder)
    _, err = desk.track()
    assert "holds results that do not say what they came from: walk.csv goes to" in err
    assert bytes_of(folder) == before and "run.json" in bytes_of(desk.out / "walk-2")
    (folder / "run.json").write_text("mine")
    figures, err = desk.track("--overwrite", code=1)
    assert "run.json is no record of a run of Phalanx. Move it away" in figures["error"]
    assert (folder / "run.json").read_text() == "mine"


def test_resume_does_what_is_not_there_whole(desk: Desk) -> None:
    def skipped(*more: object) -> bool:
        figures, err = desk.track("--resume", *more)
        n = len(figures["skipped"])
        assert f"{n} of 1 files are done already, {1 - n} to do." in err
        assert figures["files"][0]["tracked"] == record(desk.out / "walk")["figures"]["tracked"]
        return n == 1

    assert not skipped()
    first = without_run(desk.out / "walk")
    assert skipped()
    assert not skipped("--to", "csv,trc") and skipped("--to", "trc") and skipped()
    (desk.out / "walk" / "angles.csv").unlink()
    assert not skipped() and skipped()
    (desk.out / "walk" / "angles.csv").write_text("edited")
    assert not skipped()
    assert without_run(desk.out / "walk")[0]["angles.csv"] == first[0]["angles.csv"]
    assert desk.folders == ["walk"]
    assert not skipped("--gaps", "live") and skipped("--gaps", "live") and skipped()


def test_resume_ends_as_the_whole_batch_would(desk: Desk) -> None:
    """A recording with a hole ends with status 3, and so does a batch in which it was done before."""
    lines = desk.path.read_text().splitlines()
    desk.path.write_text(
        "\n".join(line for line in lines if not 30 <= int(line.split(",")[0].replace("frame", "0")) < 50)
    )
    figures, _ = desk.track(code=3)
    again, _ = desk.track("--resume", code=3)
    assert again.pop("skipped") == [str(desk.path)] and not figures.pop("skipped")
    (one,), (other,) = figures.pop("files"), again.pop("files")
    assert one.pop("speed") > 0.0 and other.pop("speed") is None
    assert sorted(one.pop("files")) == sorted(other.pop("files"))
    assert (one, figures) == (other, again) and one["holes"]["frames"] == [20]


def test_a_folder_that_another_writes_to_meanwhile_is_left_to_it(desk: Desk, tmp_path: Path) -> None:
    desk.track()
    folder = desk.out / "walk"
    theirs = bytes_of(folder)
    shutil.move(folder, tmp_path / "theirs")

    def progress(share: float, text: str) -> None:
        if not folder.exists():
            shutil.move(tmp_path / "theirs", folder)

    job = Job(desk.path, ("han19",), folder, unlabelled=False, live_labels=True, fill=False)
    with pytest.raises(ExportError, match=r"Another Phalanx wrote to .*walk meanwhile"):
        solve_and_place(job, progress)
    assert bytes_of(folder) == theirs and desk.folders == ["walk"]


def test_results_that_came_while_a_batch_was_under_way_are_left(desk: Desk) -> None:
    """A long batch chooses its folders first; another run may fill one before it is that file's turn."""
    job = Job(desk.path, ("han19",), desk.out / "walk", unlabelled=False, live_labels=True, fill=False)
    (chosen,) = placed([job], resume=False)
    desk.track()
    theirs = bytes_of(chosen.job.folder)
    with pytest.raises(ExportError, match=r"walk holds results of something else by now\. Do this file again"):
        solve_and_place(chosen.job, lambda share, text: None)
    assert bytes_of(chosen.job.folder) == theirs and desk.folders == ["walk"]
    (again,) = placed([job], resume=False)
    assert again.job.folder.name == "walk-2"


def test_a_folder_is_not_taken_from_a_file_of_its_name(desk: Desk, capsys: pytest.CaptureFixture[str]) -> None:
    jobs = []
    for name in ("walk", "walk-2", "run", "new"):
        path, folder = desk.path.with_name(f"{name}.csv"), desk.out / name
        path.write_bytes(desk.path.read_bytes())
        if name in ("walk", "run"):
            folder.mkdir(parents=True)
            (folder / "run.json").write_text('{"format": "phalanx-run", "input": {}}')
        jobs.append(Job(path, ("han19",), folder, False, True, True))
    found = placed(jobs, resume=True)
    assert [one.job.folder.name for one in found] == ["walk-3", "walk-2", "run-2", "new"]
    assert [bool(one.instead) for one in found] == [True, False, True, False]
    assert not any(one.before for one in found)
    tell_places(found)
    reason = "results of another recording of this name"
    assert capsys.readouterr().err.splitlines() == [
        f"phalanx: {desk.out / name} holds {reason}: {name}.csv goes to {desk.out / place} (--overwrite replaces it)."
        for name, place in (("walk", "walk-3"), ("run", "run-2"))
    ]


def test_what_cannot_be_solved_leaves_nothing(desk: Desk) -> None:
    desk.path.write_text("not a recording\n")
    desk.track(code=1)
    assert not desk.out.exists()


def test_the_citation_is_of_this_version() -> None:
    lines = (ROOT / "CITATION.cff").read_text(encoding="utf-8").splitlines()
    top = dict(line.split(": ", 1) for line in lines if ": " in line and line[0] not in " -")
    assert top["cff-version"] == "1.2.0" and top["title"] == "Phalanx" and top["type"] == "software"
    assert top["version"] == re.search(r'(?m)^version = "(.+)"', (ROOT / "pyproject.toml").read_text()).group(1)  # type: ignore[union-attr]
    assert "  - name: The Phalanx developers" in lines and "message" in top
