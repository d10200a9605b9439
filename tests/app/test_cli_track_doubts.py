"""What `phalanx track` says where a green figure would not: names that are no markers, hands that may be none."""

from __future__ import annotations

import csv
import re
from itertools import islice
from pathlib import Path

import numpy as np
import pytest

from app.hand_tally import HandFigures
from app.tracking_doubts import Doubt, doubts
from core.markers.layout import load_layout
from core.motion.performer import Performer
from core.motion.stream import MarkerStream
from core.profile import Profile, save_profile
from core.recording import Recording
from core.takes.export.trc import DECIMALS
from tests.app.command import phalanx

RATE = 120.0
LAYOUT = load_layout("han19")


def trc(path: Path, labels: list[str], points_m: np.ndarray, scale: float = 1000.0) -> Path:
    """points_m: (t, m, 3)."""
    n, m = points_m.shape[:2]
    rows = [
        "\t".join([str(i + 1), f"{i / RATE:.6f}", *(f"{scale * value:.{DECIMALS}f}" for value in frame.ravel())])
        for i, frame in enumerate(points_m)
    ]
    path.write_text(
        "\n".join(
            [
                f"PathFileType\t4\t(X/Y/Z)\t{path.name}",
                "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits",
                f"{RATE:g}\t{RATE:g}\t{n}\t{m}\tmm",
                "Frame#\tTime\t" + "\t\t\t".join(labels),
                "\t\t" + "\t".join(f"{axis}{i}" for i in range(1, m + 1) for axis in "XYZ"),
                "",
                *rows,
                "",
            ]
        )
    )
    return path


def unnamed(path: Path, points_m: np.ndarray) -> Path:
    """points.csv, with ids. points_m: (t, m, 3)."""
    lines = ["frame,time_s,id,x_m,y_m,z_m"]
    for i, points in enumerate(points_m):
        lines += [f"{i},{i / RATE:.6f},{k},{x:.7f},{y:.7f},{z:.7f}" for k, (x, y, z) in enumerate(points)]
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.fixture(scope="module")
def hand() -> np.ndarray:
    """(40, 19, 3) [m], a right hand that moves."""
    profile = Profile("", LAYOUT, sides=("right",))
    frames = islice(MarkerStream(Performer(profile), RATE, noise_m=0.0).frames(), 40)
    return np.stack([frame.points_m[np.argsort(frame.ids)] for frame in frames])


@pytest.fixture(scope="module")
def names() -> list[str]:
    return [f"R_{name}" for name in LAYOUT.marker_names]


def test_names_that_are_no_markers_are_said(tmp_path, hand, names):
    own = ["Daumen" if name == "R_ThumbTip" else name for name in names]
    ran = phalanx("track", trc(tmp_path / "own.trc", own, hand), "--profile", "han19", "--out", tmp_path / "out")
    assert ran.code == 0
    assert "own.trc: 1 of its 19 names is no marker of han19: Daumen." in ran.err


def test_two_performers_with_one_profile_are_refused(tmp_path, hand, names):
    both = [f"{who}:{name}" for who in ("1", "2") for name in names]
    path = trc(tmp_path / "two.trc", both, np.concatenate([hand, hand + 0.4], axis=1))
    ran = phalanx("track", path, "--profile", "han19", "--out", tmp_path / "out")
    assert ran.code == 1
    assert "two.trc names markers of 2 performers (1, 2), and the profile of one was given. Give --profile" in ran.err


def test_a_hand_in_the_wrong_unit_is_not_found_and_the_unit_is_named(tmp_path, hand, names):
    path = trc(tmp_path / "metres.trc", names, hand, scale=1.0)
    ran = phalanx("track", path, "--profile", "han19", "--out", tmp_path / "out")
    assert ran.code == 3
    said = [line for line in ran.err.splitlines() if "metres.trc: " in line]
    assert "phalanx: metres.trc: No hand was found." in said
    assert any(re.search(r"right hand's lie 0\.\d mm from .* about 8\d\.\d mm .*check the unit", line) for line in said)


def test_a_hand_without_names_that_is_the_other_one_is_not_solved(tmp_path, hand):
    save_profile(Profile("", LAYOUT, sides=("left",)), tmp_path / "left.json")
    ran = phalanx("track", unnamed(tmp_path / "one.csv", hand), "--profile", tmp_path / "left.json", "--live-labels",
                  "--to", "trc", "--out", tmp_path / "out", "--json")  # fmt: skip
    (file,) = ran.figures["files"]
    assert ran.code == 3 and [loss["kind"] for loss in file["losses"]] == ["side", "hand"]
    assert "is a right one" in file["losses"][0]["text"] and file["hands"] == {}


