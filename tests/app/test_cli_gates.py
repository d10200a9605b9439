"""`phalanx track` on real recordings whose names, unit, side or layout are wrong: not tracked, status 3, and why."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

from app.commands.track import _share
from app.least import LEAST_TRACKED
from app.review import tasks
from core.profile import load_profile, save_profile
from tests.app.command import Ran, phalanx
from tests.data import data_path

N = 300  # frames of the glove


def glove(folder: Path, **renamed: str) -> Path:
    """The first seconds of the glove; renamed: what a marker is called."""
    lines = data_path("qualisys_hand", "recording.tsv").read_text().split("\n")
    at = next(i for i, line in enumerate(lines) if line.startswith("Frame\t"))
    cells = lines[9].split("\t")
    assert cells[0] == "MARKER_NAMES"
    lines[9] = "\t".join([cells[0], *(renamed.get(name, name) for name in cells[1:])])
    titles = [title.rpartition(" ") for title in lines[at].split("\t")]
    lines[at] = "\t".join(f"{renamed.get(name, name)}{space}{axis}" for name, space, axis in titles)
    lines[0] = f"NO_OF_FRAMES\t{N}"
    path = folder / "glove.tsv"
    path.write_text("\n".join(lines[: at + 1 + N]) + "\n")
    return path


def han(folder: Path, unit: str = "mm", factor: float = 1.0) -> Path:
    """A left hand of Han's third user; its values times `factor`, called `unit`."""
    lines = data_path("han2018", "trc", "user3_sequence.12_training_dense_left.trc").read_text().split("\n")
    lines[2] = lines[2].replace("mm", unit)
    first = next(i for i, line in enumerate(lines) if line.startswith("0\t"))
    for i in range(first, len(lines)):
        cells = lines[i].rstrip().split("\t")
        if len(cells) > 2:
            values = [f"{float(cell) * factor:.7f}" for cell in cells[2:]]
            lines[i] = "\t".join([*cells[:2], *values])
    path = folder / "han.trc"
    path.write_text("\n".join(lines))
    return path


def track(path: Path, worn: object, *more: object) -> Ran:
    return phalanx("track", path, "--profile", worn, "--gaps", "live", "--out", path.parent / "out", "--json", *more)


def losses(ran: Ran) -> dict[str, str]:
    (file,) = ran.figures["files"]
    assert all(loss["text"] in ran.err for loss in file["losses"] if loss["kind"] != "holes")
    return {loss["kind"]: loss["text"] for loss in file["losses"]}


def angles(path: Path) -> dict[str, np.ndarray]:
    """Of the right hand, by column [rad]."""
    with (path.parent / "out" / path.stem / "angles.csv").open(newline="") as file:
        rows = [row for row in csv.DictReader(file) if row["hand"] == "right"]
    return {name: np.array([float(row[name]) for row in rows]) for name in rows[0] if name.endswith("_flexion")}


def test_exchanged_names_are_found_with_them_and_without_them(tmp_path):
    """As named: the two are found out and not used. Unlabelled: they are the only two that the engine names otherwise.
    What both have to say of the other digits is the same."""
    path = glove(tmp_path, index_tip="middle_tip", middle_tip="index_tip")
    ran = track(path, "qualisys13")
    (file,) = ran.figures["files"]
    assert ran.code == 3 and list(losses(ran)) == ["names"]
    assert "Of the right hand index_tip and middle_tip look exchanged: RMS" in losses(ran)["names"]
    assert file["labels_left_out"] == {"index_tip": N, "middle_tip": N}
    assert file["labels_right"] is None and "labels right" not in ran.out
    assert file["tracked"] == 1.0 and file["rms_m"] < 0.0015
    named = angles(path)
    ran = track(path, "qualisys13", "--unlabelled")
    (file,) = ran.figures["files"]
    assert ran.code == 0 and file["losses"] == [] and file["labels_left_out"] == {}
    assert round((1.0 - file["labels_right"]) * file["labelled_points"]) == 2 * N
    own = angles(path)
    others = [name for name in own if not name.startswith(("index", "middle"))]
    assert len(others) == 9
    assert max(np.degrees(np.abs(named[name] - own[name])).max() for name in others) < 5.0


def test_right_names_agree_with_none(tmp_path):
    path = glove(tmp_path)
    ran = track(path, "qualisys13")
    assert ran.code == 0 and losses(ran) == {} and "labels as given" in ran.out
    named = angles(path)
    ran = track(path, "qualisys13", "--unlabelled")
    assert ran.code == 0 and ran.figures["files"][0]["labels_right"] == 1.0
    own = angles(path)
    assert max(np.degrees(np.abs(named[name] - own[name])).max() for name in own) < 0.01


