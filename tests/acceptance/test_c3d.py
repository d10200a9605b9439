"""C3D in ezc3d, py-c3d and Kinetics Toolkit."""

from __future__ import annotations

import numpy as np
import pytest

from core.takes.export.options import ExportOptions
from tests.acceptance import truth
from tests.acceptance.compare import OPTIONS, difference, points_m
from tests.acceptance.programs import EZC3D, KINETICS, PY_C3D, Program
from tests.acceptance.report import Row
from tests.acceptance.takes import KINDS, RATE_HZ

NEAR_M = 1e-6

programs = pytest.mark.parametrize("program", [EZC3D, PY_C3D, KINETICS], ids=lambda program: program.name)
kinds = pytest.mark.parametrize("kind", KINDS)
asked = pytest.mark.parametrize("options", OPTIONS.values(), ids=OPTIONS)


@kinds
@asked
@programs
def test_every_point_and_every_gap(bench, report, program: Program, options: ExportOptions, kind: str) -> None:
    opened = bench.open(program, "c3d", options)
    taken, path = bench.taken(kind), bench.file(kind, "c3d", options)
    found, expected = opened.file(path), truth.markers(taken, options)
    assert tuple(found["labels"]) == expected.labels
    assert found["unit"] == (options.unit or "mm") or program is KINETICS  # which turns all into metres
    assert found["frames"] == len(expected.points_m)
    assert found["rate_hz"] == pytest.approx(options.rate_hz or RATE_HZ, abs=1e-4)
    values, largest_m = difference(points_m(found), expected.points_m, f"{path.name} in {opened.program}")
    assert largest_m < NEAR_M
    report(Row("C3D", opened.program, kind, "points and gaps", values, 1e6 * largest_m, "µm"))


@kinds
@asked
def test_measured_and_predicted_are_told_apart(bench, report, options: ExportOptions, kind: str) -> None:
    """By the residual, as the format is defined; py-c3d is the one that shows it."""
    opened = bench.open(PY_C3D, "c3d", options)
    expected = truth.markers(bench.taken(kind), options)
    measured = np.array(opened.file(bench.file(kind, "c3d", options))["measured"])
    np.testing.assert_array_equal(measured, expected.measured)
    report(Row("C3D", opened.program, kind, "measured or predicted", measured.size, 0.0))


@kinds
@programs
def test_marks_are_events(bench, report, program: Program, kind: str) -> None:
    opened = bench.open(program, "c3d")
    found = opened.file(bench.file(kind, "c3d"))["events"]
    marks = KINDS[kind].marks
    assert [text for _, text in found] == [text or f"Mark {n}" for n, (_, text) in enumerate(marks, 1)]
    np.testing.assert_allclose([time_s for time_s, _ in found], [i / RATE_HZ for i, _ in marks], atol=1e-5)
    if marks:
        largest_s = max(abs(time_s - i / RATE_HZ) for (time_s, _), (i, _) in zip(found, marks, strict=True))
        report(Row("C3D", opened.program, kind, "marks as events", 2 * len(marks), 1e6 * largest_s, "µs"))


def test_marks_are_events_of_the_header(bench, report) -> None:
    """Four letters each, for programs that know only these."""
    opened = bench.open(PY_C3D, "c3d")
    found = opened.file(bench.file("marks", "c3d"))["header_events"]
    assert [text for _, text in found] == ["clap", "?ffn", "M3"]
    np.testing.assert_allclose(
        [time_s for time_s, _ in found], [i / RATE_HZ for i, _ in KINDS["marks"].marks], atol=1e-6
    )
    report(Row("C3D", opened.program, "marks", "marks as events of the header", 6, 0.0))


def test_subjects(bench) -> None:
    opened = bench.open(EZC3D, "c3d")
    assert opened.file(bench.file("two performers", "c3d"))["subjects"] == ["Anna_Lena", "2"]
    assert opened.file(bench.file("marks", "c3d"))["subjects"] == ["Jürgen Groß"]


def test_what_is_said_of_the_take(bench) -> None:
    about = bench.open(EZC3D, "c3d").file(bench.file("marks", "c3d"))["about"]
    assert about["PERFORMER"] == ["Jürgen Groß"] and about["RATING"] == ["A"] and about["TAKE"] == ["marks"]
    assert about["NOTES"] == ["a second try;", 'tape on the "thumb"']
