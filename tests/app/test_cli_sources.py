"""Where each angle comes from and what a layout cannot tell, as the commands say it."""

from __future__ import annotations

import csv
import itertools
from dataclasses import replace
from pathlib import Path

import pytest

from core.hand.limits import JointLimits
from core.hand.skeleton import DOF_NAMES
from core.markers.layout import layout_names
from core.motion.performer import Performer
from core.motion.stream import MarkerStream
from core.observability import observability
from core.profile import load_profile, save_profile
from core.sources import SOURCES
from tests.app.command import phalanx

RATE_HZ = 100.0
GAP = range(60, 85)
TIGHT = {"middle_mcp_flexion": [-40.0, 1.0]}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording in which the index fingers lose their markers for a quarter of a second, and two profiles."""
    folder = tmp_path_factory.mktemp("sources")
    profile = load_profile("han19")
    save_profile(replace(profile, performer="Anna", limits=JointLimits.from_dict(TIGHT, "")), folder / "anna.json")
    stream = MarkerStream(Performer(profile, seed=4), RATE_HZ, 4)
    hidden = [i for i, label in enumerate(stream.labels) if "_Index" in label]
    lines = ["frame,time_s,id,x_m,y_m,z_m"]
    for i, sent in enumerate(itertools.islice(stream.labelled(), 200, 320)):
        for (x, y, z), point_id, truth in zip(sent.frame.points_m, sent.frame.ids, sent.truth, strict=True):
            if i not in GAP or truth not in hidden:
                lines.append(f"{i},{i / RATE_HZ},{point_id},{x:.9f},{y:.9f},{z:.9f}")
    (folder / "hands.csv").write_text("\n".join(lines) + "\n")
    return folder


def sources(folder: Path) -> list[dict[str, str]]:
    """Of every tracked hand and frame, by angle."""
    with (folder / "angles.csv").open() as stream:
        rows = [row for row in csv.DictReader(stream) if row["state"] == "tracked"]
    return [{name: row[f"{name}_source"] for name in DOF_NAMES} for row in rows]


@pytest.mark.parametrize("gaps", ["fill", "live"])
def test_the_summary_counts_what_the_file_says(folder: Path, gaps: str) -> None:
    ran = phalanx("track", folder / "hands.csv", "--profile", "han19", "--gaps", gaps, "--live-labels", "--json",
                  "--out", folder / gaps)  # fmt: skip
    assert ran.code == 0, ran.err
    (one,) = ran.figures["files"]
    told = sources(folder / gaps / "hands")
    values = [value for row in told for value in row.values()]
    for source in SOURCES:
        assert one["sources"][source] == pytest.approx(values.count(source) / len(values))
    for name in DOF_NAMES:
        column = [row[name] for row in told]
        for source in SOURCES:
            assert one["sources_by_angle"][name][source] == pytest.approx(column.count(source) / len(column))
    line = ran.out.splitlines()[0]
    assert ", ".join(f"{100 * one['sources'][source]:.1f} % {source}" for source in SOURCES) in line
    index = [row["index_pip_flexion"] for row in told]
    if gaps == "fill":  # both hands, and the time in which the difference is worked off
        assert len(GAP) * 2 <= index.count("filled") <= len(GAP) * 2 + 30 and "prior" not in index
    else:
        assert index.count("prior") == len(GAP) * 2 and one["sources"]["filled"] == 0.0
    words = [f"han19: {each}" for each in observability(load_profile("han19")).words]
    assert one["not_told"] == words and all(each in ran.err for each in words)


def test_a_take_keeps_what_was_filled(folder: Path) -> None:
    ran = phalanx("track", folder / "hands.csv", "--profile", "han19", "--live-labels", "--take",
                  "--out", folder / "with_take")  # fmt: skip
    assert ran.code == 0, ran.err
    take = folder / "with_take" / "hands" / "hands.mcap"
    ran = phalanx("export", take, "--to", "csv", "--out", folder / "exported")
    assert ran.code == 0, ran.err
    (again,) = (folder / "exported").rglob("angles.csv")
    told = sources(again.parent)
    assert "filled" in {row["index_pip_flexion"] for row in told}
    assert told == sources(folder / "with_take" / "hands")


def test_limits_of_a_profile_are_kept_and_flagged(folder: Path) -> None:
    ran = phalanx("track", folder / "hands.csv", "--profile", folder / "anna.json", "--live-labels", "--json",
                  "--out", folder / "limited")  # fmt: skip
    assert ran.code == 0, ran.err
    with (folder / "limited" / "hands" / "angles.csv").open() as stream:
        rows = [row for row in csv.DictReader(stream) if row["state"] == "tracked"]
    at = [row for row in rows if row["middle_mcp_flexion_source"] == "limit"]
    assert len(at) > 20
    assert max(float(row["middle_mcp_flexion"]) for row in rows) < 0.0174533  # one degree
    assert all(abs(float(row["middle_mcp_flexion"]) - 0.01745329) < 1e-7 for row in at)
    shown = phalanx("layout", "show", folder / "anna.json", "--json")
    assert "Joint limits of its own: middle_mcp_flexion -40 to 1 degrees" in shown.out
    assert shown.figures["limits"]["middle_mcp_flexion"] == [-40.0, 1.0]
    assert shown.figures["limits"]["index_mcp_flexion"] == [-40.0, 100.0]


def test_a_layout_says_what_it_cannot_tell(folder: Path) -> None:
    ran = phalanx("layout", "show", "schroeder8", "--json")
    told = observability(load_profile("schroeder8"))
    assert all(words in ran.out.splitlines() for words in told.words)
    assert ran.figures["told"] == told.to_dict()
    assert "schroeder17" not in ran.out


def test_the_table_of_all_layouts_has_a_row_for_every_angle() -> None:
    ran = phalanx("layout", "list", "--angles", "--json")
    lines = [line for line in ran.out.splitlines() if line.startswith("| ")]
    assert lines[0] == f"| angle | {' | '.join(layout_names())} |"
    assert [line.split("`")[1] for line in lines[2:]] == list(DOF_NAMES)
    first = ran.figures["layouts"][0]
    assert first["told"] == observability(load_profile(first["name"])).to_dict()
