"""`phalanx calibrate neutral`, and what becomes of the angles of `track` and `export`."""

from __future__ import annotations

import csv
import json
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from app.calibrate.neutral import say_dropped
from core.hand.mirror import mirror_points
from core.hand.poses import pose
from core.hand.skeleton import DIGIT_DOF_NAMES
from core.kinematics.forward import markers_world
from core.profile import Profile, load_profile, save_profile
from tests.app.command import phalanx
from tests.app.test_cli_gates import glove, han
from tests.data import data_path

RATE_HZ, SECONDS = 60.0, 5.0
FROM_S, TO_S = 1.5, 3.5
"""The hands are held in these; before and after they move."""

PROFILE = replace(load_profile("han19"), performer="Ada", scale=1.0)
NOISE_M = 0.0002


def _poses() -> tuple[np.ndarray, np.ndarray]:
    """True angles (n, 20) of the right and the left hand: relaxed, then flat, then half a fist."""
    times = np.arange(round(SECONDS * RATE_HZ)) / RATE_HZ
    flat = pose("flat")
    share = np.clip((FROM_S - 0.3 - times) / 0.8, 0.0, 1.0)[:, None]
    after = np.clip((times - TO_S - 0.2) / 1.0, 0.0, 1.0)[:, None]
    right = flat + share * (pose("relaxed") - flat) + 0.5 * after * (pose("fist") - flat)
    left = flat + 0.8 * share * (pose("relaxed") - flat) + 0.4 * after * (pose("fist") - flat)
    return right, left


def _points_csv(
    path: Path, hide: tuple[int, ...] = (), sides: tuple[str, ...] = ("right", "left"), worn_by: Profile = PROFILE
) -> Path:
    """Unlabelled points of a performer whose markers sit up to 3 mm from where the profile has them. hide: markers of
    the right hand that no camera sees."""
    random = np.random.default_rng(8)
    layout, skeleton = worn_by.worn, worn_by.hand.skeleton
    worn = layout.positions_m + random.uniform(-0.003, 0.003, layout.positions_m.shape)
    right, left = _poses()
    shown = [k for k in range(len(worn)) if k not in hide]
    rows = ["frame,time_s,id,x_m,y_m,z_m"]
    for i, (one, other) in enumerate(zip(right, left, strict=True)):
        root = np.array([0.15, 1.0, 0.01 * np.sin(i / 20.0), 0.1, 0.2, 0.05])
        hands = {
            "right": markers_world(skeleton, np.concatenate([root, one]), layout.joints, worn)[shown],
            "left": mirror_points(markers_world(skeleton, np.concatenate([root, other]), layout.joints, worn)),
        }
        points = np.concatenate([hands[side] for side in sides])
        points = random.permutation(points + random.normal(0.0, NOISE_M, points.shape))
        rows += [f"{i},{i / RATE_HZ:.6f},-1,{x:.6f},{y:.6f},{z:.6f}" for x, y, z in points]
    path.write_text("\n".join(rows) + "\n", encoding="utf-8")
    return path


def _calibrate(file: Path, profile: Path, *words: object, from_s: float = FROM_S, to_s: float = TO_S):
    return phalanx("calibrate", "neutral", file, "--from", from_s, "--to", to_s, "--profile", profile, *words)


def _angles(folder: Path, suffix: str = "") -> dict[str, np.ndarray]:
    """Of each hand (n, 20) [rad]; NaN where not tracked."""
    found: dict[str, list[list[float]]] = {"left": [], "right": []}
    with (folder / "angles.csv").open(encoding="utf-8", newline="") as stream:
        for row in csv.DictReader(stream):
            found[row["hand"]].append([float(row[name + suffix] or "nan") for name in DIGIT_DOF_NAMES])
    return {side: np.array(rows) for side, rows in found.items()}


@dataclass(frozen=True)
class Room:
    """plain, neutral: profiles without and with a trial. before, after: folders of `track` with each, `no` with the
    second and --no-neutral; each holds a take, too."""

    file: Path
    plain: Path
    neutral: Path
    told: object
    tracked: dict[str, object]
    folders: dict[str, Path]


