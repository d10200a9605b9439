"""TRC in OpenSim and pandas."""

from __future__ import annotations

import numpy as np
import pytest

from core.takes.export.options import ExportOptions
from tests.acceptance import truth
from tests.acceptance.compare import OPTIONS, difference, points_m
from tests.acceptance.programs import OPENSIM, TRC_PANDAS, Program
from tests.acceptance.report import Row
from tests.acceptance.takes import KINDS, RATE_HZ

NEAR_M = 0.06e-6

kinds = pytest.mark.parametrize("kind", KINDS)
asked = pytest.mark.parametrize("options", OPTIONS.values(), ids=OPTIONS)


@kinds
@asked
@pytest.mark.parametrize("program", [OPENSIM, TRC_PANDAS], ids=lambda program: program.name)
def test_every_point_and_every_gap(bench, report, program: Program, options: ExportOptions, kind: str) -> None:
    opened = bench.open(program, "trc", options)
    taken, path = bench.taken(kind), bench.file(kind, "trc", options)
    found, expected = opened.file(path), truth.markers(taken, options)
    # A file of TRC has no word for a prediction: markers that were not measured are gaps.
    of_markers = np.array([not label.endswith("_joint") for label in expected.labels])
    points = np.where((expected.measured | ~of_markers)[..., None], expected.points_m, np.nan)
    rate_hz = options.rate_hz or RATE_HZ
    assert tuple(found["labels"]) == expected.labels
    assert found["unit"] == (options.unit or "mm")
    assert found["frames"] == len(points)
    assert found["rate_hz"] == pytest.approx(rate_hz, abs=1e-4)
    np.testing.assert_allclose(found["times_s"], np.arange(len(points)) / rate_hz, atol=1e-6)
    values, largest_m = difference(points_m(found), points, f"{path.name} in {opened.program}")
    assert largest_m < NEAR_M
    report(Row("TRC", opened.program, kind, "points and gaps", values, 1e6 * largest_m, "µm"))


@kinds
@asked
def test_as_reference_of_inverse_kinematics(bench, report, options: ExportOptions, kind: str) -> None:
    """OpenSim's tools follow a MarkersReference."""
    opened = bench.open(OPENSIM, "trc", options)
    found = opened.file(bench.file(kind, "trc", options))
    expected = truth.markers(bench.taken(kind), options)
    assert tuple(found["reference_labels"]) == expected.labels
    assert found["reference_frames"] == len(expected.points_m)
    assert found["reference_rate_hz"] == pytest.approx(options.rate_hz or RATE_HZ, abs=1e-4)
    values = len(expected.labels) + 2
    report(Row("TRC", opened.program, kind, "names, frames and rate as MarkersReference", values, 0.0))
