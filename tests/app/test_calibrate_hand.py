"""`phalanx calibrate hand`: a profile from a recording."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from app.reconstruction.known_hands import NOISE_M, made
from core.frames import MarkerFrame
from core.hand.shape import SHAPE_NAMES
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
    save_profile(scene.given, given)
    ran = phalanx("calibrate", "hand", file, "--profile", given, "--performer", "Ada", "--out", out, "--json")
    assert ran.code == 0, ran.err
    assert "by the names of its points" in ran.err
    profile = load_profile(out)
    assert (profile.performer, profile.scale, profile.sides) == ("Ada", 1.0, ("right",))
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
    assert wrong.code == 1 or any("check that this layout was worn" in words for words in wrong.figures["doubts"])


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