@pytest.fixture(scope="module")
def room(tmp_path_factory: pytest.TempPathFactory) -> Room:
    tmp_path = tmp_path_factory.mktemp("neutral")
    file, plain, neutral = _points_csv(tmp_path / "flat.csv"), tmp_path / "ada.json", tmp_path / "zeroed.json"
    save_profile(PROFILE, plain)
    read = tmp_path / "read.csv"
    read.write_text(
        "angle,degrees\n"
        + "".join(
            f"{name},{value:.6f}\n" for name, value in zip(DIGIT_DOF_NAMES, np.degrees(pose("flat")), strict=True)
        ),
        encoding="utf-8",
    )
    told = _calibrate(file, plain, "--angles", read, "--out", neutral, "--json")
    assert told.code == 0, told.err
    tracked, folders = {}, {}
    for name, profile, words in (("before", plain, ()), ("after", neutral, ()), ("no", neutral, ("--no-neutral",))):
        out = tmp_path / name
        ran = phalanx("track", file, "--profile", profile, "--live-labels", "--take", "--to", "csv,bvh", "--out", out,
                      "--json", *words)  # fmt: skip
        assert ran.code == 0, ran.err
        tracked[name], folders[name] = ran, out / file.stem
    return Room(file, plain, neutral, told, tracked, folders)


@pytest.mark.long
def test_a_trial_takes_the_constant_error_off_every_angle(room: Room) -> None:
    truth = dict(zip(("right", "left"), _poses(), strict=True))
    for side in ("left", "right"):
        off = {name: np.degrees(_angles(room.folders[name])[side] - truth[side]) for name in ("before", "after")}
        held = slice(round(FROM_S * RATE_HZ), round(TO_S * RATE_HZ))
        rmse = {name: float(np.sqrt(np.nanmean(values**2))) for name, values in off.items()}
        assert np.abs(np.nanmedian(off["after"][held], axis=0)).max() < 0.5
        assert rmse["before"] > 3.0 and rmse["after"] < 0.6 * rmse["before"], (side, rmse)


def test_the_command_says_what_it_found(room: Room) -> None:
    told, figures = room.told, room.told.figures
    neutral = load_profile(room.neutral).neutral
    assert list(figures["hands"]) == ["left", "right"]
    for side, one in figures["hands"].items():
        hand = neutral.hands[side]
        assert (hand.source, hand.from_s, hand.to_s) == ("flat.csv", FROM_S, TO_S)
        assert one["frames"] == round((TO_S - FROM_S) * RATE_HZ) + 1 and one["hidden"] == []
        np.testing.assert_allclose(list(one["zero_deg"].values()), np.degrees(hand.zero_rad))
        np.testing.assert_allclose(list(one["given_deg"].values()), np.degrees(pose("flat")), atol=1e-5)
        np.testing.assert_allclose(
            np.subtract(list(one["tracked_deg"].values()), list(one["given_deg"].values())),
            list(one["zero_deg"].values()),
            atol=1e-6,
        )  # fmt: skip
        assert max(one["moved_deg"].values()) < 5.0
        assert f"The {side} hand was held in 121 frames: no joint moved by more than" in told.out
    assert "Ring DIP flexion" in told.out and f"{room.neutral} written." in told.out
    assert load_profile(room.neutral).same_hands(load_profile(room.plain))


def test_angles_are_less_by_the_zero_and_nothing_else_changes(room: Room) -> None:
    neutral = load_profile(room.neutral).neutral
    before, after = room.folders["before"], room.folders["after"]
    for side, hand in neutral.hands.items():
        np.testing.assert_allclose(_angles(after)[side], _angles(before)[side] - hand.zero_rad, atol=2.1e-9)
        np.testing.assert_allclose(
            _angles(after, "_std")[side], np.hypot(_angles(before, "_std")[side], hand.std_rad), atol=1.1e-7
        )
    for name in ("joints.csv", "markers.csv", "flat_left.bvh", "flat_right.bvh"):
        assert (after / name).read_bytes() == (before / name).read_bytes()