def test_names_one_finger_on(tmp_path):
    fingers = ["index", "middle", "ring", "little"]
    on = {f"{a}_{part}": f"{b}_{part}" for a, b in zip(fingers, [*fingers[1:], fingers[0]], strict=True)
          for part in ("tip", "middle")}  # fmt: skip
    ran = track(glove(tmp_path, **on), "qualisys13")
    assert ran.code == 3 and set(losses(ran)) == {"names", "hand"}
    assert "index_tip is little_tip" in losses(ran)["names"] and "The hand was not solved." in losses(ran)["names"]
    assert ran.figures["files"][0]["tracked"] == 0.0 and "no hand found" in ran.out


@pytest.mark.parametrize("unit, factor", [("m", 1.0), ("mm", 0.001)])
def test_a_header_of_another_unit(tmp_path, unit, factor):
    ran = track(han(tmp_path, unit, factor), "han19")
    assert ran.code == 3 and set(losses(ran)) == {"unit", "hand"}
    assert "check the unit of the export. The hand was not solved." in losses(ran)["unit"]
    assert ran.figures["files"][0]["tracked"] == 0.0


def test_a_left_hand_with_the_profile_of_a_right_one(tmp_path):
    worn = tmp_path / "right.json"
    worn.write_text(load_profile("han19").with_sides(("right",)).to_json())
    path = han(tmp_path)
    ran = track(path, worn)
    assert ran.code == 3 and set(losses(ran)) == {"side", "hand"}
    assert "is a left one: RMS" in losses(ran)["side"] and "Choose a profile of a left hand." in losses(ran)["side"]
    assert ran.figures["files"][0]["tracked"] == 0.0
    told = tasks.import_take(str(path), str(tmp_path / "a.mcap"), [worn.read_text()], False, lambda *_: None)
    assert told["doubts"][:2] == [losses(ran)["side"], losses(ran)["hand"]]  # and so does an import in the window


def test_a_layout_that_is_not_the_files(tmp_path):
    """Both sets of names; a file of another layout that shares a few names, too."""
    ran = track(glove(tmp_path), "han19")
    said = losses(ran)["layout"]
    assert ran.code == 3 and said.startswith("None of its 21 names is a marker of han19; its points were named anew.")
    assert "The file has hand_top, hand_left, hand_right, thumb_tip, thumb_middle and 16 more;" in said
    assert "han19 has ThumbCMC, ThumbMCP, ThumbIP, ThumbTip, IndexMCP and 14 more." in said
    few = glove(tmp_path, hand_top="BackHand1", thumb_tip="ThumbTip", index_tip="IndexTip", little_tip="PinkyTip")
    ran = track(few, "han19")
    assert ran.code == 3
    assert "Of the 19 markers of han19 the file names 4: it is hardly of this layout." in losses(ran)["layout"]


def test_a_share_that_is_asked_for(tmp_path):
    """The left hand's file ends with as many frames that hold nothing as `--least` allows, or not."""
    path = han(tmp_path)
    lines = path.read_text().rstrip("\n").split("\n")
    gone = len(lines) - 50
    lines[gone:] = ["\t".join(line.split("\t")[:2] + [""] * 57) for line in lines[gone:]]
    path.write_text("\n".join(lines) + "\n")
    ran = track(path, "han19")
    assert ran.code == 0 and ran.figures["files"][0]["tracked"] == 0.8
    ran = track(path, "han19", "--least", "90")
    assert ran.code == 3
    assert losses(ran) == {"tracked": "The left hand is tracked in 80.0 % of the frames, in less than 90 %."}
    assert track(path, "han19", "--least", "101").code == 2


def test_percentages():
    assert (_share("90"), _share("90 %"), _share("0"), LEAST_TRACKED) == (0.9, 0.9, 0.0, 0.5)


def test_a_right_hand_tracked_as_a_left_one_is_found_out_without_names(tmp_path):
    path, left = glove(tmp_path), tmp_path / "left.json"
    save_profile(load_profile("qualisys13").with_sides(("left",)), left)
    ran = track(path, left, "--unlabelled", "--live-labels")
    assert ran.code == 3 and {"side", "hand"} <= losses(ran).keys()
    assert "What is named or taken as the left hand is a right one" in losses(ran)["side"]
    assert ran.figures["files"][0]["tracked"] == 0.0
