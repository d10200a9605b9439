"""`phalanx calibrate hand`: a profile from a recording."""

from __future__ import annotations

import math
from dataclasses import replace
from datetime import date
from pathlib import Path

import numpy as np
import pytest

from app.calibration_check import stretches
from app.hand_size import FROM_MOTION, sized
from app.reconstruction.known_hands import NOISE_M, made
from core.calibration.fixed import FixedCovariance
from core.calibration.neutral import Neutral, NeutralHand
from core.calibration.priors import fixed_covariance
from core.calibration.record import Calibrated
from core.frames import MarkerFrame
from core.hand.limits import JointLimits
from core.hand.shape import N_SHAPE, SHAPE_NAMES
from core.hand.skeleton import DIGIT_DOF_NAMES
from core.observability import observability
from core.profile import load_profile, save_profile
from tests.app.command import phalanx
from tests.data import data_path


def _points_csv(path: Path, frames: list[MarkerFrame]) -> Path:
    """Unlabelled: as a device sends them."""
    rows = ["frame,time_s,id,x_m,y_m,z_m"]
    for frame in frames:
        rows += [f"{frame.sequence},{frame.times.host_s:.4f},-1,{x:.6f},{y:.6f},{z:.6f}" for x, y, z in frame.points_m]
    path.write_text("\n".join(rows) + "\n", encoding="utf-8")
    return path


def _trc(path: Path, frames: list[MarkerFrame], names: tuple[str, ...], rate_hz: float) -> Path:
    head = [
        f"PathFileType\t4\t(X/Y/Z)\t{path.name}",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames",
        f"{rate_hz}\t{rate_hz}\t{len(frames)}\t{len(names)}\tm\t{rate_hz}\t1\t{len(frames)}",
        "Frame#\tTime\t" + "\t\t\t".join(names),
        "\t\t" + "\t".join(f"X{k}\tY{k}\tZ{k}" for k in range(1, len(names) + 1)),
        "",
    ]
    rows = []
    for i, frame in enumerate(frames):
        points = frame.points_m[np.argsort(frame.ids)].ravel()
        rows.append(f"{i + 1}\t{i / rate_hz:.5f}\t" + "\t".join(f"{value:.6f}" for value in points))
    path.write_text("\n".join(head + rows) + "\n", encoding="utf-8")
    return path


def test_a_labelled_recording_gives_a_profile_that_explains_it(tmp_path: Path) -> None:
    scene = made(1)
    names = scene.given.layout.marker_names
    file = _trc(tmp_path / "warm-up.trc", scene.frames, names, 400 / 30.0)
    given, out = tmp_path / "given.json", tmp_path / "ada.json"
    limits = JointLimits((("pinky_mcp_flexion", -50.0, 110.0),))
    trial = NeutralHand(np.full(20, 0.1), np.zeros(20), np.zeros(20), (), "flat.c3d", 2.0, 4.0, "2026-03-01")
    save_profile(replace(scene.given, limits=limits, neutral=Neutral({"right": trial})), given)
    ran = phalanx("calibrate", "hand", file, "--profile", given, "--performer", "Ada", "--out", out, "--json")
    assert ran.code == 0, ran.err
    assert "by the names of its points" in ran.err
    profile = load_profile(out)
    assert (profile.performer, profile.scale, profile.sides) == ("Ada", 1.0, ("right",))
    assert profile.limits == limits and f"Joint limits kept: {limits.words}" in ran.out
    assert profile.neutral is None and "The neutral trial was of the profile before, and is gone" in ran.err
    ours, truth = profile.hand.skeleton.bone_lengths_m, scene.truth.hand.skeleton.bone_lengths_m
    assert np.abs(ours - truth)[1:].mean() < 0.001
    figures = ran.figures
    assert figures["labels_given"] is True
    told = observability(profile)
    for angle in told.angles:  # places are rounded where they are written
        assert figures["told"]["angles"][angle.name]["std_at_1_mm"] == pytest.approx(angle.std, rel=1e-4)
    assert figures["told"]["words"] and all(words in ran.out.splitlines() for words in figures["told"]["words"])
    assert figures["hands"] == 400
    assert figures["on_frames_not_used"]["after"]["rms_m"] < 2.0 * NOISE_M
    assert figures["on_frames_not_used"]["before"]["rms_m"] > 0.002
    assert list(figures["shape"]) == list(SHAPE_NAMES)
    assert list(figures["markers"]) == list(names)
    np.testing.assert_allclose(
        [figures["shape"][name]["ratio"] for name in SHAPE_NAMES], profile.shape.ratios, atol=1e-6
    )
    for words in ("all markers", "thumb", *names, "palm width", "index proximal", "distal bone not seen"):
        assert words in ran.out