def test_outputs_name_the_trial(room: Room) -> None:
    words = "angles from the neutral trial of flat.csv, 1.5 to 3.5 s"
    assert f", {words}, " in room.tracked["after"].out
    assert room.tracked["after"].figures["files"][0]["neutral"] == [words]
    entries = {e["file"]: e for e in json.loads((room.folders["after"] / "flat_export.json").read_text())["files"]}
    told = entries.pop("angles.csv")["neutral"]
    assert [(one["hand"], one["file"], one["from_s"], one["to_s"], one["hidden"]) for one in told] == [
        ("left", "flat.csv", FROM_S, TO_S, []), ("right", "flat.csv", FROM_S, TO_S, []),
    ]  # fmt: skip
    assert not any("neutral" in entry for entry in entries.values())


def test_the_methods_say_what_the_angles_count_from(room: Room) -> None:
    texts = {
        name: json.loads((folder / "run.json").read_text(encoding="utf-8"))["methods"]
        for name, folder in room.folders.items()
    }
    trial = "count from a neutral trial (angles from the neutral trial of flat.csv, 1.5 to 3.5 s)"
    assert trial in texts["after"] and "that was tracked less its zero" in texts["after"]
    assert "it is that of the difference from the trial's stance" in texts["after"]
    assert "The neutral trial in the profile was not used: angles in angles.csv are as they were" in texts["no"]
    assert "neutral trial (" not in texts["no"] and "stance" not in texts["no"]
    assert "trial" not in texts["before"]
    assert all("_std_fixed" in text for text in texts.values())


def test_no_neutral_gives_the_bytes_of_a_profile_without(room: Room) -> None:
    before, no = room.folders["before"], room.folders["no"]
    names = sorted(path.name for path in before.iterdir() if path.suffix in (".csv", ".bvh"))
    assert {"angles.csv", "joints.csv", "flat_right.bvh"} <= set(names)
    for name in names:
        assert (no / name).read_bytes() == (before / name).read_bytes(), name
    one, two = (json.loads((folder / "flat_export.json").read_text(encoding="utf-8")) for folder in (before, no))
    for record in (one, two):  # whose profiles, told how: the rest is the same
        assert record["recording"].pop("settings") and record["recording"]["performers"][0].pop("profile_sha256")
    assert one == two
    assert "neutral trial" not in room.tracked["no"].out
    assert room.tracked["no"].figures["files"][0]["neutral"] == []


def test_a_take_brings_its_trial_along(room: Room, tmp_path: Path) -> None:
    take = room.folders["no"] / "flat.mcap"
    words = "angles from the neutral trial of flat.csv, 1.5 to 3.5 s"
    ran = phalanx("info", take, "--json")
    assert ran.code == 0 and words in ran.out and ran.figures["neutral"] == [words]
    ran = phalanx("export", take, "--to", "csv", "--out", tmp_path / "with", "--json")
    assert ran.code == 0, ran.err
    assert words in ran.out.splitlines()
    assert ran.figures["neutral"] == [words]
    for side, tracked in _angles(room.folders["after"]).items():
        np.testing.assert_array_equal(_angles(tmp_path / "with")[side], tracked)
        stds = (_angles(folder, "_std")[side] for folder in (tmp_path / "with", room.folders["after"]))
        np.testing.assert_allclose(*stds, atol=1.1e-7)  # a take holds them in single precision
    ran = phalanx("export", take, "--to", "csv", "--no-neutral", "--out", tmp_path / "without", "--json")
    assert ran.code == 0 and ran.figures["neutral"] == [] and words not in ran.out
    for side, tracked in _angles(room.folders["before"]).items():
        np.testing.assert_array_equal(_angles(tmp_path / "without")[side], tracked)


def test_it_is_removed_and_the_profile_is_as_before(room: Room, tmp_path: Path) -> None:
    profile = tmp_path / "ada.json"
    profile.write_bytes(room.neutral.read_bytes())
    ran = phalanx("calibrate", "neutral", "--remove", "--side", "left", "--profile", profile, "--json")
    assert ran.code == 0 and ran.figures["removed"] == ["left"]
    assert list(load_profile(profile).neutral.hands) == ["right"]
    ran = phalanx("calibrate", "neutral", "--remove", "--profile", profile)
    assert ran.code == 0 and "right angles are reported as they are tracked" in ran.out
    assert profile.read_bytes() == room.plain.read_bytes()
    ran = phalanx("calibrate", "neutral", "--remove", "--profile", profile)
    assert ran.code == 1 and "holds no neutral trial" in ran.err


