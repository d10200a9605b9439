"""BVH in Blender and three.js."""

from __future__ import annotations

import numpy as np
import pytest

from core.takes.export.options import ExportOptions
from tests.acceptance import truth
from tests.acceptance.compare import OPTIONS, difference, points_m
from tests.acceptance.programs import BVH_BLENDER, BVH_THREE, Program
from tests.acceptance.report import Row
from tests.acceptance.takes import KINDS, RATE_HZ

NEAR_M = 2e-6

ASKED = {name: options for name, options in OPTIONS.items() if name != "with joints"}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("options", ASKED.values(), ids=ASKED)
@pytest.mark.parametrize("program", [BVH_BLENDER, BVH_THREE], ids=lambda program: program.name)
def test_every_joint_and_every_end_of_a_digit(
    bench, report, program: Program, options: ExportOptions, kind: str
) -> None:
    opened = bench.open(program, "bvh", options)
    taken = bench.taken(kind)
    paths = [path for path in bench.files(kind, "bvh", options) if path.suffix == ".bvh"]
    hands = truth.tracked_hands(taken)
    assert len(paths) == len(hands)
    every = 1 if options.rate_hz is None else round(RATE_HZ / options.rate_hz)
    for path, key in zip(paths, hands, strict=True):
        assert path.stem.endswith(f"_{key.side}")
        found, skeleton = opened.file(path), truth.skeleton(taken, key)
        expected = {truth.bvh_name(name): truth.on_the_grid(taken, at)[::every] for name, at in skeleton.rigid.items()}
        assert sorted(found["labels"]) == sorted(expected)
        assert found["rate_hz"] == pytest.approx(options.rate_hz or RATE_HZ, rel=1e-5)
        whole = truth.turned(np.stack([expected[name] for name in found["labels"]], axis=1), options)
        points = points_m(found, options.unit or "cm")
        values, largest_m = difference(points, whole, f"{path.name} in {opened.program}")
        assert largest_m < NEAR_M
        report(Row("BVH", opened.program, kind, "joints and ends of digits", values, 1e6 * largest_m, "µm"))