def test_unlabelled_points_are_labelled_first(tmp_path: Path) -> None:
    scene = made(3, swapped=0.0, count=800, seconds=20.0)
    file, out = _points_csv(tmp_path / "points.csv", scene.frames), tmp_path / "ada.json"
    given = tmp_path / "given.json"
    save_profile(scene.given, given)
    ran = phalanx("calibrate", "hand", file, "--profile", given, "--from", 2, "--to", 14, "--out", out, "--json")
    assert ran.code == 0, ran.err
    assert "labelling its points first" in ran.err
    assert 400 < ran.figures["hands"] <= 480
    ours, truth = load_profile(out).hand.skeleton.bone_lengths_m, scene.truth.hand.skeleton.bone_lengths_m
    assert np.abs(ours - truth)[1:].mean() < 0.002


def test_the_real_glove(tmp_path: Path) -> None:
    """What its first 10 s tell holds in them; a layout that was not worn is doubted."""
    recording, out = data_path("qualisys_hand", "recording.tsv"), tmp_path / "p.json"
    ran = phalanx("calibrate", "hand", recording, "--profile", "qualisys13", "--to", 10, "--out", out, "--json")
    assert ran.code == 0, ran.err
    before, after = (ran.figures["on_frames_not_used"][word]["rms_m"] for word in ("before", "after"))
    assert after < 0.001 < 1.3 * before
    assert load_profile(out).layout.name == "qualisys13"
    wrong = phalanx("calibrate", "hand", recording, "--profile", "han19", "--to", 5, "--out", out, "--json")
    assert wrong.code == 0, wrong.err
    assert any("check that this layout was worn" in words for words in wrong.figures["doubts"])
    worn = [words for words in ran.figures["doubts"] if "check that this layout was worn" in words]
    assert [words.split()[0] for words in worn] == ["thumb_tip"]  # it was worn elsewhere than the layout says


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--profile", "han19", "--keyframes", "3"], "--keyframes 3. Give 20 or more."),
        (["--profile", "han19", "--from", "100"], "nothing from 100 s"),
        (["--profile", "han19", "--to", "1"], "at least 20 are needed"),
        ([], "Give --profile"),
    ],
)
def test_what_cannot_be_calibrated_is_told(tmp_path: Path, words: list[str], message: str) -> None:
    file = _points_csv(tmp_path / "points.csv", made(1).frames)
    ran = phalanx("calibrate", "hand", file, *words, "--out", tmp_path / "p.json")
    assert ran.code == 1
    assert message in ran.err
    assert not (tmp_path / "p.json").exists()


def test_a_folder_that_is_not_there_is_told_before_the_work(tmp_path: Path) -> None:
    file = _points_csv(tmp_path / "points.csv", made(1).frames[:5])
    ran = phalanx("calibrate", "hand", file, "--profile", "han19", "--out", tmp_path / "no" / "p.json")
    assert ran.code == 1
    assert "Folder" in ran.err and "is not there" in ran.err


def test_times_are_numbers(tmp_path: Path) -> None:
    ran = phalanx("calibrate", "hand", "x.trc", "--from", "soon", "--out", tmp_path / "p.json")
    assert ran.code == 2
    assert "soon" in ran.err.splitlines()[-1]