def test_a_hidden_finger_keeps_its_zero_and_one_hand_may_be_set_alone(room: Room, tmp_path: Path) -> None:
    """The profile itself is written where no other is named."""
    ring = tuple(k for k, joint in enumerate(PROFILE.layout.joints) if joint in (10, 11, 12))
    file, profile = _points_csv(tmp_path / "hidden.csv", ring, ("right",)), tmp_path / "ada.json"
    profile.write_bytes(room.neutral.read_bytes())
    ran = _calibrate(file, profile, "--json")
    assert ran.code == 0, ran.err
    names = [name for name in DIGIT_DOF_NAMES if name.startswith("ring")]
    assert ran.figures["hands"]["right"]["hidden"] == names
    assert (
        "were hidden, or no point was found that fits them: the zero stays as it was of Ring MCP abduction" in ran.out
    )
    assert "The left hand was not tracked: its zeros stay as they were." in ran.figures["notes"]
    before, after = load_profile(room.neutral).neutral, load_profile(profile).neutral
    same = np.array([name in names for name in DIGIT_DOF_NAMES])
    one, two = before.hands["right"].zero_rad, after.hands["right"].zero_rad
    np.testing.assert_array_equal(one == two, same)
    assert after.hands["left"].to_dict() == before.hands["left"].to_dict()


def test_what_the_layout_does_not_tell_gets_no_zero_unless_it_is_asked_for(tmp_path: Path) -> None:
    """One marker on each finger: statistics tell how its joints share the bend."""
    few = replace(load_profile("schroeder8"), scale=1.0)
    file, profile = _points_csv(tmp_path / "few.csv", (), ("right",), few), tmp_path / "few.json"
    save_profile(few, profile)
    ran = _calibrate(file, profile, "--side", "right", "--json", "--out", tmp_path / "zeroed.json")
    assert ran.code == 0, ran.err
    one, hand = ran.figures["hands"]["right"], load_profile(tmp_path / "zeroed.json").neutral.hands["right"]
    assert one["prior"] == one["no_zero"] == list(hand.prior)
    assert {"index_pip_flexion", "ring_dip_flexion"} < set(hand.prior)
    told = np.array([name not in hand.prior for name in DIGIT_DOF_NAMES])
    assert told.any() and (hand.zero_rad[told] != 0.0).all()
    assert not hand.zero_rad[~told].any() and not hand.std_rad[~told].any()
    (note,) = (note for note in ran.figures["notes"] if "schroeder8 does not tell" in note)
    assert "Index PIP flexion" in note and "they have no zero" in note and note in ran.out
    asked = _calibrate(file, profile, "--side", "right", "--all", "--json", "--out", tmp_path / "all.json")
    every = load_profile(tmp_path / "all.json").neutral.hands["right"]
    assert every.prior == () and (every.zero_rad[~told] != 0.0).all()
    np.testing.assert_array_equal(every.zero_rad[told], hand.zero_rad[told])
    assert asked.figures["hands"]["right"]["prior"] == one["prior"]
    assert any("set for --all" in note for note in asked.figures["notes"])


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--from", "0", "--to", "2"], r" hand moved: its "),
        (["--from", "2", "--to", "2.3"], "at least 10 frames over 0.5 s"),
        (["--from", "2", "--to", "9"], "2 to 9 s is no stretch of flat.csv, which lasts 4.98 s"),
        (["--from", "3", "--to", "2"], "3 to 2 s is no stretch"),
        (["--from", "2"], "FILE, --from and --to are missing"),
        (["--from", "2", "--to", "3", "--remove"], "--remove takes no recording"),
        (["--from", "2", "--to", "3", "--angles", "none.csv"], "none.csv cannot be read"),
        (["--from", "2", "--to", "3", "--out", "no/p.json"], "is not there"),
    ],
)
def test_what_is_no_trial_is_refused(room: Room, tmp_path: Path, words: list[str], message: str) -> None:
    profile = tmp_path / "ada.json"
    profile.write_bytes(room.plain.read_bytes())
    ran = phalanx("calibrate", "neutral", room.file, "--profile", profile, *words)
    assert ran.code == 1
    assert message in ran.err
    assert profile.read_bytes() == room.plain.read_bytes()


