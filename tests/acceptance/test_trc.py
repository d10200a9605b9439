"""TRC in OpenSim and pandas."""

from __future__ import annotations

import numpy as np
import pytest

from core.takes.export.options import ExportOptions
from tests.acceptance import truth
from tests.acceptance.compare import difference, points_m
from tests.acceptance.programs import OPENSIM, TRC_PANDAS, Program
from tests.acceptance.report import Row
from tests.acceptance.takes import KINDS, RATE_HZ

NEAR_M = 0.06e-6

kinds = pytest.mark.parametrize("kind", KINDS)


@kinds
@pytest.mark.parametrize("joints", [False, True], ids=["markers", "joints"])
@pytest.mark.parametrize("program", [OPENSIM, TRC_PANDAS], ids=lambda program: program.name)
def test_every_point_and_every_gap(bench, report, program: Program, joints: bool, kind: str) -> None:
    options = ExportOptions(joints=joints)
    opened = bench.open(program, "trc", options)
    taken, path = bench.taken(kind), bench.file(kind, "trc", options)
    found, expected = opened.file(path), truth.markers(taken, joints)
    n = len(expected.labels)
    # A file of TRC has no word for a prediction: markers that were not measured are gaps.
    of_markers = np.array([not label.endswith("_joint") for label in expected.labels])
    points = np.where((expected.measured | ~of_markers)[..., None], expected.points_m, np.nan)
    assert tuple(found["labels"][:n]) == expected.labels
    assert found["frames"] == len(points)
    assert found["rate_hz"] == pytest.approx(RATE_HZ, abs=1e-4)
    np.testing.assert_allclose(found["times_s"], np.arange(len(points)) / RATE_HZ, atol=1e-6)
    values, largest_m = difference(points_m(found)[:, :n], points, f"{path.name} in {opened.program}")
    assert largest_m < NEAR_M
    report(Row("TRC", opened.program, kind, "points and gaps", values, 1e6 * largest_m, "µm"))


@kinds
def test_as_reference_of_inverse_kinematics(bench, report, kind: str) -> None:
    """OpenSim's tools follow a MarkersReference."""
    opened = bench.open(OPENSIM, "trc", ExportOptions())
    taken, path = bench.taken(kind), bench.file(kind, "trc", ExportOptions())
    found, expected = opened.file(path), truth.markers(taken)
    assert tuple(found["reference_labels"]) == expected.labels
    assert found["reference_frames"] == len(expected.points_m)
    assert found["reference_rate_hz"] == pytest.approx(RATE_HZ, abs=1e-4)
    report(
        Row("TRC", opened.program, kind, "names, frames and rate as MarkersReference", len(expected.labels) + 2, 0.0)
    )