def test_a_check_says_how_far_two_calibrations_differ_and_the_profile_says_where_it_is_from(tmp_path: Path) -> None:
    scene = made(1)
    file = _trc(tmp_path / "warm-up.trc", scene.frames, scene.given.layout.marker_names, 400 / 30.0)
    out = tmp_path / "ada.json"
    ran = phalanx(
        "calibrate", "hand", file, "--profile", "han19", "--from", 1, "--to", 15, "--check", 13, "--out", out, "--json"
    )
    assert ran.code == 0, ran.err
    check = ran.figures["check"]
    assert (check["first_s"], check["second_s"], check["halves"]) == ([1.0, 15.0], [15.0, 28.0], False)
    assert list(check["angles"]) == list(DIGIT_DOF_NAMES)
    for angle in check["angles"].values():
        assert 0.0 < angle["differ_mean_deg"] <= angle["differ_most_deg"]
        assert 0.0 < angle["stated_test_deg"] < 10.0
    assert check["hands"] == 400
    assert 0.9 < check["within_two_std"] <= 1.0
    assert "Test and retest: calibrated from 1.0 to 15.0 s and 15.0 to 28.0 s" in ran.out
    kept = load_profile(out).calibrated
    assert kept is not None
    assert (kept.sources, kept.from_s, kept.to_s) == (("warm-up.trc",), 1.0, 15.0)
    assert kept.made_on is not None and abs((date.fromisoformat(kept.made_on) - date.today()).days) <= 1
    assert kept.held_out_rms_m == pytest.approx(ran.figures["on_frames_not_used"]["after"]["rms_m"], rel=1e-6)
    assert list(kept.not_seen) == ran.figures["not_seen"]
    assert kept.covariance.std[:N_SHAPE] == pytest.approx([m["std"] for m in ran.figures["shape"].values()], rel=1e-3)


@pytest.mark.long
def test_seconds_are_those_of_the_file_where_it_has_none_in_between(tmp_path: Path) -> None:
    """30 s of frames, 20 s of nothing in their middle."""
    scene = made(1)
    file = _trc(tmp_path / "warm-up.trc", scene.frames, scene.given.layout.marker_names, 400 / 30.0)
    lines = file.read_text(encoding="utf-8").splitlines()
    for i in range(6 + 200, len(lines)):
        number, time_s, points = lines[i].split("\t", 2)
        lines[i] = f"{number}\t{float(time_s) + 20.0:.5f}\t{points}"
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")
    out = tmp_path / "ada.json"
    words = ("calibrate", "hand", file, "--profile", "han19", "--keyframes", 30, "--out", out, "--json")
    ran = phalanx(*words, "--to", 40, "--check", 9)
    assert ran.code == 0, ran.err
    check = ran.figures["check"]
    assert (check["first_s"], check["second_s"], check["halves"]) == ([0.0, 40.0], [40.0, 49.0], False)
    kept = load_profile(out).calibrated
    assert kept is not None and (kept.from_s, kept.to_s) == (0.0, 40.0)
    assert "lasts 50.0 s: nothing from 60 s" in phalanx(*words, "--from", 60).err


def test_a_measured_hand_is_no_longer_the_calibrated_one(tmp_path: Path) -> None:
    plain = load_profile("han19")
    record = Calibrated(FixedCovariance.of(fixed_covariance(plain)), 0.001, 120, 30.0, 0.001, 0.001)
    save_profile(replace(plain, calibrated=record), tmp_path / "ada.json")
    ran = phalanx("calibrate", "size", "M", "--profile", tmp_path / "ada.json", "--out", tmp_path / "m.json")
    assert ran.code == 0, ran.err
    assert load_profile(tmp_path / "m.json").calibrated is None
    chosen = sized(load_profile(tmp_path / "ada.json"), "L")
    assert chosen.calibrated is None
    assert sized(chosen, FROM_MOTION).calibrated is None


@pytest.mark.parametrize(
    ("first", "check_s", "second", "halves"),
    [
        ((0.0, 10.0), 10.0, (10.0, 20.0), False),
        ((10.0, math.inf), 10.0, (0.0, 10.0), False),
        ((12.0, 22.0), 10.0, (2.0, 12.0), False),
        ((5.0, 25.0), 10.0, (15.0, 25.0), True),
        ((0.0, math.inf), 10.0, (15.0, 30.0), True),
    ],
)
def test_the_other_seconds_are_after_or_before_or_the_two_halves(
    first: tuple[float, float], check_s: float, second: tuple[float, float], halves: bool
) -> None:
    found = stretches(first, check_s, 30.0)
    assert (found.second, found.halves) == (second, halves)
    (a, b), (c, d) = found.first, found.second
    assert b <= c or d <= a


def test_a_check_too_short_to_say_anything_is_refused(tmp_path: Path) -> None:
    file = _points_csv(tmp_path / "points.csv", made(1).frames)
    ran = phalanx("calibrate", "hand", file, "--profile", "han19", "--check", 1, "--out", tmp_path / "p.json")
    assert ran.code == 1
    assert "--check 1 with a calibration from 30.0 s. Check with 2 s or more" in ran.err
    assert not (tmp_path / "p.json").exists()