def test_a_shipped_layout_is_no_profile_to_write(room: Room) -> None:
    ran = _calibrate(room.file, Path("han19"))
    assert ran.code == 1 and "Give --out" in ran.err


def test_another_hand_drops_the_trial_and_says_so(room: Room, tmp_path: Path) -> None:
    out = tmp_path / "small.json"
    ran = phalanx("calibrate", "size", "S", "--profile", room.neutral, "--out", out)
    assert ran.code == 0 and "hold another one" in ran.err
    assert load_profile(out).neutral is None


def test_a_held_second_of_a_real_glove(tmp_path: Path) -> None:
    """By the names of its points; a profile without a size of its own is told."""
    recording, out = data_path("qualisys_hand", "recording.tsv"), tmp_path / "p.json"
    ran = _calibrate(recording, Path("qualisys13"), "--out", out, "--json", from_s=0.5, to_s=1.5)
    assert ran.code == 0 and "by the names of its points" in ran.err, ran.err
    one = ran.figures["hands"]["right"]
    assert max(one["moved_deg"].values()) < 1.0, "it is held"
    assert max(one["std_deg"].values()) < 0.3
    assert any("no size of its own" in note for note in ran.figures["notes"])
    large = next(note for note in ran.figures["notes"] if note.startswith("Large zeros of the right hand"))
    assert "Index PIP flexion 43" in large and "CMC" not in large, "this hand was not flat"


def test_nothing_is_said_where_there_was_none(capsys: pytest.CaptureFixture[str]) -> None:
    say_dropped(Profile("", PROFILE.layout))
    assert capsys.readouterr().err == ""


def _refused(file: Path, folder: Path, worn: Profile, *words: object) -> str:
    """What is said; `track` doubts the same recording."""
    profile = folder / "worn.json"
    save_profile(worn, profile)
    before = profile.read_bytes()
    ran = _calibrate(file, profile, *words, from_s=0.5, to_s=1.5)
    assert ran.code == 1, ran.err
    assert profile.read_bytes() == before and "written" not in ran.out
    said = ran.err.splitlines()[-1]
    assert "No zero was set." in said and "hidden" not in said
    taken = [word for word in words if word == "--unlabelled"]
    ran = phalanx("track", file, "--profile", profile, "--gaps", "live", "--out", folder / "out", "--json", *taken)
    assert ran.code == 3
    losses = [loss["text"] for loss in ran.figures["files"][0]["losses"]]
    assert any(text in said for text in losses), (said, losses)
    return said


def test_exchanged_names_give_no_zeros(tmp_path: Path) -> None:
    file = glove(tmp_path, index_tip="middle_tip", middle_tip="index_tip")
    said = _refused(file, tmp_path, load_profile("qualisys13"))
    assert "Of the right hand index_tip and middle_tip look exchanged" in said and "--unlabelled" in said
    ran = _calibrate(file, tmp_path / "worn.json", "--unlabelled", from_s=0.5, to_s=1.5)
    assert ran.code == 0, ran.err
    assert list(load_profile(tmp_path / "worn.json").neutral.hands) == ["right"]


@pytest.mark.parametrize("words", [(), ("--unlabelled",)])
def test_the_other_hand_gives_no_zeros(tmp_path: Path, words: tuple[str, ...]) -> None:
    """By its names, which do not say which hand it is, and by those that are found here."""
    left = replace(load_profile("qualisys13"), sides=("left",))
    said = _refused(glove(tmp_path), tmp_path, left, *words)
    assert "What is named or taken as the left hand is a right one" in said
    assert "Give the profile of the hand that was held" in said


