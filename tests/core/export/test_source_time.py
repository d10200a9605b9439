"""The recording's own time goes along: a trial that was cut from 6.333 s on still says so in what is made of it."""

from __future__ import annotations

import csv
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import ezc3d
import numpy as np
import pytest

from core.frames import Times
from core.takes.export import ExportOptions, export
from core.takes.export.csv_tables import SOURCE
from core.takes.formats import read_recording
from core.takes.imported import FILE_KIND
from core.takes.take import Mark, TakeInfo
from tests.core.export.recordings import solution

BEGIN_S, OFF_S = 6.333, 1_700_000_000.25


def timed(begin_s: float, **more):
    """The recording with its device's clock at `begin_s` in its first frame."""
    some = solution(lost=())
    start_s = some.raw[0].times.host_s

    def at(frame):
        times = frame.times
        return replace(frame, times=Times(begin_s + times.host_s - start_s, times.host_s, times.arrival_s))

    return replace(some, raw=tuple(map(at, some.raw)), solved=tuple(map(at, some.solved)), **more)


def rows(path: Path) -> list[dict[str, str]]:
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


@pytest.mark.parametrize("begin_s", [BEGIN_S, OFF_S])
def test_every_table_ends_with_the_time_of_the_source(tmp_path, begin_s):
    taken = timed(begin_s, marks=(Mark(0.5, "now"),))
    files = [path for path in export(taken, ["csv", "points"], tmp_path) if path.suffix == ".csv"]
    assert {path.name for path in files} >= {"markers.csv", "angles.csv", "joints.csv", "points.csv", "marks.csv"}
    own = {frame.sequence: frame.times.device_s for frame in taken.raw}
    for path in files:
        table = rows(path)
        assert list(table[0])[-1] == SOURCE
        assert all(abs(float(row[SOURCE]) - own[int(row["frame"])]) < 1e-6 for row in table)
        assert all(
            abs(float(row[SOURCE]) - float(row["time_s"]) - begin_s) < 2e-6 for row in table if "marks" not in path.name
        )


def test_a_device_without_a_clock_says_nothing(tmp_path):
    angles, points = (
        path for path in export(timed(np.nan), ["csv", "points"], tmp_path) if path.stem in ("angles", "points")
    )
    assert {row[SOURCE] for row in rows(angles)} == {row[SOURCE] for row in rows(points)} == {""}
    assert np.isnan(read_recording(points).source_s).all()


def test_points_are_read_again_with_it_and_without_it(tmp_path):
    (path,) = (path for path in export(timed(BEGIN_S), ["points"], tmp_path) if path.suffix == ".csv")
    read = read_recording(path)
    assert read.times_s[0] == 0.0 and np.allclose(read.source_s - read.times_s, BEGIN_S, atol=1e-6)
    assert [frame.times.device_s for frame in read.frames()] == read.source_s.tolist()
    old = tmp_path / "old.csv"
    old.write_text("\n".join(line.rpartition(",")[0] for line in path.read_text().splitlines()) + "\n")
    before = read_recording(old)
    assert np.array_equal(before.points_m, read.points_m, equal_nan=True)
    assert np.array_equal(before.times_s, read.times_s) and before.source_s[0] == 0.0


@pytest.mark.parametrize("kind, begin_s", [(None, BEGIN_S), (FILE_KIND, BEGIN_S), ("natnet", 0.0)])
def test_trc_begins_where_the_file_did_and_a_take_at_nothing(tmp_path, kind, begin_s):
    """kind: of the device of a take, None for a file that was solved without one."""
    created = datetime(2026, 1, 2, tzinfo=UTC)
    info = None if kind is None else TakeInfo("x", "", created, rate_hz=120.0, device={"kind": kind})
    read = read_recording(export(timed(BEGIN_S, info=info), ["trc"], tmp_path)[0])
    assert read.source_s[0] == pytest.approx(begin_s, abs=1e-6)
    assert np.allclose(read.source_s - read.times_s, begin_s, atol=1e-6)


def test_a_part_begins_at_its_own_time(tmp_path):
    path = export(timed(BEGIN_S), ["trc"], tmp_path, options=ExportOptions(from_s=0.5))[0]
    assert read_recording(path).source_s[0] == pytest.approx(BEGIN_S + 0.5, abs=1e-6)


@pytest.mark.parametrize("begin_s", [BEGIN_S, OFF_S])
def test_c3d_says_when_its_first_frame_was(tmp_path, begin_s):
    path = export(timed(begin_s), ["c3d"], tmp_path)[0]
    own = ezc3d.c3d(str(path))["parameters"]["PHALANX"]
    assert float(own["TIME_SOURCE_S"]["value"][0]) == pytest.approx(begin_s, abs=1e-6)


def test_a_trimmed_c3d_counts_from_the_first_frame_of_its_trial(tmp_path):
    """At 120 Hz frame 761 is 760 / 120 = 6.333 s after frame 1."""
    made = ezc3d.c3d(str(export(timed(0.0), ["c3d"], tmp_path)[0]))
    made["header"]["points"]["first_frame"] = 760
    made["header"]["points"]["last_frame"] = 760 + made["data"]["points"].shape[2] - 1
    del made["parameters"]["TRIAL"]
    path = tmp_path / "trimmed.c3d"
    made.write(str(path))
    read = read_recording(path)
    assert read.frame_numbers[0] == 761
    assert np.allclose(read.source_s - read.times_s, 760 / 120.0)


def test_a_text_file_keeps_its_times_as_they_stand(tmp_path):
    path = export(timed(BEGIN_S), ["trc"], tmp_path)[0]
    read = read_recording(path)
    stands = [float(line.split("\t")[1]) for line in path.read_text().splitlines()[6:]]
    assert read.source_s.tolist() == stands and read.at(np.array([3, 5])).source_s.tolist() == [stands[3], stands[5]]