def test_of_two_performers_only_the_hand_that_is_the_other_one_is_not_solved(tmp_path, hand):
    """Both wear right hands, half a metre apart; Ben's profile says left."""
    path = unnamed(tmp_path / "two.csv", np.concatenate([hand, hand + (0.5, 0.0, 0.0)], axis=1))
    words: list[object] = []
    for name, side in (("Ada", "right"), ("Ben", "left")):
        save_profile(Profile(name, LAYOUT, sides=(side,)), tmp_path / f"{name}.json")
        words += ["--profile", tmp_path / f"{name}.json"]
    ran = phalanx("track", path, *words, "--live-labels", "--gaps", "live", "--out", tmp_path / "out", "--json")
    (file,) = ran.figures["files"]
    assert ran.code == 3 and [loss["kind"] for loss in file["losses"]] == ["side"], ran.err
    said = file["losses"][0]["text"]
    assert "the Ben left hand is a right one" in said and "The hand was not solved." in said
    assert list(file["hands"]) == ["Ada right"] and file["hands"]["Ada right"]["tracked"] > 0.9
    with (tmp_path / "out" / "two" / "angles.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert {row["performer"] for row in rows if row["state"] == "tracked"} == {"Ada"}


def test_a_hand_that_rests_on_few_markers_may_be_none():
    recording = Recording("body", RATE, np.zeros(1), np.zeros(1, dtype=np.int64), np.zeros((1, 0, 3)), (), np.zeros(0))
    found = {"left": HandFigures(1.0, 0.0, 0.0028, 0.74)}
    (doubt,) = doubts(recording, (Profile("", LAYOUT),), None, False, found)
    assert doubt == Doubt(
        "markers", "Of the left hand 26 % of the markers were seen on average: look whether it is one."
    )
    assert doubt.lost


def test_no_name_fits(tmp_path, names):
    recording = Recording(
        "x", RATE, np.zeros(1), np.zeros(1, dtype=np.int64), np.zeros((1, 19, 3)), tuple(names), np.arange(19)
    )
    found = {"right": HandFigures(1.0, 0.0, 0.001, 0.1)}
    cast = (Profile("", load_layout("qualisys13")),)
    (doubt,) = doubts(recording, cast, None, False, found)
    assert (doubt.kind, doubt.lost) == ("layout", True)
    assert doubt.text == (
        "None of its 19 names is a marker of qualisys13; its points were named anew. The file has R_ThumbCMC, "
        "R_ThumbMCP, R_ThumbIP, R_ThumbTip, R_IndexMCP and 14 more; qualisys13 has hand_top, hand_left, hand_right, "
        "thumb_tip, thumb_middle and 8 more."
    )
    assert doubts(recording, cast, None, True, found) == ()


@pytest.mark.parametrize("name", ["Unlabeled 17", "*12", "marker 3", "U4", "unlabeled1023", "M001", "C_7"])
def test_trajectories_that_nobody_named_are_no_names(name):
    recording = Recording(
        "x", RATE, np.zeros(1), np.zeros(1, dtype=np.int64), np.zeros((1, 1, 3)), (name,), np.arange(1)
    )
    found = {"right": HandFigures(1.0, 0.0, 0.001, 0.1)}
    assert doubts(recording, (Profile("", LAYOUT),), None, False, found) == ()


def test_a_hand_that_the_profile_does_not_look_for_is_said(names):
    recording = Recording(
        "x", RATE, np.zeros(1), np.zeros(1, dtype=np.int64), np.zeros((1, 19, 3)), tuple(names), np.arange(19)
    )
    cast = (Profile("", LAYOUT, sides=("left",)),)
    told = doubts(recording, cast, {k: ("right", k) for k in range(19)}, False, {})
    assert [doubt.kind for doubt in told][:2] == ["side", "hand"]
    assert told[0].text == "The file names the right hand, and the profile looks for the left one alone."


def test_a_name_that_is_left_out_of_most_frames_is_said(names):
    recording = Recording("x", RATE, np.zeros(10), np.arange(10), np.zeros((10, 19, 3)), tuple(names), np.arange(19))
    found = {"right": HandFigures(1.0, 0.0, 0.001, 0.1)}
    given = {k: ("right", k) for k in range(19)}
    told = doubts(recording, (Profile("", LAYOUT),), given, False, found, (), {"R_ThumbIP": 1, "R_ThumbTip": 2})
    assert [doubt.text for doubt in told] == [
        "R_ThumbTip was left out of 20.0 % of the frames that have it: its points cannot be that marker."
    ]


BLANK = Recording("x", RATE, np.zeros(1), np.zeros(1, dtype=np.int64), np.zeros((1, 0, 3)), (), np.zeros(0))


def sizes(left_m: float, right_m: float, scale: float | None = None) -> tuple[Doubt, ...]:
    found = {side: HandFigures(1.0, 0.0, 0.001, 0.1, length) for side, length in (("left", left_m), ("right", right_m))}
    return doubts(BLANK, (Profile("", LAYOUT, scale=scale),), None, False, found)


def test_hands_of_two_sizes_are_nobodys():
    (doubt,) = sizes(0.143, 0.186)
    assert (doubt.kind, doubt.lost) == ("size", True)
    assert doubt.text.startswith("The left hand was found 143 mm long and the right one 186 mm: nobody has two such")
    assert sizes(0.1655, 0.19) == () and len(sizes(0.165, 0.19)) == 1
    assert sizes(0.143, 0.186, scale=1.0) == (), "what the profile says was not found"
    assert sizes(float("nan"), 0.186) == ()


def test_hands_of_two_performers_may_differ():
    cast = (Profile("Ada", LAYOUT), Profile("Ben", LAYOUT))
    found = {
        name: HandFigures(1.0, 0.0, 0.001, 0.1, length)
        for name, length in (("Ada left", 0.15), ("Ada right", 0.15), ("Ben left", 0.2), ("Ben right", 0.16))
    }
    (doubt,) = doubts(BLANK, cast, None, False, found)
    assert doubt.text.startswith("The Ben left hand was found 200 mm long and the Ben right one 160 mm")


@pytest.mark.parametrize(
    ("length_m", "why"),
    [
        (0.109, "hands are 110 to 270 mm long"),
        (0.271, "hands are 110 to 270 mm long"),
        (0.6 * 0.18564, "no shorter one is looked for"),
    ],
)
def test_a_hand_of_a_size_that_none_has_is_said(length_m, why):
    told = sizes(length_m, length_m)
    assert [(doubt.kind, doubt.lost) for doubt in told] == [("size", True)] * 2
    for side, doubt in zip(("left", "right"), told, strict=True):
        assert doubt.text.startswith(f"The {side} hand was found {1000 * length_m:.0f} mm long, and {why}: check the")
    assert sizes(0.115, 0.12) == sizes(0.269, 0.269) == ()