@pytest.mark.long
def test_another_layout_gives_no_zeros(tmp_path: Path) -> None:
    said = _refused(glove(tmp_path), tmp_path, load_profile("han19"))
    assert "names is a marker of han19" in said and "Give the profile of the layout that was worn" in said


@pytest.mark.long
def test_another_unit_gives_no_zeros(tmp_path: Path) -> None:
    said = _refused(han(tmp_path, "m"), tmp_path, load_profile("han19"))
    assert "check the unit of the export" in said and "Export the recording in another unit." in said


def test_names_exchanged_in_a_part_keep_only_that_part_from_giving_zeros(tmp_path: Path) -> None:
    """Frames 151 to 300, from 1.5 s on."""
    file = glove(tmp_path)
    lines = file.read_text(encoding="utf-8").split("\n")
    at = next(i for i, line in enumerate(lines) if line.startswith("Frame\t"))
    one, other = (lines[at].split("\t").index(f"{name} X") for name in ("index_tip", "middle_tip"))
    for i in range(at + 151, at + 301):
        cells = lines[i].split("\t")
        cells[one : one + 3], cells[other : other + 3] = cells[other : other + 3], cells[one : one + 3]
        lines[i] = "\t".join(cells)
    file.write_text("\n".join(lines), encoding="utf-8")
    profile = tmp_path / "worn.json"
    save_profile(load_profile("qualisys13"), profile)
    ran = _calibrate(file, profile, from_s=1.8, to_s=2.6)
    assert ran.code == 1 and "index_tip and middle_tip look exchanged in frames 151 to 300 (1.50 to" in ran.err, ran.err
    assert "left out of" not in ran.err and load_profile(profile).neutral is None
    ran = _calibrate(file, profile, "--json", from_s=0.5, to_s=1.3)
    assert ran.code == 0, ran.err
    assert ran.figures["hands"]["right"]["hidden"] == []


@pytest.mark.long
def test_angles_of_the_other_hand_are_refused_and_what_is_not_given_is_said(room: Room, tmp_path: Path) -> None:
    read, profile = tmp_path / "read.csv", tmp_path / "ada.json"
    profile.write_bytes(room.plain.read_bytes())
    read.write_text("angle,left_degrees\nring_dip_flexion,5\n", encoding="utf-8")
    ran = _calibrate(room.file, profile, "--angles", read)
    assert ran.code == 1 and "gives no angle of the right hand, which was tracked, only of the left one" in ran.err
    assert profile.read_bytes() == room.plain.read_bytes()
    read.write_text(
        "angle,left_degrees,right_degrees\nring_dip_flexion,,1.5\nring_pip_flexion,0.5,1.5\n", encoding="utf-8"
    )
    ran = _calibrate(room.file, profile, "--angles", read, "--json")
    assert ran.code == 0, ran.err
    note = "Of the left hand no angle is given of Ring DIP flexion: it counts as held at 0."
    assert note in ran.figures["notes"] and note in ran.out
    given = {side: one["given_deg"]["ring_dip_flexion"] for side, one in ran.figures["hands"].items()}
    assert given == pytest.approx({"left": 0.0, "right": 1.5})
    assert "phalanx: read.csv: No angle is larger than 1.5: are these radians?" in ran.err
    assert any("radians" in text for text in ran.figures["warnings"])


@pytest.mark.long
def test_a_hand_calibrated_by_exchanged_names_is_doubted(tmp_path: Path) -> None:
    """It is written, with status 3 and what looks wrong."""
    out = tmp_path / "hand.json"
    for renamed, code in (({}, 0), ({"index_tip": "middle_tip", "middle_tip": "index_tip"}, 3)):
        file = glove(tmp_path, **renamed)
        ran = phalanx(
            "calibrate", "hand", file, "--profile", "qualisys13", "--keyframes", "30", "--out", out, "--json"
        )  # fmt: skip
        assert ran.code == code, ran.err
        said = [text for text in ran.figures["warnings"] if "look exchanged" in text]
        assert len(said) == (code == 3) and all(text in ran.err for text in said)
        assert all("used as they are" in text and "not used" not in text for text in said)
    assert load_profile(out).calibrated is not None
