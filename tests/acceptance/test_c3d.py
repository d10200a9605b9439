"""C3D in ezc3d, py-c3d and Kinetics Toolkit."""

from __future__ import annotations

import numpy as np
import pytest

from core.takes.export.options import ExportOptions
from tests.acceptance import truth
from tests.acceptance.compare import difference, points_m
from tests.acceptance.programs import EZC3D, KINETICS, PY_C3D, Program
from tests.acceptance.report import Row
from tests.acceptance.takes import KINDS, RATE_HZ

JOINTS = ExportOptions(joints=True)
NEAR_M = 1e-6

programs = pytest.mark.parametrize("program", [EZC3D, PY_C3D, KINETICS], ids=lambda program: program.name)
kinds = pytest.mark.parametrize("kind", KINDS)


@kinds
@programs
def test_every_point_and_every_gap(bench, report, program: Program, kind: str) -> None:
    opened = bench.open(program, "c3d", JOINTS)
    taken, path = bench.taken(kind), bench.file(kind, "c3d", JOINTS)
    found, expected = opened.file(path), truth.markers(taken, joints=True)
    # Fingertips, where a file has them, come after what is compared.
    n = len(expected.labels)
    assert tuple(found["labels"][:n]) == expected.labels
    assert found["frames"] == len(expected.points_m)
    assert found["rate_hz"] == pytest.approx(RATE_HZ, abs=1e-4)
    values, largest_m = difference(points_m(found)[:, :n], expected.points_m, f"{path.name} in {opened.program}")
    assert largest_m < NEAR_M
    report(Row("C3D", opened.program, kind, "points and gaps", values, 1e6 * largest_m, "µm"))


@kinds
def test_measured_and_predicted_are_told_apart(bench, report, kind: str) -> None:
    """By the residual, as the format is defined; py-c3d is the one that shows it."""
    opened = bench.open(PY_C3D, "c3d", JOINTS)
    taken, path = bench.taken(kind), bench.file(kind, "c3d", JOINTS)
    expected = truth.markers(taken, joints=True)
    measured = np.array(opened.file(path)["measured"])[:, : len(expected.labels)]
    np.testing.assert_array_equal(measured, expected.measured)
    report(Row("C3D", opened.program, kind, "measured or predicted", measured.size, 0.0))


def test_subjects(bench) -> None:
    opened = bench.open(EZC3D, "c3d", JOINTS)
    path = bench.file("two performers", "c3d", JOINTS)
    assert opened.file(path)["subjects"] == ["Anna_Lena", "2"]
