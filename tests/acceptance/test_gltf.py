"""glTF in Khronos's validator, three.js and Blender."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from core.hand.skeleton import JOINT_NAMES
from core.takes.export.bone_names import BONE_SCHEMES, bone_names
from core.takes.export.options import ExportOptions
from tests.acceptance import truth
from tests.acceptance.compare import OPTIONS, difference
from tests.acceptance.programs import GLTF_BLENDER, GLTF_THREE, VALIDATOR, Program
from tests.acceptance.report import Row
from tests.acceptance.takes import KINDS, RATE_HZ
from tests.some import some

NEAR_M = 3e-6
NEAR_DEG = 1e-4

ASKED = {name: OPTIONS[name] for name in ("as it is", "every second frame")}
"""glTF is in metres and Y up, whatever is asked for."""

kinds = pytest.mark.parametrize("kind", KINDS)
asked = pytest.mark.parametrize("options", ASKED.values(), ids=ASKED)
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
@asked
@programs
def test_every_joint_and_fingertip_at_every_key(bench, report, program: Program, options, kind: str) -> None:
    opened = bench.open(program, "gltf", options)
    taken, found = bench.taken(kind), opened.file(bench.file(kind, "gltf", options))
    times_s = np.array(found["times_s"])
    if options.rate_hz is None:
        assert set(np.round(np.array(taken.kind.there) / RATE_HZ, 4)) <= set(np.round(times_s, 4))
    else:
        np.testing.assert_allclose(times_s, np.arange(len(times_s)) / options.rate_hz, atol=1e-6)
    for key in truth.tracked_hands(taken):
        solved = truth.skeleton(taken, key).solved
        expected = np.stack([truth.at_keys(taken, at, times_s) for at in solved.values()], axis=1)
        joints = np.stack([np.array(found["nodes"][name]) for name in solved], axis=1)
        values, largest_m = difference(joints, expected, f"{kind} in {opened.program}")
        assert largest_m < NEAR_M
        report(Row("glTF", opened.program, kind, "joints and fingertips at every key", values, 1e6 * largest_m, "µm"))


@kinds
def test_every_joint_is_turned_as_it_was_solved(bench, report, kind: str) -> None:
    """three.js keeps the joints' own axes; Blender lays its bones along theirs."""
    opened = bench.open(GLTF_THREE, "gltf")
    taken, found = bench.taken(kind), opened.file(bench.file(kind, "gltf"))
    times_s = np.array(found["times_s"])
    for key in some(truth.tracked_hands(taken)):
        skeleton = truth.skeleton(taken, key)
        expected = Rotation.from_matrix(truth.at_keys(taken, skeleton.turns, times_s).reshape(-1, 3, 3))
        names = [skeleton.prefix + name for name in JOINT_NAMES]
        turned = Rotation.from_quat(np.stack([np.array(found["turns"][name]) for name in names], axis=1).reshape(-1, 4))
        largest = np.degrees((expected.inv() * turned).magnitude()).max()
        assert largest < NEAR_DEG
        report(Row("glTF", opened.program, kind, "turns of joints at every key", 3 * len(turned), largest, "°"))


@kinds
@programs
def test_what_is_said_of_the_take(bench, report, program: Program, kind: str) -> None:
    """Blender shows it as custom properties of the scene, three.js as userData of the scene and the animation."""
    opened = bench.open(program, "gltf")
    about = KINDS[kind]
    found = opened.file(bench.file(kind, "gltf"))
    said = [found["extras"], *found.get("animation_extras", ())]
    assert len(said) == (2 if program is GLTF_THREE else 1)
    for one in said:
        assert one["take"] == kind and one["rate_hz"] == RATE_HZ
        assert (one.get("rating", ""), one.get("notes", "")) == (
            about.info.get("rating", ""),
            about.info.get("notes", ""),
        )
        assert one["performer"] == ", ".join(worn.performer or str(k) for k, worn in enumerate(about.worn, 1))
        marks = one.get("marks", [])
        assert [mark["text"] for mark in marks] == [text for _, text in about.marks]
        np.testing.assert_allclose([mark["time_s"] for mark in marks], [i / RATE_HZ for i, _ in about.marks], atol=1e-6)
    report(
        Row(
            "glTF", opened.program, kind, "marks, notes, rating, performer", (4 + 2 * len(about.marks)) * len(said), 0.0
        )
    )


@kinds
@programs
def test_a_hand_says_from_when_to_when_its_pose_is_held(bench, report, program: Program, kind: str) -> None:
    opened = bench.open(program, "gltf")
    taken, found = bench.taken(kind), opened.file(bench.file(kind, "gltf"))
    for key in some(truth.tracked_hands(taken)):
        said = found["node_extras"][truth.hand_words(taken, key)].get("held", [])
        # Between two keys a hand moves on: a frame or two that were lost are no holding.
        held = [span for span in truth.held(taken, key) if span[2] != "no frames" or span[1] - span[0] > 2]
        assert [one["reason"] for one in said] == [why for _, _, why in held]
        times_s = [(one["from_s"], one["to_s"]) for one in said]
        np.testing.assert_allclose(
            np.reshape(times_s, (-1, 2)), np.reshape([(a, b) for a, b, _ in held], (-1, 2)) / RATE_HZ, atol=1e-6
        )
        report(Row("glTF", opened.program, kind, "when a pose is held", 3 * len(held), 0.0))


@kinds
@programs
def test_surfaces_lie_around_their_joints(bench, report, program: Program, kind: str) -> None:
    """Each vertex is where the hand's own surface has it when it is posed so."""
    opened = bench.open(program, "gltf")
    taken, found = bench.taken(kind), opened.file(bench.file(kind, "gltf"))
    times_s = np.array(found["surface_times_s"])
    for key in some(truth.tracked_hands(taken)):
        name = truth.hand_words(taken, key).removesuffix("hand") + "surface"
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


@programs
def test_bones_by_the_names_of_other_programs(bench, report, tmp_path, program: Program) -> None:
    schemes = [scheme for scheme in BONE_SCHEMES if scheme != "phalanx"]
    files = [bench.file("whole", "gltf", ExportOptions(bones=scheme)) for scheme in schemes]
    opened = bench.open_files(program, files, tmp_path)
    taken = bench.taken("whole")
    for scheme, path in some(zip(schemes, files, strict=True)):
        found = opened.file(path)
        for key in some(truth.tracked_hands(taken)):
            names = bone_names(scheme, key.side)
            solved = truth.skeleton(taken, key).solved.values()
            expected = np.stack([truth.at_keys(taken, at, np.array(found["times_s"])) for at in solved], axis=1)
            joints = np.stack([np.array(found["nodes"][name]) for name in (*names.joints, *names.tips)], axis=1)
            values, largest_m = difference(joints, expected, f"{scheme} in {opened.program}")
            assert largest_m < NEAR_M
            report(Row("glTF", opened.program, "whole", "five other sets of bone names", values, 1e6 * largest_m, "µm"))
