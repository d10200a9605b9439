"""glTF in Khronos's validator, three.js and Blender."""

from __future__ import annotations

import numpy as np
import pytest

from tests.acceptance import truth
from tests.acceptance.compare import difference
from tests.acceptance.programs import GLTF_BLENDER, GLTF_THREE, VALIDATOR, Program
from tests.acceptance.report import Row
from tests.acceptance.takes import KINDS, RATE_HZ

NEAR_M = 3e-6

kinds = pytest.mark.parametrize("kind", KINDS)
programs = pytest.mark.parametrize("program", [GLTF_THREE, GLTF_BLENDER], ids=lambda program: program.name)


@kinds
def test_the_validator_has_nothing_to_say(bench, report, kind: str) -> None:
    opened = bench.open(VALIDATOR, "gltf")
    found = opened.file(bench.file(kind, "gltf"))
    assert found["messages"] == []
    assert (found["errors"], found["warnings"], found["infos"], found["hints"]) == (0, 0, 0, 0)
    assert found["animations"] == 1 and found["skinned"]
    report(Row("glTF", opened.program, kind, "errors, warnings, infos, hints", 4, 0.0))


@kinds
@programs
def test_every_joint_at_every_key(bench, report, program: Program, kind: str) -> None:
    opened = bench.open(program, "gltf")
    taken, found = bench.taken(kind), opened.file(bench.file(kind, "gltf"))
    times_s = np.array(found["times_s"])
    assert set(np.round(np.array(taken.kind.there) / RATE_HZ, 4)) <= set(np.round(times_s, 4))
    for key in truth.tracked_hands(taken):
        solved = truth.skeleton(taken, key).solved
        expected = np.stack([truth.at_keys(taken, at, times_s) for at in solved.values()], axis=1)
        joints = np.stack([np.array(found["nodes"][name]) for name in solved], axis=1)
        values, largest_m = difference(joints, expected, f"{kind} in {opened.program}")
        assert largest_m < NEAR_M
        report(Row("glTF", opened.program, kind, "joints at every key", values, 1e6 * largest_m, "µm"))


@kinds
@programs
def test_surfaces_lie_around_their_joints(bench, report, program: Program, kind: str) -> None:
    """Each vertex is where the hand's own surface has it when it is posed so."""
    opened = bench.open(program, "gltf")
    taken, found = bench.taken(kind), opened.file(bench.file(kind, "gltf"))
    times_s = np.array(found["surface_times_s"])
    for key in truth.tracked_hands(taken):
        (name,) = [one for one in found["surfaces"] if one == truth.surface_name(taken, key)]
        surface = np.array(found["surfaces"][name])
        expected = truth.surface(taken, key, times_s)
        values, largest_m = difference(surface, expected, f"{name} of {kind} in {opened.program}")
        assert largest_m < NEAR_M
        report(Row("glTF", opened.program, kind, "vertices of surfaces", values, 1e6 * largest_m, "µm"))


@programs
def test_a_prop_moves_as_it_was_seen(bench, report, program: Program) -> None:
    opened = bench.open(program, "gltf")
    taken, found = bench.taken("props"), opened.file(bench.file("props", "gltf"))
    pens = [next(p for p in frame.props if p.name == "pen") if frame.props else None for frame in taken.solution.solved]
    first = next(pen for pen in pens if pen is not None and pen.tracked)
    held = []
    for pen in pens:
        held.append(
            pen.transform_world[:3, 3] if pen and pen.tracked else held[-1] if held else first.transform_world[:3, 3]
        )
    expected = truth.at_keys(taken, np.array(held), np.array(found["times_s"]))
    values, largest_m = difference(np.array(found["nodes"]["pen"]), expected, f"pen in {opened.program}")
    assert largest_m < NEAR_M
    report(Row("glTF", opened.program, "props", "props at every key", values, 1e6 * largest_m, "µm"))


@kinds
@programs
def test_one_animation_of_the_whole_length(bench, program: Program, kind: str) -> None:
    opened = bench.open(program, "gltf")
    ((name, seconds),) = opened.file(bench.file(kind, "gltf"))["animations"]
    there = bench.taken(kind).kind.there
    assert kind in name
    assert seconds == pytest.approx((there[-1] - there[0]) / RATE_HZ, abs=1e-4)
