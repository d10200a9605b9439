"""Any recording that can be read is asked what it holds, checked, and its reader's warnings reach whoever uses it."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from app.cli import build_parser
from app.commands import solving
from app.commands.job import Job
from app.commands.train import order_of
from app.tracking_figures import frames_and_columns, without_ids
from core.errors import PhalanxError
from core.frames import NO_ID, MarkerFrame
from core.markers.layout import load_layout
from core.motion.performer import Performer
from core.motion.stream import MarkerStream
from core.profile import load_profile
from core.takes.formats import read_recording
from tests.app.command import Ran, phalanx
from tests.app.takes import write_take
from tests.data import case_path

N, RATE_HZ = 30, 100.0
FAR = "lies beyond 1000 m and is left out as a gap"
KEYS = {"frames", "rate_hz", "seconds", "markers", "gaps", "warnings"}
NAMES = load_layout("han19").marker_names


def points_file(path: Path, wild: bool = True) -> Path:
    """30 frames of a hand, every id for ever, one point far off in frame 4, time without frames before frame 20."""
    stream = MarkerStream(Performer(load_profile("han19").with_sides(("right",)), seed=3), RATE_HZ, 3)
    lines = ["frame,time_s,id,x_m,y_m,z_m"]
    for i, sent in enumerate(itertools.islice(stream.labelled(), 200, 200 + N)):
        for k, (x, y, z) in enumerate(sent.frame.points_m):
            x = 1e7 if wild and (i, k) == (3, 5) else x
            lines.append(f"{i},{i / RATE_HZ + (i >= 20)},{sent.truth[k] + 1},{x:.9f},{y:.9f},{z:.9f}")
    path.write_text("\n".join(lines) + "\n")
    return path


def trc_file(path: Path, wild: bool = False, names: Sequence[str] = NAMES) -> Path:
    """30 frames of a right hand; its second marker is not seen in frames 5 to 8."""
    stream = MarkerStream(Performer(load_profile("han19").with_sides(("right",)), seed=3), RATE_HZ, 3)
    head = [
        f"PathFileType\t4\t(X/Y/Z)\t{path.name}",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames",
        f"{RATE_HZ}\t{RATE_HZ}\t{N}\t{len(names)}\tmm\t{RATE_HZ}\t1\t{N}",
        "Frame#\tTime\t" + "\t\t\t".join(names) + "\t\t",
        "\t\t" + "\t".join(f"X{k}\tY{k}\tZ{k}" for k in range(1, len(names) + 1)),
        "",
    ]
    for i, sent in enumerate(itertools.islice(stream.labelled(), 200, 200 + N)):
        row = [["", "", ""] for _ in names]
        for point, true in zip(sent.frame.points_m, sent.truth, strict=True):
            if true >= 0 and not (true == 1 and 5 <= i < 9):
                row[true] = [f"{1000 * v:.4f}" for v in point]
        if wild and i == 3:
            row[0] = ["9999999", "0", "0"]
        head.append("\t".join([str(i + 1), f"{i / RATE_HZ:.4f}", *itertools.chain(*row)]))
    path.write_text("\n".join(head) + "\n")
    return path


def check(figures: dict[str, Any]) -> None:
    """What every kind of recording says under the same names."""
    assert figures.keys() >= KEYS
    gaps = figures["gaps"]
    assert gaps.keys() == {"total", "absent", "zero", "far", "share"}
    assert gaps["total"] == gaps["absent"] + gaps["zero"] + gaps["far"]
    assert all(isinstance(text, str) for text in [*figures["markers"], *figures["warnings"]])


def warned(ran: Ran, name: str) -> list[str]:
    """The warnings on standard error, without what stands before them."""
    start = f"phalanx: {name}: "
    return [line.removeprefix(start) for line in ran.err.splitlines() if line.startswith(start)]


def said(ran: Ran) -> list[str]:
    """The warnings that info and verify print, and print once."""
    assert ran.err == "", ran.err
    lines = [line.split(maxsplit=1) for line in ran.out.splitlines() if line.lower().startswith("warning")]
    return [text.strip() for _, text in lines]


def test_info_of_a_labelled_file(tmp_path: Path) -> None:
    ran = phalanx("info", trc_file(tmp_path / "hand.trc"), "--json")
    assert ran.code == 0 and ran.err == ""
    check(ran.figures)
    assert ran.figures["markers"] == list(NAMES)
    assert (ran.figures["frames"], ran.figures["rate_hz"], ran.figures["format"]) == (N, RATE_HZ, "TRC")
    assert ran.figures["seconds"] == pytest.approx(0.3)
    assert ran.figures["gaps"] == {"total": 4, "absent": 4, "zero": 0, "far": 0, "share": pytest.approx(4 / 570)}
    assert ran.figures["marker_gaps"] == {NAMES[1]: {"share": pytest.approx(4 / 30), "longest_s": pytest.approx(0.04)}}
    lines = ran.out.splitlines()
    assert "Format     TRC" in lines
    assert "Frames     30 at 100 Hz, 0.30 s, numbered 1 to 30" in lines
    assert f"Markers    19: {', '.join(NAMES[:8])} and 11 more" in lines
    assert "Gaps       4 gaps, 0.7 % of its points" in lines
    assert f"           {NAMES[1]}: 13.3 % of the frames, at longest 0.04 s" in lines


def test_info_and_verify_of_points_without_names(tmp_path: Path) -> None:
    path = points_file(tmp_path / "points.csv")
    info = phalanx("info", path, "--json")
    assert info.code == 0
    check(info.figures)
    assert (info.figures["markers"], info.figures["frames"]) == ([], N)
    assert info.figures["seconds"] == pytest.approx(1.3)
    assert info.figures["silent_s"] == pytest.approx(1.0) and info.figures["missing"] == 100
    assert info.figures["gaps"] == {"total": 1, "absent": 0, "zero": 0, "far": 1, "share": pytest.approx(1 / 570)}
    assert "Markers    without names, 19 points in a frame (18 to 19)" in info.out
    assert "Holes      1.0 s without frames, about 100" in info.out
    assert said(info) == info.figures["warnings"]
    assert len(info.figures["warnings"]) == 1 and FAR in info.figures["warnings"][0]
    checked = phalanx("verify", path, "--json")
    assert checked.code == 3 and checked.figures["ok"] is False
    check(checked.figures)
    assert checked.figures["warnings"] == said(checked)
    assert checked.figures["warnings"][0] == info.figures["warnings"][0]
    assert "1.0 s without frames" in checked.figures["warnings"][1]
    assert [line.split()[0] for line in checked.out.splitlines()[:3]] == ["warning", "warning", "note"]


def test_verify_of_a_file_that_is_as_it_should_be(tmp_path: Path) -> None:
    ran = phalanx("verify", trc_file(tmp_path / "hand.trc"), "--json")
    assert ran.code == 0 and ran.err == "" and ran.figures["ok"] is True
    check(ran.figures)
    assert ran.figures["warnings"] == []
    assert [one["level"] for one in ran.figures["findings"]] == ["note"]
    assert "is as it should be: TRC, 30 frames at 100 Hz, 19 markers." in ran.out


def test_verify_says_what_is_amiss(tmp_path: Path) -> None:
    names = (*NAMES[:-1], NAMES[0])
    ran = phalanx("verify", trc_file(tmp_path / "hand.trc", wild=True, names=names), "--json")
    assert ran.code == 3
    assert len(ran.figures["warnings"]) == 2
    assert f"{NAMES[0]} is the name of several markers" in ran.figures["warnings"][0]
    assert FAR in ran.figures["warnings"][1]
    assert f"in frame 4: {NAMES[0]} at x = 10000 m." in ran.figures["warnings"][1]


@pytest.mark.parametrize("command", ["info", "verify"])
def test_what_cannot_be_true_is_said_once_by_both(tmp_path: Path, command: str) -> None:
    """Metres labelled mm, and a code for missing markers; the range has digits enough to be seen."""
    text = trc_file(tmp_path / "hand.trc").read_text()
    rows = [line.split("\t") for line in text.splitlines()]
    small = [[*row[:2], *(f"{float(v) / 1000:.7f}" if v else "" for v in row[2:])] for row in rows[6:]]
    path = tmp_path / "metres.trc"
    path.write_text("\n".join("\t".join(row) for row in rows[:6] + small) + "\n")
    ran = phalanx(command, path, "--json")
    (warning,) = said(ran)
    assert ran.figures["warnings"] == [warning] and "mm: check the unit of the export" in warning
    assert ran.code == (3 if command == "verify" else 0)
    if command == "info":
        x = next(line for line in ran.out.splitlines() if line.startswith("Range"))[5:].split(",")[0]
        low, high = (float(word) for word in x.split()[1::2])
        assert (low, high) == pytest.approx(np.array(ran.figures["range_m"])[:, 0], abs=1e-6) and high > low
    lost = [[*row[:2], *(v or "-9999.99" for v in row[2:])] for row in rows[6:]]
    path.write_text("\n".join("\t".join(row) for row in rows[:6] + lost) + "\n")
    (warning,) = said(phalanx(command, path))
    assert warning.startswith("4 points stand at exactly -9.99999 -9.99999 -9.99999 m (-9999.99 in mm), far from all")


def test_one_marker_in_one_frame(tmp_path: Path) -> None:
    trc = trc_file(tmp_path / "hand.trc")
    head, rows = trc.read_text().splitlines()[:6], trc.read_text().splitlines()[6:]
    head[2] = head[2].replace(f"\t{N}\t19\t", "\t2\t1\t")
    head[3] = "\t".join(head[3].split("\t")[:5])
    head[4] = "\t\tX1\tY1\tZ1"
    trc.write_text("\n".join([*head, *("\t".join(row.split("\t")[:5]) for row in rows[:2])]) + "\n")
    assert "2 frames at 100 Hz, 1 marker." in phalanx("verify", trc).out


@pytest.mark.parametrize("command", ["info", "verify"])
def test_a_rate_that_changes_is_said_as_exports_say_it(command: str) -> None:
    path = case_path("files", "13-rate-changes-in-mid-take", "nat_ratechange.mcap")
    assert said(phalanx(command, path)) == ["Its rate changes from 120 to 240 Hz at 1.7 s."]


def test_a_take_says_the_same_and_more(tmp_path: Path) -> None:
    path = write_take(tmp_path, "shot")
    for command in ("info", "verify"):
        ran = phalanx(command, path, "--json")
        assert ran.code == 0, ran.err
        check(ran.figures)
        assert ran.figures["frames"] == ran.figures["raw"] == 60
        assert ran.figures["rate_hz"] == RATE_HZ
        assert ran.figures["seconds"] == pytest.approx(0.59)
        assert ran.figures["gaps"]["far"] == 0
        assert all(name[:2] in ("L_", "R_") for name in ran.figures["markers"]) and ran.figures["markers"]


def test_wild_points_of_a_live_take_are_said_and_the_take_is_solved(tmp_path: Path) -> None:
    path = case_path("files", "06-one-wild-point-refuses-all", "nat_nanpts.mcap")
    for command, code in (("info", 0), ("verify", 0)):
        ran = phalanx(command, path, "--json")
        assert ran.code == code
        assert ran.figures["gaps"] == {
            "total": 180, "absent": 0, "zero": 0, "far": 180, "share": pytest.approx(180 / (598 * 19), abs=5e-4)
        }  # fmt: skip
        assert any("180 gaps beyond 1000 m" in text for text in ran.figures["warnings"])
        assert ran.figures["warnings"] == said(ran)
    ran = phalanx("track", path, "--profile", "han19", "--live-labels", "--out", tmp_path, "--json")
    assert ran.code == 3 and "No hand was found." in ran.err  # its points are none: they are solved all the same
    (figures,) = ran.figures["files"]
    assert (figures["frames"], figures["gaps"]["far"]) == (598, 180)
    assert warned(ran, path.name) == [*figures["warnings"], *figures["notes"]]
    assert figures["warnings"][0].startswith("180 points lie beyond 1000 m and are left out as gaps")


@pytest.mark.parametrize("command", ["info", "verify"])
def test_what_cannot_be_read_is_one_line(tmp_path: Path, command: str) -> None:
    path = tmp_path / "hand.trc"
    path.write_text("nothing\n")
    ran = phalanx(command, path, "--json")
    assert (ran.code, len(ran.err.splitlines())) == (1, 1)
    assert "hand.trc" in ran.figures["error"]


def test_warnings_reach_every_command_that_reads(tmp_path: Path) -> None:
    path, trc = points_file(tmp_path / "walk.csv"), trc_file(tmp_path / "hand.trc", wild=True)
    ran = phalanx("track", path, "--profile", "han19", "--live-labels", "--out", tmp_path / "out", "--json")
    (told,) = ran.figures["files"]
    assert warned(ran, "walk.csv") == [*told["warnings"], *told["notes"]] and FAR in ran.err
    for motion in (path, trc):
        ran = phalanx(
            "simulate", "natnet", "--motion", motion, "--command-port", 0, "--data-port", 0, "--seconds", 0.1, "--json"
        )
        assert ran.code == 0, ran.err
        assert warned(ran, motion.name) == ran.figures["warnings"] and FAR in ran.err
    ran = phalanx(
        "prop",
        "define",
        trc,
        "--points",
        ",".join(NAMES[-3:]),
        "--name",
        "back",
        "--out",
        tmp_path / "p.json",
        "--json",
    )
    assert ran.code == 0, ran.err
    assert warned(ran, "hand.trc") == ran.figures["warnings"] and FAR in ran.err


def test_warnings_are_said_whatever_becomes_of_the_work(tmp_path: Path) -> None:
    """A third of a second is too short to learn a subspace from, and enough for a calibration."""
    trc = trc_file(tmp_path / "hand.trc", wild=True)
    options = ("--profile", "han19", "--out", tmp_path / "out.json", "--json")
    learnt, calibrated = phalanx("subspace", trc, *options), phalanx("calibrate", "hand", trc, *options)
    assert (learnt.code, calibrated.code) == (1, 0)
    assert warned(learnt, "hand.trc") == warned(calibrated, "hand.trc") == calibrated.figures["warnings"]
    assert len(calibrated.figures["warnings"]) == 1 and FAR in calibrated.figures["warnings"][0]


def test_what_is_recorded_from_a_file_is_recorded_with_its_warnings(tmp_path: Path) -> None:
    path = points_file(tmp_path / "walk.csv")
    ran = phalanx("record", "playback", "--file", path, "--out", tmp_path / "take", "--json")
    assert ran.code in (0, 3), ran.err
    assert warned(ran, "walk.csv") == ran.figures["warnings"]
    assert len(ran.figures["warnings"]) == 1 and FAR in ran.figures["warnings"][0]


def test_training_is_told_what_its_recordings_lack(tmp_path: Path) -> None:
    folder = tmp_path / "data"
    folder.mkdir()
    trc_file(folder / "hand.trc", wild=True)
    words = ["train", "labeller", "--layout", "han19", "--data", str(folder), "--out", str(tmp_path / "n.onnx")]
    warnings: dict[str, Sequence[str]] = {}
    with suppress(PhalanxError):  # what training needs may not be installed; the recordings are read before
        order_of(build_parser(["train"]).parse_args(words), warnings)
    assert list(warnings) == ["hand.trc"] and FAR in warnings["hand.trc"][0]


# Labels and ids that are withheld.


def test_labels_are_withheld_and_ids_stay(tmp_path: Path) -> None:
    points = read_recording(points_file(tmp_path / "walk.csv"))
    as_sent = list(points.frames())
    frames, columns = frames_and_columns(points, unlabelled=True)
    assert [frame.ids.tolist() for frame in frames] == [frame.ids.tolist() for frame in as_sent]
    assert all((np.diff(column) > 0).all() for column in columns)
    labelled = read_recording(trc_file(tmp_path / "hand.trc"))
    frames, columns = frames_and_columns(labelled, unlabelled=True)
    assert all((frame.ids == NO_ID).all() for frame in frames)
    assert any((np.diff(column) < 0).any() for column in columns)
    for i, (frame, column) in enumerate(zip(frames, columns, strict=True)):
        np.testing.assert_array_equal(frame.points_m, labelled.points_m[i, column])


def test_without_ids_points_are_the_same_in_another_order(tmp_path: Path) -> None:
    points = read_recording(points_file(tmp_path / "walk.csv"))
    as_sent = list(points.frames())
    frames, columns = frames_and_columns(points, no_ids=True)
    assert all((frame.ids == NO_ID).all() for frame in frames)
    bare, orders = without_ids(as_sent)
    for i, (frame, column, order) in enumerate(zip(frames, columns, orders, strict=True)):
        np.testing.assert_array_equal(frame.points_m, points.points_m[i, column])
        np.testing.assert_array_equal(bare[i].points_m, as_sent[i].points_m[order])
        assert (frame.sequence, frame.times) == (as_sent[i].sequence, as_sent[i].times)
        assert sorted(order) == list(range(len(as_sent[i].ids)))
    assert any((np.diff(order) < 0).any() for order in orders)


@pytest.mark.parametrize("kind", ["points", "trc", "take"])
@pytest.mark.parametrize(("unlabelled", "no_ids"), [(False, False), (True, False), (True, True)])
def test_what_the_engine_gets(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str, unlabelled: bool, no_ids: bool
) -> None:
    """`track --unlabelled` and `--no-ids`, for every kind of recording."""
    given: list[MarkerFrame] = []
    solve = solving.solve

    def watched(frames: Sequence[MarkerFrame], *rest: Any, **options: Any) -> Any:
        given.extend(frames)
        assert (options["labels"] is None) == (unlabelled or kind != "trc")
        return solve(frames, *rest, **options)

    monkeypatch.setattr(solving, "solve", watched)
    path = {
        "points": lambda: points_file(tmp_path / "walk.csv", wild=False),
        "trc": lambda: trc_file(tmp_path / "hand.trc"),
        "take": lambda: write_take(tmp_path, "shot", 20),
    }[kind]()
    job = Job(path, ("han19",), tmp_path / "out", unlabelled, True, False, None, no_ids)
    solving.solve_file(job, lambda share, text: None)
    known = sum(int((frame.ids != NO_ID).sum()) for frame in given)
    points = sum(len(frame.ids) for frame in given)
    assert points > 0
    withheld = no_ids or (unlabelled and kind == "trc")
    assert known == (0 if withheld else points)


def test_track_without_ids_finds_the_hand(tmp_path: Path) -> None:
    path = points_file(tmp_path / "walk.csv", wild=False)
    ran = phalanx("track", path, "--profile", "han19", "--no-ids", "--live-labels", "--out", tmp_path, "--json")
    assert ran.code in (0, 3), ran.err
    assert ran.figures["no_ids"] is True
    assert ran.figures["files"][0]["hands"]["right"]["tracked"] > 0.2
    helped = " ".join(phalanx("track", "--help").out.split())
    assert "keep the ids that their device gave them" in helped and "--no-ids" in helped
